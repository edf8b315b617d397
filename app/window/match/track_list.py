"""The tracks of the plate in view, the worst first: where each is seen and keyed, how sure it is, and its curves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, QSize, Qt
from PySide6.QtGui import QMouseEvent, QPainter
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QLabel,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from app.window.desk import Desk
from app.window.fields.choice_bar import ChoiceBar
from app.window.match.marks import GOOD, POOR, UNLIKE
from app.window.match.shape_list import ShapeList
from app.window.pose.graph import Graph, Line
from app.window.sections import Row
from app.window.theme import look_of
from core.document import Document
from core.field import Field
from core.image.plate import Plate
from core.match.track import Track, badness_of, errors_of
from core.workspace import Workspace
from tools.match_edits import select_tracks, selected_tracks, shown_plate

MOST_ROWS = 8  # so that the curves below are in view on a small screen
MARGIN = 3  # pixels beside the spans
ROLE = Qt.ItemDataRole.UserRole
HEADS = ("Track", "Error", "Like", "Seen")
TO_THE_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
TIPS = (
    "Tracks of the plate, the worst first. A click selects one and goes to its worst frame.",
    "The largest error the track foretells of itself, in pixels of the plate.",
    "How like its key the pattern is on the worst frame, from 0 to 1.",
    "Where along the plate the track is seen; its keys are brighter. A click goes to that frame.",
)
CURVES = ("motion", "speed", "error", "likeness")
_GRAPH = Field("Curve", "What is plotted of the active track over the frames; a click goes to a frame.")


class TrackList(QWidget):
    """List and curves."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.said = QLabel()
        self.said.setWordWrap(True)
        self.said.setEnabled(False)
        self.list = _Tracks()
        self.kind = ChoiceBar(_GRAPH, CURVES[0], CURVES[0], CURVES, CURVES)
        self.graph = Graph()
        self.graph.setToolTip("The active track over the frames of the plate. Click goes to a frame.")
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        self.shapes = ShapeList(desk)
        for widget in (self.said, self.list, self.shapes, Row(_GRAPH.label, self.kind), self.graph):
            column.addWidget(widget)
        self._filling = False
        self._seen: tuple[object, ...] = ()
        self.list.itemSelectionChanged.connect(self._selected)
        self.list.itemClicked.connect(self._clicked)
        self.kind.edited.connect(lambda value, final: self.plot())
        self.graph.pointed.connect(self._pointed)
        desk.changed.connect(self._document_changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)
        self.refresh()

    def showEvent(self, event: object) -> None:
        super().showEvent(event)  # type: ignore[arg-type]
        self.refresh()

    def refresh(self) -> None:
        """Show the tracks on the desk."""
        document = self.desk.document
        if self.desk.session.stroking:
            return
        seen = (document.tracks, document.plates)
        if len(seen) == len(self._seen) and all(a is b for a, b in zip(seen, self._seen, strict=True)):
            self._filling = True  # the rows stay: one of them may be under a press of the hand
            try:
                self.list.choose(document.track_selection)
            finally:
                self._filling = False
            self.plot()
            return
        self._seen = seen
        plate = shown_plate(document)
        tracks = [t for t in document.tracks if plate is not None and t.plate_id == plate.id]
        self.said.setVisible(not tracks)
        self.said.setText(
            "No plate yet. Open a sequence or a movie from the File menu, or drop its folder on the window."
            if plate is None else
            "No tracks yet. Click a corner on the plate and track it forward, or let the program find features.")
        self.list.setVisible(bool(tracks))
        self._filling = True
        try:
            if plate is not None:
                self.list.fill(plate, sorted(tracks, key=badness, reverse=True), document.track_selection)
        finally:
            self._filling = False
        self.plot()

    def plot(self) -> None:
        """The curves of the active track."""
        tracks = selected_tracks(self.desk.document)
        plate = shown_plate(self.desk.document)
        if not tracks or plate is None or len(tracks[-1].frames) < 2:
            self.graph.show_words("Select a track that is seen on several frames to see its curves.")
            return
        track, kind = tracks[-1], str(self.kind.value())
        frames = track.frames.astype(np.float64) + plate.offset
        by = track.points - track.points[0]
        if kind == "motion":
            lines = [Line("x", frames, by[:, 0]), Line("y", frames, by[:, 1])]
        elif kind == "speed":
            steps = np.diff(track.points, axis=0) / np.diff(frames)[:, None]
            lines = [Line("pixels a frame", frames[1:], np.hypot(steps[:, 0], steps[:, 1]))]
        elif kind == "error":
            lines = [Line(track.name, frames, errors_of(track))]
        else:
            lines = [Line(track.name, frames, track.score)]
        marks = [(float(f + plate.offset), "key") for f in track.keys[:, 0]] if len(track.keys) <= 8 else []
        up = "likeness" if kind == "likeness" else "px"
        self.graph.show_lines(lines, "frame", up, self.desk.workspace.frame, marks)

    def _selected(self) -> None:
        if not self._filling:
            ids = tuple(int(item.data(0, ROLE)) for item in self.list.selectedItems())
            self.desk.edit("Select tracks", select_tracks, ids)

    def _clicked(self, item: QTreeWidgetItem, place: int) -> None:
        plate = shown_plate(self.desk.document)
        track = next((t for t in self.desk.document.tracks if t.id == item.data(0, ROLE)), None)
        if plate is not None and place == len(HEADS) - 1:
            self.desk.set_workspace(frame=float(self.list.frame_pressed(plate) + plate.offset))
        elif plate is not None and track is not None and len(track.frames):
            worst = int(track.frames[int(np.argmax(badness_of(track)))])
            self.desk.set_workspace(frame=float(worst + plate.offset))

    def _pointed(self, frame: float) -> None:
        self.desk.set_workspace(frame=float(round(frame)))

    def _document_changed(self, old: Document, new: Document) -> None:
        if old.tracks is not new.tracks or old.plates is not new.plates or old.track_selection != new.track_selection:
            self.refresh()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.frame != new.frame:
            self.graph.mark(new.frame)


