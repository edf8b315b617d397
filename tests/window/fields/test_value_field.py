"""Values an artist may animate: number, keys, expression, map; and the editor of their curves."""

import pytest
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu, QWidget
from pytestqt.qtbot import QtBot

from app.window.fields.value_field import ValueField
from app.window.timeline.curve_editor import CurveEditor
from core.curve import Curve, Key, curve_at
from core.field import Field
from core.value import Constant, Value, constant, formula

CLUMP = Field("Clump", "How far hairs close up towards their guide.", "", (0.0, 1.0), (0.0, 1.0))
LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier


def curve(*keys: tuple[float, float]) -> Curve:
    return Curve(keys=tuple(Key(frame=f, value=v) for f, v in keys))


def mouse(widget: QWidget, kind: str, at: QPointF, held: Qt.KeyboardModifier = NONE) -> None:
    types = {"press": QEvent.Type.MouseButtonPress, "move": QEvent.Type.MouseMove,
             "release": QEvent.Type.MouseButtonRelease, "double": QEvent.Type.MouseButtonDblClick}
    button = Qt.MouseButton.NoButton if kind == "move" else LEFT
    buttons = Qt.MouseButton.NoButton if kind == "release" else LEFT
    place = QPointF(widget.mapToGlobal(at))
    QApplication.sendEvent(widget, QMouseEvent(types[kind], at, place, button, buttons, held))


class Told:
    def __init__(self, widget: ValueField | CurveEditor) -> None:
        self.all: list[tuple[object, bool]] = []
        edited = widget.edited_one if isinstance(widget, CurveEditor) else widget.edited
        edited.connect(lambda value, final: self.all.append((value, final)))

    @property
    def finals(self) -> list[object]:
        return [value for value, final in self.all if final]


def shown(qtbot: QtBot, value: Value, frame: float = 1001.0) -> tuple[ValueField, Told]:
    widget = ValueField(CLUMP, value, constant(0.0), "m", ("frame", "id"), ("stripe", "ears"), frame)
    qtbot.addWidget(widget)
    widget.resize(300, 30)
    with qtbot.waitActive(widget):
        widget.show()
        widget.activateWindow()
    return widget, Told(widget)


def test_a_constant_is_dragged_and_keeps_its_map(qtbot: QtBot) -> None:
    widget, told = shown(qtbot, constant(0.2, "stripe"))
    bar = widget.bar
    mouse(bar, "press", QPointF(20, 10))
    mouse(bar, "move", QPointF(20 + (bar.width() - 2) * 0.5, 10))
    mouse(bar, "release", QPointF(20 + (bar.width() - 2) * 0.5, 10))
    value = widget.value()
    assert isinstance(value.base, Constant)
    assert value.base.number == pytest.approx(0.7)
    assert value.map == "stripe"
    assert [final for _, final in told.all] == [False, True]


def test_escape_gives_the_very_value(qtbot: QtBot) -> None:
    start = constant(0.2)
    widget, told = shown(qtbot, start)
    mouse(widget.bar, "press", QPointF(20, 10))
    mouse(widget.bar, "move", QPointF(90, 10))
    assert widget.value() is not start
    QTest.keyClick(widget.bar, Qt.Key.Key_Escape)
    assert widget.value() is start
    assert told.all[-1] == (start, True)


def test_the_diamond_sets_and_takes_keys(qtbot: QtBot) -> None:
    widget, told = shown(qtbot, constant(0.25), 1001.0)
    QTest.mouseClick(widget.key, LEFT)
    base = widget.value().base
    assert isinstance(base, Curve)
    assert [(k.frame, k.value) for k in base.keys] == [(1001.0, 0.25)]
    assert widget.key.keyed
    widget.set_frame(1011.0)
    assert (widget.key.animated, widget.key.keyed) == (True, False)
    QTest.keyClick(widget.bar, Qt.Key.Key_Right)  # a change of an animated number sets a key
    base = widget.value().base
    assert isinstance(base, Curve)
    assert [(k.frame, k.value) for k in base.keys] == [(1001.0, 0.25), (1011.0, pytest.approx(0.26))]
    QTest.mouseClick(widget.key, LEFT)
    widget.set_frame(1001.0)
    QTest.mouseClick(widget.key, LEFT)
    assert isinstance(widget.value().base, Constant)  # no key left: a number again
    assert widget.value().base.number == 0.25
    assert len(told.finals) == 4


