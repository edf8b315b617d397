"""The solved camera in space beside the plate: its path, the picture it sees, the points by their error."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QImage,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
    QTransform,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.window.desk import Desk
from app.window.keymap import Gesture, Keymap, Navigation
from app.window.match.screen import PlateScreen
from app.window.navigation import NOTCH, PULL, TURN
from app.window.tablet import BUTTON_NAMES, modifier_names
from app.window.theme import look_of, text_font
from core import navigate
from core.camera import Camera, frame_points, project
from core.image.plate import Plate
from core.match.solved import SolvedCamera, cube_edges, object_size, world_axes
from core.match.solved_scene import (
    UP,
    from_behind,
    frustum_up,
    grades,
    ground_lines,
    path_up,
    points_up,
    sigma_of,
    spreads_up,
)
from tools.match_edits import select_tracks, shown_plate
from tools.solve_edits import solved_of
from viewport.overlay_drawing import TONES
from viewport.plate import GROUND

Array = NDArray[np.float64]
REACH = 8.0  # pixels from a point within which a click takes it
STILL = 3.0  # pixels a hand may move in a click
SIGMAS = 3.0  # of an ellipse about a point
LEAST_ELLIPSE = 3.0  # pixels, smaller ones are behind the point itself
LENS = 0.5  # radians
NOTHING = "Solve the camera: its path and the points will stand here."


class _Held(NamedTuple):
    """What goes on from press to release."""

    action: Navigation
    start: QPointF
    last: QPointF
    clicks: bool


class SolveSpace(QWidget):
    """A drag of the left button, or as the keymap says, turns; a click takes the track of a point, Shift adds.

    Parameters
    ----------
    keymap : that of the window. trackball : whether orbiting rolls. screen : where frames of the plate are.
    """

    def __init__(
        self, desk: Desk, keymap: Callable[[], Keymap], trackball: Callable[[], bool], screen: PlateScreen,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._desk, self._keymap, self._trackball, self._screen = desk, keymap, trackball, screen
        self._camera: Camera | None = None
        self._of: int | None = None  # the plate the camera looks at the solve of
        self._held: _Held | None = None
        self._hover: int | None = None
        self._pixels: NDArray[np.uint8] | None = None
        self._image: QImage | None = None
        self.setMinimumSize(200, 160)
        self.setMouseTracking(True)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("Solved scene")
        self.setToolTip("The solved camera in space. Drag: turn. Wheel: nearer. Click: take the track of a point. "
                        "Double click: see all.")
        desk.changed.connect(lambda old, new: self.update())
        desk.workspace_changed.connect(lambda old, new: self.update())
        desk.session_replaced.connect(self.fit)
        screen.fresh.connect(self.update)

    def sizeHint(self) -> QSize:
        return QSize(36 * look_of().text, 30 * look_of().text)

    @property
    def plate(self) -> Plate | None:
        """The plate in view."""
        return shown_plate(self._desk.document)

    @property
    def solved(self) -> SolvedCamera | None:
        """Its solved camera."""
        plate = self.plate
        return None if plate is None else solved_of(self._desk.document, plate.id)

    @property
    def camera(self) -> Camera:
        """How the solve is looked at; all of it until a hand has moved."""
        solved = self.solved
        assert solved is not None
        if self._camera is None or self._of != solved.plate_id:
            self._of = solved.plate_id
            self._camera = frame_points(
                _all_of(solved), from_behind(solved), self.width() / self.height(), field_of_view=LENS, margin=1.15)
        return self._camera

    def fit(self) -> None:
        """See all of it."""
        self._camera = None
        self.update()

    def places(self) -> tuple[Array, Array]:
        """Where the points of the solve are in the widget (P, 2), and how far away (P,); negative behind."""
        solved = self.solved
        return self._seen(np.zeros((0, 3)) if solved is None else points_up(solved))

    def point_at(self, place: QPointF) -> int | None:
        """The row of the point under a place of the widget, the nearest to the pointer."""
        if self.solved is None:
            return None
        xy, depth = self.places()
        far = np.where(depth > 0.0, np.hypot(xy[:, 0] - place.x(), xy[:, 1] - place.y()), np.inf)
        return int(np.argmin(far)) if len(far) and far.min() <= REACH else None

    # -- the hand --------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if self.solved is None or self._held is not None:
            return
        pressed = Gesture(BUTTON_NAMES.get(event.button(), ""), modifier_names(event.modifiers()))
        move = self._keymap().navigation(pressed)
        plain = event.button() == Qt.MouseButton.LeftButton and move is None
        if move is not None or plain:
            place = event.position()
            self._held = _Held(move or "orbit", place, place, plain)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        place, held = event.position(), self._held
        if held is None:
            hover = self.point_at(place)
            if hover != self._hover:
                self._hover = hover
                self.update()
            return
        if held.clicks and (place - held.start).manhattanLength() <= STILL:
            return
        self._held = held._replace(last=place, clicks=False)
        moved = place - held.last
        self._move(held.action, moved.x(), moved.y())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        held, self._held = self._held, None
        solved = self.solved
        if held is None or not held.clicks or solved is None:
            return
        row, adds = self.point_at(event.position()), bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        before = self._desk.document.track_selection
        if row is None:
            wanted = before if adds else ()
        else:
            track = int(solved.track_ids[row])
            others = tuple(i for i in before if i != track)
            wanted = (track,) if not adds else others if track in before else (*others, track)
        self._desk.edit("Select tracks", select_tracks, wanted)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.fit()

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.solved is not None:
            self._camera = navigate.dolly(self.camera, self._pivot(), NOTCH ** (event.angleDelta().y() / 120.0))
            self.update()
        event.accept()

    def leaveEvent(self, event: object) -> None:
        self._hover = None
        self.update()

    def _move(self, action: Navigation, across: float, down: float) -> None:
        camera, pivot = self.camera, self._pivot()
        if action in ("orbit", "tumble"):
            turn = navigate.tumble if self._trackball() == (action == "orbit") else navigate.orbit
            self._camera = turn(camera, pivot, -TURN * across, TURN * down)
        elif action == "pan":
            self._camera = navigate.pan(camera, pivot, across, down, self.height())
        elif action == "dolly":
            self._camera = navigate.dolly(camera, pivot, math.exp(PULL * (down - across)))
        else:
            self._camera = navigate.zoom(camera, math.exp(PULL * (down - across)))
        self.update()

    def _pivot(self) -> Array:
        """The selected points, else all."""
        solved = self.solved
        assert solved is not None
        chosen = np.isin(solved.track_ids, self._desk.document.track_selection)
        points = points_up(solved)
        return np.asarray(np.median(points[chosen] if chosen.any() else points, axis=0))

    # -- the picture -----------------------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        painter, look = QPainter(self), look_of()
        painter.fillRect(self.rect(), QColor.fromRgbF(*GROUND))
        painter.setFont(text_font(look))
        solved = self.solved
        if solved is None:
            painter.setPen(_tone("faint"))
            painter.drawText(QRectF(self.rect()).adjusted(16, 16, -16, -16),
                             Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap, NOTHING)
            painter.end()
            return
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        self._draw_ground(painter, solved)
        self._draw_camera(painter, solved)
        self._draw_points(painter, solved)
        self._draw_words(painter, solved)
        painter.end()

    def _draw_ground(self, painter: QPainter, solved: SolvedCamera) -> None:
        """A grid at the height zero and the axes, where it was said where the world lies; test cubes."""
        if solved.line_up.said:
            for line in ground_lines(solved):
                self._line(painter, line[[0, -1]] * UP, "faint", 0.5, 0.45)
            for tone, axis in zip("xyz", world_axes(solved, 2), strict=True):
                self._line(painter, axis * UP, tone, 2.0)
        for track in solved.cubes:
            if track in solved.track_ids:
                for edges in cube_edges(solved, track, 2):
                    self._line(painter, edges * UP, "selected", 1.5)

    def _draw_camera(self, painter: QPainter, solved: SolvedCamera) -> None:
        """The path, its worst frames in red, and the camera of the frame with its picture."""
        path = path_up(solved)
        if len(path) > 1:
            self._line(painter, path, "accent", 1.5)
        xy, depth = self._seen(path)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(_tone("trouble"))
        for row in np.flatnonzero((grades(solved.by_frame) > 0) & (depth > 0.0)):
            painter.drawEllipse(QPointF(*xy[row]), 3.0, 3.0)
        plate = self.plate
        assert plate is not None
        frame = round(self._desk.workspace.frame) - plate.offset
        corners = frustum_up(solved, frame)
        if corners is None:
            return
        xy, depth = self._seen(corners)
        if (depth <= 0.0).any():
            return
        image = self._picture(plate, frame)
        if image is not None:
            to = QPolygonF([QPointF(x, y) for x, y in xy[1:].tolist()])
            wide, tall = image.width(), image.height()
            of = QPolygonF([QPointF(0, 0), QPointF(wide, 0), QPointF(wide, tall), QPointF(0, tall)])
            way = QTransform()
            if QTransform.quadToQuad(of, to, way):
                painter.save()
                painter.setOpacity(0.85)
                painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
                painter.setTransform(way)
                painter.drawImage(0, 0, image)
                painter.restore()
        for k in range(1, 5):
            self._line(painter, corners[[0, k]], "plain", 1.0)
        self._line(painter, corners[[1, 2, 3, 4, 1]], "plain", 1.0)

    def _draw_points(self, painter: QPainter, solved: SolvedCamera) -> None:
        """Points in the colour of their error with the ellipses of their covariance; chosen ones are ringed."""
        xy, depth = self.places()
        inside = (depth > 0.0) & (np.abs(xy) < 1e5).all(axis=1)
        grade, chosen = grades(solved.errors), np.isin(solved.track_ids, self._desk.document.track_selection)
        for level, tone in enumerate(("good", "accent", "trouble")):
            colour = _tone(tone)
            rows = np.flatnonzero(inside & (grade == level))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(_tone(tone, 0.6), 1.0))
            if len(solved.spread):
                self._draw_ellipses(painter, solved, rows, xy)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(colour)
            for row in rows:
                painter.drawEllipse(QPointF(*xy[row]), 2.5, 2.5)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(_tone("selected"), 2.0))
        for row in np.flatnonzero(inside & chosen):
            painter.drawEllipse(QPointF(*xy[row]), 6.0, 6.0)

    def _draw_ellipses(self, painter: QPainter, solved: SolvedCamera, rows: NDArray[np.intp], xy: Array) -> None:
        """Three standard deviations of points, as they are seen."""
        spread, points = spreads_up(solved), points_up(solved)
        step = 1e-4 * object_size(solved)
        for row in rows:
            beside, _ = self._seen(points[row] + step * np.eye(3))
            slope = (beside - xy[row]).T / step  # (2, 3) pixels for a metre
            values, axes = np.linalg.eigh(slope @ spread[row] @ slope.T)
            long, short = SIGMAS * math.sqrt(max(float(values[1]), 0.0)), SIGMAS * math.sqrt(max(float(values[0]), 0.0))
            if long < LEAST_ELLIPSE or long > 4 * self.width():
                continue
            painter.save()
            painter.translate(QPointF(*xy[row]))
            painter.rotate(math.degrees(math.atan2(float(axes[1, 1]), float(axes[0, 1]))))
            painter.drawEllipse(QPointF(0.0, 0.0), long, short)
            painter.restore()

    def _draw_words(self, painter: QPainter, solved: SolvedCamera) -> None:
        look, words = look_of(), self.about
        box = QRectF(0.0, self.height() - look.row, self.width(), look.row)
        painter.fillRect(box, QColor.fromRgbF(*GROUND, 0.8))
        painter.setPen(_tone("plain"))
        painter.drawText(box.adjusted(8, 0, -8, 0), Qt.AlignmentFlag.AlignVCenter, words)

    @property
    def about(self) -> str:
        """What is under the pointer, else what is seen."""
        solved, hover = self.solved, self._hover
        if solved is None:
            return NOTHING
        if hover is None or hover >= len(solved.points):
            length = float(np.linalg.norm(np.diff(path_up(solved), axis=0), axis=1).sum())
            ellipses = "   ellipses: 3 sigma" if len(solved.spread) else ""
            return f"{len(solved.points)} points   path {length:.3g} m{ellipses}"
        track = next((t for t in self._desk.document.tracks if t.id == solved.track_ids[hover]), None)
        name = "a track that is gone" if track is None else track.name
        sure = f"   known to {sigma_of(solved, hover):.2g} m" if len(solved.spread) else ""
        return f"{name}   error {solved.errors[hover]:.2f} px{sure}"

    def _line(self, painter: QPainter, points: Array, tone: str, width: float, opacity: float = 1.0) -> None:
        """A line through points (N, 3), the part of it that is before the eye."""
        ends = _before(self.camera, points)
        painter.setPen(QPen(_tone(tone, opacity), width))
        for pair in ends:
            xy, _ = self._seen(pair)
            painter.drawLine(QPointF(*xy[0]), QPointF(*xy[1]))

    def _seen(self, points: Array) -> tuple[Array, Array]:
        if not len(points):
            return np.zeros((0, 2)), np.zeros(0)
        seen = project(self.camera, points, self.width(), self.height())
        return seen.xy + 0.5, seen.depth

    def _picture(self, plate: Plate, frame: int) -> QImage | None:
        pixels = self._screen.pixels(plate, frame)
        if pixels is None:
            return None
        if pixels is not self._pixels:
            small = np.ascontiguousarray(pixels[::2, ::2]) if pixels.shape[1] > 1200 else pixels
            tall, wide = small.shape[:2]
            self._image = QImage(small.tobytes(), wide, tall, 3 * wide, QImage.Format.Format_RGB888).copy()
            self._pixels = pixels
        return self._image


def _all_of(solved: SolvedCamera) -> Array:
    """Points and path, without the farthest, which are no part of the set."""
    points = points_up(solved)
    far = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    return np.vstack([points[far <= 3.0 * np.median(far)], path_up(solved)])


def _before(camera: Camera, points: Array) -> Array:
    """(M, 2, 3) pieces of a line through points (N, 3), cut off at the plane a little before the eye."""
    ends = np.stack([points[:-1], points[1:]], axis=1)
    depth = (ends - camera.position) @ camera.forward
    near = max(1e-3 * float(np.abs(depth).max(initial=0.0)), 1e-9)
    kept = ends[(depth > near).any(axis=1)].copy()
    depth = depth[(depth > near).any(axis=1)]
    for k in (0, 1):
        behind = depth[:, k] < near
        share = (near - depth[behind, k]) / (depth[behind, 1 - k] - depth[behind, k])
        kept[behind, k] += share[:, None] * (kept[behind, 1 - k] - kept[behind, k])
    return kept


def _tone(name: str, opacity: float = 1.0) -> QColor:
    colour = QColor(*TONES[name])
    colour.setAlphaF(opacity)
    return colour
