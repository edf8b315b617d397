"""A field for a value an artist may animate: a number, a keyed curve or an expression, and a map that multiplies it."""

from __future__ import annotations

from collections.abc import Collection
from contextlib import suppress
from typing import Any

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QHBoxLayout, QMenu, QSizePolicy, QVBoxLayout, QWidget

from app.window.fields.choice_bar import ChoiceBar
from app.window.fields.math_edit import MathEdit
from app.window.fields.number_bar import NumberBar
from app.window.fields.number_text import held
from app.window.icons import IconButton, icon, paint_icon
from app.window.theme import code_font, look_of
from app.window.timeline.curve_editor import CurveEditor
from core import expression
from core.curve import Curve
from core.curve_edit import key_at, with_key, without_keys
from core.errors import UserError
from core.expression import ExpressionError
from core.field import Field
from core.value import Constant, Formula, Value, evaluate

_NONE = "(no map)"


class KeyButton(IconButton):
    """The diamond beside an animated number: hollow without a key on this frame, filled with one."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("key", "Set a key on this frame, or take the one that is there away.", parent)
        self.animated = self.keyed = False

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        shown = 1.0 if self.animated or self.underMouse() or self.hasFocus() else 0.35
        colour = look.theme.colour("accent" if self.animated else "dim", shown)
        side = float(look.text + 2)
        place = QRectF((self.width() - side) / 2, (self.height() - side) / 2, side, side)
        paint_icon(painter, "key-set" if self.keyed else "key", place, colour)


class ValueField(QWidget):
    """A bar while it is a number, a bar with keys while it is a curve, a line while it is an expression.

    edited : (Value, final), like the bars.

    Parameters
    ----------
    names : an expression may read beside the maps. frame : shown. unit : of lengths.
    """

    edited = Signal(object, bool)

    def __init__(
        self, known: Field, value: Value, default: Value | None = None, unit: str = "m",
        names: Collection[str] = ("frame",), maps: Collection[str] = (), frame: float = 0.0,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.known, self.default = known, default
        self._value, self._frame = value, frame
        self._before: Value | None = None
        self._names, self._maps = tuple(names), tuple(maps)
        plain = default.base.number if default is not None and isinstance(default.base, Constant) else None
        self.bar = NumberBar(known, self._number(), plain, unit)
        self.bar.animatable = True
        self.bar.edited.connect(self._number_edited)
        self.bar.key_asked.connect(self.toggle_key)
        self.bar.expression_asked.connect(self.start_expression)
        self.line = MathEdit("", f"{known.label} expression", self)
        self.line.entered.connect(self._expression_entered)
        self.line.left.connect(self._expression_left)
        self.line.given_up.connect(self._show)
        self.key = KeyButton()
        self.key.clicked.connect(self.toggle_key)
        self.more = IconButton("more", "Expression, curve, map and reset of this value.")
        self.more.clicked.connect(self._pop_up)
        self.map = ChoiceBar(
            Field(f"Map of {known.label}", "The map that multiplies the value, for every hair where it grows."), _NONE)
        self.map.edited.connect(lambda name, _: self.set_map(None if name == _NONE else name))
        self.curve: CurveEditor | None = None
        top = QHBoxLayout()
        top.setSpacing(0)
        for widget, stretch in ((self.bar, 1), (self.line, 1), (self.key, 0), (self.more, 0)):
            top.addWidget(widget, stretch)
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(0, 0, 0, 0)
        self._column.setSpacing(4)
        self._column.addLayout(top)
        self._column.addWidget(self.map)
        self.setFocusProxy(self.bar)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._show()

    @property
    def editing(self) -> bool:
        """True while a hand is at it."""
        return self.bar.editing or (self.curve is not None and self.curve.editing)

    def value(self) -> Value:
        """The value shown."""
        return self._value

    def set_value(self, value: Value) -> None:
        """Show a value from outside; while a hand is editing the hand's value stays."""
        if value is not self._value and not self.editing:
            self._value = value
            self._show()

    def set_frame(self, frame: float) -> None:
        """Show another frame."""
        if frame != self._frame:
            self._frame = frame
            if not isinstance(self._value.base, Constant):
                self._show()

    def set_unit(self, unit: str) -> None:
        """Show lengths in another unit."""
        self.bar.set_unit(unit)

    def set_maps(self, maps: Collection[str]) -> None:
        """Offer the maps of a groom."""
        if tuple(maps) != self._maps:
            self._maps = tuple(maps)
            self._show()

    def toggle_key(self) -> None:
        """Set a key on this frame, or take the one there away; the last one leaves a number behind."""
        base = self._value.base
        if isinstance(base, Curve):
            at = key_at(base, self._frame)
            if at is None:
                self._commit(base=with_key(base, self._frame))
            else:
                left = without_keys(base, {at})
                self._commit(base=Constant(number=base.keys[at].value) if left is None else left)
        else:
            self._commit(base=with_key(None, self._frame, self._number()))

    def start_expression(self) -> None:
        """Open the line for an expression, which begins with what the value is now."""
        if not isinstance(self._value.base, Formula):
            self.bar.hide()
            self.line.setText(f"{self._number():g}")
            self.line.show()
        self.line.setFont(code_font(look_of()))
        self.line.setFocus(Qt.FocusReason.OtherFocusReason)
        self.line.selectAll()

    def set_map(self, name: str | None) -> None:
        """Multiply by a map, or by none."""
        self._commit(map=name)

    def show_curve(self, shown: bool) -> None:
        """Open the editor of the curve below the bar, or close it."""
        base = self._value.base
        if shown and isinstance(base, Curve) and self.curve is None:
            self.curve = CurveEditor(base, self.bar.scale, self._frame)
            self.curve.edited_one.connect(self._curve_edited)
            self._column.addWidget(self.curve)
        elif not shown and self.curve is not None:
            self._column.removeWidget(self.curve)
            self.curve.deleteLater()
            self.curve = None

    def menu(self) -> QMenu:
        """What can be done with the value."""
        menu, base = QMenu(self), self._value.base
        if not isinstance(base, Formula):
            menu.addAction(icon("expression"), "Expression…").triggered.connect(self.start_expression)
        if isinstance(base, Curve):
            text = "Hide curve" if self.curve is not None else "Show curve"
            menu.addAction(icon("curve"), text).triggered.connect(lambda: self.show_curve(self.curve is None))
        if not isinstance(base, Constant):
            menu.addAction("Make it a plain number").triggered.connect(
                lambda: self._commit(base=Constant(number=self._number())))
        maps = menu.addMenu(icon("map"), "Multiply by map")
        maps.setEnabled(bool(self._maps))
        for name in (None, *self._maps):
            action = maps.addAction(name or _NONE)
            action.setCheckable(True)
            action.setChecked(name == self._value.map)
            action.triggered.connect(lambda _=False, chosen=name: self.set_map(chosen))
        menu.addSeparator()
        reset = menu.addAction(icon("reset"), "Reset")
        reset.setEnabled(self.default is not None)
        reset.triggered.connect(self._reset)
        return menu

    def _pop_up(self) -> None:
        menu = self.menu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(self.more.mapToGlobal(self.more.rect().bottomLeft()))

    def _reset(self) -> None:
        if self.default is not None:
            self._commit(base=self.default.base, map=self.default.map)

    def _number(self) -> float:
        """The number at this frame, without the map; 0 where an expression needs a hair to be evaluated."""
        return _number_at(self._value, self._frame, (*self._names, *self._maps))

    def _number_edited(self, number: float, final: bool) -> None:
        before = self._value if self._before is None else self._before
        if number == _number_at(before, self._frame, ()):
            self._value = before  # the hand came back: the very value there was
        else:
            base = before.base
            made = with_key(base, self._frame, number) if isinstance(base, Curve) else Constant(number=number)
            self._value = before.replace(base=made)
        self._before = None if final else before
        if final:
            self._show()
        self.edited.emit(self._value, final)

    def _curve_edited(self, curve: Curve, final: bool) -> None:
        before = self._value if self._before is None else self._before
        self._value = before if curve is before.base else before.replace(base=curve)
        self._before = None if final else before
        if final:
            self._show()
        self.edited.emit(self._value, final)

    def _expression_entered(self, text: str) -> None:
        try:
            expression.parse(text, {*self._names, *self._maps})
        except ExpressionError as error:
            self.line.refuse(error)
            return
        self._keep(text)
        (self.line if isinstance(self._value.base, Formula) else self.bar).setFocus(Qt.FocusReason.OtherFocusReason)

    def _expression_left(self, text: str) -> None:
        """Clicking elsewhere takes what can be read; what cannot, and a line nobody wrote in, is given up."""
        if not self.line.isModified():
            self._show()
            return
        try:
            expression.parse(text, {*self._names, *self._maps})
        except ExpressionError:
            self._show()
        else:
            self._keep(text)

    def _keep(self, text: str) -> None:
        """Take an expression that can be read; a number alone is a number."""
        if isinstance(self._value.base, Formula) and text.strip() == self._value.base.source:
            self._show()
            return
        if expression.names_used(text):
            self._commit(base=Formula(source=text.strip()))
            return
        number = held(float(expression.evaluate(text, {})), self.known)
        if isinstance(self._value.base, Constant) and number == self._value.base.number:
            self._show()
        else:
            self._commit(base=Constant(number=number))

    def _commit(self, **changes: Any) -> None:
        if all(getattr(self._value, name) is new for name, new in changes.items()):
            return
        self._value = self._value.replace(**changes)
        self._show()
        self.edited.emit(self._value, True)

    def _show(self) -> None:
        value = self._value
        base = value.base
        formula = isinstance(base, Formula)
        if isinstance(base, Formula):
            self.line.setFont(code_font(look_of()))
            self.line.setText(base.source)
            self.line.setCursorPosition(0)
            self.line.setToolTip(self.bar.teaching())
        else:
            self.bar.set_value(self._number())
        self.line.setVisible(formula)
        self.bar.setVisible(not formula)
        self.setFocusProxy(self.line if formula else self.bar)
        self.key.setVisible(not formula)
        self.key.animated = isinstance(base, Curve)
        self.key.keyed = isinstance(base, Curve) and key_at(base, self._frame) is not None
        self.key.update()
        if not isinstance(base, Curve):
            self.show_curve(False)
        elif self.curve is not None:
            self.curve.set_curve(base)
            self.curve.set_frame(self._frame)
        self.map.setVisible(value.map is not None)
        self.map.set_choices((_NONE, *self._maps), (_NONE, *(f"× {name}" for name in self._maps)))
        self.map.set_value(_NONE if value.map is None else value.map)


def _number_at(value: Value, frame: float, names: Collection[str]) -> float:
    known = dict.fromkeys(names, 0.0)
    with suppress(UserError):
        return float(evaluate(value.replace(map=None), frame, known))
    return 0.0
