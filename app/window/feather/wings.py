"""The wings of a coat: which wing, which row, which feather, and the numbers of each, to be set and keyed."""

from __future__ import annotations

from typing import Any

from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.fields.choice_bar import ChoiceBar
from app.window.params_panel import RecordForm, Setting
from app.window.sections import Row
from core.document import Document
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.wing import WING_NAMES, Wing, WingOffset, WingRow
from core.field import Field
from core.record import Record

_WING = Field("Wing", "Which wing is shown below, or the tail.")
_ROW = Field("Row", "Which row of feathers is shown below: quills, coverts, or those of the tail.")
_FEATHER = Field("Feather", "One feather of the row, 1 the innermost, to be moved by hand; all sets the whole row.")
NONE = "No wings: *Feathers of the wings* in the menu gives a rig with joints called humerus, forearm and hand its own."


class WingList(QWidget):
    """The wings of one coat; a drag is a preview, its end one step of the document."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.coat: FeatherCoat | None = None
        self.words = QLabel(NONE.replace("*", ""))
        self.words.setWordWrap(True)
        self.words.setEnabled(False)
        self.wing, self.row = ChoiceBar(_WING, 0, None, (0,)), ChoiceBar(_ROW, 0, None, (0,))
        self.feather = ChoiceBar(_FEATHER, 0, None, (0,))
        self.rows = {bar: Row(bar.known.label, bar) for bar in (self.wing, self.row, self.feather)}
        self.forms: dict[str, RecordForm] = {}
        self._about: dict[str, tuple[Any, ...]] = {}
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        column.addWidget(self.words)
        self.boxes: dict[str, QVBoxLayout] = {}
        for bar, name in ((self.wing, "wing"), (self.row, "row"), (self.feather, "feather")):
            column.addWidget(self.rows[bar])
            box = QVBoxLayout()
            box.setContentsMargins(0, 0, 0, 0)
            column.addLayout(box)
            self.boxes[name] = box
            bar.edited.connect(lambda value, final: self.show_coat(self.coat))

    def show_coat(self, coat: FeatherCoat | None) -> None:
        """Show the wings of a coat, or none."""
        self.coat = coat
        there = coat is not None and bool(coat.wings)
        self.words.setVisible(not there)
        self.setEnabled(coat is None or not coat.locked)
        for row in self.rows.values():
            row.setVisible(there)
        if coat is None or not there:
            for name in tuple(self.forms):
                self._clear(name)
            return
        _offer(self.wing, [wing.id for wing in coat.wings], [wing.name for wing in coat.wings])
        wing = self._wing(coat)
        _offer(self.row, [row.id for row in wing.rows], [row.name for row in wing.rows])
        row = self._row(wing)
        numbers = list(range(row.count + 1))
        _offer(self.feather, numbers, ["all", *(str(number) for number in numbers[1:])])
        setting = Setting(self.desk.document.unit, self.desk.workspace.frame, WING_NAMES)
        self._show("wing", (coat.id, wing.id), wing, setting)
        number = self.feather.value()
        if number:
            from tools.wing_edits import offset_of

            self._clear("row")
            self._show("feather", (coat.id, wing.id, row.id, number), offset_of(row, number), setting)
        else:
            self._clear("feather")
            self._show("row", (coat.id, wing.id, row.id), row, setting)

    def _wing(self, coat: FeatherCoat) -> Wing:
        return next(wing for wing in coat.wings if wing.id == self.wing.value())

    def _row(self, wing: Wing) -> WingRow:
        return next(row for row in wing.rows if row.id == self.row.value())

    def _show(self, name: str, about: tuple[Any, ...], record: Record, setting: Setting) -> None:
        form = self.forms.get(name)
        if form is not None and self._about[name] == about:
            form.set_record(record)
            form.set_setting(setting)
            return
        self._clear(name)
        form = RecordForm(record, setting)
        form.changed.connect(self._edited)
        self.boxes[name].addWidget(form)
        self.forms[name], self._about[name] = form, about

    def _clear(self, name: str) -> None:
        form = self.forms.pop(name, None)
        if form is not None:
            self._about.pop(name)
            form.hide()
            form.deleteLater()

    def _edited(self, record: Record, final: bool) -> None:
        """Take what the hand made of a wing, a row or a feather."""
        coat = self.coat
        if coat is None:
            return
        session, wing_id, row_id = self.desk.session, self.wing.value(), self.row.value()
        if not final:
            self.desk.attempt(lambda: session.preview(with_record(session.document, coat.id, wing_id, row_id, record)))
            return
        what = {Wing: "Wing", WingRow: "Row of the wing", WingOffset: "Feather of the wing"}[type(record)]
        self.desk.edit(what, with_record, coat.id, wing_id, row_id, record)
        coats = {one.id: one for one in self.desk.document.feathers}
        self.show_coat(coats.get(coat.id))  # what was refused goes back to what it was


def with_record(document: Document, coat_id: int, wing_id: int, row_id: int, record: Record) -> Document:
    """The document with a wing, a row or what is added to a feather in place of the one there was."""
    from tools.wing_edits import set_row, set_wing, set_wing_feather

    changes = {name: getattr(record, name) for name in record.__struct_fields__}
    if isinstance(record, Wing):
        return set_wing(document, coat_id, wing_id, **changes)
    if isinstance(record, WingOffset):
        return set_wing_feather(document, coat_id, wing_id, row_id, **changes)
    return set_row(document, coat_id, wing_id, row_id, **changes)


def _offer(bar: ChoiceBar, values: list[int], names: list[str]) -> None:
    bar.set_choices(values, names)
    if bar.value() not in values:
        bar.set_value(values[0])