def test_the_bar_follows_the_frame_of_a_curve(qtbot: QtBot) -> None:
    base = curve((1001, 0.0), (1011, 1.0))
    widget, _ = shown(qtbot, Value(base=base), 1001.0)
    for frame in (1001.0, 1004.0, 1011.0):
        widget.set_frame(frame)
        assert widget.bar.value() == float(curve_at(base, frame))


def test_an_expression_is_typed_and_its_faults_are_told_at_their_column(qtbot: QtBot) -> None:
    widget, told = shown(qtbot, constant(0.5))
    widget.bar.expression_asked.emit()
    assert widget.line.isVisible()
    assert not widget.bar.isVisible()
    QTest.keyClicks(widget.line, "rand(id) * stripes")
    QTest.keyClick(widget.line, Qt.Key.Key_Return)
    assert "did you mean 'stripe'" in widget.line.fault
    assert widget.line.cursorPosition() == 11
    assert told.all == []
    QTest.keyClick(widget.line, Qt.Key.Key_End)
    QTest.keyClick(widget.line, Qt.Key.Key_Backspace)
    assert widget.line.fault == ""
    QTest.keyClick(widget.line, Qt.Key.Key_Return)
    assert widget.value().base.source == "rand(id) * stripe"  # type: ignore[union-attr]
    assert len(told.finals) == 1
    QTest.keyClicks(widget.line, " + 1")
    QTest.keyClick(widget.line, Qt.Key.Key_Escape)
    assert widget.line.text() == "rand(id) * stripe"
    assert len(told.finals) == 1


def test_a_number_typed_as_an_expression_is_a_number_within_its_range(qtbot: QtBot) -> None:
    widget, told = shown(qtbot, formula("frame / 10"))
    widget.line.setFocus()
    widget.line.selectAll()
    QTest.keyClicks(widget.line, "2 * 3")
    QTest.keyClick(widget.line, Qt.Key.Key_Return)
    assert isinstance(widget.value().base, Constant)
    assert widget.value().base.number == 1.0
    assert widget.bar.isVisible()
    assert not widget.line.isVisible()
    assert len(told.finals) == 1


def test_an_expression_given_up_before_it_was_one_leaves_the_number(qtbot: QtBot) -> None:
    start = constant(0.5)
    widget, told = shown(qtbot, start)
    widget.start_expression()
    QTest.keyClicks(widget.line, "frame *")
    widget.bar.setFocus()
    QTest.keyClick(widget.line, Qt.Key.Key_Escape)
    assert widget.value() is start
    assert widget.bar.isVisible()
    assert told.all == []


def test_maps_are_chosen_from_the_menu_and_a_missing_one_is_seen(qtbot: QtBot) -> None:
    widget, _ = shown(qtbot, constant(0.5))
    assert not widget.map.isVisible()
    menu = widget.menu()
    (maps,) = (each for each in menu.findChildren(QMenu) if each.title() == "Multiply by map")
    next(action for action in maps.actions() if action.text() == "ears").trigger()
    assert widget.value().map == "ears"
    assert widget.map.isVisible()
    assert widget.map.words() == "× ears"
    widget.set_maps(("stripe",))
    assert widget.map.words() == "ears"
    widget.map.enter("(no map)")
    assert widget.value().map is None
    assert not widget.map.isVisible()


def test_reset_brings_the_default_back(qtbot: QtBot) -> None:
    widget, told = shown(qtbot, formula("rand(id)", "stripe"))
    menu = widget.menu()
    next(action for action in menu.actions() if action.text() == "Reset").trigger()
    assert isinstance(widget.value().base, Constant)
    assert (widget.value().base.number, widget.value().map) == (0.0, None)
    assert len(told.finals) == 1


def editor(qtbot: QtBot, base: Curve) -> tuple[CurveEditor, Told]:
    widget = CurveEditor(base)
    qtbot.addWidget(widget)
    widget.resize(400, 200)
    with qtbot.waitActive(widget):
        widget.show()
        widget.activateWindow()
    widget.setFocus()
    widget.show_keys()
    return widget, Told(widget)


