"""A matchmover at the real window: a plate is opened, a point placed and followed, saved and opened again."""

from __future__ import annotations

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QInputDialog

from app.window.commands import Command
from app.window.match import doors
from app.window.match.commands import MATCH
from app.window.match.dope_sheet import tones_of
from app.window.match.plate_panel import PlatePanel
from app.window.match.track_list import TrackList
from app.window.theme import look_of
from core.document import Document
from core.image.plate import Plate
from core.image.plate_view import plate_camera, view_points
from core.match.outline import Mask
from core.match.track import carried_points, keyed_track
from core.record import freeze
from tests.core.match.test_solved import small_solve
from tests.window.conftest import Opened
from tests.window.hand import LEFT, NONE, Hand
from tests.window.host import Host
from tools import match_edits as edits

WIDTH, HEIGHT, FIRST, COUNT = 240, 160, 1001, 10
STEP = np.array([2.3, -0.7])  # pixels from frame to frame
START = np.array([90.0, 90.0])


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Smooth noise that slides by STEP."""
    folder = tmp_path_factory.mktemp("plate") / "sliding"
    folder.mkdir()
    rough = np.random.default_rng(7).random((100, 140, 3)).astype(np.float32)
    noise = cv2.resize(rough, (560, 400), interpolation=cv2.INTER_CUBIC)
    for n in range(COUNT):
        x, y = np.meshgrid(np.arange(WIDTH) + 100 - n * STEP[0], np.arange(HEIGHT) + 100 - n * STEP[1])
        frame = cv2.remap(noise, x.astype(np.float32), y.astype(np.float32), cv2.INTER_CUBIC)
        cv2.imwrite(str(folder / f"sliding.{FIRST + n}.png"), np.clip(frame * 255.0, 0, 255).astype(np.uint8))
    return folder


def pixel(hand: Hand, place: NDArray[np.float64]) -> QPoint:
    """The pixel of Qt's that shows a place of the plate."""
    view = hand.view
    x, y = view_points(view.eye.camera, 1.0, place, *view.pixels())[0]
    ratio = view.devicePixelRatio()
    return QPoint(round(x / ratio), round(y / ratio))


def click(hand: Hand, place: NDArray[np.float64], modifiers: Qt.KeyboardModifier = NONE) -> None:
    at = pixel(hand, place)
    QTest.mousePress(hand.view, LEFT, modifiers, at)
    QTest.mouseRelease(hand.view, LEFT, modifiers, at)
    hand.painted()


def opened_plate(opened: Opened, plate: Path) -> Hand:
    hand = opened(Document())
    hand.window.opening.open(plate)
    hand.until(lambda: bool(hand.window.desk.document.plates))
    hand.rest()
    return hand


def test_a_point_is_placed_followed_saved_and_opened_again(opened: Opened, plate: Path, tmp_path: Path) -> None:
    hand = opened_plate(opened, plate)
    desk = hand.window.desk
    assert desk.session.tool.name == "track_point"
    assert (desk.document.first_frame, desk.document.last_frame) == (FIRST, FIRST + COUNT - 1)
    click(hand, START)
    (track,) = desk.document.tracks
    assert np.abs(track.points[0] - START).max() < 1.0 / hand.window.match.eye.camera.height * HEIGHT
    assert desk.document.track_selection == (track.id,)
    hand.window.commands.run("match.forward")
    hand.until(lambda: not desk.jobs.running, 240_000)
    (track,) = desk.document.tracks
    assert list(track.frames) == list(range(FIRST, FIRST + COUNT))
    truth = track.points[0] + STEP * np.arange(COUNT)[:, None]
    assert np.abs(track.points - truth).max() < 0.1
    assert desk.session.history.undo_name == "Track forward"
    desk.set_workspace(frame=float(FIRST + 5))
    hand.rest()
    project = tmp_path / "shot.filo"
    desk.session.save(project)
    hand.window.opening.open(project)
    hand.until(lambda: desk.session.path == project)
    hand.rest()
    assert np.array_equal(desk.document.tracks[0].points, track.points)
    assert hand.window.match.shown


