"""Truths: the sculpts themselves, at every pose, by every kernel, through every layer."""

import itertools

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator

from core.document import Document, MeshObject
from core.errors import UserError
from core.evaluator import Evaluator
from core.formats.project import read_project, write_project
from core.leaves import same_bits
from core.mesh.mesh import Mesh
from core.pose import edit_layers
from core.pose.clip import split_matrices
from core.pose.controls import rotation_dof
from core.pose.corrective import as_kind
from core.pose.edit_layers import (
    add_sculpt,
    cross_talk,
    merged_poses,
    moved_pose,
    refresh,
    sculpt_errors,
    without_pose,
)
from core.pose.layers import Sculpt, build
from core.pose.pose import Pose, local_of_pose
from core.pose.pose_space import Correctives, PoseSpace
from core.pose.refusal import Refusal
from core.pose.resculpt import sculpted_again
from core.pose.rig import Control
from core.pose.skeleton import Clip
from core.pose.solve import solve, weights
from core.pose.synthesis import evaluate, prepare
from core.posed import skin_at
from core.record import freeze
from core.workers import Workers
from core.workspace import Workspace
from tests.core.pose.arms import arm, bumped, skinned_at, turned

KERNELS = ("gaussian", "thin-plate", "multiquadric", "inverse-multiquadric", "wendland", "cubic", "linear", "shepard")


def poses():
    return [
        turned("elbow 45", fore=(0, 0, 45)), turned("elbow 90", fore=(0, 0, 90)),
        turned("elbow 130", fore=(0, 10, 130)), turned("twist", fore=(80, 0, 20)),
        turned("raise", upper=(0, 40, 50)), turned("swing", upper=(20, -50, 10)),
        turned("both", upper=(0, 30, 40), fore=(0, 0, 80)), turned("both more", upper=(0, -30, 70), fore=(0, 20, 50)),
        turned("flexed", {"flex": 1.0}, fore=(0, 0, 90)), turned("glad", {"mood": 0.9}), turned("sad", {"mood": -0.7}),
    ]


def sculpts(rig, points):
    places = (0.4, 0.4, 0.45, 0.5, 0.1, 0.2, 0.3, 0.35, 0.45, 0.8, 0.85)
    return [Sculpt(p, bumped(rig, points, p, i, places[i])) for i, p in enumerate(poses())]


def worst(rig, points, correctives, made):
    size = np.linalg.norm(np.ptp(points, axis=0))
    ready = prepare(correctives, rig)
    return max(np.abs(evaluate(points, rig, correctives, s.pose, prepared=ready) - s.target).max() for s in made) / size


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("skinning", ["linear", "dual-quaternion"])
def test_every_sculpt_is_met(kernel, skinning):
    rig, points = arm(skinning=skinning)
    made = sculpts(rig, points)
    found = build(points, rig, made, kernel=kernel)
    assert len(found.correctives.layers) == 5  # elbow, shoulder, both, elbow with flex, mood
    assert worst(rig, points, found.correctives, made) <= 1e-6
    without = max(np.abs(skinned_at(rig, points, s.pose) - s.target).max() for s in made)
    assert without > 0.01  # there was something to correct
    names, table = cross_talk(points, rig, found.correctives)
    assert len(names) == len(made)
    assert table.max() <= 1e-6


@pytest.mark.parametrize("options", [
    {"normalise": "above-one"}, {"normalise": "always"}, {"clamp": True}, {"affine": True}, {"table": 512},
    {"weighted": 4}, {"kernel": "multiquadric", "affine": True, "weighted": 2, "clamp": True},
])
def test_every_option_meets_every_sculpt(options):
    rig, points = arm()
    made = sculpts(rig, points)
    assert worst(rig, points, build(points, rig, made, **options).correctives, made) <= 1e-6


def test_rest_stays_rest_and_far_away_nothing_is_left():
    rig, points = arm()
    narrow = rotation_dof(rig.skeleton, "fore", falloff=(0.35,))
    found = build(points, rig, sculpts(rig, points)[:3], dofs=[narrow]).correctives
    assert np.abs(evaluate(points, rig, found, Pose()) - points).max() <= 1e-7
    far = turned("far", fore=(0, 0, -120))
    assert np.abs(evaluate(points, rig, found, far) - skinned_at(rig, points, far)).max() < 1e-3


