"""Another plate, or another photograph of the model, beside the one in view: witness cameras and stills, in step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QImage, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF, QWheelEvent
from PySide6.QtWidgets import QSizePolicy, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.fields.choice_bar import ChoiceBar
from app.window.match.marks import Sheet, marks_of
from app.window.match.model_marks import model_marks
from app.window.match.screen import PlateScreen
from app.window.match.solve_marks import solve_marks
from app.window.navigation import NOTCH
from app.window.theme import look_of, text_font
from core.camera import Camera
from core.document import Document
from core.field import Field
from core.image.plate import Plate
from core.image.plate_view import plate_camera, plate_points, plate_size, whole_plate
from core.overlay import Circle, Fill, Label, Marker, Overlays, Polyline
from core.workspace import Workspace
from tools.match_edits import place_at, select_tracks, shown_plate
from tools.photomodel_edits import model_of
from tools.plate_edits import show_plate_in_step
from tools.solve_edits import solved_of
from viewport.overlay_drawing import TONES
from viewport.plate import GROUND

Array = NDArray[np.float64]
SHARE = 4  # of the memory for frames, as a divisor, that the plate beside may take
LEAST = 64 << 20  # bytes, that it may take in any case
REACH, STILL = 10.0, 3.0  # pixels: of a click from a track, and of a hand in a click
NOTHING = "Open a second plate, or take more photographs: it will stand here beside the one in view."
_WHICH = Field("Beside", "The plate or the photograph beside the one in view; plates run in step by their offsets.")


class Beside(NamedTuple):
    """What may stand here. frame : as the files count; None for the frame of the desk."""

    plate: int
    frame: int | None


class PlateBeside(QWidget):
    """A drag slides, the wheel zooms, a click takes a track, a double click brings it all into the large view."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._desk = desk
        self.which = ChoiceBar(_WHICH, None, None, (None,), ("nothing",))
        self.sheet = _Sheet(desk, self)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addWidget(self.which)
        column.addWidget(self.sheet, 1)
        self.which.edited.connect(lambda choice, final: self.show_beside(choice))
        desk.changed.connect(self._document_changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self._session_replaced)
        self.refresh()

    def sizeHint(self) -> QSize:
        return QSize(36 * look_of().text, 30 * look_of().text)

    def show_beside(self, choice: Beside | None) -> None:
        """Put a plate or a photograph here."""
        self.sheet.put(choice)

    def refresh(self) -> None:
        """Offer what there is beside the plate in view."""
        offered = choices(self._desk.document, round(self._desk.workspace.frame))
        names = dict(offered)
        kept = self.sheet.choice if self.sheet.choice in names else next(iter(names), None)
        self.which.set_choices(tuple(names) or (None,), tuple(names.values()) or ("nothing",))
        self.which.set_value(kept)
        self.sheet.put(kept)

    def set_budget(self, size: int) -> None:
        """Of the bytes that frames may take, a part is for those here."""
        self.sheet.screen.set_budget(max(size // SHARE, LEAST))

    def close_frames(self) -> None:
        """Give back frames and the child that reads them."""
        self.sheet.screen.close()

    def _session_replaced(self) -> None:
        self.close_frames()
        self.refresh()

    def _document_changed(self, old: Document, new: Document) -> None:
        if old.plates is not new.plates or old.photomodels is not new.photomodels:
            self.refresh()
        self.sheet.update()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.frame != new.frame:
            self.refresh()
        self.sheet.update()


def choices(document: Document, frame: int) -> list[tuple[Beside, str]]:
    """Other plates than that in view, and other photographs of the model that is worked on; what they are called."""
    shown = shown_plate(document)
    found = [(Beside(plate.id, None), plate.name) for plate in document.plates if plate is not shown]
    model = model_of(document)
    plates = {plate.id: plate for plate in document.plates}
    for number, photo in enumerate(() if model is None else model.photos, 1):
        plate = plates.get(photo.plate_id)
        here = plate is not None and plate is shown and photo.frame == frame - plate.offset
        if plate is not None and not here:
            found.append((Beside(plate.id, photo.frame), f"photograph {number}: {plate.name} {photo.frame}"))
    return found


class _Sheet(QWidget):
    """The picture with its marks."""

    def __init__(self, desk: Desk, parent: QWidget) -> None:
        super().__init__(parent)
        self._desk = desk
        self.screen = PlateScreen(desk)
        self.choice: Beside | None = None
        self._cameras: dict[int, Camera] = {}
        self._held: tuple[QPointF, QPointF, bool] | None = None  # start, last, whether it is still a click
        self._image: tuple[NDArray[np.uint8], QImage] | None = None
        self.setMinimumSize(160, 120)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("Plate beside")
        self.setToolTip("Another plate in step. Drag: slide. Wheel: zoom. Click: take a track. Double click: bring it "
                        "into the large view.")
        self.screen.fresh.connect(self.update)

    def put(self, choice: Beside | None) -> None:
        """Show a plate or a photograph."""
        if choice != self.choice:
            self.choice = choice
            self.update()

    @property
    def plate(self) -> Plate | None:
        """The plate that is shown, None for nothing."""
        choice = self.choice
        return None if choice is None else next((p for p in self._desk.document.plates if p.id == choice.plate), None)

    @property
    def frame(self) -> int:
        """The frame that is shown, as the files count."""
        plate, choice = self.plate, self.choice
        if choice is not None and choice.frame is not None:
            return choice.frame
        return round(self._desk.workspace.frame) - (0 if plate is None else plate.offset)

    @property
    def camera(self) -> Camera:
        """Which part of the plate is seen, all of it until a hand has moved."""
        plate = self.plate
        assert plate is not None
        return self._cameras.get(plate.id) or whole_plate(plate, max(self.width(), 1), max(self.height(), 1))

    def at(self, place: QPointF) -> Array:
        """The place (2,) of the plate under a point of the widget."""
        plate = self.plate
        assert plate is not None
        found: Array = plate_points(
            self.camera, plate.pixel_aspect, (place.x() - 0.5, place.y() - 0.5), self.width(), self.height())[0]
        return found

    # -- the hand --------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if self.plate is not None:
            self._held = event.position(), event.position(), event.button() == Qt.MouseButton.LeftButton

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._held is None or self.plate is None:
            return
        start, last, click = self._held
        place = event.position()
        if click and (place - start).manhattanLength() <= STILL:
            return
        camera, scale = self.camera, self.camera.height / max(self.height(), 1)
        moved = place - last
        x, y, _ = camera.position
        self._look(plate_camera(x - scale * moved.x(), y + scale * moved.y(), camera.height))
        self._held = start, place, False

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        held, self._held = self._held, None
        plate = self.plate
        if held is None or not held[2] or plate is None:
            return
        sheet = self._over(plate)
        near, best = None, REACH
        for track in self._desk.document.tracks:
            place = place_at(track, self.frame) if track.plate_id == plate.id and not track.hidden else None
            if place is None:
                continue
            x, y = sheet.at(place[None])[0] + 0.5
            away = float(np.hypot(x - event.position().x(), y - event.position().y()))
            if away <= best:
                near, best = track.id, away
        if near is not None:
            adds = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
            others = tuple(i for i in self._desk.document.track_selection if i != near) if adds else ()
            self._desk.edit("Select tracks", select_tracks, (*others, near))

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        plate, choice, frame = self.plate, self.choice, self.frame
        if plate is None or choice is None or event.button() != Qt.MouseButton.LeftButton:
            return
        self._held = None
        before = shown_plate(self._desk.document)
        if plate is before or self._desk.edit("Show plate", show_plate_in_step, plate.id):
            if choice.frame is not None:
                self._desk.set_workspace(frame=float(frame + plate.offset))
            if before is not None and before is not plate:
                self.put(Beside(before.id, None))

    def wheelEvent(self, event: QWheelEvent) -> None:
        plate = self.plate
        if plate is not None:
            camera, place = self.camera, self.at(event.position()) * (plate.pixel_aspect, -1.0)
            factor = NOTCH ** (event.angleDelta().y() / 120.0)
            x, y = place + factor * (camera.position[:2] - place)
            self._look(plate_camera(float(x), float(y), camera.height * factor))
        event.accept()

    def _look(self, camera: Camera) -> None:
        plate = self.plate
        assert plate is not None
        wide, tall = plate_size(plate)
        if 0.01 * tall < camera.height < 20.0 * max(wide, tall):
            self._cameras[plate.id] = camera
            self.update()

    # -- the picture -----------------------------------------------------------------------------------------

    def _over(self, plate: Plate) -> Sheet:
        return Sheet(plate, self.frame, self.camera, (self.width(), self.height()), look_of().text / 12.0)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter, look, plate = QPainter(self), look_of(), self.plate
        painter.fillRect(self.rect(), QColor.fromRgbF(*GROUND))
        painter.setFont(text_font(look))
        if plate is None:
            painter.setPen(_tone("faint"))
            painter.drawText(QRectF(self.rect()).adjusted(16, 16, -16, -16),
                             Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap, NOTHING)
            painter.end()
            return
        painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.SmoothPixmapTransform)
        sheet, frame = self._over(plate), self.frame
        shown = self.screen.picture(plate, frame)
        wide, tall = plate_size(plate)
        left, top, right, bottom = (sheet.at(np.array([[-0.5, -0.5], [wide - 0.5, tall - 0.5]])) + 0.5).ravel().tolist()
        if shown is not None:
            painter.drawImage(QRectF(left, top, right - left, bottom - top), self._as_image(shown.pixels))
        marks = marks_of(self._desk.document, sheet) + model_marks(self._desk.document, sheet)
        solved = solved_of(self._desk.document, plate.id)
        _paint(painter, marks + (() if solved is None else solve_marks(solved, sheet)))
        words = f"{plate.name}   frame {frame}" + ("" if shown is None or not shown.words else f"   {shown.words}")
        box = QRectF(0.0, self.height() - look.row, self.width(), look.row)
        painter.fillRect(box, QColor.fromRgbF(*GROUND, 0.8))
        painter.setPen(_tone("plain"))
        painter.drawText(box.adjusted(8, 0, -8, 0), Qt.AlignmentFlag.AlignVCenter, words)
        painter.end()

    def _as_image(self, pixels: NDArray[np.uint8]) -> QImage:
        if self._image is None or self._image[0] is not pixels:
            tall, wide = pixels.shape[:2]
            data = np.ascontiguousarray(pixels).tobytes()
            self._image = pixels, QImage(data, wide, tall, 3 * wide, QImage.Format.Format_RGB888).copy()
        return self._image[1]


def _paint(painter: QPainter, marks: Overlays) -> None:
    """Marks as the view draws them, with lines of Qt's."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for one in marks:
        if isinstance(one, Fill):
            continue
        colour = _tone(one.tone)
        painter.setPen(QPen(colour, one.width if isinstance(one, Polyline | Circle) else 1.0))
        if isinstance(one, Polyline):
            if not np.isfinite(one.points).all() or np.abs(one.points).max(initial=0.0) > 1e5:
                continue
            line = QPolygonF([QPointF(x + 0.5, y + 0.5) for x, y in one.points.tolist()])
            if one.closed:
                painter.drawPolygon(line)
            else:
                painter.drawPolyline(line)
        elif isinstance(one, Circle):
            painter.drawEllipse(QPointF(one.x + 0.5, one.y + 0.5), one.radius, one.radius)
        elif isinstance(one, Marker):
            half = 0.5 * one.size
            painter.drawLine(QPointF(one.x - half, one.y), QPointF(one.x + half, one.y))
            painter.drawLine(QPointF(one.x, one.y - half), QPointF(one.x, one.y + half))
        elif isinstance(one, Label):
            painter.drawText(QPointF(one.x, one.y), one.words)


def _tone(name: str) -> QColor:
    return QColor(*TONES[name])