ASKS = {"match.distance"}  # a question comes before the step
EDITS = [c for c in MATCH if c.undo is not None and not c.twin.startswith("core.match") and c.name not in ASKS]
SELECTED = {"match.ground": (1, 2, 3)}
BEFORE = {"match.show_all": "match.hide", "match.select_all": "match.select_none"}


@pytest.mark.parametrize("command", EDITS, ids=lambda c: c.name)
def test_the_step_of_an_edit_has_the_name_it_promises(command: Command, host: Host) -> None:
    rows = np.column_stack((np.arange(11.0, 21.0), np.random.default_rng(1).random((10, 2)) * 9.0 + 50.0))
    tracks = tuple(keyed_track(n, f"t{n}", rows + np.array([0.0, n, n]), 1) for n in (1, 2, 3))
    film = Plate(id=1, name="p", path="nothing.####.png", first=11, last=20, width=200, height=100)
    document = edits.put_tracks(edits.add_plate(host.desk.document, film), tracks)
    shape = freeze(np.array([[[5.0, 5.0], [50.0, 5.0], [5.0, 50.0]]]))
    mask = Mask(id=1, name="m", frames=freeze(np.array([11], np.int32)), points=shape, plate_id=1)
    solved = small_solve().replace(
        size=(200, 100), track_ids=freeze(np.arange(1, 4, dtype=np.int32)), cubes=(), errors=freeze(np.full(3, 0.2)),
        points=freeze(np.array([[0.0, 0.0, 5.0], [0.0, 1.0, 5.0], [1.0, 0.5, 6.0]])))
    document = document.replace(
        masks=(mask,), plates=(*document.plates, film.replace(id=2, hidden=True)), solves=(solved,))
    host.desk.session.commit("Tracks", edits.select_tracks(document, SELECTED.get(command.name, (1, 2))))
    host.desk.set_workspace(frame=15.0)
    if command.name in BEFORE:
        assert host.commands.run(BEFORE[command.name]), host.failed
    before = host.desk.document
    assert host.commands.run(command.name), host.failed
    assert host.desk.document is not before
    assert host.desk.session.history.undo_name == command.undo
    host.commands.run("edit.undo")
    assert host.desk.document is before


def test_the_distance_between_two_tracks_is_asked_for_in_metres(opened: Opened, plate: Path) -> None:
    hand = opened_plate(opened, plate)
    desk = hand.window.desk
    shot = desk.document.plates[0]
    tracks = tuple(keyed_track(n, f"t{n}", np.array([[FIRST, 50.0 + n, 60.0]]), shot.id) for n in (1, 2))
    solved = small_solve().replace(
        plate_id=shot.id, size=(WIDTH, HEIGHT), track_ids=freeze(np.array([1, 2], np.int32)), cubes=(),
        points=freeze(np.array([[0.0, 0.0, 5.0], [0.0, 3.0, 9.0]])), errors=freeze(np.full(2, 0.2)))
    ready = edits.put_tracks(desk.document, tracks).replace(solves=(solved,))
    desk.session.commit("Tracks", edits.select_tracks(ready, (1, 2)))
    for words, apart in (("far", 5.0), ("2,5", 2.5)):
        assert hand.window.commands.run("match.distance")
        (dialog,) = hand.window.findChildren(QInputDialog)
        dialog.setTextValue(words)
        dialog.accept()
        hand.until(lambda: not hand.window.findChildren(QInputDialog))
        first, second = desk.document.solves[0].points
        assert np.linalg.norm(second - first) == pytest.approx(apart), words
    assert desk.session.history.undo_name == "Set distance"