def test_order_does_not_matter():
    rig, points = arm(200)
    made = sculpts(rig, points)
    at = turned("here", fore=(0, 5, 60), upper=(3, 20, 20))
    truth = evaluate(points, rig, build(points, rig, made).correctives, at)
    for shuffle in itertools.islice(itertools.permutations(made), 0, 4000, 997):
        again = evaluate(points, rig, build(points, rig, shuffle).correctives, at)
        assert np.abs(again - truth).max() <= 1e-6


def test_one_by_one_is_the_same_as_all_at_once():
    rig, points = arm(300)
    made = sculpts(rig, points)
    one = Correctives()
    for s in made[::-1]:  # the spaces of most controls first
        one = add_sculpt(points, rig, one, s.pose, s.target).correctives
    assert [layer.space.controls for layer in one.layers].index(("fore", "upper")) > 0
    assert worst(rig, points, one, made) <= 1e-6


def test_vertices_know_only_the_poses_that_moved_them():
    rig, points = arm()
    a, b = turned("a", fore=(0, 0, 50)), turned("b", fore=(0, 0, -100))
    far = rotation_dof(rig.skeleton, "fore", falloff=(0.3,))
    made = [Sculpt(a, bumped(rig, points, a, 1, 0.3, 0.1)), Sculpt(b, bumped(rig, points, b, 2, 0.7, 0.1))]
    layer = build(points, rig, made, dofs=[far]).correctives.layers[0]
    assert set(map(tuple, layer.moved.T)) == {(True, False), (False, True)}
    assert len(prepare(Correctives(layers=(layer,)), rig)[0].starts) == 3
    wide = build(points, rig, made, kernel="linear").correctives  # reaches from one to the other
    assert set(map(tuple, wide.layers[0].moved.T)) == {(True, True)}
    assert worst(rig, points, wide, made) <= 1e-6


def test_later_layers_follow_an_edit_below():
    rig, points = arm()
    made = sculpts(rig, points)
    found = build(points, rig, made).correctives
    changed = bumped(rig, points, made[1].pose, 77)
    edited = add_sculpt(points, rig, found, made[1].pose, changed).correctives
    made[1] = made[1]._replace(target=changed)
    size = np.linalg.norm(np.ptp(points, axis=0))
    for errors in sculpt_errors(points, rig, edited).values():
        assert errors.max(initial=0.0) <= 1e-6 * size
    assert np.abs(evaluate(points, rig, edited, made[1].pose) - changed).max() <= 1e-6 * size


def test_a_layer_above_that_speaks_at_a_pose_below_is_seen():
    rig, points = arm()
    first = turned("both", fore=(0, 0, 90), upper=(0, 30, 0))
    found = build(points, rig, [Sculpt(first, bumped(rig, points, first, 1))]).correctives
    above = turned("alone", fore=(0, 0, 90))
    later = build(points, rig, [Sculpt(above, bumped(rig, points, above, 2))]).correctives
    names, table = cross_talk(points, rig, Correctives(layers=(*found.layers, *later.layers)))
    assert names == ("both", "alone")
    assert table[0, 1] > 0.01
    assert table[1, 0] == 0.0


def test_half_a_turn_of_twist_is_met_and_flagged():
    rig, points = arm()
    for angle in (175.0, 179.9, 180.0, -180.0):
        pose = turned("turned", fore=(0, 0, 0))
        dof = rotation_dof(rig.skeleton, "fore")
        half = np.radians(angle) / 2
        pose = pose.replace(rotations={"fore": (*(np.sin(half) * np.array(dof.axis)), np.cos(half))})
        target = bumped(rig, points, pose, 3, 0.4, 0.3)
        found = build(points, rig, [Sculpt(pose, target)])
        posed = evaluate(points, rig, found.correctives, pose)
        assert np.isfinite(posed).all()
        assert np.abs(posed - target).max() <= 1e-6 * np.linalg.norm(np.ptp(points, axis=0))
        report = found.reports[0]
        assert np.array_equal(report.flagged, (report.condition > 30).any(axis=0))


