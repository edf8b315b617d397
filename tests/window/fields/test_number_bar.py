"""The number field, driven by real mouse and key events."""

import math

import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QGuiApplication, QMouseEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from app.window.fields.choice_bar import ChoiceBar, SwitchBar, TextField
from app.window.fields.color_field import ColorField, decoded, encoded
from app.window.fields.field_widget import FieldWidget
from app.window.fields.number_bar import NumberBar
from app.window.fields.number_text import editable, read, scale_of, shown
from core.expression import ExpressionError
from core.field import Field

PLAIN = Field("Strength", "How much one pass of the brush does, 0 to 1.", "", (0.0, 1.0), (0.0, 2.0))
ANGLE = Field("Lift", "How far hair stands off the skin, in degrees.", "rad", (0.0, math.pi / 2), (-math.pi, math.pi))
LENGTH = Field("Length", "How long new hair is when it is planted.", "m", (0.0, 0.1), (0.0, 10.0))
COUNT = Field("Hairs", "How many hairs are grown over all of the skin.", "", (0, 1000), (0, 100_000))
NONE, SHIFT, CTRL = (Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier,
                     Qt.KeyboardModifier.ControlModifier)
LEFT = Qt.MouseButton.LeftButton
WIDTH = 202  # the bar inside its frame is 200 pixels


class Bench:
    """A window with one field, and what it said."""

    def __init__(self, qtbot: QtBot, widget: FieldWidget) -> None:
        self.qtbot, self.widget = qtbot, widget
        self.window = QWidget()
        column = QVBoxLayout(self.window)
        column.addWidget(widget)
        column.addStretch(1)
        widget.setFixedSize(WIDTH, 24)
        self.window.resize(300, 160)
        self.said: list[tuple[object, bool]] = []
        widget.edited.connect(lambda value, final: self.said.append((value, final)))
        qtbot.addWidget(self.window)
        with qtbot.waitActive(self.window):
            self.window.show()
            self.window.activateWindow()
        widget.setFocus()

    def drag(self, *xs: int, held: Qt.KeyboardModifier = NONE, release: bool = True) -> None:
        QTest.mousePress(self.widget, LEFT, held, QPoint(xs[0], 12))
        for x in xs[1:]:
            _move(self.widget, x, held)
        if release:
            QTest.mouseRelease(self.widget, LEFT, held, QPoint(xs[-1], 12))

    def type(self, text: str, enter: bool = True) -> None:
        for key in text:  # the first one opens the line that the others go to
            QTest.keyClicks(QApplication.focusWidget(), key)
        if enter:
            QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Return)

    @property
    def finals(self) -> list[object]:
        return [value for value, final in self.said if final]


def _move(widget: QWidget, x: int, held: Qt.KeyboardModifier) -> None:
    """A mouse move with keys held, which QTest cannot send."""
    place = QPointF(x, 12.0)
    event = QMouseEvent(QEvent.Type.MouseMove, place, QPointF(widget.mapToGlobal(place)), LEFT, LEFT, held)
    QApplication.sendEvent(widget, event)


def number(qtbot: QtBot, known: Field = PLAIN, value: float = 0.5, **more: object) -> tuple[Bench, NumberBar]:
    bar = NumberBar(known, value, **more)  # type: ignore[arg-type]
    return Bench(qtbot, bar), bar


def test_a_drag_is_previews_and_one_final_value(qtbot: QtBot) -> None:
    bench, bar = number(qtbot)
    bench.drag(50, 60, 70, 90)
    assert bar.value() == pytest.approx(0.5 + 40 / 200)
    assert [final for _, final in bench.said] == [False, False, False, True]
    assert bench.finals == [bar.value()]


def test_a_shaking_click_is_no_edit(qtbot: QtBot) -> None:
    bench, bar = number(qtbot)
    bench.drag(50, 52, 51)
    assert bench.said == []
    assert bar.value() == 0.5


def test_shift_is_ten_times_finer_and_ctrl_steps(qtbot: QtBot) -> None:
    bench, bar = number(qtbot)
    bench.drag(50, 90, held=SHIFT)
    assert bar.value() == pytest.approx(0.5 + 0.02)
    bench.drag(50, 94, held=CTRL)  # 0.52 + 0.22 = 0.74
    assert bar.value() == pytest.approx(0.7)


