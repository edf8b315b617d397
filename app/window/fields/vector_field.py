"""Three numbers side by side: a direction or a place."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QSizePolicy, QWidget

from app.window.fields.number_bar import NumberBar
from core.field import Field

Vector = tuple[float, float, float]
AXES = "XYZ"


class VectorField(QWidget):
    """A bar for each axis; a drag along one changes that number alone.

    edited : (value, final), like the bars.
    """

    edited = Signal(object, bool)

    def __init__(
        self, known: Field, value: Vector, default: Vector | None = None, unit: str = "m",
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.known, self.default, self._value = known, default, value
        self.bars = tuple(
            NumberBar(known._replace(label=f"{known.label} {axis}"), value[k], None if default is None else default[k],
                      unit)
            for k, axis in enumerate(AXES))
        line = QHBoxLayout(self)
        line.setContentsMargins(0, 0, 0, 0)
        line.setSpacing(3)
        for bar in self.bars:
            line.addWidget(bar)
            bar.edited.connect(lambda _, final: self._edited(final))
        self.setFocusProxy(self.bars[0])
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    @property
    def editing(self) -> bool:
        """True while a hand is at one of them."""
        return any(bar.editing for bar in self.bars)

    def value(self) -> Vector:
        """The value shown."""
        return self._value

    def set_value(self, value: Vector) -> None:
        """Show a value from outside; while a hand is editing the hand's value stays."""
        if not self.editing:
            self._value = value
            for bar, number in zip(self.bars, value, strict=True):
                bar.set_value(number)

    def set_unit(self, unit: str) -> None:
        """Show lengths in another unit."""
        for bar in self.bars:
            bar.set_unit(unit)

    def _edited(self, final: bool) -> None:
        x, y, z = (float(bar.value()) for bar in self.bars)
        self._value = (x, y, z)
        self.edited.emit(self._value, final)