def test_vertices_flagged_by_a_later_sculpt_keep_the_earlier_ones():
    rig, points = arm()
    axis = np.array(rotation_dof(rig.skeleton, "fore").axis)
    half_turn = Pose(name="half a turn", rotations={"fore": (*(np.sin(np.radians(89)) * axis), np.cos(np.radians(89)))})
    made = [Sculpt(p, bumped(rig, points, p, i, 0.4, 0.3)) for i, p in enumerate([*poses()[:2], half_turn])]
    found = build(points, rig, made[:2]).correctives
    assert not found.layers[0].after.any()
    found = add_sculpt(points, rig, found, half_turn, made[2].target).correctives
    assert found.layers[0].after.any()
    assert not found.layers[0].after.all()
    assert worst(rig, points, found, made) <= 1e-6
    again = refresh(points, rig, found).correctives
    assert worst(rig, points, again, made) <= 1e-6


def test_deleting_merging_and_moving_mend_a_refusal():
    rig, points = arm(200)
    made = sculpts(rig, points)[:3]
    twin = made[0].pose.replace(name="twin")
    with pytest.raises(Refusal) as refused:
        build(points, rig, [*made, Sculpt(twin, made[1].target)])
    assert refused.value.poses == ("elbow 45", "twin")
    assert refused.value.reason == "duplicate"
    for word in ("merge", "delete", "move"):
        assert word in str(refused.value)
    apart = build(points, rig, [*made, Sculpt(turned("twin", fore=(0, 0, 20)), made[0].target)]).correctives
    left = refresh(points, rig, without_pose(apart, "twin")).correctives
    assert worst(rig, points, left, made) <= 1e-6
    merged = refresh(points, rig, merged_poses(apart, ["elbow 45", "twin"])).correctives
    assert [s.name for s in merged.layers[0].space.samples] == ["elbow 45", "elbow 90", "elbow 130"]
    moved = refresh(points, rig, moved_pose(points, rig, apart, "twin", turned("new", fore=(0, 0, -30)))).correctives
    pose = moved.layers[0].space.samples[-1].pose
    assert pose.name == "twin"
    errors = sculpt_errors(points, rig, moved)["twin"]
    assert errors.max() <= 1e-6
    with pytest.raises(UserError, match="no sculpted pose"):
        without_pose(apart, "nobody")
    with pytest.raises(UserError, match="one layer"):
        merged_poses(apart, ["twin"])


@pytest.mark.parametrize(("degrees", "reason"), [(0, "duplicate"), (1e-3, "near-duplicate"), (0.05, "near-duplicate")])
def test_poses_a_hand_made_twice_are_refused(degrees, reason):
    """A thousandth of a falloff apart, sculpts a millimetre apart would throw the surface by a metre beside them."""
    rig, points = arm(200)
    made = sculpts(rig, points)[:3]
    near = Sculpt(turned("near", fore=(0, 0, 90 + degrees)), made[0].target)
    with pytest.raises(Refusal) as refused:
        build(points, rig, [*made, near])
    assert (refused.value.reason, refused.value.poses) == (reason, ("elbow 90", "near"))
    found = build(points, rig, made).correctives
    with pytest.raises(Refusal, match="'elbow 90' and 'near'"):
        add_sculpt(points, rig, found, near.pose, near.target)
    build(points, rig, [*made, Sculpt(turned("near", fore=(0, 0, 90.1)), made[0].target)])


def test_a_pose_at_rest_is_refused():
    rig, points = arm(50)
    with pytest.raises(Refusal) as refused:
        build(points, rig, [Sculpt(Pose(name="nothing"), points)])
    assert refused.value.poses == ("rest", "nothing")
    with pytest.raises(UserError, match="no joint 'nose'"):
        build(points, rig, [Sculpt(turned("p", nose=(0, 0, 9)), points)])


def test_plain_correctives_fight_where_pose_spaces_do_not():
    rig, points = arm()
    made = sculpts(rig, points)[:3]
    found = build(points, rig, made).correctives
    assert worst(rig, points, found, made) <= 1e-6
    for kind in ("linear", "combination"):
        assert worst(rig, points, as_kind(found, kind), made) > 1e-3
        alone = build(points, rig, made[:1]).correctives
        assert worst(rig, points, as_kind(alone, kind), made[:1]) <= 1e-6


