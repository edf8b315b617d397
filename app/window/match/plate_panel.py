"""The plates of the document: which is in view, what is told of it, and what tracking sees of it."""

from __future__ import annotations

from typing import Annotated, Any

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QGridLayout, QLabel, QPushButton, QTreeWidgetItem, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.fields.choice_bar import ChoiceBar
from app.window.match.doors import MatchDoors
from app.window.params_panel import RecordForm
from app.window.pose.names import Names
from app.window.sections import FoldMemory, Row, Section
from core.document import Document
from core.field import Field, field
from core.image.plate import MOST_SIDE, ChannelMix, FilmBack, Plate
from core.record import Record
from core.workspace import PlateLook, Workspace
from tools import plate_edits
from tools.match_edits import shown_plate
from viewport.plate_color import color_spaces, displays

_SPACE = Field("Colour space", "What the numbers of the files mean, by its name in the configuration of OpenColorIO "
               "($OCIO, else a built-in one); it changes what is shown, never the plate.")
_ON = Field("Shown on", "The display and view of the configuration of OpenColorIO that the plate is shown through; "
            "nothing that is tracked or written changes.")
FIRST = "as configured"
_ROLE = Qt.ItemDataRole.UserRole
_SIDES = ("left", "top", "right", "bottom")
AS_FILE = "as the file says"
_CUT, _MOST = (0, 400), (0, MOST_SIDE)


class PlateForm(Record):
    """What may be told of a plate. Zero stands for a film back or a focal length that nobody knows."""

    name: Annotated[str, field("Name", "What the plate is called here; its files keep their names.")]
    offset: Annotated[int, field("Offset", "Added to the numbers of the files, so that plates run in step.", "frames",
                                 (-1000, 1000), (-(2**30), 2**30), 1)] = 0
    pixel_aspect: Annotated[float, field("Pixel aspect", "Width of a pixel over its height: 2 for anamorphic film.",
                                         "", (0.5, 2.0), (0.01, 100.0))] = 1.0
    film_width: Annotated[float, field("Film width", "Of what the light fell on, in millimetres; 0 while nobody "
                                       "knows.", "", (0.0, 70.0), (0.0, 10_000.0))] = 0.0
    film_height: Annotated[float, field("Film height", "Of what the light fell on, in millimetres; 0 while nobody "
                                        "knows.", "", (0.0, 50.0), (0.0, 10_000.0))] = 0.0
    focal: Annotated[float, field("Focal length", "Of the lens, in millimetres; 0 while nobody knows.", "",
                                  (0.0, 200.0), (0.0, 100_000.0))] = 0.0
    left: Annotated[int, field("Crop left", "Pixels left out at the left; before anything is tracked.", "px", _CUT,
                               _MOST, 1)] = 0
    top: Annotated[int, field("Crop top", "Pixels left out above; before anything is tracked.", "px", _CUT, _MOST,
                              1)] = 0
    right: Annotated[int, field("Crop right", "Pixels left out at the right; before anything is tracked.", "px", _CUT,
                                _MOST, 1)] = 0
    bottom: Annotated[int, field("Crop bottom", "Pixels left out below; before anything is tracked.", "px", _CUT,
                                 _MOST, 1)] = 0