def test_a_drag_ends_at_the_soft_range_and_typing_at_the_hard_one(qtbot: QtBot) -> None:
    bench, bar = number(qtbot)
    bench.drag(50, 1000)
    assert bar.value() == 1.0
    bench.type("7")
    assert bar.value() == 2.0
    bench.drag(50, 60)  # beyond its soft range it may only come back
    assert bar.value() == 2.0


def test_escape_during_a_drag_puts_the_very_value_back(qtbot: QtBot) -> None:
    start = float("0.5")
    bench, bar = number(qtbot, value=start)
    bench.drag(50, 120, release=False)
    assert bar.editing
    QTest.keyClick(bar, Qt.Key.Key_Escape)
    assert bar.value() is start
    assert bench.said[-1] == (start, True)
    _move(bar, 150, NONE)
    QTest.mouseRelease(bar, LEFT, NONE, QPoint(150, 12))
    assert bench.said[-1] == (start, True)
    assert len(bench.said) == 2


def test_a_drag_that_ends_where_it_began_gives_the_very_value(qtbot: QtBot) -> None:
    start = float("0.5")
    bench, bar = number(qtbot, value=start)
    bench.drag(50, 120, 50)
    assert bar.value() is start
    assert len(bench.finals) == 1


def test_values_from_outside_do_not_take_it_out_of_the_hand(qtbot: QtBot) -> None:
    bench, bar = number(qtbot)
    bench.drag(50, 90, release=False)
    bar.set_value(0.1)
    assert bar.value() == pytest.approx(0.7)
    QTest.mouseRelease(bar, LEFT, NONE, QPoint(90, 12))
    bar.set_value(0.1)
    assert bar.value() == 0.1


@pytest.mark.parametrize(("typed", "known", "unit", "stored"), [
    ("2*3+1", LENGTH, "cm", 0.07),
    ("1.5cm", LENGTH, "m", 0.015),
    ("1.5 cm", LENGTH, "in", 0.015),
    ("12 in", LENGTH, "mm", 12 * 0.0254),
    ("2 * 3mm + 1", LENGTH, "cm", 0.016),
    ("1 ft + 1 in", LENGTH, "m", 13 * 0.0254),
    ("30 deg", ANGLE, "m", math.pi / 6),
    ("30", ANGLE, "m", math.pi / 6),
    ("-45°", ANGLE, "m", -math.pi / 4),
    ("pi/4 * 1rad", ANGLE, "m", math.pi / 4),
    (".25", PLAIN, "m", 0.25),
    ("(1+2)/4", PLAIN, "m", 0.75),
    ("min(0.3, 2)", PLAIN, "m", 0.3),
])
def test_typed_mathematics_with_units(qtbot: QtBot, typed: str, known: Field, unit: str, stored: float) -> None:
    bench, bar = number(qtbot, known, 0.04, unit=unit)
    QTest.mouseDClick(bar, LEFT, NONE, QPoint(50, 12))
    bench.type(typed)
    assert bar.value() == pytest.approx(stored, rel=1e-12)
    assert bench.said == [(bar.value(), True)]
    assert bar.line is None


@pytest.mark.parametrize(("typed", "words", "column"), [
    ("2 +", "expected a number", 4),
    ("3 kg", "'kg' is no unit of a length", 3),
    ("1cm + foo", "no value named 'foo'", 7),
    ("1 cm +* 2", "expected a number", 7),
    ("__import__", "has no meaning here", 1),
])
def test_a_fault_is_shown_in_words_where_it_is(qtbot: QtBot, typed: str, words: str, column: int) -> None:
    bench, bar = number(qtbot, LENGTH, 0.04, unit="cm")
    QTest.keyClick(bar, Qt.Key.Key_Return)
    bench.type(typed)
    assert bar.line is not None
    assert words.lower() in bar.line.fault.lower()
    assert bar.line.cursorPosition() == column - 1
    assert bench.said == []
    QTest.keyClick(bar.line, Qt.Key.Key_Escape)
    assert bar.line is None
    assert bar.value() == 0.04


def test_typing_a_digit_starts_with_it_and_leaving_takes_what_can_be_understood(qtbot: QtBot) -> None:
    bench, bar = number(qtbot)
    QTest.keyClicks(bar, "0")
    assert bar.line is not None
    bench.type(".9", enter=False)
    bar.line.clearFocus()
    assert (bar.value(), bar.line) == (0.9, None)
    bar.setFocus()
    QTest.keyClicks(bar, "(")
    assert bar.line is not None
    bar.line.clearFocus()
    assert (bar.value(), bar.line) == (0.9, None)
    assert bench.said == [(0.9, True)]