def test_a_pose_without_a_sculpt_holds_what_lies_below():
    rig, points = arm()
    made = sculpts(rig, points)[:2]
    free = turned("free", fore=(0, 0, 65))
    found = build(points, rig, [*made, Sculpt(free, None)]).correctives
    assert np.abs(evaluate(points, rig, found, free) - skinned_at(rig, points, free)).max() <= 1e-6


def test_no_poses_at_all_and_threads():
    rig, points = arm(5000)
    assert np.array_equal(evaluate(points, rig, build(points, rig, []).correctives, Pose()),
                          evaluate(points, rig, None, Pose()))
    found = build(points, rig, sculpts(rig, points)).correctives
    here = turned("here", fore=(0, 0, 70), upper=(0, 10, 10))
    workers = Workers(2)
    assert np.array_equal(evaluate(points, rig, found, here, workers.ranges), evaluate(points, rig, found, here))
    workers.close()


def test_a_document_keeps_them(tmp_path):
    rig, points = arm(120)
    corners = np.arange(120, dtype=np.int32)
    mesh = Mesh(points=points, counts=np.full(40, 3, np.int32), corners=corners, parts=np.zeros(40, np.int32),
                part_names=("arm",))
    found = build(points, rig, sculpts(rig, points)[:4]).correctives
    document = Document(meshes=(MeshObject(id=1, name="arm", mesh=mesh, rig=rig, correctives=found),))
    write_project(tmp_path / "a.filo", document, Workspace())
    assert same_bits(read_project(tmp_path / "a.filo").document, document)
    beyond = found.layers[0].replace(vertices=found.layers[0].vertices + np.int32(100))
    with pytest.raises(ValueError, match="correctives"):
        document.meshes[0].replace(correctives=Correctives(layers=(beyond,)))


def test_a_clip_plays_with_its_correctives():
    rig, points = arm(90)
    made = sculpts(rig, points)
    found = build(points, rig, made).correctives
    locals_ = [local_of_pose(rig.skeleton, s.pose) for s in made[:6]]
    parts = [split_matrices(m)[:3] for m in locals_]
    columns = (np.array(c, np.float32) for c in zip(*parts))
    clip = Clip(**dict(zip(("translations", "rotations", "scales"), columns)))
    mesh = Mesh(points=points, counts=np.full(30, 3, np.int32), corners=np.arange(90, dtype=np.int32),
                parts=np.zeros(30, np.int32), part_names=("arm",))
    item = MeshObject(id=1, name="arm", mesh=mesh, rig=rig.replace(clip=clip), correctives=found)
    evaluator = Evaluator()
    for k, s in enumerate(made[:6]):
        assert np.abs(skin_at(item, 1001.0 + k, evaluator).points - s.target).max() <= 2e-6
    bare = skin_at(item.replace(correctives=None), 1002.0, evaluator).points
    assert np.abs(bare - made[1].target).max() > 0.01
    evaluator.close()


def test_a_control_that_is_a_piece_of_the_body_is_felt():
    rig, points = arm()
    switch = Control(name="switch", kind="joint", joint="hand", axis=(0.0, 1.0, 0.0), travel=0.3)
    rig = rig.replace(controls=(*rig.controls, switch))
    pose = turned("up", {"switch": 1.0})
    target = points + np.float32(0.01)
    found = build(points, rig, [Sculpt(pose.replace(numbers={"flex": 1.0}), target)]).correctives
    space = found.layers[0].space
    heard = space.replace(
        dofs=(space.dofs[0].replace(control="switch"),),
        samples=(space.samples[0].replace(pose=pose),))
    felt_by = Correctives(layers=(found.layers[0].replace(space=heard),))
    raised = Pose(translations={"hand": tuple(np.linalg.inv(rig.skeleton.bind[2, :3, :3]) @ [0.0, 0.3, 0.0])})
    moved = evaluate(points, rig, felt_by, raised) - skinned_at(rig, points, raised)
    assert np.allclose(moved, evaluate(points, rig, found, pose.replace(numbers={"flex": 1.0})) - points, atol=1e-3)
    assert np.abs(moved).max() > 0.009


