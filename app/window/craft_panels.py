"""The panels of what is at hand: the active tool, what all tools respect, the coat of the active groom."""

from __future__ import annotations

from typing import Any

from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.params_panel import RecordForm, Setting
from app.window.sections import FoldMemory, Section
from core.document import Document, feathers_of, find_feathers, find_groom, with_feathers, with_groom
from core.feather.coat.coat import NAMES as FEATHER_NAMES
from core.feather.coat.coat import FeatherCoat
from core.field import fields_of
from core.groom.groom import NAMES, Coat
from core.record import Record
from core.workspace import Respect, Workspace
from tools.map_edits import ROLES

OF_GUIDES = ("hairspray", "selection")  # of what is respected: other crafts have no guides


class _Panel(Section):
    """A section around one form that follows the desk; it is silent while a stroke goes on."""

    def __init__(self, title: str, desk: Desk, memory: FoldMemory | None, name: str) -> None:
        self.box = QWidget()
        column = QVBoxLayout(self.box)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        super().__init__(title, self.box, memory, name)
        self.desk = desk
        self.form: RecordForm | None = None
        self._about: Any = None
        self._unit = "document"
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)
        desk.workspace_changed.connect(self._workspace_changed)

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if not self.desk.session.stroking:
            self.refresh()

    @property
    def unit(self) -> str:
        """Of the lengths shown."""
        return self.desk.document.unit if self._unit == "document" else self._unit

    def set_unit(self, unit: str) -> None:
        """Show lengths in a unit, or with "document" in that of the document."""
        self._unit = unit
        self.refresh()

    def refresh(self) -> None:
        """Show what is on the desk now."""
        raise NotImplementedError

    def show_record(self, about: Any, record: Record, setting: Setting) -> None:
        """Show a record; `about` tells whether it is of another thing, so that the form is built anew."""
        if self.form is None or about != self._about or type(self.form.record()) is not type(record):
            self.clear()
            self.form = RecordForm(record, setting)
            self.form.changed.connect(self.edited)
            self._layout().addWidget(self.form)
            self._about = about
        else:
            self.form.set_record(record)
            self.form.set_setting(setting)

    def show_words(self, text: str) -> None:
        """Show a sentence in place of the fields."""
        self.clear()
        words = QLabel(text)
        words.setWordWrap(True)
        words.setEnabled(False)
        self._layout().addWidget(words)

    def clear(self) -> None:
        """Take everything away."""
        self.form, self._about = None, None
        while (item := self._layout().takeAt(0)) is not None:
            widget = item.widget()
            if widget is not None:
                widget.hide()
                widget.deleteLater()

    def edited(self, record: Any, final: bool) -> None:
        """Take what the hand made of the record."""
        raise NotImplementedError

    def _layout(self) -> QVBoxLayout:
        layout = self.box.layout()
        assert isinstance(layout, QVBoxLayout)
        return layout


class ToolPanel(_Panel):
    """Parameters of the active tool."""

    def __init__(self, desk: Desk, memory: FoldMemory | None = None) -> None:
        super().__init__("Tool", desk, memory, "tool")
        self.refresh()

    def refresh(self) -> None:
        tool = self.desk.session.tool
        if self.title != tool.label:
            self.set_title(tool.label)
        groom = self.desk.groom
        maps = () if groom is None else tuple(m.name for m in groom.maps if m.values is not None)
        self.show_record(tool.name, tool.params, Setting(unit=self.unit, maps=maps))

    def edited(self, record: Record, final: bool) -> None:
        params = {name: getattr(record, name) for name in record.__struct_fields__}
        self.desk.choose(self.desk.session.tool.name, **params)
        if final:
            self.refresh()  # what was refused goes back to what it was


class RespectPanel(_Panel):
    """What every tool heeds: hairspray, selection, symmetry."""

    def __init__(self, desk: Desk, memory: FoldMemory | None = None) -> None:
        super().__init__("Respect", desk, memory, "respect")
        self.refresh()

    def refresh(self) -> None:
        craft = self.desk.session.tool.craft
        self.show_record(("respect", craft), self.desk.workspace.respect, Setting())
        if self.form is not None:
            for name in OF_GUIDES:
                self.form.rows[name].setVisible(craft == "groom")

    def edited(self, record: Respect, final: bool) -> None:
        self.desk.set_workspace(respect=record)


class CoatPanel(_Panel):
    """What the hairs of the active groom are like, or the feathers whose keys it holds: a drag is a preview, its end
    one named step."""

    def __init__(self, desk: Desk, memory: FoldMemory | None = None) -> None:
        super().__init__("Coat", desk, memory, "coat")
        desk.changed.connect(self._document_changed)
        self.refresh()

    def refresh(self) -> None:
        if self.desk.session.stroking:
            return
        groom = self.desk.groom
        if groom is None:
            if self.form is not None or self._layout().count() == 0:
                self.show_words("No groom yet. Plant or scatter guides on a mesh and the coat grows from them.")
            return
        maps, frame = tuple(m.name for m in groom.maps), self.desk.workspace.frame
        feathers = feathers_of(self.desk.document, groom)
        self.set_title("Coat" if feathers is None else "Feathers")
        if feathers is None:
            self.show_record(groom.id, groom.coat, Setting(self.unit, frame, NAMES, maps))
            assert self.form is not None
            for role in ROLES:  # they are given beside the maps themselves
                self.form.rows[role].hide()
        else:
            self.show_record(groom.id, feathers, Setting(self.unit, frame, FEATHER_NAMES, maps))

    def edited(self, coat: Coat | FeatherCoat, final: bool) -> None:
        session, groom = self.desk.session, self.desk.groom
        if groom is None:
            return
        committed: Coat | FeatherCoat = find_groom(session.history.current, groom.id).coat
        if isinstance(coat, FeatherCoat):
            committed = find_feathers(session.history.current, coat.id)
        if not final:
            self.desk.attempt(lambda: session.preview(_with_coat(session.document, groom.id, coat)))
        elif coat is committed:
            session.cancel()
        else:
            what = "Feathers" if isinstance(coat, FeatherCoat) else "Coat"
            self.desk.edit(f"{what} {_changed_label(committed, coat)}", _with_coat, groom.id, coat)
            self.refresh()  # what was refused goes back to what it was

    def _document_changed(self, old: Document, new: Document) -> None:
        if old.grooms is not new.grooms or old.feathers is not new.feathers or old.unit != new.unit:
            self.refresh()


def _with_coat(document: Document, groom_id: int, coat: Coat | FeatherCoat) -> Document:
    if isinstance(coat, FeatherCoat):
        return with_feathers(document, coat)
    return with_groom(document, find_groom(document, groom_id).replace(coat=coat))


def _changed_label(old: Record, new: Record) -> str:
    labels = [known.label.lower() for name, known in fields_of(type(new)).items()
              if getattr(old, name) is not getattr(new, name)]
    return labels[0] if len(labels) == 1 else f"{len(labels)} values"
