"""How far a sculpt reaches: a bar for each control it reads, or one for each axis of a joint."""

from __future__ import annotations

import math

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from app.window.fields.choice_bar import SwitchBar
from app.window.fields.number_bar import NumberBar
from app.window.sections import Row
from core.field import Field
from core.pose.pose_space import FALLOFFS, Dof, Falloff, PoseSample

AXES = {"swing": ("swing", "across"), "swing-twist": ("swing", "across", "twist"),
        "translation": ("X", "Y", "Z")}
AXIS_WORDS = {"swing": "as the joint swings along its own side axis", "across": "as the joint swings across that",
              "twist": "as the joint turns about itself", "X": "along X", "Y": "along Y", "Z": "along Z"}
_EACH = Field("Each axis", "One reach for every axis of the joint instead of one for all: a sculpt may be felt far "
              "along a bend and vanish soon with a twist.")


class Reach(QWidget):
    """Falloffs of one sculpt along one control.

    edited : the falloffs, one or one for each axis, when a hand is done with them.
    """

    edited = Signal(tuple)

    def __init__(self, sample: PoseSample, dof: Dof, unit: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        own = sample.falloffs.get(dof.control, dof.falloff)
        names = AXES.get(dof.kind, ()) if len(own) > 1 else ()
        usual = dof.falloff if len(dof.falloff) == len(own) else (dof.falloff[0],) * len(own)
        self.bars = tuple(NumberBar(_field(dof, name), reach, default, unit)
                          for name, reach, default in zip(names or ("",), own, usual, strict=True))
        self.each: SwitchBar | None = None
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        for name, bar in zip(names or ("",), self.bars, strict=True):
            bar.edited.connect(lambda value, final: final and self.edited.emit(self.value()))
            column.addWidget(Row(f"Reach {dof.control}" if not name else f"{dof.control} {name}", bar))
        count = FALLOFFS[dof.kind]
        if count > 1:
            self.each = SwitchBar(_EACH, len(own) > 1, False)
            self.each.edited.connect(lambda on, final: final and self.edited.emit(
                (self.value()[0],) * (count if on else 1)))
            column.addWidget(Row(_EACH.label, self.each))

    def value(self) -> Falloff:
        """The falloffs that the bars show."""
        return tuple(float(bar.value()) for bar in self.bars)


def _field(dof: Dof, axis: str) -> Field:
    words = f"How far this sculpt is felt along {dof.control}"
    words += f", {AXIS_WORDS[axis]}" if axis else ""
    words += ": at this distance from its pose it has faded by e."
    if dof.kind == "number":
        return Field("Reach", words, soft=(0.05, max(4.0 * dof.falloff[0], 1.0)), hard=(1e-6, 1e6))
    if dof.kind == "translation":
        return Field("Reach", words, "m", (0.001, 1.0), (1e-6, 1e6))
    return Field("Reach", words, "rad", (math.radians(5), math.pi), (1e-6, 4.0 * math.pi))