def test_a_key_is_dragged_in_time_and_value(qtbot: QtBot) -> None:
    widget, told = editor(qtbot, curve((0, 0.0), (10, 1.0), (20, 0.5)))
    start = widget.place_of(10, 1.0)
    mouse(widget, "press", start)
    mouse(widget, "move", widget.place_of(12.3, 0.8), Qt.KeyboardModifier.ControlModifier)
    mouse(widget, "release", widget.place_of(12.3, 0.8))
    keys = widget.curve().keys
    assert keys[1].frame == pytest.approx(12.0)
    assert keys[1].value == pytest.approx(0.8)
    assert (keys[0].value, keys[2].value) == (0.0, 0.5)
    assert [final for _, final in told.all] == [False, True]


def test_keys_may_pass_each_other_and_stay_selected(qtbot: QtBot) -> None:
    widget, _ = editor(qtbot, curve((0, 0.0), (10, 1.0), (20, 0.5)))
    mouse(widget, "press", widget.place_of(0, 0.0))
    mouse(widget, "move", widget.place_of(10, 0.0))  # onto another one: refused, the drag goes on
    mouse(widget, "move", widget.place_of(15, 0.0))
    mouse(widget, "release", widget.place_of(15, 0.0))
    assert [round(k.frame, 6) for k in widget.curve().keys] == [10.0, 15.0, 20.0]
    assert widget.selected == {1}


def test_escape_during_a_drag_gives_the_very_curve(qtbot: QtBot) -> None:
    base = curve((0, 0.0), (10, 1.0))
    widget, told = editor(qtbot, base)
    mouse(widget, "press", widget.place_of(10, 1.0))
    mouse(widget, "move", widget.place_of(12, 0.8))
    QTest.keyClick(widget, Qt.Key.Key_Escape)
    assert widget.curve() is base
    assert told.all[-1] == (base, True)


def test_a_handle_frees_its_tangents_and_the_curve_follows_it(qtbot: QtBot) -> None:
    widget, _ = editor(qtbot, curve((0, 0.0), (10, 0.5), (20, 1.0)))
    mouse(widget, "press", widget.place_of(10, 0.5))
    mouse(widget, "release", widget.place_of(10, 0.5))
    before = float(curve_at(widget.curve(), 12.0))
    at = widget.handle_place(1, "leave")
    mouse(widget, "press", at)
    mouse(widget, "move", at + QPointF(0.0, -30.0))
    mouse(widget, "release", at + QPointF(0.0, -30.0))
    key = widget.curve().keys[1]
    assert (key.arrive, key.leave) == ("aligned", "aligned")
    slope_in = key.arrive_handle[1] / key.arrive_handle[0]
    assert key.leave_handle[1] / key.leave_handle[0] == pytest.approx(slope_in)
    assert float(curve_at(widget.curve(), 12.0)) > before
    assert float(curve_at(widget.curve(), 10.0)) == pytest.approx(0.5)


def test_double_click_sets_a_key_delete_takes_it_and_one_stays(qtbot: QtBot) -> None:
    widget, told = editor(qtbot, curve((0, 0.0), (10, 1.0)))
    at = widget.place_of(5.2, 0.9)
    mouse(widget, "double", at)
    assert [k.frame for k in widget.curve().keys] == [0.0, 5.0, 10.0]
    assert widget.curve().keys[1].value == pytest.approx(0.9)
    QTest.keyClick(widget, Qt.Key.Key_Delete)
    assert [k.frame for k in widget.curve().keys] == [0.0, 10.0]
    widget.pick({"": frozenset({0, 1})})
    QTest.keyClick(widget, Qt.Key.Key_Delete)
    assert len(widget.curve().keys) == 2
    assert len(told.finals) == 2


def test_f_shows_what_is_selected(qtbot: QtBot) -> None:
    widget, _ = editor(qtbot, curve((0, 0.0), (10, 1.0), (1000, 0.5)))
    widget.pick({"": frozenset({0, 1})})
    QTest.keyClick(widget, Qt.Key.Key_F)
    assert 0 < widget.place_of(0, 0.0).x() < widget.place_of(10, 1.0).x() < widget.width()
    assert widget.place_of(1000, 0.5).x() > widget.width()
    QTest.keyClick(widget, Qt.Key.Key_Home)
    assert widget.place_of(1000, 0.5).x() < widget.width()


def test_places_and_values_are_one_map_and_its_inverse(qtbot: QtBot) -> None:
    widget, _ = editor(qtbot, curve((0, 0.0), (10, 1.0), (20, 0.5)))
    frame, value = widget.at(widget.place_of(7.25, 0.31))
    assert (frame, value) == (pytest.approx(7.25), pytest.approx(0.31))