class PlatePanel(QWidget):
    """A list of plates, the settings of the one in view, and below them how tracking looks at it."""

    def __init__(self, desk: Desk, memory: FoldMemory | None = None, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.doors = MatchDoors(desk, self)
        self.said = QLabel("No plate yet. Open a sequence or a movie, or drop its folder on the window.")
        self.said.setWordWrap(True)
        self.said.setEnabled(False)
        self.list = Names("Plates")
        self.list.setSelectionMode(Names.SelectionMode.SingleSelection)
        self.buttons = {
            "open": _button("Open…", "Opens a sequence of frames or a movie; choose one frame.", self._open),
            "relink": _button("Relink…", "Finds the plate in view at another place; what is on it stays.",
                              self._relink),
            "delete": _button("Delete", "Takes the plate in view out with its tracks; its files stay.", self._delete),
        }
        self.about = QLabel()
        self.about.setWordWrap(True)
        self.about.setEnabled(False)
        inside = QWidget()
        self._settings = QVBoxLayout()
        within = QVBoxLayout(inside)
        within.setContentsMargins(0, 0, 0, 0)
        within.setSpacing(4)
        looks = QWidget()
        self._looks = QVBoxLayout(looks)
        self._looks.setContentsMargins(0, 0, 0, 0)
        self.film = Section("Film", inside, memory, "plate film")
        self.seen_by = Section("What tracking sees", looks, memory, "plate mix")
        self.space = ChoiceBar(_SPACE, "", "", ("",), (AS_FILE,))
        self.space.edited.connect(self._coloured)
        self.on = ChoiceBar(_ON, "", "", ("",), (FIRST,))
        self.on.set_value(desk.workspace.plate_look.display)
        self.on.edited.connect(self._shown_on)
        self.look = RecordForm(desk.workspace.plate_look)
        self.look.changed.connect(self._looked_at)
        screen = QWidget()
        lines = QVBoxLayout(screen)
        lines.setContentsMargins(0, 0, 0, 0)
        lines.setSpacing(4)
        lines.addWidget(Row(_ON.label, self.on))
        lines.addWidget(self.look)
        self.screen = Section("On the screen", screen, memory, "plate screen")
        within.addWidget(Row(_SPACE.label, self.space))
        within.addLayout(self._settings)
        self._spaces_asked = False
        self.form: RecordForm | None = None
        self.mix: RecordForm | None = None
        grid = QGridLayout()
        grid.setSpacing(4)
        for at, button in enumerate(self.buttons.values()):
            grid.addWidget(button, 0, at)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        for widget in (self.said, self.list, self.about):
            column.addWidget(widget)
        column.addLayout(grid)
        column.addWidget(self.screen)
        column.addWidget(self.seen_by)
        column.addWidget(self.film)
        self._seen: tuple[object, ...] = ()
        self._formed: Plate | None = None
        self.list.itemClicked.connect(self._clicked)
        desk.changed.connect(self._document_changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.refresh)
        desk.session_replaced.connect(self._show_look)
        desk.stroke_ended.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the plates of the desk."""
        document = self.desk.document
        if self.desk.session.stroking or self._seen == (document.plates,):
            return
        self._seen = (document.plates,)
        plate = shown_plate(document)
        self.list.clear()
        for one in document.plates:
            step = f"{one.offset:+d}" if one.offset else ""
            state = "   locked" if one.locked else ""
            entry = QTreeWidgetItem([f"{one.name}   {one.first} to {one.last} {step}{state}"])
            entry.setData(0, _ROLE, one.id)
            entry.setToolTip(0, f"{one.path}: a click brings this plate into view.")
            self.list.addTopLevelItem(entry)
            entry.setSelected(one is plate)
        self.list.setVisible(bool(document.plates))
        self.list.updateGeometry()
        self.said.setVisible(not document.plates)
        for name in ("relink", "delete"):
            self.buttons[name].setEnabled(plate is not None)
        self.about.setVisible(plate is not None)
        if plate is not None:
            gaps = f", {len(plate.missing)} missing" if plate.missing else ""
            kind = "movie" if plate.movie else "still" if plate.first == plate.last else "sequence"
            self.about.setText(f"{kind}, {plate.width} × {plate.height} pixels, {len(plate.frames)} frames{gaps}")
        self._show_forms(plate)

    def _show_forms(self, plate: Plate | None) -> None:
        for part in (self.screen, self.film, self.seen_by):
            part.setVisible(plate is not None)
        if plate is not None:
            self._ask_spaces()
            self.space.set_value(plate.color_space)
        if plate is not None and self.form is not None and self._formed is not None and plate.id == self._formed.id:
            assert self.mix is not None
            self._formed = plate
            self.form.set_record(_form_of(plate))
            self.mix.set_record(plate.mix)
            return
        self._formed = plate
        for column in (self._settings, self._looks):
            while (old := column.takeAt(0)) is not None:
                widget = old.widget()
                if widget is not None:
                    widget.hide()
                    widget.deleteLater()
        self.form = self.mix = None
        if plate is None:
            return
        self.form, self.mix = RecordForm(_form_of(plate)), RecordForm(plate.mix)
        self.form.changed.connect(self._told)
        self.mix.changed.connect(self._mixed)
        self._settings.addWidget(self.form)
        self._looks.addWidget(self.mix)

    # -- what the hand does ------------------------------------------------------------------------------

    def _clicked(self, entry: QTreeWidgetItem) -> None:
        wanted = int(entry.data(0, _ROLE))
        plate = shown_plate(self.desk.document)
        if plate is None or plate.id != wanted:
            # after this signal, for the edit fills the list anew, and its row is still at work here
            QTimer.singleShot(0, self, lambda: self._show(wanted))

    def _show(self, plate_id: int) -> None:
        if self.desk.edit("Show plate", plate_edits.show_plate_in_step, plate_id):
            document, frame = self.desk.document, self.desk.workspace.frame
            self.desk.set_workspace(frame=float(min(max(frame, document.first_frame), document.last_frame)))

    def _told(self, record: PlateForm, final: bool) -> None:
        plate = shown_plate(self.desk.document)
        if not final or plate is None:
            return
        film = FilmBack(record.film_width, record.film_height)
        told: dict[str, Any] = {
            "name": record.name.strip() or plate.name, "offset": record.offset, "pixel_aspect": record.pixel_aspect,
            "film_back": film if film.width and film.height else None, "focal_mm": record.focal or None,
            "crop": tuple(getattr(record, side) for side in _SIDES)}
        changes = {name: value for name, value in told.items() if value != getattr(plate, name)}
        if changes:
            self._set("Edit plate", **changes)

    def _ask_spaces(self) -> None:
        """Read the names of colour spaces once, apart from the window."""
        if self._spaces_asked:
            return
        self._spaces_asked = True

        def done(names: tuple[tuple[str, ...], tuple[str, ...]]) -> None:
            spaces, shown_on = names
            self.space.set_choices(("", *spaces), (AS_FILE, *spaces))
            self.on.set_choices(("", *shown_on), (FIRST, *shown_on))

        self.desk.jobs.start(
            "Read colour spaces", lambda progress, cancelled: (color_spaces(), displays()), done, self.desk.error, self)

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.plate_look is not new.plate_look:
            self._show_look()

    def _show_look(self) -> None:
        look = self.desk.workspace.plate_look
        self.look.set_record(look)
        self.on.set_value(look.display)

    def _looked_at(self, look: PlateLook, final: bool) -> None:
        self.desk.set_workspace(plate_look=look.replace(display=self.desk.workspace.plate_look.display))

    def _shown_on(self, display: str, final: bool) -> None:
        if final:
            self.desk.set_workspace(plate_look=self.desk.workspace.plate_look.replace(display=display))

    def _coloured(self, space: str, final: bool) -> None:
        plate = shown_plate(self.desk.document)
        if final and plate is not None and space != plate.color_space:
            self._set("Colour space", color_space=space)

    def _mixed(self, mix: ChannelMix, final: bool) -> None:
        plate = shown_plate(self.desk.document)
        if final and plate is not None and mix != plate.mix:
            self._set("What tracking sees", mix=mix)

    def _set(self, step: str, **changes: Any) -> None:
        plate = shown_plate(self.desk.document)
        if plate is not None and not self.desk.edit(step, plate_edits.set_plate, plate.id, **changes):
            QTimer.singleShot(0, self, self._again)  # the form goes back to what is there

    def _again(self) -> None:
        self._seen, self._formed = (), None
        self.refresh()

    def _open(self) -> None:
        self.doors.ask_plate()

    def _relink(self) -> None:
        plate = shown_plate(self.desk.document)
        if plate is not None:
            self.doors.ask_relink(plate.id)

    def _delete(self) -> None:
        plate = shown_plate(self.desk.document)
        if plate is not None:
            self.desk.edit("Delete plate", plate_edits.delete_plate, plate.id)

    def _document_changed(self, old: Document, new: Document) -> None:
        if old.plates is not new.plates:
            self.refresh()


def _form_of(plate: Plate) -> PlateForm:
    film = plate.film_back or FilmBack(0.0, 0.0)
    return PlateForm(
        name=plate.name, offset=plate.offset, pixel_aspect=plate.pixel_aspect, film_width=film.width,
        film_height=film.height, focal=plate.focal_mm or 0.0, **dict(zip(_SIDES, plate.crop, strict=True)))


def _button(words: str, tooltip: str, run: Any) -> QPushButton:
    button = QPushButton(words)
    button.setToolTip(tooltip)
    button.clicked.connect(lambda: run())
    return button