def test_enter_without_a_change_is_no_edit(qtbot: QtBot) -> None:
    third = 1.0 / 3.0
    bench, bar = number(qtbot, value=third)
    QTest.keyClick(bar, Qt.Key.Key_Return)
    QTest.keyClick(bar.line, Qt.Key.Key_Return)
    assert bar.value() is third
    assert bench.said == []


def test_arrow_keys_step_and_the_release_is_final(qtbot: QtBot) -> None:
    bench, bar = number(qtbot)
    QTest.keyPress(bar, Qt.Key.Key_Right)
    QTest.keyPress(bar, Qt.Key.Key_Right)
    assert bench.finals == []
    QTest.keyRelease(bar, Qt.Key.Key_Right)
    assert bar.value() == pytest.approx(0.52)
    assert bench.finals == [bar.value()]
    QTest.keyClick(bar, Qt.Key.Key_Down, CTRL)
    assert bar.value() == pytest.approx(0.42)


def test_the_wheel_steps_only_with_the_focus_and_is_final_at_rest(qtbot: QtBot) -> None:
    bench, bar = number(qtbot)

    def turn() -> bool:
        event = QWheelEvent(QPointF(50, 12), QPointF(bar.mapToGlobal(QPoint(50, 12))), QPoint(), QPoint(0, 120),
                            Qt.MouseButton.NoButton, NONE, Qt.ScrollPhase.NoScrollPhase, False)
        QApplication.sendEvent(bar, event)
        return event.isAccepted()

    assert turn()
    assert turn()
    assert bar.value() == pytest.approx(0.52)
    assert bench.finals == []
    qtbot.waitUntil(lambda: len(bench.finals) == 1)
    bar.clearFocus()
    turn()
    assert bar.value() == pytest.approx(0.52)


def test_whole_numbers_stay_whole(qtbot: QtBot) -> None:
    bench, bar = number(qtbot, COUNT, 500, whole=True)
    bench.drag(50, 57)
    assert bar.value() == 535
    assert isinstance(bar.value(), int)
    bench.type("100,000")
    assert bar.value() == 100_000
    assert bar.words() == "100,000"
    QTest.keyClick(bar, Qt.Key.Key_Left)
    assert bar.value() == 99_990


def test_the_menu_resets_copies_and_pastes(qtbot: QtBot) -> None:
    bench, bar = number(qtbot, LENGTH, 0.04, default=0.025, unit="cm")
    menu = bar.menu()
    actions = {action.text(): action for action in menu.actions()}
    actions["Copy"].trigger()
    assert QGuiApplication.clipboard().text() == "4 cm"
    actions["Reset to 2.5 cm"].trigger()
    assert bar.value() == 0.025
    QGuiApplication.clipboard().setText("1 in")
    QTest.keySequence(bar, "Ctrl+V")
    assert bar.value() == pytest.approx(0.0254)
    QGuiApplication.clipboard().setText("a sentence")
    QTest.keySequence(bar, "Ctrl+V")
    assert bar.value() == pytest.approx(0.0254)
    assert "Key here" not in actions
    bar.animatable = True
    menu = bar.menu()
    assert "Key here" in [action.text() for action in menu.actions()]
    assert [final for _, final in bench.said] == [True, True]


def test_it_says_its_name_value_and_what_it_does(qtbot: QtBot) -> None:
    _, bar = number(qtbot, ANGLE, math.pi / 6)
    assert bar.accessibleName() == "Lift"
    assert bar.accessibleDescription() == "30.0°"
    assert "stands off the skin" in bar.toolTip()
    limited = NumberBar(PLAIN, 0.5, 0.6)
    qtbot.addWidget(limited)
    assert "Usually 0.60. From 0.00 to 2.00." in limited.toolTip()
    assert bar.focusPolicy() & Qt.FocusPolicy.TabFocus


def test_tab_goes_on(qtbot: QtBot) -> None:
    bench, bar = number(qtbot)
    other = NumberBar(ANGLE, 0.0)
    bench.window.layout().addWidget(other)
    other.show()
    QTest.keyClicks(bar, "1")
    QTest.keyClick(bar.line, Qt.Key.Key_Tab)
    qtbot.waitUntil(lambda: QApplication.focusWidget() is other)
    assert bar.value() == 1.0


