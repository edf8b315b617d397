"""The editor of the feather beside the view: flat and in space, dials, another feather, every attribute.

What is edited is the coat of the keys at hand: every change is a step of the document; the coat in the view follows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QSplitter, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.feather.attribute_list import AttributeList
from app.window.feather.canvas import FlatCanvas, FlatFeather
from app.window.feather.placements import PlacementList
from app.window.feather.solid import Draw, SolidView
from app.window.feather.wings import WingList
from app.window.fields.choice_bar import ChoiceBar
from app.window.fields.number_bar import NumberBar
from app.window.files.opening import PICTURE_SUFFIXES, choose_file, filter_of
from app.window.jobs import Asked, Progress
from app.window.params_panel import Setting
from app.window.sections import Column, FoldMemory, Row, Section
from app.window.theme import look_of
from core.document import Document, feathers_of, find_feathers
from core.feather.attributes import COLUMNS
from core.feather.coat.coat import NAMES, FeatherCoat
from core.feather.coat.worn import worn_preset, worn_values
from core.feather.dials import DIALS
from core.feather.pieces import FeatherMesh
from core.feather.presets import load_bird, preset_names, preset_values
from core.field import Field
from core.value import Constant, Value, constant
from core.workspace import Workspace

NO_OTHER = "none"
EDGE, BARB = "outline", "barb"
LEVEL_NAMES = ("card", "vane", "barbs", "barbules")
PICTURES = 0.45  # of the height, at first
TOLD = 3  # attributes two feathers differ in most, by name
_PART = Field("Part", "Whose feather is shown: of the body, or of a part of the bird with feathers of its own.")
_LEVEL = Field("Level", "How finely the feather in space is made: from a card with a picture to every barbule.")
_DRAWN = Field("Draw", "What a line drawn over the flat feather becomes: the edge of a vane, or a barb.")
_OTHER = Field("Compare with", "Another feather: its outline is dashed over this one, its attributes are compared.")
_BLEND = Field("Blend", "Drag towards the other feather; at 1 the feathers of this coat have become it.",
               soft=(0.0, 1.0), hard=(0.0, 1.0))
NO_COAT = ("No feathers are at hand. Right click on a mesh in the scene and choose Dress with feathers, or choose the "
           "keys of feathers there.")


class Shown(NamedTuple):
    """A feather made to be looked at."""

    flat: FlatFeather
    solid: FeatherMesh
    other: tuple[NDArray[np.float64], NDArray[np.float64]] | None
    told: str


class FeatherSide(QWidget):
    """The editor.

    Parameters
    ----------
    draw : a scene as a picture, see :class:`SolidView`.
    """

    def __init__(
        self, desk: Desk, draw: Draw, memory: FoldMemory | None = None, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.desk = desk
        self.canvas, self.solid = FlatCanvas(), SolidView(draw)
        self.part = ChoiceBar(_PART, "body", None, ("body",))
        self.level = ChoiceBar(_LEVEL, "barbs", "barbs", LEVEL_NAMES)
        self.drawn = ChoiceBar(_DRAWN, EDGE, EDGE, (EDGE, BARB))
        self.other = ChoiceBar(_OTHER, NO_OTHER, NO_OTHER, (NO_OTHER, *preset_names()))
        self.blend = NumberBar(_BLEND, 0.0, 0.0)
        self.told = QLabel()
        self.told.setWordWrap(True)
        self.told.setEnabled(False)
        self.trace = QPushButton("Trace a photograph…")
        self.trace.setToolTip("Takes outline and colours of one feather photographed flat on a plain ground.")
        self.dials = {
            dial.name: NumberBar(Field(
                dial.name.capitalize(), f"{dial.description}. Turns many attributes at once; 0 changes nothing.",
                soft=(-1.0, 1.0), hard=(-1.0, 1.0)), 0.0, 0.0)
            for dial in DIALS
        }
        self.attributes = AttributeList()
        self.placements = PlacementList(desk)
        self.wings = WingList(desk)
        self._asked: tuple[object, ...] = ()
        self._busy = self._laid = False
        self._lay_out(memory)
        self.canvas.drawn.connect(self._line_drawn)
        self.attributes.edited.connect(self._attribute_edited)
        for name, bar in self.dials.items():
            bar.edited.connect(lambda position, final, name=name: self._dial_edited(name, position, final))
        self.blend.edited.connect(self._blended)
        self.trace.clicked.connect(lambda: choose_file(
            self, "Trace a photograph", [filter_of("Photographs", PICTURE_SUFFIXES)], self.trace_photograph))
        for choice in (self.part, self.level, self.drawn, self.other):
            choice.edited.connect(lambda value, final: self.refresh())
        desk.changed.connect(self._document_changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)

    def _lay_out(self, memory: FoldMemory | None) -> None:
        self.setMinimumWidth(260)
        above = QWidget()
        column = QVBoxLayout(above)
        column.setContentsMargins(8, 8, 8, 4)
        column.setSpacing(4)
        for bar in (self.part, self.level, self.drawn):
            column.addWidget(Row(bar.known.label, bar))
        pictures = QHBoxLayout()
        pictures.setSpacing(4)
        pictures.addWidget(self.canvas, 1)
        pictures.addWidget(self.solid, 1)
        column.addLayout(pictures, 1)
        below = Column()
        below.add(Section("Dials", _rows(self.dials.values()), memory, "feather dials"))
        other = _rows((self.other, self.blend))
        for widget in (self.told, self.trace):
            other.layout().addWidget(widget)  # type: ignore[union-attr]
        below.add(Section("Another feather", other, memory, "feather other"))
        below.add(Section("Placement", self.placements, memory, "feather placement"))
        below.add(Section("Wings", self.wings, memory, "feather wings"))
        below.add(Section("Attributes", self.attributes, memory, "feather attributes"))
        parts = self._parts = QSplitter(Qt.Orientation.Vertical)
        parts.setChildrenCollapsible(False)
        parts.setHandleWidth(look_of().grid)
        parts.addWidget(above)
        parts.addWidget(below)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.addWidget(parts)

    def sizeHint(self) -> QSize:
        return QSize(34 * look_of().text, 400)

    # -- what is shown -----------------------------------------------------------------------------------

    @property
    def coat(self) -> FeatherCoat | None:
        """The coat that is edited, as it is previewed."""
        return feathers_of(self.desk.document, self.desk.groom)

    def values(self, coat: FeatherCoat) -> NDArray[np.float32]:
        """All attributes of the feather that is shown."""
        return worn_values(coat, worn_preset(coat, self.part.value()))

    @property
    def editing(self) -> bool:
        """True while a hand is at one of the bars."""
        return self.attributes.editing or self.blend.editing or any(bar.editing for bar in self.dials.values())

    def refresh(self) -> None:
        """Show what is on the desk now; the feather is made by a job."""
        if self.desk.session.stroking or not self.isVisible():
            return
        coat = self.coat
        choices = (self.part, self.level, self.drawn, self.other, self.blend, self.trace)
        for widget in (*self.dials.values(), self.attributes, *choices):
            widget.setEnabled(coat is not None and not coat.locked)
        if coat is None:
            self.canvas.words = NO_COAT
            self.canvas.show_feather(None)
            self.solid.show_mesh(None)
            self.told.setText("")
            self.placements.show_coat(None, ())
            self.wings.show_coat(None)
            self._asked = ()
            return
        parts = ["body", *(name for name in load_bird(coat.preset).feathers if name != "body")]
        self.part.set_choices(parts)
        if self.part.value() not in parts:
            self.part.set_value("body")
        self._show_numbers(coat)
        self._make(coat)

    def _show_numbers(self, coat: FeatherCoat) -> None:
        turned = {dial.name: dial.position for dial in coat.dials}
        for name, bar in self.dials.items():
            bar.set_value(turned.get(name, 0.0))
        groom = self.desk.groom
        maps = () if groom is None else tuple(item.name for item in groom.maps)
        self.placements.show_coat(coat, maps)
        self.wings.show_coat(coat)
        setting = Setting(self.desk.document.unit, self.desk.workspace.frame, NAMES, maps)
        preset = worn_preset(coat, self.part.value())
        plain = worn_values(coat.replace(dials=()), preset)  # bars show what is set, not what the dials make of it
        self.attributes.show_values(
            plain, preset_values(preset), {item.name: item.value for item in coat.attributes}, setting)

    def _make(self, coat: FeatherCoat) -> None:
        """Have the feather made, unless it is the one that is shown or being made."""
        values, level = self.values(coat), self.level.value()
        other = None if self.other.value() == NO_OTHER else preset_values(self.other.value())
        wanted = (values.tobytes(), level, self.other.value())
        if wanted == self._asked or self._busy:
            return
        self._asked, self._busy = wanted, True

        def work(progress: Progress, cancelled: Asked) -> Shown:
            return made(values, level, other)

        def done(shown: Shown) -> None:
            self._busy = False
            self.canvas.show_feather(shown.flat)
            self.canvas.compare(shown.other)
            self.solid.show_mesh(shown.solid)
            self.told.setText(shown.told)
            self.refresh()  # it may have been changed meanwhile

        def failed(error: Exception) -> None:
            self._busy = False
            self.desk.error(error)

        self.desk.jobs.start("Making the feather", work, done, failed, self)

    # -- what the hand does ------------------------------------------------------------------------------

    def _attribute_edited(self, name: str, value: Value, final: bool) -> None:
        from tools.feather_edits import reset_attributes, set_attributes

        coat = self.coat
        if coat is None:
            return
        usual = float(preset_values(worn_preset(coat, self.part.value()))[COLUMNS[name]])
        given = {item.name: item.value for item in self._committed(coat.id).attributes}
        before = _number(given.get(name, constant(usual)))
        step, same = f"Feather {_words(name)}", before is not None and before == _number(value)
        if _number(value) == usual:
            self._change(step, final, same, coat.id, reset_attributes, (name,))
        else:
            self._change(step, final, same, coat.id, set_attributes, {name: value})

    def _dial_edited(self, name: str, position: float, final: bool) -> None:
        from tools.feather_edits import turn_dial

        coat = self.coat
        if coat is not None:
            before = next((dial.position for dial in self._committed(coat.id).dials if dial.name == name), 0.0)
            self._change(f"Feather dial {name}", final, position == before, coat.id, turn_dial, name, position)

    def _blended(self, share: float, final: bool) -> None:
        from core.feather.compare import blend
        from tools.feather_edits import wear_feather

        coat = self.coat
        if coat is None or self.other.value() == NO_OTHER:
            self.blend.set_value(0.0)
            return
        mixed = blend(self.values(self._committed(coat.id)), preset_values(self.other.value()), share)
        self._change(
            f"Blend with {self.other.value()}", final, not share, coat.id, wear_feather, mixed, self.part.value())
        if final:
            self.blend.set_value(0.0)  # this is the feather now

    def _line_drawn(self, side: int, line: NDArray[np.float64]) -> None:
        """An edge or a barb was drawn: the feather takes it on."""
        coat = self.coat
        if coat is None:
            return
        values, what, coat_id, part = self.values(coat), self.drawn.value(), coat.id, self.part.value()

        def work(progress: Progress, cancelled: Asked) -> NDArray[np.float32]:
            from core.feather.outline import fitted_barb, fitted_outline

            return fitted_outline(values, side, line) if what == EDGE else fitted_barb(values, side, line)

        def put(fitted: NDArray[np.float32]) -> None:
            from tools.feather_edits import wear_feather

            self.desk.edit(f"Draw {what} of feather", wear_feather, coat_id, fitted, part)

        self.desk.jobs.start(f"Fitting the {what}", work, put, owner=self)

    def _committed(self, coat_id: int) -> FeatherCoat:
        """The coat as it was before the hand came."""
        return find_feathers(self.desk.session.history.current, coat_id)

    def trace_photograph(self, path: Path) -> None:
        """Give the feathers the outline and the colours of the feather in a photograph."""
        coat = self.coat
        if coat is None:
            return
        values, coat_id, part = self.values(coat), coat.id, self.part.value()

        def work(progress: Progress, cancelled: Asked) -> NDArray[np.float32]:
            from core.feather.trace import traced
            from core.formats.picture import read_colors

            return traced(read_colors(path), values)

        def put(found: NDArray[np.float32]) -> None:
            from tools.feather_edits import wear_feather

            self.desk.edit("Trace feather", wear_feather, coat_id, found, part)

        self.desk.jobs.start(f"Tracing {path.name}", work, put, owner=self)

    def _change(
        self, step: str, final: bool, same: bool, coat_id: int, edit: Callable[..., Document], *args: object
    ) -> None:
        """Preview an edit of the document as it was before the hand came, or make it; none that changes nothing."""
        session = self.desk.session
        if not final:
            self.desk.attempt(lambda: session.preview(edit(session.history.current, coat_id, *args)))
        elif same:
            session.cancel()
        else:
            self.desk.edit(step, edit, coat_id, *args)
        self.refresh()

    # -- what changes ------------------------------------------------------------------------------------

    def showEvent(self, event: object) -> None:
        super().showEvent(event)  # type: ignore[arg-type]
        if not self._laid:
            self._laid = True
            self._parts.setSizes([round(PICTURES * self.height()), round((1.0 - PICTURES) * self.height())])
        self.refresh()

    def _document_changed(self, old: Document, new: Document) -> None:
        if old.feathers is not new.feathers or old.grooms is not new.grooms:
            self.refresh()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.groom != new.groom or old.frame != new.frame or old.craft != new.craft:
            self.refresh()


def made(values: NDArray[np.float32], level: str, other: NDArray[np.float32] | None) -> Shown:
    """A feather as the editor shows it; for a job."""
    from core.feather.compare import compare
    from core.feather.levels import LEVELS, feather_mesh, flat_feather
    from core.feather.outline import outline_of

    flat = FlatFeather(*flat_feather(values), (outline_of(values, 0), outline_of(values, 1)))
    solid = feather_mesh(values, 0, next(known for known in LEVELS if known == level))
    if other is None:
        return Shown(flat, solid, None, "")
    found = compare(values, other)
    most = ", ".join(_words(difference.name) for difference in found.attributes[:TOLD])
    told = "These are the same feather."
    if found.attributes:
        told = (f"They differ in {len(found.attributes)} attributes, most in {most}. Outlines lie up to "
                f"{found.outline_most:.1%} of the shaft apart, {found.outline_mean:.1%} on average.")
    return Shown(flat, solid, (outline_of(other, 0), outline_of(other, 1)), told)


def _rows(bars: Iterable[ChoiceBar | NumberBar]) -> QWidget:
    rows = QWidget()
    column = QVBoxLayout(rows)
    column.setContentsMargins(0, 0, 0, 0)
    column.setSpacing(4)
    for bar in bars:
        column.addWidget(Row(bar.known.label, bar))
    return rows


def _number(value: Value) -> float | None:
    """The number a value is for all feathers and frames, or None."""
    return value.base.number if isinstance(value.base, Constant) and value.map is None else None


def _words(name: str) -> str:
    return "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in name)