def test_a_pattern_of_one_edge_is_not_followed_and_it_is_said_why(opened: Opened, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    for k in range(5):
        light = 40.0 + 120.0 / (1.0 + np.exp(-(np.arange(HEIGHT) - 80.0 - k) / 0.8))
        frame = light[:, None] + rng.normal(0.0, 2.0, (HEIGHT, WIDTH))
        cv2.imwrite(str(tmp_path / f"edge.{k + 1}.png"), np.clip(frame, 0, 255).astype(np.uint8))
    hand = opened_plate(opened, tmp_path)
    desk, said = hand.window.desk, []
    desk.said.connect(said.append)
    click(hand, np.array([120.0, 80.0]))
    hand.window.commands.run("match.forward")
    hand.until(lambda: not desk.jobs.running, 240_000)
    assert len(desk.document.tracks[0].frames) == 1
    assert any("one edge only" in words for words in said)


def test_a_gap_is_filled_by_flow_and_a_plate_is_slowed_down(opened: Opened, plate: Path) -> None:
    hand = opened_plate(opened, plate)
    window, desk = hand.window, hand.window.desk
    click(hand, START)
    window.commands.run("match.forward")
    hand.until(lambda: not desk.jobs.running, 240_000)
    whole = desk.document.tracks[0]
    kept = np.array([0, 1, 2, 7, 8, 9])
    part = whole.replace(**{
        name: freeze(getattr(whole, name)[kept]) for name in ("frames", "points", "covariance", "own", "score")})
    desk.edit("Gap", edits.put_tracks, (part,))
    window.commands.run("match.fill")
    hand.until(lambda: not desk.jobs.running, 240_000)
    (filled,) = desk.document.tracks
    assert desk.session.history.undo_name == "Fill gaps"
    assert np.array_equal(filled.frames, whole.frames)
    assert np.abs(filled.points - whole.points).max() < 0.3
    desk.set_workspace(plate_look=desk.workspace.plate_look.replace(speed=0.5))
    window.commands.run("match.slow_motion")
    hand.until(lambda: not desk.jobs.running, 240_000)
    film = desk.document.plates[0]
    first, second = (np.float32(window.match.screen.pixels(film, FIRST + k)) for k in (2, 3))
    assert window.match.slow.picture(film, FIRST + 2.0) is None
    made = np.float32(window.match.slow.picture(film, FIRST + 2.5))
    moved = cv2.warpAffine(first, np.float32([[1, 0, 0.5 * STEP[0]], [0, 1, 0.5 * STEP[1]]]), (WIDTH, HEIGHT))
    inner = np.s_[10:-10, 10:-10]
    assert np.abs(made - moved)[inner].mean() < 0.4 * np.abs(0.5 * (first + second) - moved)[inner].mean()
    eye, at = window.match.eye, np.array([60.0, 40.0])
    eye.look(plate_camera(at[0], -at[1], eye.size()[1] / 6.0))  # six pixels of the screen for one of the plate
    window.commands.run("match.hide")
    desk.set_workspace(frame=FIRST + 2.5)
    hand.view._pointer = None
    hand.view.redraw()
    hand.painted()
    shown = hand.view.grabFramebuffer().pixelColor(pixel(hand, at))
    assert np.abs(np.array([shown.red(), shown.green(), shown.blue()]) - made[40, 60]).max() <= 2


def test_the_dope_sheet_stands_over_the_timeline_takes_tracks_and_scrubs(opened: Opened, plate: Path) -> None:
    hand = opened_plate(opened, plate)
    window, desk = hand.window, hand.window.desk
    rows = np.column_stack((np.arange(FIRST, FIRST + COUNT), np.full((COUNT, 2), 50.0)))
    first, second = (keyed_track(n, f"t{n}", rows[n:], 1) for n in (1, 2))
    poor = second.covariance.copy()
    poor[4:] = 1.0, 0.0, 1.0
    desk.edit("Tracks", edits.put_tracks, (first, second.replace(covariance=freeze(poor))))
    assert list(tones_of(desk.document.tracks[1])) == [0] * 4 + [2] * 4
    window.commands.run("window.dope")
    hand.rest()
    sheet = window.dope_sheet
    assert sheet.isVisible()
    ruler = window.timeline.ruler
    for frame in (FIRST, FIRST + 6):  # what stands over each other is the same frame
        over = sheet.viewport().mapToGlobal(QPoint(round(sheet.x_of(frame)), 0)).x()
        assert abs(over - ruler.mapToGlobal(QPoint(round(ruler.x_of(frame)), 0)).x()) <= 1
    high = sheet._row(look_of())
    at = QPoint(round(sheet.x_of(FIRST + 6)), round(1.5 * high))
    QTest.mouseClick(sheet.viewport(), LEFT, NONE, at)
    assert (desk.document.track_selection, desk.workspace.frame) == ((2,), FIRST + 6)
    QTest.mouseClick(sheet.viewport(), LEFT, Qt.KeyboardModifier.ShiftModifier, QPoint(at.x(), round(0.5 * high)))
    assert desk.document.track_selection == (2, 1)
    QTest.mousePress(sheet.viewport(), LEFT, NONE, at)
    QTest.mouseMove(sheet.viewport(), QPoint(round(sheet.x_of(FIRST + 3)), at.y()))
    QTest.mouseRelease(sheet.viewport(), LEFT, NONE, QPoint(round(sheet.x_of(FIRST + 3)), at.y()))
    assert desk.workspace.frame == FIRST + 3
    assert "a key" in sheet._words(desk.document.tracks[0], at)
    picture = sheet.viewport().grab().toImage()
    ratio = picture.devicePixelRatio()
    for frame, tone in ((FIRST + 2, "cached"), (FIRST + 8, "trouble")):
        x = 0.5 * (sheet.x_of(frame) + sheet.x_of(frame + 1))
        shown = picture.pixelColor(round(x * ratio), round(1.5 * high * ratio))
        wanted = look_of().theme.colour(tone)
        assert max(abs(shown.red() - wanted.red()), abs(shown.green() - wanted.green())) < 40


def test_picking_holds_at_every_zoom(opened: Opened, plate: Path) -> None:
    hand = opened_plate(opened, plate)
    view, eye, desk = hand.view, hand.window.match.eye, hand.window.desk
    for notches, corner in ((0, (0.5, 0.5)), (8, (0.4, 0.6)), (12, (0.55, 0.35)), (-14, (0.5, 0.5))):
        width, height = view.pixels()
        pixel_there = (corner[0] * width, corner[1] * height)
        before = eye.under(*pixel_there)
        view.eye.wheel("dolly", notches, *pixel_there)
        assert np.allclose(eye.under(*pixel_there), before, atol=1e-6), "what is under the pointer stays there"
        place = np.array([120.0, 80.0]) + 3.0 * notches
        eye.look_at(place)
        hand.painted()
        click(hand, place)
        made = desk.document.tracks[-1]
        half_a_pixel = 0.5 * eye.camera.height / height * view.devicePixelRatio() + 1e-9
        assert np.abs(made.points[0] - place).max() <= 1.01 * half_a_pixel
        # the picture itself is where picking says: the colour under the click is that of the frame
        shown = hand.window.match.screen.pixels(desk.document.plates[0], eye.frame)
        assert shown is not None
        if notches > 0:
            hand.window.commands.run("match.hide")
            view._pointer = None
            view.redraw()
            hand.painted()
            image = view.grabFramebuffer()
            color = image.pixelColor(pixel(hand, np.round(place)))
            truth = shown[round(place[1]), round(place[0])]
            assert np.abs(np.array([color.red(), color.green(), color.blue()]) - truth).max() <= 2
    assert len(desk.document.tracks) == 4


def test_cancelled_tracking_leaves_all_as_it_was_and_a_plane_is_pinned(opened: Opened, plate: Path) -> None:
    hand = opened_plate(opened, plate)
    desk = hand.window.desk
    click(hand, START)
    before = desk.document
    hand.window.commands.run("match.forward")
    (job,) = [j for j in desk.jobs.running if j.name == "Track forward"]
    desk.jobs.cancel(job)
    hand.until(lambda: not desk.jobs.running, 240_000)
    assert desk.document is before
    assert hand.window.match.tracking.tails() == []
    desk.choose("track_plane")
    press, release = pixel(hand, np.array([60.0, 50.0])), pixel(hand, np.array([110.0, 100.0]))
    QTest.mousePress(hand.view, LEFT, NONE, press)
    QTest.mouseMove(hand.view, release)
    hand.painted()
    QTest.mouseRelease(hand.view, LEFT, NONE, release)
    hand.painted()
    (plane,) = desk.document.planes
    assert np.abs(plane.corners[[0, 2]] - [[60.0, 50.0], [110.0, 100.0]]).max() < 1.0
    hand.window.commands.run("match.planes")
    hand.until(lambda: not desk.jobs.running, 240_000)
    (plane,) = desk.document.planes
    assert list(plane.frames) == list(range(FIRST, FIRST + COUNT))
    pinned = carried_points(plane, FIRST + COUNT - 1, plane.corners)
    assert pinned is not None
    assert np.abs(pinned - plane.corners - STEP * (COUNT - 1)).max() < 0.2


def test_plates_are_listed_told_of_relinked_and_shown(opened: Opened, plate: Path, tmp_path: Path) -> None:
    hand = opened_plate(opened, plate)
    desk, panel = hand.window.desk, hand.window.findChild(PlatePanel)
    assert panel.isVisible()
    panel.mix.fields["channels"].enter("grey")
    panel.mix.fields["denoise"].enter(0.7)
    panel.form.fields["left"].enter(20)
    panel.form.fields["film_width"].enter(24.0)
    panel.form.fields["film_height"].enter(16.0)
    panel.form.fields["pixel_aspect"].enter(2.0)
    (first,) = desk.document.plates
    assert (first.mix.channels, first.mix.denoise, first.crop) == ("grey", 0.7, (20, 0, 0, 0))
    assert (tuple(first.film_back), first.pixel_aspect) == ((24.0, 16.0), 2.0)
    hand.until(lambda: len(panel.space.choices) > 1)
    panel.space.enter(panel.space.choices[-1])
    assert desk.document.plates[0].color_space == panel.space.choices[-1]
    panel.form.fields["left"].enter(5000)
    hand.until(lambda: panel.form.fields["left"].value() == 20)
    moved = tmp_path / "elsewhere"
    shutil.copytree(plate, moved)
    hand.window.match.doors.relink(first.id, moved)
    hand.until(lambda: "elsewhere" in desk.document.plates[0].path)
    assert desk.document.plates[0].crop == (20, 0, 0, 0)
    hand.window.opening.open(plate)
    hand.until(lambda: len(desk.document.plates) == 2)
    panel.form.fields["offset"].enter(7)
    assert (desk.document.first_frame, desk.document.last_frame) == (FIRST + 7, FIRST + COUNT + 6)
    assert panel.list.topLevelItemCount() == 2
    row = panel.list.visualItemRect(panel.list.topLevelItem(0)).center()
    QTest.mouseClick(panel.list.viewport(), LEFT, pos=row)
    hand.until(lambda: edits.shown_plate(desk.document).id == first.id)
    assert (desk.document.first_frame, desk.document.last_frame) == (FIRST, FIRST + COUNT - 1)
    hand.window.commands.run("match.next_plate")
    assert edits.shown_plate(desk.document).id != first.id
    QTest.mouseClick(panel.buttons["delete"], LEFT)
    assert [p.id for p in desk.document.plates] == [first.id]
    assert edits.shown_plate(desk.document).id == first.id


def test_a_click_in_the_list_is_a_step_and_shapes_are_deleted_one_by_one(opened: Opened, plate: Path) -> None:
    hand = opened_plate(opened, plate)
    desk, tracks = hand.window.desk, hand.window.findChild(TrackList)
    made = tuple(keyed_track(n, f"t{n}", np.array([[FIRST, 50.0 + 30 * n, 60.0]])) for n in (1, 2))
    desk.edit("Tracks", edits.add_tracks, made, desk.document.plates[0].id)
    before = desk.document
    row = tracks.list.visualItemRect(tracks.list.topLevelItem(0)).center()
    QTest.mouseClick(tracks.list.viewport(), LEFT, pos=row)
    assert len(desk.document.track_selection) == 1
    assert desk.session.history.undo_name == "Select tracks"
    chosen = desk.document.track_selection
    hand.window.commands.run("edit.undo")
    assert desk.document is before
    assert len(tracks.list.selectedItems()) == 2
    hand.window.commands.run("edit.redo")
    assert [item.data(0, Qt.ItemDataRole.UserRole) for item in tracks.list.selectedItems()] == list(chosen)
    desk.set_workspace(frame=float(FIRST + 2))
    hand.key(Qt.Key.Key_Left)
    hand.until(lambda: desk.workspace.frame == FIRST + 1)  # the keys still go to the plate
    here = desk.document.plates[0].id
    masks = tuple(
        Mask(id=n, name=f"m{n}", frames=freeze(np.array([FIRST], np.int32)), plate_id=here,
             points=freeze(np.array([[[9.0, 9.0], [40.0, 9.0], [9.0, 40.0]]]))) for n in (1, 2))
    desk.edit("Masks", lambda document: document.replace(masks=masks))
    shapes = tracks.shapes
    hand.until(shapes.isVisible)
    shapes.list.topLevelItem(1).setSelected(True)
    QTest.mouseClick(shapes.buttons["lock"], LEFT)
    assert [m.locked for m in desk.document.masks] == [False, True]
    QTest.mouseClick(shapes.buttons["lock"], LEFT)
    QTest.mouseClick(shapes.buttons["delete"], LEFT)
    assert [m.id for m in desk.document.masks] == [1]


def test_a_point_is_followed_by_a_drawn_pattern_beside_it(opened: Opened, plate: Path) -> None:
    hand = opened_plate(opened, plate)
    desk = hand.window.desk
    click(hand, START)
    desk.choose("track_pattern")
    angles = np.linspace(0.0, 2.0 * np.pi, 24)
    ring = START + np.array([30.0, 5.0]) + 11.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    QTest.mousePress(hand.view, LEFT, NONE, pixel(hand, ring[0]))
    for place in ring[1:]:
        QTest.mouseMove(hand.view, pixel(hand, place))
        hand.painted()
    QTest.mouseRelease(hand.view, LEFT, NONE, pixel(hand, ring[-1]))
    (track,) = desk.document.tracks
    assert track.offset == pytest.approx((30.0, 5.0), abs=2.0)
    hand.window.commands.run("match.forward")
    hand.until(lambda: not desk.jobs.running, 240_000)
    (track,) = desk.document.tracks
    assert len(track.frames) == COUNT
    assert np.abs(track.points - track.points[0] - np.arange(COUNT)[:, None] * STEP).max() < 0.2


def test_tracks_go_out_and_in_by_the_dialogs_and_a_click_on_their_span_goes_to_a_frame(
    opened: Opened, plate: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hand = opened_plate(opened, plate)
    desk, tracks = hand.window.desk, hand.window.findChild(TrackList)
    said: list[str] = []
    desk.failed.connect(lambda words, details: said.append(words))
    rows = np.column_stack([np.arange(FIRST, FIRST + COUNT), *np.linspace((50.0, 60.0), (90.0, 70.0), COUNT).T])
    desk.edit("Tracks", edits.add_tracks, (keyed_track(1, "eye", rows),), desk.document.plates[0].id)
    wanted: list[Path] = []
    monkeypatch.setattr(doors, "choose_file", lambda parent, title, kinds, done, save="": done(wanted[-1]))
    for suffix in (".json", ".nk", ".3de", ".2dt", ".uv", ".boujou", ".syntheyes"):
        wanted.append(tmp_path / f"tracks{suffix}")
        hand.window.commands.run("file.export_tracks")
        hand.until(lambda: wanted[-1].exists() and not desk.jobs.running)
        before = len(desk.document.tracks)
        hand.window.commands.run("file.import_tracks")
        hand.until(lambda before=before: len(desk.document.tracks) > before)
        found = desk.document.tracks[-1]
        assert found.frames.tolist() == rows[:, 0].tolist(), suffix
        assert np.abs(found.points - rows[:, 1:]).max() < 1e-2, suffix
        desk.session.undo()
    wanted.append(tmp_path / "tracks.odd")
    hand.window.commands.run("file.export_tracks")
    assert "tracks are written as" in said[-1]
    (tmp_path / "broken.nk").write_text("Tracker4 {")
    wanted.append(tmp_path / "broken.nk")
    hand.window.commands.run("file.import_tracks")
    hand.until(lambda: len(said) > 1)
    assert "broken.nk" in said[-1]
    hand.until(tracks.isVisible)
    tree = tracks.list
    tree.scrollToItem(tree.topLevelItem(0))
    middle = tree.visualItemRect(tree.topLevelItem(0)).center().y()
    left, wide = tree.columnViewportPosition(3), tree.columnWidth(3)
    QTest.mouseClick(tree.viewport(), LEFT, pos=QPoint(left + round(0.75 * wide), middle))
    assert desk.workspace.frame == FIRST + 7
    more = tuple(keyed_track(n, f"t{n}", rows) for n in range(2, 22))
    desk.edit("Tracks", edits.add_tracks, more, desk.document.plates[0].id)
    hand.until(tree.verticalScrollBar().isVisible)
    hand.until(lambda: tree.columnViewportPosition(3) + tree.columnWidth(3) == tree.viewport().width())
    QTest.mouseMove(hand.view, hand.at((0.5, 0.5)))
    top, last = tree.topLevelItem(0), tree.topLevelItem(tree.topLevelItemCount() - 1)
    area = tree.viewport().rect()
    assert area.contains(tree.visualItemRect(top))
    assert not area.intersects(tree.visualItemRect(last))
    desk.edit("Select tracks", edits.select_tracks, (last.data(0, Qt.ItemDataRole.UserRole),))
    assert area.intersects(tree.visualItemRect(last)), "the active track is brought into view"


def test_a_plate_is_shown_smaller_brighter_and_picked_as_well(opened: Opened, plate: Path) -> None:
    hand = opened_plate(opened, plate)
    window, desk = hand.window, hand.window.desk
    panel = window.findChild(PlatePanel)
    assert panel is not None
    hand.finish()
    one, frame = desk.document.plates[0], window.match.eye.frame
    full = window.match.screen.pixels(one, frame)
    assert full is not None
    assert full.shape == (HEIGHT, WIDTH, 3)
    choice = panel.look.fields["proxy"]
    choice.enter("half")
    hand.finish()
    half = window.match.screen.pixels(one, frame)
    assert half is not None
    assert half.shape == (HEIGHT // 2, WIDTH // 2, 3)
    window.commands.run("tool.track_point")
    click(hand, START)
    np.testing.assert_allclose(desk.document.tracks[-1].points[0], START, atol=0.8)  # within a pixel of the screen
    panel.look.fields["exposure"].enter(1.0)
    hand.finish()
    brighter = window.match.screen.pixels(one, frame)
    assert brighter is not None
    assert brighter.mean() > 1.2 * half.mean()
    choice.enter("full")
    panel.look.fields["exposure"].enter(0.0)
    hand.finish()
    again = window.match.screen.pixels(one, frame)
    assert again is not None
    np.testing.assert_array_equal(again, full)
    assert desk.workspace.plate_look.proxy == "full"


def test_a_look_is_no_step_takes_hold_while_frames_are_read_and_is_saved(
    opened: Opened, plate: Path, tmp_path: Path,
) -> None:
    hand = opened_plate(opened, plate)
    desk, panel, screen = hand.window.desk, hand.window.findChild(PlatePanel), hand.window.match.screen
    (film,) = desk.document.plates
    before = desk.document
    hand.rest()
    plain = screen.pixels(film, hand.window.match.eye.frame)
    assert plain is not None
    for stops in (0.5, 1.0, 1.5, 2.0):  # as a hand drags: every next one while the frame of the last is made
        panel.look.fields["exposure"].enter(stops)
        hand.painted()
    hand.until(lambda: screen.pixels(film, hand.window.match.eye.frame) is not None)
    hand.rest()
    bright = screen.pixels(film, hand.window.match.eye.frame)
    light = np.where(plain <= 10, plain / 255.0 / 12.92, ((plain / 255.0 + 0.055) / 1.055) ** 2.4) * 4.0
    truth = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    assert bright is not None
    assert np.abs(bright - 255.0 * np.clip(truth, 0.0, 1.0)).max() <= 1.0
    assert desk.document is before, "a look is no step of undo"
    panel.look.fields["proxy"].enter("quarter")
    assert desk.workspace.plate_look.words() == "exposure +2.0 stops · quarter proxy"
    click(hand, START)
    hand.window.commands.run("match.forward")
    hand.until(lambda: not desk.jobs.running, 240_000)
    (track,) = desk.document.tracks
    truth = track.points[0] + STEP * np.arange(COUNT)[:, None]
    assert np.abs(track.points - truth).max() < 0.1, "tracking sees every pixel"
    project = tmp_path / "looked.filo"
    desk.session.save(project)
    panel.look.fields["exposure"].enter(0.0)
    hand.window.opening.open(project)
    hand.until(lambda: desk.session.path == project)
    hand.rest()
    assert (desk.workspace.plate_look.exposure, desk.workspace.plate_look.proxy) == (2.0, "quarter")
    assert (panel.look.fields["exposure"].value(), panel.look.fields["proxy"].value()) == (2.0, "quarter")
