"""Manipulators of the pose craft as a hand uses them: what a drag on the screen does to the joints of a rig."""

import math

import numpy as np
import pytest

from core.camera import clip_from_world
from core.document import Document, MeshObject
from core.errors import UserError
from core.groom.region import View
from core.leaves import same_bits
from core.mesh.mesh import Mesh
from core.overlay import Label, Polyline
from core.pose.keying import still_clip
from core.pose.pose import REST, local_of_pose
from core.pose.rig import Constraint
from core.pose.rotation import polar_rotation
from core.pose.skinning import object_matrices
from core.pose.synthesis import pose_at
from core.record import freeze
from core.workspace import Respect, Workspace
from tests.core.pose.arms import arm, turned
from tests.tools.scenes import sight
from tools.ground import Pointer
from tools.pose.posing import joints_of
from tools.session import Session

SIGHT = sight(distance=2.5)


def posing(tool, joint=None, pose=None, constraints=(), respect=None, **params) -> Session:
    rig, points = arm()
    corners = np.arange(len(points) // 3 * 3, dtype=np.int32)
    count = len(corners) // 3
    mesh = Mesh(points=freeze(points), counts=freeze(np.full(count, 3, np.int32)), corners=freeze(corners),
                parts=freeze(np.zeros(count, np.int32)), part_names=("arm",))
    item = MeshObject(id=1, name="arm", mesh=mesh, rig=rig.replace(constraints=tuple(constraints)), pose=pose,
                      joint_selection=() if joint is None else (joint,))
    s = Session(Document(meshes=(item,)), Workspace(mesh=1, craft="pose", respect=respect or Respect(symmetry=False)))
    s.choose(tool, **params)
    return s


def world(s, pose=None):
    item = s.document.meshes[0]
    matrices = object_matrices(item.rig.skeleton, local_of_pose(item.rig.skeleton, pose or item.pose or REST))
    return dict(zip(item.rig.skeleton.names, matrices, strict=True))


def pixel(place):
    view = View(clip_from_world(SIGHT.camera, SIGHT.width, SIGHT.height), SIGHT.width, SIGHT.height)
    return view.pixels(np.asarray(place, np.float64))[0]


def drag(s, places):
    s.hand.stroke(SIGHT, tuple(Pointer(float(x), float(y), time=0.1 * i) for i, (x, y) in enumerate(places)))


def around(centre, radius, start, end, count=24):
    """Places on the screen round a centre, from angle to angle, counted as one sees them: y goes up."""
    a = np.linspace(start, end, count)
    return np.stack([centre[0] + radius * np.cos(a), centre[1] - radius * np.sin(a)], axis=1)


@pytest.mark.parametrize("degrees", [35.0, -80.0, 200.0, 400.0])
def test_the_ring_of_the_view_turns_by_the_angle_seen(degrees):
    """The tip of the arm, seen from the front, goes round its joint by as many degrees as the pointer does."""
    s = posing("rotate", "fore", size=80.0)
    before = world(s)
    centre = pixel(before["fore"][:3, 3])
    drag(s, around(centre, 100.0, 0.3, 0.3 + math.radians(degrees), 60))
    after = world(s)
    eye = np.asarray(SIGHT.camera.world_from_camera, np.float64)[:3, 3]
    axis = (eye - before["fore"][:3, 3]) / np.linalg.norm(eye - before["fore"][:3, 3])
    turn = polar_rotation(after["fore"][:3, :3]) @ polar_rotation(before["fore"][:3, :3]).T
    assert np.allclose(turn @ axis, axis, atol=1e-6)
    found = math.degrees(math.atan2(np.linalg.norm(turn - turn.T) / math.sqrt(8), (np.trace(turn) - 1) / 2))
    wanted = abs((degrees + 180) % 360 - 180)
    assert found == pytest.approx(wanted, abs=2.0)  # the line of sight to the joint is not quite that of the picture
    assert np.allclose(after["fore"][:3, 3], before["fore"][:3, 3])  # it turns about itself
    if abs(degrees) < 90:  # and the way the hand went
        way = pixel(after["hand"][:3, 3]) - centre
        was = pixel(before["hand"][:3, 3]) - centre
        seen = math.degrees(math.atan2(was[1], was[0]) - math.atan2(way[1], way[0]))
        assert seen == pytest.approx(degrees, abs=4.0)


def test_a_ring_of_world_axes_turns_about_that_axis_by_the_angle_on_it():
    s = posing("rotate", "fore", axes="world", size=80.0)
    before = world(s)
    centre = pixel(before["fore"][:3, 3])
    drag(s, around(centre, 80.0, 0.4, 0.4 + math.radians(50)))
    turn = polar_rotation(world(s)["fore"][:3, :3]) @ polar_rotation(before["fore"][:3, :3]).T
    assert np.allclose(turn @ [0, 0, 1], [0, 0, 1], atol=1e-9)
    assert math.degrees(math.atan2(turn[1, 0], turn[0, 0])) == pytest.approx(50, abs=1.0)


def test_a_ring_seen_from_its_edge_is_pulled_along():
    s = posing("rotate", "fore", axes="world", size=80.0)
    before = world(s)
    x, y = pixel(before["fore"][:3, 3])
    drag(s, [(x + 50.0, y), (x + 70.0, y), (x + 90.0, y)])  # on the line that the ring about y is seen as
    turn = polar_rotation(world(s)["fore"][:3, :3]) @ polar_rotation(before["fore"][:3, :3]).T
    angle = math.acos(min(1.0, (np.trace(turn) - 1) / 2))
    assert abs(angle - 0.5) < 0.05  # 40 pixels over a radius of 80
    assert np.allclose(turn @ [0, 1, 0], [0, 1, 0], atol=1e-9)


def test_steps_of_an_angle_and_several_joints_at_once():
    s = posing("rotate", "fore", axes="world", size=80.0, snap=math.radians(15))
    item = s.document.meshes[0]
    s.edit("Select", lambda d: d.replace(meshes=(item.replace(joint_selection=("upper", "fore")),)))
    before = world(s)
    drag(s, around(pixel(before["fore"][:3, 3]), 80.0, 0.4, 0.4 + math.radians(50)))
    after = world(s)
    for joint, times in (("upper", 1), ("fore", 2)):  # each by itself: the second is carried by the first as well
        turn = polar_rotation(after[joint][:3, :3]) @ polar_rotation(before[joint][:3, :3]).T
        assert math.degrees(math.atan2(turn[1, 0], turn[0, 0])) == pytest.approx(45.0 * times, abs=1e-6)


def test_a_click_picks_a_joint_and_poses_nothing():
    s = posing("rotate", size=40.0)
    drag(s, [pixel(world(s)["fore"][:3, 3])])
    item = s.document.meshes[0]
    assert item.joint_selection == ("fore",)
    assert item.pose is None
    s.choose("rotate", add=True, size=40.0)
    drag(s, [pixel(world(s)["hand"][:3, 3])])
    assert s.document.meshes[0].joint_selection == ("fore", "hand")
    drag(s, [pixel(world(s)["hand"][:3, 3])])
    assert s.document.meshes[0].joint_selection == ("fore",)


@pytest.mark.parametrize("tool", ["rotate", "move", "ik"])
def test_a_click_that_picks_is_named_so_and_picking_the_same_again_is_no_step(tool):
    s = posing(tool)
    place = pixel(world(s)["hand"][:3, 3])
    drag(s, [place])
    assert s.history.names == ("New", "Select joints")
    assert s.document.meshes[0].joint_selection == ("hand",)
    before = s.document
    drag(s, [place])
    assert s.document is before
    assert s.history.names == ("New", "Select joints")


@pytest.mark.parametrize("tool", ["rotate", "move"])
@pytest.mark.parametrize("pose", [None, turned("bent", fore=(0, 0, 50))])
def test_a_handle_that_is_pressed_and_not_dragged_is_no_step(tool, pose):
    s = posing(tool, "fore", pose=pose, axes="world", size=80.0)
    x, y = pixel(world(s)["fore"][:3, 3])
    way = around((x, y), 80.0, 0.6, 1.2) if tool == "rotate" else [(x + 60.0, y), (x + 90.0, y)]
    before = s.document
    drag(s, [way[0], way[0]])
    assert s.document is before
    drag(s, way)
    assert s.history.names == ("New", "Rotate joints" if tool == "rotate" else "Move joints")


def test_an_arrow_moves_along_its_axis_only_and_by_what_is_seen():
    s = posing("move", "hand", axes="world", size=80.0)
    before = world(s)
    x, y = pixel(before["hand"][:3, 3])
    drag(s, [(x, y - 40.0), (x + 9.0, y - 60.0), (x + 15.0, y - 90.0)])
    after = world(s)
    moved = after["hand"][:3, 3] - before["hand"][:3, 3]
    assert np.allclose(moved[[0, 2]], 0.0, atol=1e-9)
    assert moved[1] > 0.0
    assert pixel(after["hand"][:3, 3])[1] == pytest.approx(y - 50.0, abs=1.0)
    assert np.allclose(after["fore"], before["fore"])


def test_the_middle_moves_with_the_pointer():
    s = posing("move", "hand")
    x, y = pixel(world(s)["hand"][:3, 3])
    drag(s, [(x, y), (x + 30.0, y + 20.0)])
    assert pixel(world(s)["hand"][:3, 3]) == pytest.approx([x + 30.0, y + 20.0], abs=1e-6)


def test_a_hand_reaches_where_it_is_dragged():
    s = posing("ik", keep=True)
    before = world(s)
    x, y = pixel(before["hand"][:3, 3])
    drag(s, [(x, y), (x - 40.0, y - 30.0), (x - 90.0, y - 60.0)])
    after = world(s)
    assert pixel(after["hand"][:3, 3]) == pytest.approx([x - 90.0, y - 60.0], abs=0.01)
    assert np.allclose(polar_rotation(after["hand"][:3, :3]), polar_rotation(before["hand"][:3, :3]))
    for a, b in (("upper", "fore"), ("fore", "hand")):
        lengths = [np.linalg.norm(w[b][:3, 3] - w[a][:3, 3]) for w in (before, after)]
        assert lengths[0] == pytest.approx(lengths[1])
    assert s.document.meshes[0].joint_selection == ("hand",)


def test_the_elbow_turns_and_the_hand_stays():
    s = posing("ik", "hand", pose=turned("bent", fore=(0, 0, 80)), turn=True)
    before = world(s)
    x, y = pixel(before["fore"][:3, 3])
    drag(s, [(x, y), (x, y + 80.0)])
    after = world(s)
    assert np.allclose(after["hand"][:3, 3], before["hand"][:3, 3], atol=1e-6)
    assert np.linalg.norm(after["fore"][:3, 3] - before["fore"][:3, 3]) > 0.01


def test_a_clip_that_rests_but_for_its_rounding_is_at_rest():
    s = posing("draw")
    item = s.document.meshes[0]
    playing = item.rig.replace(clip=still_clip(item.rig.skeleton, 1001.0, 3, 24.0))
    assert pose_at(playing, 1002.0).rotations, "there is rounding, otherwise this shows nothing"
    s.edit("Clip", lambda d: d.replace(meshes=(item.replace(rig=playing),)))
    with pytest.raises(UserError, match="away from rest"):
        s.hand.press(SIGHT, Pointer(200.0, 200.0))


def test_limits_hold_while_a_ring_is_dragged():
    limit = Constraint(joint="fore", kind="limit", low=(-0.2, -0.2, -0.2), high=(0.2, 0.2, 0.2))
    s = posing("rotate", "fore", constraints=(limit,), size=80.0)
    drag(s, around(pixel(world(s)["fore"][:3, 3]), 100.0, 0.0, 2.0))
    q = s.document.meshes[0].pose.rotations["fore"]
    assert 2 * math.acos(min(1.0, abs(q[3]))) < 0.36


def test_the_pose_is_relative_to_rest_and_undo_takes_it_back():
    """Turned under a moved root, a joint has the same numbers: nothing of the world leaks into its pose."""
    poses = []
    for root in (None, turned("moved", root=(0, 0, 30))):
        s = posing("rotate", "fore", pose=root, axes="local", size=80.0)
        before = s.document
        item = before.meshes[0]
        grounds = s.hand.craft("pose").grounds(s, SIGHT, s.tool)
        joints = joints_of(grounds[0], grounds[0].pose)
        centre = joints.pixels[item.rig.skeleton.names.index("fore")]
        drag(s, around(centre, 100.0, 0.3, 1.0))
        posed = s.document.meshes[0].pose
        assert set(posed.rotations) - {"root"} == {"fore"}
        assert not posed.translations
        poses.append(posed)
        s.undo()
        assert s.document is before
        s.redo()
        assert same_bits(s.document.meshes[0].pose, posed)
    assert poses[0].rotations["fore"] != (0.0, 0.0, 0.0, 1.0)


def test_replayed_it_is_the_same_to_the_bit():
    s = posing("rotate", "fore", size=80.0)
    made = []
    s.hand.recorded = made.append
    drag(s, around(pixel(world(s)["fore"][:3, 3]), 100.0, 0.3, 1.4))
    first = s.document.meshes[0].pose
    s.undo()
    s.hand.replay(made[0])
    assert same_bits(s.document.meshes[0].pose, first)


def test_the_held_ring_shows_the_sector_and_says_the_angle():
    s = posing("rotate", "fore", axes="world", size=80.0)
    centre = pixel(world(s)["fore"][:3, 3])
    places = around(centre, 80.0, 0.4, 0.4 + math.radians(50))
    s.hand.press(SIGHT, Pointer(*places[0]))
    for place in places[1:]:
        s.hand.move((Pointer(*place),))
    marks = s.hand.hover(SIGHT, Pointer(*places[-1]))
    label = next(m for m in marks if isinstance(m, Label))
    assert label.words.startswith("Z ")
    said = float(label.words[2:-1])
    q = s.document.meshes[0].pose.rotations["fore"]
    assert abs(said) == pytest.approx(math.degrees(2 * math.acos(min(abs(q[3]), 1.0))), abs=0.06)
    arc = max((m for m in marks if isinstance(m, Polyline)), key=lambda m: m.width).points - centre
    ends = np.degrees(np.arctan2(arc[:, 1], arc[:, 0]))
    assert np.linalg.norm(arc, axis=1) == pytest.approx(80.0, abs=1.0)
    assert abs(ends[-1] - ends[0]) == pytest.approx(50.0, abs=1.0)


@pytest.mark.parametrize("name", ["rotate", "move"])
def test_handles_have_the_colours_and_names_of_axes_and_the_pointed_joint_its_name(name):
    s = posing(name, "fore", axes="world", size=30.0)
    x, y = pixel(world(s)["hand"][:3, 3])
    marks = s.hand.hover(SIGHT, Pointer(x, y))
    named = {(m.words, m.tone) for m in marks if isinstance(m, Label)}
    assert {("X", "x"), ("Y", "y"), ("Z", "z")} < named
    assert "hand" in {words for words, _ in named}
