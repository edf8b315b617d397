"""The craft of posing in the real window: rigs open in it, sliders and the map pose them, lists follow."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget

from app.window.palette import Palette
from app.window.pose import map_panel as pose_map_panel
from app.window.pose.controls import PoseControls
from app.window.pose.overlay import skeleton_of
from app.window.pose.poses import PoseLibrary, PoseList
from app.window.pose.rig_panel import RigPanel
from core.camera import clip_from_world
from core.demo.pose_document import pose_document
from core.document import Document, find_mesh, with_mesh
from core.overlay import Circle
from core.pose.compare import LABELS
from core.pose.edit_layers import cross_talk
from core.pose.pose import REST, Pose
from core.pose.rig import playing
from core.pose.rotation import euler_from_quaternion, quaternion_from_euler
from core.pose.sculpt.symmetry import opposites_by_axis
from core.pose.synthesis import evaluate
from core.pose.weights import weights_of
from core.posed import shown_points
from core.record import freeze
from docs.first_pose import elbow_on_screen
from tests.tools import pose_scenes
from tests.window.conftest import Opened
from tests.window.hand import Hand
from tools import control_edits
from tools.pose_edits import hold_pose, select_joints, set_reading

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture(scope="module")
def rigs() -> Document:
    return pose_document()


@pytest.fixture
def posing(opened: Opened, rigs: Document) -> Hand:
    """A hand at a window with the arm and the face, in the craft of posing."""
    hand = opened(rigs)
    hand.window.resize(1500, 900)
    hand.window.desk.set_craft("pose")
    hand.rest()
    return hand


def part(hand: Hand, kind: type[QWidget]) -> QWidget:
    return hand.window.findChild(kind)


def test_crafts_are_words_at_the_top_with_their_own_tools_and_panels(opened: Opened, rigs: Document) -> None:
    window = opened(rigs).window
    QTest.mouseClick(window.top.crafts.buttons["pose"], LEFT)
    assert window.desk.workspace.craft == "pose"
    assert window.panels["controls"].isVisible()
    assert window.pose_side.isVisible()
    assert not window.panels["coat"].isVisible()
    assert "grab" in window.shelf.buttons
    QTest.mouseClick(window.top.crafts.buttons["groom"], LEFT)
    assert not window.pose_side.isVisible()
    assert window.panels["coat"].isVisible()
    assert next(iter(window.shelf.buttons)) == window.desk.session.tools.of("groom")[0].name


def test_a_slider_turns_the_joint_and_is_one_step(posing: Hand) -> None:
    desk, controls = posing.window.desk, part(posing, PoseControls)
    assert controls.joint.value() == "elbow"
    for value, final in ((0.5, False), (1.2, False), (1.2, True)):
        controls.angles[2].set_value(value)
        controls.angles[2].edited.emit(value, final)
    assert list(desk.session.history.names)[1:] == ["Pose"]
    assert desk.document.meshes[0].pose.rotations["elbow"] == pytest.approx(
        quaternion_from_euler((0, 0, math.degrees(1.2))), abs=1e-9)
    QTest.mouseClick(controls.play, LEFT)
    assert desk.document.meshes[0].pose is None


def test_the_dot_of_the_map_takes_the_model_along(posing: Hand) -> None:
    desk, canvas = posing.window.desk, posing.window.pose_side.map.canvas
    desk.set_workspace(mesh=2)
    posing.rest()
    assert [s.name for s in canvas.chart.space.samples] == ["joy", "anger", "sadness", "calm"]
    start, end = canvas.to_pixel(canvas.dot).toPoint(), canvas.to_pixel(np.array([0.5, 0.25])).toPoint()
    before = shown_points(desk.document.meshes[1], 1001.0, desk.session.evaluator)
    QTest.mousePress(canvas, LEFT, pos=start + QPoint(9, 0))
    QTest.mouseMove(canvas, (start + end) / 2)
    QTest.mouseMove(canvas, end)
    assert desk.session.history.names == ("New",)  # a preview
    QTest.mouseRelease(canvas, LEFT, pos=end)
    pose = desk.document.meshes[1].pose
    axes = [axis.dof.control for axis in canvas.chart.axes]
    assert [pose.numbers[name] for name in axes] == pytest.approx(
        canvas.to_place(QPointF(end)), abs=1e-9)
    assert [pose.numbers[name] for name in axes] == pytest.approx([0.5, 0.25], abs=0.02)
    after = shown_points(desk.document.meshes[1], 1001.0, desk.session.evaluator)
    assert np.abs(after - before).max() > 1e-3


def test_a_click_on_a_pose_of_the_map_holds_it(posing: Hand) -> None:
    desk, canvas = posing.window.desk, posing.window.pose_side.map.canvas
    where = canvas.to_pixel(canvas.chart.spots[1]).toPoint()
    QTest.mouseClick(canvas, LEFT, pos=where)
    sample = canvas.chart.space.samples[0]
    assert desk.document.meshes[0].pose.rotations == sample.pose.rotations
    assert canvas.chosen == 1


def test_the_map_of_all_poses_mixes_those_near_the_dot(posing: Hand) -> None:
    desk, side = posing.window.desk, posing.window.pose_side
    desk.set_workspace(mesh=2)
    side.map.across.enter("all poses (by distance)")
    chart = side.map.canvas.chart
    assert chart.axes is None
    joy = [s.name for s in chart.space.samples].index("joy")
    assert side.map.pose_of(tuple(chart.spots[1 + joy])).numbers == pytest.approx(
        chart.space.samples[joy].pose.numbers)


def test_the_heat_of_the_map_is_painted_by_a_job(posing: Hand) -> None:
    posing.rest()
    values = posing.window.pose_side.map.canvas._heat[0]
    assert values.max() == pytest.approx(1.0, abs=0.05)
    assert abs(values[len(values) // 2].min()) < 0.3


def test_the_list_has_the_layers_and_holds_a_pose(posing: Hand) -> None:
    desk, poses = posing.window.desk, part(posing, PoseList)
    top = [poses.list.topLevelItem(i) for i in range(poses.list.topLevelItemCount())]
    assert [item.child(0).text(0) for item in top] == ["elbow bent", "shoulder raised", "forearm twisted"]
    poses.list.setCurrentItem(top[2].child(0))
    poses.list.itemClicked.emit(top[2].child(0), 0)
    assert list(desk.document.meshes[0].pose.rotations) == ["wrist"]
    assert poses.falloffs["wrist"].value()[0] > 0.0
    poses.falloffs["wrist"].bars[0].enter(0.5)
    layer = desk.document.meshes[0].correctives.layers[2]
    assert layer.space.samples[0].falloffs["wrist"] == (0.5,)
    top = poses.list.topLevelItem(0)
    top.setCheckState(0, Qt.CheckState.Unchecked)
    posing.until(lambda: not desk.document.meshes[0].correctives.layers[0].enabled)
    assert list(desk.session.history.names)[1:] == ["Pose", "Falloff", "Hide layer"]


def test_methods_are_compared_by_a_switch(posing: Hand) -> None:
    desk, poses = posing.window.desk, part(posing, PoseList)
    poses.way.enter("linear")
    assert {layer.kind for layer in desk.document.meshes[0].correctives.layers} == {"linear"}
    assert desk.session.history.undo_name == "Method"


def test_a_sculpt_at_a_taken_pose_is_refused_in_words(posing: Hand) -> None:
    desk, poses = posing.window.desk, part(posing, PoseList)
    said: list[str] = []
    desk.failed.connect(lambda words, details: said.append(words))
    desk.edit("Pose", lambda document, i: document.replace(meshes=(
        document.meshes[0].replace(pose=REST), *document.meshes[1:])), 1)
    QTest.mouseClick(poses.buttons["add"], LEFT)
    assert said
    assert "rest" in said[0]
    bent = desk.posed.correctives.layers[0].space.samples[0].pose
    half = {"elbow": tuple(map(float, quaternion_from_euler((0.0, 0.0, 40.0))))}
    desk.edit("Pose", hold_pose, 1, bent.replace(name="half", rotations=half))
    QTest.mouseClick(poses.buttons["add"], LEFT)
    name = desk.posed.correctives.layers[0].space.samples[1].name
    desk.edit("Pose", hold_pose, 1, bent.replace(name="again"))
    poses.list.clearSelection()
    poses.list.topLevelItem(0).child(1).setSelected(True)
    assert poses.chosen == [name]
    QTest.mouseClick(poses.buttons["move"], LEFT)
    assert bent.name in said[1]
    assert set(poses.chosen) == {bent.name, name}, "those that the refusal names, to be merged or deleted"
    assert poses.buttons["merge"].isEnabled()


def test_poses_are_kept_in_the_library_and_held_again(posing: Hand) -> None:
    desk, library, controls = posing.window.desk, part(posing, PoseLibrary), part(posing, PoseControls)
    controls.angles[0].edited.emit(0.0, True)
    library.keep("first try")
    QTest.mouseClick(controls.rest, LEFT)
    assert [pose.name for pose in desk.document.meshes[0].library] == ["first try"]
    library.list.itemClicked.emit(library.list.topLevelItem(0), 0)
    assert desk.document.meshes[0].pose.name == "first try"
    library.list.topLevelItem(0).setSelected(True)
    QTest.mouseClick(library.forget_button, LEFT)
    assert desk.document.meshes[0].library == ()


def test_map_and_model_stand_over_one_another_in_a_narrow_window(posing: Hand) -> None:
    window = posing.window
    assert window.sides.orientation() == Qt.Orientation.Horizontal
    window.resize(900, 700)
    posing.rest()
    assert window.sides.orientation() == Qt.Orientation.Vertical
    assert window.viewport.width() > 300


def colours_of_the_surface_follow_the_pose_and_say_what_they_mean(posing: Hand) -> None:
    window = posing.window
    desk, picture = window.desk, window.viewport.picture
    window.pose_side.look.heat.enter("shape")
    assert desk.workspace.view.heat == "shape"
    at_rest = picture_values(posing)
    assert np.ptp(at_rest) == pytest.approx(0.0, abs=1e-6)
    desk.edit("Pose", hold_pose, desk.posed.id, desk.posed.correctives.layers[0].space.samples[0].pose)
    drawn(posing)
    assert np.ptp(picture_values(posing)) > 0.2
    legend = picture.panes.shown[0].legend
    assert legend.signed
    assert legend.ticks[2].endswith("m")
    window.commands.run("view.heat_error")
    drawn(posing)
    assert picture.panes.shown[0].legend.title.startswith("Error")
    window.commands.run("view.heat_plain")
    drawn(posing)
    assert picture.panes.shown[0].scene.surfaces[0].values is None
    desk.choose("mask")
    drawn(posing)
    assert picture.panes.shown[0].legend.title == "Mask"


def methods_stand_side_by_side_and_the_hand_works_in_any_of_them(posing: Hand) -> None:
    window = posing.window
    desk, view = window.desk, window.viewport
    whole = view.pixels()
    desk.edit("Pose", hold_pose, desk.posed.id, desk.posed.correctives.layers[0].space.samples[0].pose)
    window.pose_side.look.sides.enter("SSD · SI · PSD · WPSD")
    drawn(posing)
    panes = view.picture.panes.shown
    assert [pane.name for pane in panes] == [LABELS[m] for m in ("skin", "interpolation", "pose-space", "weighted")]
    skin, _, psd, _ = (pane.scene.surfaces[0].points for pane in panes)
    item = desk.posed
    assert np.array_equal(skin, evaluate(item.mesh.points, item.rig, None, item.pose))
    assert psd == pytest.approx(evaluate(item.mesh.points, item.rig, item.correctives, item.pose), abs=1e-6)
    size = view.pixels()
    assert size == (whole[0] // 2, whole[1] // 2)
    desk.choose("rotate")
    names = item.rig.skeleton.names
    rings = [m for m in skeleton_of(desk, view.eye.camera, size, 1.0) if isinstance(m, Circle)]
    ring = rings[names.index("elbow")]
    place = (ring.x + size[0] + 0.5) / whole[0], (ring.y + size[1] + 0.5) / whole[1]  # in the last pane
    posing.press(place)
    posing.release(place)
    drawn(posing)
    assert desk.posed.joint_selection == ("elbow",)
    window.commands.run("view.single")
    drawn(posing)
    assert view.pixels() == whole


def two_dials_have_a_pad_whose_dots_are_the_sculpts(posing: Hand) -> None:
    window = posing.window
    desk, controls = window.desk, part(posing, PoseControls)
    assert controls.pad is None
    desk.set_workspace(mesh=desk.document.meshes[1].id)
    pad = controls.pad
    joy = next(pose for pose in pad.poses if pose.name == "joy")
    assert {pose.name for pose in pad.poses} == {"joy", "anger", "sadness", "calm"}
    steps = len(desk.session.history.names)
    start, end = pad.to_pixel(*pad.at).toPoint(), pad.to_pixel(0.5, -0.25).toPoint()
    QTest.mousePress(pad, LEFT, pos=start)
    QTest.mouseMove(pad, (start + end) / 2)
    QTest.mouseMove(pad, end)
    held = desk.posed.pose.numbers
    assert held["valence"] == pytest.approx(0.5, abs=0.02)
    assert held["arousal"] == pytest.approx(-0.25, abs=0.02)
    QTest.mouseRelease(pad, LEFT, pos=end)
    assert len(desk.session.history.names) == steps + 1
    assert controls.dials["valence"].value() == pytest.approx(held["valence"])
    QTest.mouseClick(pad, LEFT, pos=pad.to_pixel(joy.numbers["valence"], joy.numbers["arousal"]).toPoint())
    assert desk.posed.pose.numbers == joy.numbers


def a_chosen_layer_shows_what_it_is_set_to_and_takes_another_kernel(posing: Hand) -> None:
    desk, poses = posing.window.desk, part(posing, PoseList)
    poses.list.clearSelection()
    poses.list.setCurrentItem(poses.list.topLevelItem(0))
    name = poses.chosen_layer
    assert {"kernel", "affine", "normalise", "clamp", "smoothing", "table", "weighted"} <= poses.settings.fields.keys()
    poses.settings.fields["kernel"].enter("wendland")
    layer = desk.posed.correctives.layers[0]
    assert (layer.name, layer.space.kernel) == (name, "wendland")
    assert poses.chosen_layer == name
    poses.readings["elbow"].enter("swing")
    assert [dof.kind for dof in desk.posed.correctives.layers[0].space.dofs] == ["swing"]
    desk.session.undo()
    desk.session.undo()
    assert desk.posed.correctives.layers[0].space.kernel == "gaussian"


def skin_only_is_looked_at_and_weighted_is_a_step(posing: Hand) -> None:
    desk, poses = posing.window.desk, part(posing, PoseList)
    before = desk.posed.correctives
    poses.way.enter("skin")
    drawn(posing)
    assert desk.posed.correctives is before
    assert posing.window.viewport.picture.panes.shown[0].name == LABELS["skin"]
    poses.way.enter("weighted")
    drawn(posing)
    assert all(layer.space.weighted for layer in desk.posed.correctives.layers)
    assert desk.session.history.names[-1] == "Method"
    assert posing.window.viewport.picture.panes.shown[0].name == ""
    assert poses.way.value() == "weighted"


def cross_talk_is_a_table_whose_rows_hold_their_poses(posing: Hand) -> None:
    desk, side = posing.window.desk, posing.window.pose_side
    side.kind.enter("talk")
    drawn(posing)
    item = desk.posed
    names, known = cross_talk(item.mesh.points, item.rig, item.correctives)
    assert side.talk.names == names
    assert np.array_equal(side.talk.table, known)
    QTest.mouseClick(side.talk, LEFT, pos=side.talk.cell(1, -1).center().toPoint())
    held = desk.posed.pose
    assert held.name == names[1]
    side.talk.show_table(("bent", "raised"), np.array([[0.0, 0.0023], [0.0, 0.0]]))
    assert "bent the sculpt raised moves the surface by 2.3 mm" in side.talk.said(0, 1)
    assert "silent" in side.talk.said(1, 0)


def respect_says_only_what_concerns_posing(posing: Hand) -> None:
    panel = posing.window.panels["respect"]
    shown = {name for name, row in panel.form.rows.items() if not row.isHidden()}
    assert shown == {"symmetry"}
    posing.window.desk.set_craft("groom")
    assert {name for name, row in panel.form.rows.items() if not row.isHidden()} == {
        "hairspray", "selection", "symmetry"}


def a_map_of_many_sculpts_is_laid_out_by_a_job(hand: Hand) -> None:
    canvas, bars = hand.window.pose_side.map.canvas, hand.window.pose_side.map
    known = canvas.chart
    bars.layer.enter("wrist")
    bars.layer.enter("elbow")
    assert canvas.chart is None
    assert "Laying out" in canvas.words
    drawn(hand)
    assert np.array_equal(canvas.chart.spots, known.spots)
    assert len(canvas.chart.rims) == len(known.rims)
    assert canvas.dot is not None


def test_what_the_view_shows_and_what_stands_beside_it(posing: Hand, monkeypatch: pytest.MonkeyPatch) -> None:
    """In one window, for opening one takes longer than all of these."""
    with monkeypatch.context() as patch:
        patch.setattr(pose_map_panel, "AT_ONCE", 0)
        a_map_of_many_sculpts_is_laid_out_by_a_job(posing)
    for follows in (
        colours_of_the_surface_follow_the_pose_and_say_what_they_mean,
        methods_stand_side_by_side_and_the_hand_works_in_any_of_them,
        a_chosen_layer_shows_what_it_is_set_to_and_takes_another_kernel,
        skin_only_is_looked_at_and_weighted_is_a_step,
        cross_talk_is_a_table_whose_rows_hold_their_poses,
        two_dials_have_a_pad_whose_dots_are_the_sculpts,
        respect_says_only_what_concerns_posing,
    ):
        follows(posing)


def picture_values(hand: Hand) -> np.ndarray:
    drawn(hand)
    values = hand.window.viewport.picture.panes.shown[0].scene.surfaces[0].values
    assert values is not None
    return values


def drawn(hand: Hand) -> None:
    """Wait until jobs have ended and what they caused is on the screen; nothing needs to be finished for that."""
    hand.until(lambda: not hand.window.desk.jobs.running and not hand.view.pending)


def test_a_pad_is_of_two_of_three_dials_that_the_hand_chooses(posing: Hand) -> None:
    desk, controls = posing.window.desk, part(posing, PoseControls)
    desk.set_workspace(mesh=2)
    assert controls.axes == ()
    desk.edit("Add dial", control_edits.add_dial, 2, "wonder", -1.0, 1.0)
    across, up = controls.axes
    assert (across.value(), up.value()) == ("valence", "arousal"), "those that sculpts read"
    up.enter("wonder")
    pad = controls.pad
    assert (pad.across.name, pad.up.name) == ("valence", "wonder")
    assert pad.poses == (), "no sculpt is about these two"
    QTest.mouseClick(pad, LEFT, pos=pad.to_pixel(0.5, -0.5).toPoint())
    numbers = desk.posed.pose.numbers
    assert [numbers["valence"], numbers["wonder"]] == pytest.approx([0.5, -0.5], abs=0.02)
    controls.axes[0].enter("wonder")
    assert (controls.pad.across.name, controls.pad.up.name) == ("wonder", "valence"), "they change places"


def test_a_sculpt_reaches_differently_along_each_axis(posing: Hand) -> None:
    desk, poses = posing.window.desk, part(posing, PoseList)
    poses.list.topLevelItem(0).child(0).setSelected(True)
    (name,) = poses.chosen
    reach = next(iter(poses.falloffs.values()))
    reach.each.enter(True)
    reach = poses.falloffs["elbow"]
    assert len(reach.bars) == 3
    reach.bars[2].enter(0.25)
    sample = desk.posed.correctives.layers[0].space.samples[0]
    assert sample.name == name
    assert sample.falloffs["elbow"][2] == 0.25
    assert sample.falloffs["elbow"][0] == sample.falloffs["elbow"][1] != 0.25
    poses.falloffs["elbow"].each.enter(False)
    assert len(desk.posed.correctives.layers[0].space.samples[0].falloffs["elbow"]) == 1


def test_controls_are_made_changed_and_deleted_in_the_panel_of_the_rig(posing: Hand) -> None:
    desk, panel = posing.window.desk, part(posing, RigPanel).controls
    said: list[str] = []
    desk.failed.connect(lambda words, details: said.append(words))
    QTest.mouseClick(panel.buttons["dial"], LEFT)
    assert panel.chosen == "dial"
    panel.form.fields["high"].enter(3.0)
    panel.form.fields["name"].enter("strain")
    (control,) = desk.posed.rig.controls
    assert (control.name, control.low, control.high) == ("strain", 0.0, 3.0)
    panel.form.fields["high"].enter(-1.0)
    posing.until(lambda: panel.form is not None and panel.form.fields["high"].value() == 3.0)
    assert "within a range" in said[-1]
    QTest.mouseClick(panel.buttons["geometry"], LEFT)
    assert "mask" in said[-1]
    mask = np.zeros(len(desk.posed.mesh.points), np.float32)
    mask[:9] = 1.0
    desk.edit("Mask", lambda d, i: with_mesh(d, find_mesh(d, i).replace(mask=freeze(mask))), 1)
    QTest.mouseClick(panel.buttons["geometry"], LEFT)
    assert list(desk.posed.rig.controls[1].vertices) == list(range(9))
    panel.form.fields["travel"].enter(0.05)
    assert desk.posed.rig.controls[1].travel == 0.05
    QTest.mouseClick(panel.buttons["delete"], LEFT)
    assert [c.name for c in desk.posed.rig.controls] == ["strain"]
    assert desk.session.history.undo_name == "Delete control"


def test_constraints_are_made_changed_and_deleted_in_the_panel_of_the_rig(posing: Hand) -> None:
    desk, panel = posing.window.desk, part(posing, RigPanel).constraints
    desk.edit("Select joint", select_joints, 1, ("elbow",))
    QTest.mouseClick(panel.buttons["limit"], LEFT)
    panel.list.topLevelItem(0).setSelected(True)
    panel.form.fields["high_z"].enter(0.4)
    (limit,) = desk.posed.rig.constraints
    assert limit.high == pytest.approx((math.pi / 4, math.pi / 4, 0.4))
    controls = part(posing, PoseControls)
    controls.angles[2].enter(1.2)
    assert desk.posed.pose.rotations["elbow"] == pytest.approx(
        quaternion_from_euler((0, 0, math.degrees(0.4))), abs=1e-6)
    panel.form.fields["high_z"].enter(0.2)
    assert desk.posed.pose.rotations["elbow"] == pytest.approx(
        quaternion_from_euler((0, 0, math.degrees(0.2))), abs=1e-6), "a pose that is held obeys at once"
    QTest.mouseClick(panel.buttons["delete"], LEFT)
    assert desk.posed.rig.constraints == ()


def test_a_stroke_that_is_refused_can_still_be_merged(posing: Hand) -> None:
    desk, poses = posing.window.desk, part(posing, PoseList)
    bent = desk.posed.correctives.layers[0].space.samples[0].pose
    angles = np.degrees(euler_from_quaternion(np.array(bent.rotations["elbow"])))
    desk.edit("Reading", set_reading, 1, desk.posed.correctives.layers[0].name, "elbow", "z")
    near = {"elbow": tuple(map(float, quaternion_from_euler((20.0, 0.0, angles[2]))))}
    desk.edit("Pose", hold_pose, 1, bent.replace(name="near", rotations=near))
    posing.rest()
    points = shown_points(desk.posed, 1001.0, desk.session.evaluator)
    x, y = elbow_on_screen(posing)
    posing.drag((x, y), (x - 0.01, y + 0.045))
    assert poses.refused.isVisible()
    assert bent.name in poses.chosen
    assert desk.session.history.undo_name == "Pose", "nothing was changed yet"
    QTest.mouseClick(poses.refused.buttons["merge"], LEFT)
    assert not poses.refused.isVisible()
    item = desk.posed
    after = evaluate(item.mesh.points, item.rig, item.correctives, bent)
    assert np.abs(after - points).max() > 1e-3
    assert len(item.correctives.layers[0].space.samples) == 1


def test_keys_of_poses_stand_on_the_timeline_and_are_moved_and_deleted(posing: Hand) -> None:
    desk, row = posing.window.desk, posing.window.timeline.pose_keys
    assert not row.isVisible()
    desk.set_workspace(mesh=2)
    desk.edit("No clip", lambda document: with_mesh(document, document.meshes[1].replace(
        rig=playing(document.meshes[1].rig, None))))
    pad = part(posing, PoseControls).pad
    for frame, x in ((1001.0, 0.0), (1021.0, 0.8)):
        desk.set_workspace(frame=frame)
        QTest.mouseClick(pad, LEFT, pos=pad.to_pixel(x, 0.3).toPoint())
        posing.window.commands.run("pose.key_pose")
    posing.until(row.isVisible)
    assert row.frames == (1001.0, 1021.0)
    scale, middle = posing.window.timeline.ruler.scale, row.height() // 2
    here, there = (QPoint(round(scale.x_of(frame)), middle) for frame in (1021.0, 1031.0))
    QTest.mousePress(row, LEFT, pos=here)
    QTest.mouseMove(row, (here + there) / 2)
    QTest.mouseMove(row, there)
    QTest.mouseRelease(row, LEFT, pos=there)
    assert row.frames[-1] == 1031.0
    clip = desk.posed.rig.clip
    at = clip.number_names.index("valence")
    assert clip.numbers[30, at] == pytest.approx(0.8, abs=0.02)
    assert 0.1 < clip.numbers[15, at] < 0.7, "it eases there over the longer way"
    QTest.keyClick(row, Qt.Key.Key_Delete)
    assert row.frames[-1] == 1001.0
    assert np.abs(desk.posed.rig.clip.numbers[:, at]).max() < 0.02, "as if it had never been keyed"
    assert list(desk.session.history.names)[-2:] == ["Move pose keys", "Delete pose keys"]


def test_a_sculpt_is_read_while_the_window_goes_on(posing: Hand, tmp_path: Path) -> None:
    desk, item = posing.window.desk, posing.window.desk.posed
    turned = {"wrist": tuple(map(float, quaternion_from_euler((30.0, 0.0, 0.0))))}
    desk.edit("Pose", hold_pose, 1, Pose(name="new", rotations=turned))
    there = item.mesh.points if item.rig.file_vertices is None else item.mesh.points[item.rig.file_vertices]
    (tmp_path / "new.obj").write_text("".join(f"v {x:.9g} {y + 0.01:.9g} {z:.9g}\n" for x, y, z in there))
    before = desk.document
    posing.window.import_sculpt(tmp_path / "new.obj")
    assert desk.document is before, "it is not there yet"
    posing.until(lambda: desk.session.history.undo_name == "Import sculpt")
    assert "new" in [s.name for layer in desk.posed.correctives.layers for s in layer.space.samples]
    (tmp_path / "few.obj").write_text("v 0 0 0\n")
    said: list[str] = []
    desk.failed.connect(lambda words, details: said.append(words))
    posing.window.import_sculpt(tmp_path / "few.obj")
    posing.until(lambda: bool(said))
    assert "few.obj" in said[0]


def test_what_is_posed_is_isolated(posing: Hand) -> None:
    desk = posing.window.desk
    desk.set_workspace(mesh=2)
    posing.window.commands.run("view.isolate")
    assert desk.workspace.view.isolated == (2,)
    posing.window.commands.run("view.isolate")
    desk.set_workspace(mesh=1)
    posing.window.commands.run("view.isolate")
    assert desk.workspace.view.isolated == (1,)


def test_weights_are_painted_by_the_hand_and_kept_in_order_by_actions(posing: Hand) -> None:
    desk, run = posing.window.desk, posing.window.commands.run
    desk.edit("Select joint", select_joints, 1, ("elbow",))
    joint = desk.posed.rig.skeleton.names.index("elbow")

    def share() -> np.ndarray:
        skin = desk.posed.rig.skin
        return np.where(skin.joints == joint, skin.weights, 0.0).sum(axis=1)

    x, y = elbow_on_screen(posing)
    desk.choose("weights")
    before = share()
    posing.drag((x, y), (x + 0.03, y), steps=4)
    assert desk.session.history.undo_name == "Paint weights"
    painted = share() - before
    assert painted.max() > 0.05
    assert painted.min() >= -1e-6
    posing.drag((x, y), (x + 0.03, y), modifiers=Qt.KeyboardModifier.ControlModifier, steps=4)
    assert (share() - before - painted).min() < -0.05
    for command in ("smooth_weights", "prune_weights", "limit_influences", "normalise_weights"):
        run(f"pose.{command}")
        skin = desk.posed.rig.skin
        assert skin.weights.sum(axis=1) == pytest.approx(np.ones(len(skin.weights)), abs=1e-6)
    assert ((skin.weights > 0).sum(axis=1) <= 4).all()
    assert skin.weights[skin.weights > 0].min() >= 0.009
    run("pose.lock_joints")
    said: list[str] = []
    desk.failed.connect(lambda words, details: said.append(words))
    locked = share()
    posing.drag((x, y), (x + 0.03, y), steps=4)
    assert "locked" in said[0]
    assert (share() == locked).all()


def test_weights_are_mirrored_while_the_hand_paints_and_by_words_afterwards(opened: Opened) -> None:
    """With symmetry the other side's joint is painted as well; what was painted on one side alone is mirrored later."""
    hand = opened(pose_scenes.document(joint_selection=("arm_L",)))
    window, desk = hand.window, hand.window.desk
    desk.set_craft("pose")
    desk.choose("weights")
    hand.rest()
    pairs = opposites_by_axis(pose_scenes.strip().points)

    def share(joint: str) -> np.ndarray:
        return weights_of(desk.posed.rig.skin, pose_scenes.JOINTS.index(joint))

    def place(x: float) -> tuple[float, float]:
        view, (width, height) = window.viewport, window.viewport.pixels()
        clip = clip_from_world(view.eye.camera, width, height) @ np.array([x, 0.0, 0.05, 1.0])
        return (clip[0] / clip[3] + 1) / 2, (1 - clip[1] / clip[3]) / 2

    before = share("arm_L").copy()
    hand.drag(place(0.25), place(0.35), steps=3)
    assert (share("arm_L") - before).max() > 0.05
    assert np.abs(share("arm_R") - share("arm_L")[pairs]).max() > 0.05
    hand.key(Qt.Key.Key_K, Qt.KeyboardModifier.ControlModifier)
    (palette,) = window.findChildren(Palette)
    QTest.keyClicks(palette.line, "mirror weights")
    QTest.keyClick(palette.line, Qt.Key.Key_Return)
    hand.rest()
    assert desk.session.history.undo_name == "Mirror weights"
    assert np.abs(share("arm_R") - share("arm_L")[pairs]).max() < 1e-5
    window.commands.run("tool.symmetry")
    painted = share("arm_L").copy()
    hand.drag(place(0.4), place(0.5), steps=3)
    assert (share("arm_L") - painted).max() > 0.02
    # in the middle, where both rings reach, one side is painted after the other
    assert np.abs(share("arm_R") - share("arm_L")[pairs]).max() < 1e-3
