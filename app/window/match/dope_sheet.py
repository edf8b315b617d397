"""The dope sheet of tracks: a row for every track over the timeline, coloured by how good each frame is."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPoint, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QHelpEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QAbstractScrollArea, QSizePolicy, QToolTip, QWidget

from app.window.desk import Desk
from app.window.match.marks import GOOD, POOR, UNLIKE
from app.window.theme import Look, look_of, text_font
from app.window.timeline.curve_view import diamond
from core.document import Document
from core.match.track import Track, badness_of, errors_of
from core.workspace import Workspace
from tools.match_edits import select_tracks, shown_plate

ROWS = 7  # that it is high at first
TONES = ("cached", "accent", "trouble")  # of good, doubtful and poor frames
NAMED = 140.0  # pixels of names at least; where the ruler leaves less, they stand over the frames


class DopeSheet(QAbstractScrollArea):
    """Tracks of the plate in view, by the frame they begin on; `ruler` says where the frames stand.

    Click selects a track (Shift adds or takes away) and goes to the frame, a drag scrubs.
    """

    def __init__(self, desk: Desk, ruler: QWidget, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._desk, self._ruler = desk, ruler
        self._tracks: tuple[Track, ...] = ()
        self._offset = 0  # of the plate
        self.setAccessibleName("Dope sheet of tracks")
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setFrameShape(QAbstractScrollArea.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        desk.changed.connect(self._document_changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)
        self.refresh()

    def sizeHint(self) -> QSize:
        return QSize(400, round(ROWS * self._row(look_of())))

    def minimumSizeHint(self) -> QSize:
        return QSize(200, round(2 * self._row(look_of())))

    def refresh(self) -> None:
        """Show the tracks on the desk."""
        plate = shown_plate(self._desk.document)
        self._offset = 0 if plate is None else plate.offset
        found = [t for t in self._desk.document.tracks if plate is not None and t.plate_id == plate.id]
        self._tracks = tuple(sorted(found, key=lambda t: (int(t.frames[0]) if len(t.frames) else 0, t.name)))
        self._measure()
        self.viewport().update()

    def row_at(self, y: float) -> Track | None:
        """The track whose row is at a height."""
        row = int((y + self.verticalScrollBar().value()) // self._row(look_of()))
        return self._tracks[row] if 0 <= row < len(self._tracks) else None

    def x_of(self, frame: float) -> float:
        """Where a frame of the timeline stands."""
        return float(self._ruler.scale.x_of(frame)) + self._left()  # type: ignore[attr-defined]

    def frame_at(self, x: float) -> int:
        """The frame of the timeline nearest to a place."""
        return int(self._ruler.scale.frame_at(x - self._left()))  # type: ignore[attr-defined]

    # -- the hand --------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton:
            return
        track = self.row_at(event.position().y())
        if track is not None:
            chosen = self._desk.document.track_selection
            if event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
                ids = tuple(i for i in chosen if i != track.id) if track.id in chosen else (*chosen, track.id)
            else:
                ids = (track.id,)
            if ids != chosen:
                self._desk.edit("Select tracks", select_tracks, ids)
        if event.position().x() >= self.x_of(self._desk.document.first_frame) - look_of().text:
            self._go(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._go(event)

    def viewportEvent(self, event: object) -> bool:
        if isinstance(event, QHelpEvent):
            track = self.row_at(event.pos().y())
            QToolTip.showText(event.globalPos(), "" if track is None else self._words(track, event.pos()), self)
            return True
        return bool(super().viewportEvent(event))  # type: ignore[arg-type]

    def resizeEvent(self, event: object) -> None:
        self._measure()

    def _go(self, event: QMouseEvent) -> None:
        self._desk.set_workspace(frame=float(self.frame_at(event.position().x())))

    def _words(self, track: Track, place: QPoint) -> str:
        frame = self.frame_at(place.x()) - self._offset
        at = np.flatnonzero(track.frames == frame)
        if not at.size:
            return f"{track.name} is not seen on frame {frame}."
        key = ", a key" if (track.keys[:, 0] == frame).any() else ""
        return (f"{track.name} on frame {frame}{key}: error {errors_of(track)[at[0]]:.3f} px, "
                f"likeness {track.score[at[0]]:.2f}.")

    # -- the picture -----------------------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self.viewport())
        painter.setFont(text_font(look, look.small))
        row, top = self._row(look), self.verticalScrollBar().value()
        if not self._tracks:
            painter.setPen(look.theme.colour("dim"))
            painter.drawText(self.viewport().rect(), Qt.AlignmentFlag.AlignCenter, "No tracks on this plate yet.")
        first = max(int(top // row), 0)
        for k in range(first, min(first + int(self.viewport().height() // row) + 2, len(self._tracks))):
            self._paint_row(painter, look, self._tracks[k], k * row - top, row)
        x = self.x_of(self._desk.workspace.frame)
        painter.fillRect(QRectF(round(x), 0.0, 1.0, float(self.viewport().height())), look.theme.colour("accent"))
        painter.end()

    def _paint_row(self, painter: QPainter, look: Look, track: Track, y: float, row: float) -> None:
        theme, middle = look.theme, y + 0.5 * row
        wide = max(self.x_of(self._desk.document.first_frame) - 2.0 * look.grid, NAMED)
        if track.id in self._desk.document.track_selection:
            painter.fillRect(QRectF(0.0, y, float(self.viewport().width()), row), theme.colour("hover"))
        step = abs(self.x_of(1.0) - self.x_of(0.0))
        half = min(0.5 * step, float(look.text))  # few frames are far apart, and a bar is about its frame
        painter.setPen(Qt.PenStyle.NoPen)
        tones = tones_of(track)
        cuts = np.flatnonzero((np.diff(track.frames) > 1) | (np.diff(tones) != 0)) + 1
        for frames, tone in zip(np.split(track.frames, cuts), np.split(tones, cuts), strict=True):
            if len(frames):
                left = self.x_of(int(frames[0]) + self._offset) - half
                painter.fillRect(QRectF(left, middle - 3.0, max(1.0, step * (len(frames) - 1) + 2.0 * half), 6.0),
                                 theme.colour(TONES[int(tone[0])], 0.35 if track.hidden else 0.9))
        painter.setBrush(theme.colour("text"))
        for frame in track.keys[:, 0]:
            painter.drawPolygon(diamond(QPointF(self.x_of(frame + self._offset) + 0.5, middle), 4.0))
        painter.setPen(theme.colour("dim" if track.hidden or track.locked else "text"))
        state = " (locked)" if track.locked else " (hidden)" if track.hidden else ""
        name = painter.fontMetrics().elidedText(f"{track.name}{state}", Qt.TextElideMode.ElideRight, int(wide))
        painter.drawText(QRectF(float(look.grid), y, wide, row), Qt.AlignmentFlag.AlignVCenter, name)

    def _row(self, look: Look) -> float:
        return float(look.small + look.grid + 2)

    def _left(self) -> float:
        """Where the ruler begins, seen from here."""
        here = self.viewport().mapTo(self.window(), QPoint(0, 0)).x()
        return float(self._ruler.mapTo(self._ruler.window(), QPoint(0, 0)).x() - here)

    def _measure(self) -> None:
        whole, high = round(self._row(look_of()) * len(self._tracks)), self.viewport().height()
        self.verticalScrollBar().setRange(0, max(whole - high, 0))
        self.verticalScrollBar().setPageStep(high)
        self.verticalScrollBar().setSingleStep(round(self._row(look_of())))

    def _document_changed(self, old: Document, new: Document) -> None:
        if old.tracks is not new.tracks or old.plates is not new.plates:
            self.refresh()
        elif old.track_selection != new.track_selection or old.first_frame != new.first_frame \
                or old.last_frame != new.last_frame:
            self.viewport().update()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.frame != new.frame:
            self.viewport().update()


def tones_of(track: Track) -> np.ndarray:
    """(F,) 0 for good frames of a track, 1 for doubtful ones, 2 for poor ones, by the bounds of the marks."""
    errors = errors_of(track)
    poor = (errors > POOR) | (track.score < UNLIKE)
    return np.where(poor, 2, np.where((errors > GOOD) | (badness_of(track) > POOR), 1, 0)).astype(np.int8)
