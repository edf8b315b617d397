"""Every attribute of the feather: found by group or by a word, each with its bar, its unit and what it does."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QLabel, QLineEdit, QVBoxLayout, QWidget

from app.window.fields.bars_together import BarsTogether
from app.window.fields.choice_bar import ChoiceBar
from app.window.fields.number_bar import NumberBar
from app.window.fields.value_field import ValueField
from app.window.params_panel import Setting
from app.window.sections import Row
from app.window.theme import look_of
from core.feather.attributes import ATTRIBUTES, COLUMNS, GROUPS, SHAPE_NAMES, Attribute
from core.field import Field
from core.value import Value, constant

CHANGED = "changed here"
LABEL = 15  # heights of the text
MOST_FOUND = 40  # rows for a word; a longer list is not read
_GROUP = Field("Group", "Which of the attributes are listed below: those of one group, or those changed here.")


def field_of(known: Attribute) -> Field:
    """An attribute as panels show it: ``vaneWidthLeft`` is Vane width left."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", known.name).lower()
    tooltip = f"{known.description} In expressions and files it is called {known.name}."
    return Field(words.capitalize(), tooltip, known.unit, (known.low, known.high), (known.low, known.high))


def found(word: str, group: str, changed: Sequence[str]) -> list[str]:
    """Names of the attributes that a word is in, of all groups; without a word those of a group."""
    words = word.lower().split()
    if words:
        said = {known.name: f"{known.name} {field_of(known).label} {known.group} {known.description}".lower()
                for known in ATTRIBUTES}
        return [name for name, text in said.items() if all(part in text for part in words)]
    if group == CHANGED:
        return [known.name for known in ATTRIBUTES if known.name in changed]
    return [known.name for known in ATTRIBUTES if known.group == group]


class _Row(Row):
    """A row with room for the long names of attributes."""

    def _measure(self) -> None:
        look = look_of()
        self.label.setFixedSize(LABEL * look.text, look.row)


class AttributeList(QWidget):
    """Rows of bars; those that shape the feather may be keyed and follow expressions.

    edited : (name, Value, final), like the bars.
    """

    edited = Signal(str, object, bool)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.word = QLineEdit()
        self.word.setPlaceholderText(f"Find among {len(ATTRIBUTES)} attributes")
        self.word.setClearButtonEnabled(True)
        self.word.setAccessibleName("Find an attribute")
        self.group = ChoiceBar(_GROUP, GROUPS[0], None, (*GROUPS, CHANGED))
        self.more = QLabel()
        self.more.setWordWrap(True)
        self.more.setEnabled(False)
        self.bars: dict[str, NumberBar | ValueField] = {}
        self._rows = QWidget()
        self._values = self._usual = np.zeros(0, np.float32)
        self._given: dict[str, Value] = {}
        self._setting = Setting()
        column = self._column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        for widget in (self.word, Row(_GROUP.label, self.group), self._rows, self.more):
            column.addWidget(widget)
        self.word.textChanged.connect(lambda text: self._list())
        self.group.edited.connect(lambda value, final: self._list())

    def show_values(
        self, values: NDArray[np.float32], usual: NDArray[np.float32], given: dict[str, Value], setting: Setting
    ) -> None:
        """Show attributes (K,), what they usually are for this feather, and those given on this coat."""
        self._values, self._usual, self._given, self._setting = values, usual, given, setting
        wanted = self._wanted()
        if wanted != list(self.bars):
            self._list()
            return
        for name, bar in self.bars.items():
            if isinstance(bar, ValueField):
                bar.set_frame(setting.frame)
                bar.set_maps(setting.maps)
                shown = self._value(name)
                if bar.value() != shown:
                    bar.set_value(shown)
            else:
                bar.set_value(self._number(name))

    @property
    def editing(self) -> bool:
        """True while a hand is at one of the bars."""
        return any(bar.editing for bar in self.bars.values())

    def _wanted(self) -> list[str]:
        return found(self.word.text(), self.group.value(), tuple(self._given))[:MOST_FOUND]

    def _number(self, name: str) -> float:
        return float(self._values[COLUMNS[name]])

    def _value(self, name: str) -> Value:
        return self._given.get(name) or constant(self._number(name))

    def _list(self) -> None:
        """Build the rows that are wanted now."""
        if not len(self._values):
            return
        self._column.removeWidget(self._rows)
        self._rows.hide()
        self._rows.deleteLater()
        self._rows, self.bars = QWidget(), {}
        column = QVBoxLayout(self._rows)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        together = BarsTogether(self._rows)
        names = self._wanted()
        for name in names:
            known, usual = field_of(ATTRIBUTES[COLUMNS[name]]), float(self._usual[COLUMNS[name]])
            bar: NumberBar | ValueField
            if name in SHAPE_NAMES:
                bar = ValueField(known, self._value(name), constant(usual), self._setting.unit, self._setting.names,
                                 self._setting.maps, self._setting.frame)
            else:
                bar = NumberBar(known, self._number(name), usual, self._setting.unit)
            bar.setObjectName(name)
            bar.edited.connect(lambda given, final, name=name: self.edited.emit(
                name, given if isinstance(given, Value) else constant(given), final))
            row = _Row(known.label, bar)
            row.label.setToolTip(f"<p style='white-space:normal'>{known.tooltip}</p>")
            together.add(bar.bar if isinstance(bar, ValueField) else bar, row.label)
            column.addWidget(row)
            self.bars[name] = bar
        self._column.insertWidget(2, self._rows)
        self.more.setText(self._left_out(len(names)))
        self.more.setVisible(bool(self.more.text()))

    def _left_out(self, shown: int) -> str:
        word = self.word.text().strip()
        every = len(found(word, self.group.value(), tuple(self._given)))
        if every > shown:
            return f"{every - shown} more; choose a group or type another word."
        if every:
            return ""
        return f"No attribute has to do with {word!r}." if word else "Every attribute is that of the bird so far."