@pytest.mark.parametrize("unit", ["m", "cm", "mm", "in", "ft"])
@pytest.mark.parametrize("known", [LENGTH, Field("Width", "How thick one hair is, at its root.", "m", (0.0, 5e-4))])
@pytest.mark.parametrize("stored", [0.0, 8e-5, 0.0123456, 1.5])
def test_what_is_shown_for_editing_is_read_back(unit: str, known: Field, stored: float) -> None:
    scale = scale_of(known, unit)
    assert read(editable(stored, scale), known, scale) == pytest.approx(stored, rel=1e-8)
    assert read(shown(stored, scale), known, scale) == pytest.approx(stored, rel=0.03)


def test_digits_that_mean_something() -> None:
    width = Field("Width", "How thick one hair is, at its root.", "m", (0.0, 5e-4))
    assert shown(8e-5, scale_of(width, "m")) == "0.080 mm"
    assert shown(0.0015, scale_of(LENGTH, "cm")) == "0.15 cm"
    assert shown(0.6, scale_of(PLAIN)) == "0.60"
    assert shown(1e-4, scale_of(PLAIN)) == "0.0001"
    assert shown(-1e-12, scale_of(PLAIN)) == "-1e-12"
    assert shown(-0.0, scale_of(PLAIN)) == "0.00"
    assert shown(70.0, scale_of(Field("Size", "How far it reaches.", "px", (8, 300)))) == "70 px"


def test_units_are_refused_where_they_mean_nothing() -> None:
    with pytest.raises(ExpressionError, match="plain number"):
        read("3 cm", PLAIN, scale_of(PLAIN))
    assert read("1 if 2 > 1 else 3", PLAIN, scale_of(PLAIN)) == 1.0


def test_switch(qtbot: QtBot) -> None:
    switch = SwitchBar(Field("Hairspray", "Sprayed hair holds its shape under every tool."), True, True)
    bench = Bench(qtbot, switch)
    QTest.mouseClick(switch, LEFT, NONE, QPoint(20, 12))
    QTest.keyClick(switch, Qt.Key.Key_Space)
    assert bench.said == [(False, True), (True, True)]
    assert switch.accessibleDescription() == "on"


def test_choices_side_by_side_or_in_a_menu(qtbot: QtBot) -> None:
    bar = ChoiceBar(Field("Kind", "What kind of thing it is.", choices=("one", "two", "three")), "one", "one")
    bench = Bench(qtbot, bar)
    assert bar.segmented
    QTest.mouseClick(bar, LEFT, NONE, QPoint(WIDTH - 10, 12))
    QTest.keyClick(bar, Qt.Key.Key_Left)
    assert bench.said == [("three", True), ("two", True)]
    bar.set_choices(tuple(f"a long name {i}" for i in range(9)))
    assert not bar.segmented
    menu = bar.pop_up()
    menu.actions()[4].trigger()
    menu.close()
    assert bar.value() == "a long name 4"


def test_text(qtbot: QtBot) -> None:
    line = TextField(Field("Name", "What it is called in lists."), "cat")
    bench = Bench(qtbot, line)
    line.line.selectAll()
    QTest.keyClicks(line.line, "dog")
    QTest.keyClick(line.line, Qt.Key.Key_Return)
    assert bench.said == [("dog", True)]
    QTest.keyClicks(line.line, "gy")
    QTest.keyClick(line.line, Qt.Key.Key_Escape)
    assert line.line.text() == "dog"


def test_colours_are_stored_linear_and_shown_as_the_screen_does(qtbot: QtBot) -> None:
    grey = (0.21404114, 0.21404114, 0.21404114)  # sRGB 0.5
    colour = ColorField(Field("Colour", "Colour of the hair at its root."), grey, (0.1, 0.1, 0.1))
    bench = Bench(qtbot, colour)
    assert colour.words() == "#808080"
    assert all(decoded(encoded(v)) == pytest.approx(v, abs=1e-12) for v in (0.0, 0.001, 0.0031308, 0.2, 1.0))
    QTest.mouseClick(colour, LEFT, NONE, QPoint(20, 12))
    dialog = colour.dialog
    assert dialog is not None
    assert not dialog.isModal()
    dialog.setCurrentColor(QColor("#ff0000"))
    assert colour.value() == pytest.approx((1.0, 0.0, 0.0))
    dialog.reject()
    assert colour.value() is grey
    assert [final for _, final in bench.said] == [False, True]
    QGuiApplication.clipboard().setText("#00ff00")
    colour.setFocus()
    QTest.keySequence(colour, "Ctrl+V")
    assert colour.value() == pytest.approx((0.0, 1.0, 0.0))
