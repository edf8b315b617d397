"""Strokes of the pose craft: what they show is what layers give, both sides alike, undone and replayed to the bit."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.document import find_mesh, with_mesh
from core.errors import UserError
from core.history import History
from core.leaves import same_bits
from core.pose.carry import carried_surface
from core.pose.pose import Pose
from core.pose.sculpt.symmetry import opposites_by_axis
from core.pose.synthesis import evaluate
from core.posed import skin_at
from core.workspace import Respect, Workspace
from tests.tools.scenes import BENT, EVALUATOR, line, pointers, rig, session, sight
from tools.macro import play
from tools.pose.weights import WeightParams
from tools.pose_edits import add_sculpt
from tools.registry import Registry
from tools.session import Session

REGISTRY = Registry(())
NAMES = [kind.name for kind in REGISTRY.of("pose")]
SCULPTS = [kind.name for kind in REGISTRY.of("pose") if kind.edits == "surface"]
WAY = line((215, 150), (250, 175))
NODDED = Pose(name="nod", rotations={"top": (math.sin(0.4), 0.0, 0.0, math.cos(0.4))})


def changed(document, **fields):
    return with_mesh(document, find_mesh(document, 1).replace(**fields))


def held(pose=NODDED, **workspace):
    """The ball held in a pose that is symmetric across X = 0."""
    s = session(workspace=Workspace(**workspace))
    s.edit("Hold", changed, pose=pose, joint_selection=("top",))
    return s


def points_of(s):
    return skin_at(s.document.meshes[0], s.workspace.frame, EVALUATOR).points


def size_of(s):
    return float(np.linalg.norm(np.ptp(s.document.meshes[0].mesh.points, axis=0)))


@pytest.mark.parametrize("name", SCULPTS)
def test_the_layers_give_at_the_pose_what_the_hand_saw(name):
    s = held()
    s.choose("draw", size=60.0)
    s.hand.stroke(sight(), line((200, 140), (220, 180)))  # a bump, for what smooths and restores
    before, seen = points_of(s), []
    s.changed = lambda old, new: seen.append(new.meshes[0].surface)
    s.choose(name, size=60.0, strength=0.8)
    s.hand.stroke(sight(), WAY)
    last = [surface for surface in seen if surface is not None][-1]
    assert s.document.meshes[0].surface is None
    assert np.abs(last - before).max() > 1e-4 * size_of(s)
    assert np.linalg.norm(points_of(s) - last, axis=1).max() <= 1e-6 * size_of(s)
    names = [x.name for layer in s.document.meshes[0].correctives.layers for x in layer.space.samples]
    assert names == ["nod"], "a second stroke at one pose goes on with its sculpt"


@pytest.mark.parametrize("name", SCULPTS)
@pytest.mark.parametrize("way", ["topology", "axis"])
def test_with_symmetry_both_sides_of_a_symmetric_pose_are_alike(name, way):
    s = held(respect=Respect(symmetry=True))
    if name not in ("grab", "draw", "inflate", "pinch"):
        s.choose("draw", size=40.0, mirror=way)
        s.hand.stroke(sight(), line((225, 140), (245, 180)))
    before = points_of(s)
    s.choose(name, size=25.0, mirror=way)
    s.hand.stroke(sight(), line((240, 150), (255, 175)))
    after = points_of(s)
    pairs = opposites_by_axis(s.document.meshes[0].mesh.points)
    assert (pairs >= 0).all()
    moved = (after - before).astype(np.float64)
    assert np.abs(moved).max() > 0.0
    np.testing.assert_allclose(moved[pairs] * [-1.0, 1.0, 1.0], moved, atol=2e-5 * size_of(s))


@pytest.mark.parametrize("name", SCULPTS)
def test_at_rest_a_sculpt_is_refused_in_words(name):
    s = held(pose=Pose(name="still"))
    before = s.document
    s.choose(name)
    with pytest.raises(UserError, match="away from rest"):
        s.hand.press(sight(), WAY[0])
    assert s.document is before


def test_a_mask_spares_what_it_covers_and_is_undone():
    s = held()
    s.choose("mask", size=400.0, strength=1.0, falloff="constant")
    s.hand.stroke(sight(), line((200, 150), (260, 250)))
    mask = s.document.meshes[0].mask
    assert mask.max() == 1.0
    before = points_of(s)
    s.choose("draw", size=60.0)
    s.hand.stroke(sight(), WAY)
    np.testing.assert_allclose(points_of(s)[mask == 1.0], before[mask == 1.0], atol=1e-6)
    s.jump(1)
    assert s.document.meshes[0].mask is None


def test_restore_goes_towards_the_shape_of_another_pose():
    s = held()
    far = Pose(name="far", rotations={"top": (math.sin(0.6), 0.0, 0.0, math.cos(0.6))})
    push = np.where(s.document.meshes[0].mesh.points[:, 1:2] > 0.0, np.float32([0.0, 0.0, 0.1]), np.float32(0))
    points, moved = s.document.meshes[0].mesh.points, points_of(s)
    s.edit("Sculpt", add_sculpt, 1, far, evaluate(points, rig(), None, far) + push)
    s.edit("Still here", add_sculpt, 1, NODDED.replace(name="here"), evaluate(points, rig(), None, NODDED))
    before = points_of(s)
    assert np.abs(before - moved).max() < 1e-5
    goal = carried_surface(points, rig(), s.document.meshes[0].correctives, far, NODDED)
    s.choose("restore", size=80.0, strength=1.0, towards="far")
    s.hand.stroke(sight(), WAY)
    away, now = np.linalg.norm(goal - before, axis=1), np.linalg.norm(goal - points_of(s), axis=1)
    assert away.max() > 0.09
    assert (now <= away + 1e-5).all()
    assert (now < 0.5 * away)[away > 0.05].sum() > 5
    s.choose("restore", towards="nowhere")
    with pytest.raises(UserError, match="no pose 'nowhere'"):
        s.hand.press(sight(), WAY[0])


def test_weights_are_painted_for_the_active_joint_and_locks_hold():
    s = held()
    s.choose("weights", size=80.0, how="replace", value=0.25, strength=1.0, falloff="constant")
    before = s.document.meshes[0].rig.skin
    s.hand.stroke(sight(), WAY)
    after = s.document.meshes[0].rig.skin
    np.testing.assert_allclose(after.weights.sum(axis=1), 1.0, atol=1e-6)
    own = np.where(after.joints == 1, after.weights, 0.0).sum(axis=1)
    was = np.where(before.joints == 1, before.weights, 0.0).sum(axis=1)
    touched = np.abs(own - was) > 1e-6
    assert touched.any()
    assert (np.abs(own - 0.25) <= np.abs(was - 0.25) + 1e-6).all(), "nearer to what is painted, never beyond"
    assert np.abs(own - was).max() > 0.05
    s.edit("Lock", changed, locked_joints=("top",))
    with pytest.raises(UserError, match="locked"):
        s.hand.press(sight(), WAY[0])
    s.edit("Unlock", changed, locked_joints=(), joint_selection=())
    with pytest.raises(UserError, match="No joint is selected"):
        s.hand.press(sight(), WAY[0])
    assert WeightParams().how == "add"


def test_sculpts_stand_when_weights_are_painted_below_them():
    s = held()
    s.choose("draw", size=60.0)
    s.hand.stroke(sight(), WAY)
    sculpted = points_of(s)
    moved = s.document.meshes[0].correctives.layers[0].vertices
    s.choose("weights", size=60.0, how="subtract", strength=0.3)
    s.hand.stroke(sight(), WAY)
    assert s.document.meshes[0].rig.skin is not rig().skin
    assert np.linalg.norm(points_of(s)[moved] - sculpted[moved], axis=1).max() <= 1e-6 * size_of(s)


def test_crafts_have_tools_of_their_own_and_a_stroke_ends_with_them():
    s = held()
    s.set_craft("pose")
    assert s.tool.name == "grab"
    s.hand.press(sight(), WAY[0])
    s.set_craft("groom")
    assert not s.stroking
    assert s.tool.name == "comb"
    with pytest.raises(UserError, match="no craft named"):
        s.set_craft("cooking")


STROKES = st.tuples(
    st.sampled_from([*NAMES, "comb"]), st.integers(0, 2**31 - 1), st.booleans(), st.sampled_from([1001.0, BENT]))


def some_stroke(s, stroke):
    """A stroke of anything, or a refusal in words."""
    name, seed, symmetry, frame = stroke
    rng = np.random.default_rng(seed)
    s.choose(name, size=float(rng.uniform(20.0, 90.0)))
    s.set_workspace(frame=frame, respect=Respect(symmetry=symmetry))
    if rng.random() < 0.3:
        s.edit("Hold", changed, pose=None if rng.random() < 0.5 else NODDED)
    way = 200.0 + np.cumsum(rng.normal(0.0, 30.0, (4, 2)), axis=0)
    before, keys = s.document, {key: bool(rng.random() < 0.2) for key in ("shift", "ctrl", "eraser")}
    try:
        s.hand.stroke(sight(rng.normal(size=3)), pointers(way, **keys))
    except UserError:
        assert s.document is before
    assert s.document.meshes[0].surface is None


@settings(max_examples=12, deadline=None)
@given(st.lists(STROKES, min_size=1, max_size=5))
def test_any_strokes_and_edits_are_undone_and_redone_to_the_bit(strokes):
    s = held()
    s.history = History(s.document, keep=1)
    states = [s.document]
    for stroke in strokes:
        place = len(s.history.names)
        some_stroke(s, stroke)
        while len(states) < len(s.history.names):
            states.append(s.history.jump(len(states)))
        assert len(s.history.names) >= place
    s.jump(len(states) - 1)
    for state in reversed(states):
        assert same_bits(s.document, state)
        s.undo()
        s.history.flush()
    for state in states:
        assert same_bits(s.document, state)
        s.redo()
    s.history.close()


def test_a_macro_makes_the_same_bits(tmp_path):
    s = held(frame=BENT)
    s.save(tmp_path / "start.filo")
    macro = s.record()
    for name in NAMES:
        s.choose(name, size=50.0)
        s.set_workspace(respect=Respect(symmetry=name in ("draw", "mask")))
        s.hand.stroke(sight((0.2, 0.1, -1.0)), line((205, 150), (245, 185), pressure=0.7))
    s.stop_recording()
    macro.save(tmp_path / "macro.py")
    again = Session.open(tmp_path / "start.filo")
    play(tmp_path / "macro.py", again)
    assert same_bits(again.document, s.document)
    assert again.history.names[1:] == s.history.names[2:]
    assert len(again.history.names) > len(SCULPTS)


def test_hair_follows_the_pose_that_is_held():
    s = held()
    item = s.document.meshes[0]
    turned = points_of(s)
    assert np.abs(turned - item.mesh.points).max() > 0.1
    top = item.mesh.points[:, 1] >= 0.5  # of full weight: a rigid turn about X by 0.8
    y, z = item.mesh.points[top, 1], item.mesh.points[top, 2]
    np.testing.assert_allclose(turned[top, 1], np.cos(0.8) * y - np.sin(0.8) * z, atol=2e-6)
    np.testing.assert_allclose(turned[top, 2], np.sin(0.8) * y + np.cos(0.8) * z, atol=2e-6)
    guides = s.hand.craft("groom").grounds(s, sight(), s.tool_named("comb"))[0].guides
    nearest = np.linalg.norm(guides.points[:, :1].astype(np.float64) - turned[None], axis=2).min(axis=1)
    assert nearest.max() < 0.2 * size_of(s)