def test_refused_records():
    rig, points = arm(50)
    found = build(points, rig, sculpts(rig, points)[:2]).correctives
    layer = found.layers[0]
    for wrong in (
        lambda: PoseSpace(dofs=()), lambda: layer.space.replace(kernel="other"),
        lambda: layer.space.replace(kernel_version=2), lambda: layer.space.replace(samples=layer.space.samples * 2),
        lambda: layer.space.dofs[0].replace(falloff=(0.0,)), lambda: layer.space.dofs[0].replace(side=(1.0, 0.0, 0.0)),
        lambda: layer.replace(vertices=layer.vertices * np.int32(0)), lambda: Pose(rotations={"a": (0, 0, 0, 0)}),
        lambda: Pose(numbers={"a": float("nan")}), lambda: found.replace(layers=found.layers * 2),
        lambda: layer.space.samples[0].replace(falloffs={"nobody": (1.0,)}) and layer.space.replace(
            samples=(layer.space.samples[0].replace(falloffs={"nobody": (1.0,)}),)),
    ):
        with pytest.raises(ValueError):
            wrong()


@pytest.mark.parametrize("skinning", ["linear", "dual-quaternion"])
def test_a_further_stroke_is_as_if_all_had_been_sculpted_at_once(skinning, monkeypatch):
    """Where only corrections change the layer is not extracted anew; where more does, it is: the same comes out."""
    rig, points = arm(skinning=skinning)
    made = sculpts(rig, points)
    half_turn = turned("half a turn", fore=(180, 0, 0))
    made.append(Sculpt(half_turn, bumped(rig, points, half_turn, 3, 0.55, 0.3)))
    looks = turned("b", fore=(10, 5, 70)), turned("c", {"flex": 0.6}, upper=(0, 20, 10), fore=(60, 0, 50))
    first = build(points, rig, made).correctives
    short = []
    monkeypatch.setattr(edit_layers, "sculpted_again", lambda *a: short.append(sculpted_again(*a)) or short[-1])
    stroke = np.float32([0.004, 0.01, -0.007])
    for k in (1, 3, 7, len(made) - 1):
        moved = np.abs(made[k].target - skinned_at(rig, points, made[k].pose)).max(axis=1) > 1e-4
        elsewhere = np.flatnonzero(~moved)
        for rows, whole in ((np.flatnonzero(moved)[::3], False), (elsewhere[::40], True)):
            target = made[k].target.copy()
            target[rows] += stroke
            made[k] = made[k]._replace(target=target)
            layers = add_sculpt(points, rig, first, made[k].pose, target).correctives
            assert (short.pop() is None) == whole
            truth = build(points, rig, made).correctives
            assert worst(rig, points, layers, made) <= 1e-6
            assert [[s.name for s in layer.space.samples] for layer in layers.layers] == [
                [s.name for s in layer.space.samples] for layer in truth.layers]
            for pose in looks:
                apart = evaluate(points, rig, layers, pose) - evaluate(points, rig, truth, pose)
                assert np.abs(apart).max() < 2e-6
            first = layers


def test_a_further_stroke_keeps_the_settings_of_a_layer_of_one_pose():
    rig, points = arm(200)
    pose = turned("bent", fore=(0, 0, 90))
    reach, swing = {"fore": (0.5,)}, rotation_dof(rig.skeleton, "fore", "swing")
    target = bumped(rig, points, pose, 0)
    made = add_sculpt(points, rig, Correctives(), pose, target, reach, (swing,), kernel="wendland").correctives
    for place in (0.4, 0.9):  # where it is sculpted, and where it is not yet
        again = add_sculpt(points, rig, made, pose, bumped(rig, points, pose, 1, place)).correctives
        assert same_bits(again.layers[0].space, made.layers[0].space)
        assert not same_bits(again.layers[0].targets, made.layers[0].targets)


@pytest.mark.parametrize("apart", [1, 1000])
def test_a_layer_names_a_vertex_once(apart):
    rig, points = arm()
    layer = build(points, rig, [Sculpt(turned("bent", fore=(0, 0, 90)), points + 0.1)]).correctives.layers[0]
    vertices = np.arange(len(layer.vertices), dtype=np.int32) * apart
    layer.replace(vertices=freeze(vertices.copy()))
    vertices[7] = vertices[400]
    with pytest.raises(ValueError, match="different"):
        layer.replace(vertices=freeze(vertices.copy()))


