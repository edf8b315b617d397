"""The curve panel by mouse and keys: everything a hand does to keys is one step that undo takes back."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from app.window.hotkeys import Hotkeys
from app.window.timeline.curve_panel import CurvePanel
from app.window.timeline.curve_view import CurveView
from app.window.window_commands import AT_FIRST_HIDDEN, PANELS, shown_panels, written_panels
from core.curve import Curve, Key
from core.document import with_groom
from core.value import Constant
from tests.documents import animated_document
from tests.window.hand import CTRL, LEFT, NONE, SHIFT
from tests.window.host import Host
from tools.keyed import set_bases

CLUMP, FRIZZ, WIDTH = (f"grooms/1/coat/{name}" for name in ("clump", "frizz", "width_root"))


def keys(*places: tuple[float, float]) -> Curve:
    return Curve(keys=tuple(Key(frame=frame, value=value) for frame, value in places))


@pytest.fixture
def panel(host: Host, qtbot: QtBot) -> CurvePanel:
    """A panel in a window, with two curves: clump and width (metres)."""
    document = animated_document()
    coat = document.grooms[0].coat
    document = with_groom(document, document.grooms[0].replace(coat=coat.replace(frizz=coat.length_variation)))
    host.desk.session.commit("Keys", set_bases(document, {
        CLUMP: keys((1001, 0.0), (1011, 1.0), (1021, 0.5)), WIDTH: keys((1001, 1e-4), (1021, 2e-4))}))
    panel = CurvePanel(host.desk, host.commands, Hotkeys(host, host.commands, host.keymap))
    host.setCentralWidget(panel)
    host.activateWindow()
    qtbot.waitUntil(host.isActiveWindow)
    panel.view.setFocus()
    qtbot.waitUntil(panel.view.hasFocus)
    return panel


def key_place(view: CurveView, name: str, place: int) -> QPoint:
    key = view.curves()[name].keys[place]
    return view.place_of(key.frame, key.value, name).toPoint()


def drag(view: CurveView, start: QPoint, end: QPoint, held: Qt.KeyboardModifier = NONE) -> None:
    QTest.mousePress(view, LEFT, held, start)
    for part in (0.5, 1.0):  # QTest moves without modifiers
        at = QPointF(start + (end - start) * part)
        QApplication.sendEvent(view, QMouseEvent(
            QEvent.Type.MouseMove, at, QPointF(view.mapToGlobal(at)), Qt.MouseButton.NoButton, LEFT, held))
    QTest.mouseRelease(view, LEFT, held, end)


def frames(host: Host, address: str) -> list[float]:
    return [round(key.frame, 3) for one in host.desk.keys.all if one.address == address for key in one.curve.keys]


def test_values_are_listed_by_owner_and_the_chosen_ones_are_shown(host: Host, panel: CurvePanel) -> None:
    top = panel.list.topLevelItem(0)
    assert (top.text(0), [top.child(i).text(0) for i in range(top.childCount())]) == (
        "coat", ["Width at the root", "Clump"])
    assert set(panel.view.curves()) == {CLUMP, WIDTH}
    place = panel.list.visualItemRect(top.child(1)).center()
    QTest.mouseClick(panel.list.viewport(), LEFT, pos=place)
    assert set(panel.view.curves()) == {CLUMP}
    QTest.mouseClick(panel.list.viewport(), LEFT, pos=panel.list.visualItemRect(top).center())
    assert set(panel.view.curves()) == {CLUMP, WIDTH}
    assert host.desk.session.history.undo_name == "Keys"


def test_a_key_is_dragged_onto_whole_frames(host: Host, panel: CurvePanel) -> None:
    before, view = host.desk.document, panel.view
    start = key_place(view, CLUMP, 1)
    drag(view, start, view.place_of(1014.3, 0.8, CLUMP).toPoint())
    assert frames(host, CLUMP) == [1001.0, 1014.0, 1021.0]
    assert host.desk.document.grooms[0].coat.clump.base.keys[1].value == pytest.approx(0.8, abs=0.02)
    assert host.desk.session.history.undo_name == "Move keys"
    assert panel.frame.text() == "1014"
    host.commands.run("edit.undo")
    assert host.desk.document is before
    drag(view, key_place(view, CLUMP, 1), view.place_of(1014.3, 1.0, CLUMP).toPoint(), CTRL)
    assert frames(host, CLUMP)[1] == pytest.approx(1014.3, abs=0.1)
    assert frames(host, CLUMP)[1] != 1014.0


def test_what_is_in_the_box_is_selected_and_scaled_by_its_sides(host: Host, panel: CurvePanel) -> None:
    view = panel.view
    drag(view, view.place_of(999.5, 1.2, CLUMP).toPoint(), view.place_of(1012, -0.1, CLUMP).toPoint())
    assert host.desk.keys.selected == {CLUMP: {0, 1}, WIDTH: {0}}
    drag(view, view.place_of(1020, 1.0, CLUMP).toPoint(), view.place_of(1022.5, 0.3, CLUMP).toPoint(), SHIFT)
    assert host.desk.keys.count == 4
    drag(view, view.place_of(999.5, 1.2, CLUMP).toPoint(), view.place_of(1012, -0.1, CLUMP).toPoint())
    box = view.box()
    wide = view.place_of(1011, 0, CLUMP).x() - view.place_of(1001, 0, CLUMP).x()
    right = QPointF(box.right(), box.center().y())
    drag(view, right.toPoint(), (right - QPointF(wide * 0.4, 0.0)).toPoint())
    assert frames(host, CLUMP) == [1001.0, 1007.0, 1021.0]
    assert frames(host, WIDTH) == [1001.0, 1021.0]
    assert host.desk.session.history.undo_name == "Scale keys"


def test_handles_are_turned_and_escape_gives_up(host: Host, panel: CurvePanel) -> None:
    view, before = panel.view, host.desk.document
    QTest.mouseClick(view, LEFT, pos=key_place(view, CLUMP, 1))
    end = view.handle_place(1, "leave", CLUMP).toPoint()
    QTest.mousePress(view, LEFT, pos=end)
    QTest.mouseMove(view, end + QPoint(0, 40))
    assert host.desk.document is not before  # seen in the view at once
    QTest.keyClick(view, Qt.Key.Key_Escape)
    QTest.mouseRelease(view, LEFT, pos=end + QPoint(0, 40))
    assert host.desk.document is before
    drag(view, end, end + QPoint(0, 40))
    key = host.desk.document.grooms[0].coat.clump.base.keys[1]
    assert (key.arrive, key.leave) == ("aligned", "aligned")
    assert host.desk.session.history.undo_name == "Turn handle"


def test_keys_are_typed(host: Host, panel: CurvePanel) -> None:
    QTest.mouseClick(panel.view, LEFT, pos=key_place(panel.view, WIDTH, 1))
    assert (panel.frame.text(), panel.value.text(), panel.unit.text()) == ("1021", "0.2", "mm")
    for field, text in ((panel.frame, "1031.5"), (panel.value, "0.25")):
        field.selectAll()
        QTest.keyClicks(field, text)
        QTest.keyClick(field, Qt.Key.Key_Return)
    key = host.desk.document.grooms[0].coat.width_root.base.keys[1]
    assert (key.frame, key.value) == (1031.5, pytest.approx(2.5e-4))
    assert host.desk.session.history.undo_name == "Set keys"


def test_hotkeys_work_on_keys_where_the_curves_are(host: Host, panel: CurvePanel) -> None:
    view = panel.view
    QTest.keyClick(view, Qt.Key.Key_A)
    assert host.desk.keys.count == 5
    QTest.keyClick(view, Qt.Key.Key_2)
    assert {key.leave for one in host.desk.keys.all for key in one.curve.keys} == {"linear"}
    QTest.keyClick(view, Qt.Key.Key_C, CTRL)
    host.desk.set_workspace(frame=1051.0)
    QTest.keyClick(view, Qt.Key.Key_V, CTRL)
    assert frames(host, CLUMP) == [1001.0, 1011.0, 1021.0, 1051.0, 1061.0, 1071.0]
    assert frames(host, WIDTH) == [1001.0, 1021.0, 1051.0, 1071.0]
    assert host.desk.keys.count == 5
    QTest.keyClick(view, Qt.Key.Key_Delete)
    assert frames(host, CLUMP) == [1001.0, 1011.0, 1021.0]
    QTest.keyClick(view, Qt.Key.Key_Down)
    assert host.desk.workspace.frame == 1021.0
    host.desk.set_workspace(frame=1006.0)
    QTest.keyClick(view, Qt.Key.Key_I)
    assert frames(host, WIDTH) == [1001.0, 1006.0, 1021.0]
    QTest.keyClick(view, Qt.Key.Key_A)
    QTest.keyClick(view, Qt.Key.Key_X)
    assert host.desk.keys.all == ()
    left = host.desk.document.grooms[0].coat.clump.base
    assert isinstance(left, Constant)
    assert left.number == 0.0  # of the first key
    assert not panel.split.isVisible()


def test_the_numbers_below_scrub_and_the_line_follows_the_time(host: Host, panel: CurvePanel) -> None:
    view = panel.view
    below = QPoint(view.place_of(1016, 0.0).toPoint().x(), view.height() - 6)
    QTest.mousePress(view, LEFT, pos=below)
    assert host.desk.workspace.frame == 1016.0
    QTest.mouseRelease(view, LEFT, pos=below)
    before = view.grab().toImage()
    host.desk.set_workspace(frame=1003.0)
    assert view.grab().toImage() != before


def test_every_curve_fills_the_height_when_asked(host: Host, panel: CurvePanel) -> None:
    def tall(name: str) -> float:
        one = panel.view.curves()[name].keys
        heights = [panel.view.place_of(key.frame, key.value, name).y() for key in one]
        return max(heights) - min(heights)

    assert tall(WIDTH) < 0.2 * tall(CLUMP)
    QTest.mouseClick(panel.buttons["curves.normalize"], LEFT)
    assert tall(WIDTH) == pytest.approx(tall(CLUMP), rel=0.01)


def test_a_panel_that_is_new_since_a_workspace_was_saved_is_shown() -> None:
    assert shown_panels(()) == tuple(name for name in PANELS if name not in AT_FIRST_HIDDEN)
    old = written_panels({"scene", "curves"})
    assert shown_panels(old) == ("scene", "curves")
    assert "maps" in shown_panels([name for name in old if "maps" not in name])
    assert shown_panels(written_panels(())) == ()