class _Tracks(QTreeWidget):
    """Rows of tracks, as high as what is in it, up to eight."""

    def __init__(self) -> None:
        super().__init__()
        self._pressed = 0.0
        self._chosen: tuple[int, ...] = ()
        self.setRootIsDecorated(False)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.setUniformRowHeights(True)
        self.setAccessibleName("Tracks")
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # after a click the keys still go to the plate
        self.setHeaderLabels(HEADS)
        for place, words in enumerate(TIPS):
            self.headerItem().setToolTip(place, words)
        self.setItemDelegateForColumn(len(HEADS) - 1, _Spans(self))
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        head = self.header()
        head.setStretchLastSection(False)  # by its mode, for alone it keeps its first width beside a scroll bar
        head.setMinimumSectionSize(30)
        head.setSectionResizeMode(len(HEADS) - 1, QHeaderView.ResizeMode.Stretch)
        for place in range(len(HEADS) - 1):
            head.setSectionResizeMode(place, QHeaderView.ResizeMode.ResizeToContents)

    def sizeHint(self) -> QSize:
        rows = min(max(self.topLevelItemCount(), 1), MOST_ROWS) + 1
        return QSize(180, rows * (look_of().row + 1) + 6)

    minimumSizeHint = sizeHint

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._pressed = event.position().x()
        super().mousePressEvent(event)

    def frame_pressed(self, plate: Plate) -> int:
        """The frame of the plate where the hand pressed in the column that shows where tracks are seen."""
        last = len(HEADS) - 1
        left = self.columnViewportPosition(last) + MARGIN
        share = (self._pressed - left) / max(self.columnWidth(last) - 2 * MARGIN, 1)
        return min(max(plate.first + int(share * len(plate.frames)), plate.first), plate.last)

    def fill(self, plate: Plate, tracks: list[Track], chosen: tuple[int, ...]) -> None:
        """Show these tracks in this order."""
        theme = look_of().theme
        self.clear()
        items = []
        for track in tracks:
            error, score = worst_of(track)
            state = " (locked)" if track.locked else " (hidden)" if track.hidden else ""
            item = QTreeWidgetItem([f"{track.name}{state}", f"{error:.2f}", f"{score:.2f}"])
            count = len(track.keys)
            item.setToolTip(0, f"{track.name}: seen on {len(track.frames)} of {len(plate.frames)} frames, "
                               f"{count} {'key' if count == 1 else 'keys'}. A click goes to its worst frame.")
            item.setData(0, ROLE, track.id)
            item.setData(len(HEADS) - 1, ROLE, (track, plate))
            for place, poor in ((1, error > POOR), (2, score < UNLIKE)):
                item.setTextAlignment(place, TO_THE_RIGHT)
                if poor:
                    item.setForeground(place, theme.colour("trouble_text"))
            items.append(item)
        self.addTopLevelItems(items)
        self._chosen = chosen  # the worst stay in view, wherever the active one stands
        self.choose(chosen)
        self.updateGeometry()

    def choose(self, chosen: tuple[int, ...]) -> None:
        """Show these tracks as selected; a new active one, the last, is brought into view, never under the hand."""
        another, self._chosen = chosen != self._chosen and not self.underMouse(), chosen
        for row in range(self.topLevelItemCount()):
            item = self.topLevelItem(row)
            item.setSelected(item.data(0, ROLE) in chosen)
            if another and chosen and item.data(0, ROLE) == chosen[-1]:
                self.scrollToItem(item)


class _Spans(QStyledItemDelegate):
    """Draws where along the plate a track is seen, and its keys."""

    def paint(
        self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        super().paint(painter, option, index)
        found = index.data(ROLE)
        if not found:
            return
        track, plate = found
        theme, box = look_of().theme, QRectF(option.rect).adjusted(MARGIN, 0, -MARGIN, 0)  # type: ignore[attr-defined]
        count = max(1, plate.last - plate.first + 1)
        painter.save()
        painter.setPen(Qt.PenStyle.NoPen)
        middle = box.center().y()
        painter.setBrush(theme.colour("cached" if badness(track) < GOOD + 0.3 else "trouble"))
        for run in np.split(track.frames, np.flatnonzero(np.diff(track.frames) > 1) + 1):
            if len(run):
                left = box.left() + box.width() * (int(run[0]) - plate.first) / count
                wide = max(1.5, box.width() * len(run) / count)
                painter.drawRect(QRectF(left, middle - 2.0, wide, 4.0))
        painter.setBrush(theme.colour("accent"))
        for frame in track.keys[:, 0]:
            at = box.left() + box.width() * (float(frame) - plate.first + 0.5) / count
            painter.drawRect(QRectF(at - 1.5, middle - 4.5, 3.0, 9.0))
        painter.restore()


def worst_of(track: Track) -> tuple[float, float]:
    """The largest error in pixels that a track foretells, and its least likeness."""
    if not len(track.frames):
        return 0.0, 1.0
    errors: NDArray[np.float64] = errors_of(track)
    return float(errors.max()), float(track.score.min())


def badness(track: Track) -> float:
    """How bad a track is on its worst frame."""
    return float(badness_of(track).max(initial=0.0))