def test_a_falloff_of_a_control_that_rests_says_nothing():
    rig, points = arm()
    pose = turned("bent", {"flex": 0.0, "mood": 0.25}, fore=(0, 0, 90))
    target = bumped(rig, points, pose, 0)
    falloffs = {"fore": (1.0,), "hand": (0.5,), "flex": (0.2,), "mood": (0.1,)}
    made = build(points, rig, [Sculpt(pose, target, falloffs)]).correctives
    again = add_sculpt(points, rig, Correctives(), pose, target, falloffs).correctives
    assert [c.layers[0].space.samples[0].falloffs for c in (made, again)] == [{"fore": (1.0,)}] * 2


def test_poses_of_one_falloff_measure_alike_with_rest_and_anchors_among_them():
    """SciPy knows one width; rest and the anchors of a space whose poses have one of their own have it as well."""
    rig, points = arm()
    reach = {"flex": (0.3,), "mood": (0.3,)}
    numbers = [{"mood": -0.4}, {"flex": 0.9, "mood": 0.9}, {"flex": 0.4, "mood": -0.6}, {"flex": 0.7, "mood": -0.1}]
    made = [Sculpt(p, bumped(rig, points, p, k), reach) for k, p in enumerate(turned(f"{n}", n) for n in numbers)]
    whole = build(points, rig, made, kernel="gaussian").correctives
    one_by_one = Correctives()
    for s in made:
        one_by_one = add_sculpt(points, rig, one_by_one, s.pose, s.target, s.falloffs).correctives
    for layers in (whole, one_by_one):
        space = layers.layers[1].space
        assert [pose.name for pose in space.anchors] == [made[0].pose.name]
        centres = np.array([[0.0, 0.25], *([n.get("flex", 0.0), n["mood"]] for n in numbers)])
        truth = RBFInterpolator(centres, np.eye(5)[:, 2:], kernel="gaussian", epsilon=1 / (0.3 * 2**0.5), degree=-1)
        for flex, mood in ((0.2, 0.1), (0.8, -0.5)):
            found = weights(solve(space), Pose(numbers={"flex": flex, "mood": mood}))
            assert np.abs(found - truth([[flex, mood]])[0]).max() <= 1e-10


def test_sculpts_are_met_where_a_piece_of_geometry_or_a_joint_is_the_number():
    """The number follows from the joints of a pose, whether the pose was sculpted at, moved or only looked at."""
    rig, points = arm()
    tip = freeze(np.flatnonzero(points[:, 0] > 0.9).astype(np.int32))
    rig = rig.replace(controls=(
        *rig.controls, Control(name="tip", kind="geometry", vertices=tip, travel=0.1),
        Control(name="switch", kind="joint", joint="hand", travel=0.1)))
    poses = [turned("bent", fore=(0, 0, 60)), turned("turned", fore=(50, 10, 0)), turned("flexed", {"flex": 1.0}),
             turned("raised", upper=(0, 0, 40))]
    sculpts = [Sculpt(pose, bumped(rig, points, pose, k)) for k, pose in enumerate(poses)]
    whole = build(points, rig, sculpts).correctives
    assert {"tip", "switch"} <= {d.control for layer in whole.layers for d in layer.space.dofs}
    one_by_one = Correctives()
    for sculpt in sculpts:
        one_by_one = add_sculpt(points, rig, one_by_one, sculpt.pose, sculpt.target).correctives
    for made in (whole, one_by_one):
        for pose, target, _ in sculpts:
            assert np.abs(evaluate(points, rig, made, pose) - target).max() <= 1e-6
    moved = refresh(points, rig, moved_pose(points, rig, whole, "bent", turned("bent", fore=(0, 0, 75)))).correctives
    assert max(e.max() for e in sculpt_errors(points, rig, moved).values()) <= 1e-6
    with pytest.raises(Refusal, match="'bent'"):
        refresh(points, rig, moved_pose(points, rig, whole, "bent", Pose(name="rest")))
