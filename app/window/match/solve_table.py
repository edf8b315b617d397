"""Which tracks and frames a solve misses most: error, share of the whole, how sure the point is, and what leaving it
out would do to the rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTreeWidget, QTreeWidgetItem, QWidget

from app.window.theme import look_of
from core.document import Document
from core.match.solved import SolvedCamera
from core.match.solved_scene import sigma_of

_ROLE = Qt.ItemDataRole.UserRole
HEADERS = ("", "error", "share", "sigma", "then")
TOLD = (
    "A track or a frame, the worst first; a click goes there.",
    "How far it is off, RMS in pixels.",
    "Its share of the sum of all squared errors.",
    "How well the point is known along its worst axis, one standard deviation, in metres of the solved world.",
    "RMS in pixels that the rest is foretold to have without it; empty where that would change nothing worth a look.",
)
TRACKS, FRAMES = 6, 3


class Worst(NamedTuple):
    """A row. track_id : 0 of a frame. frame : None of a track. share : 0 .. 1. sigma, without : 0 where unknown."""

    name: str
    track_id: int
    frame: int | None
    error: float
    share: float
    sigma: float
    without: float


class SolveTable(QTreeWidget):
    """Rows of :func:`worst_of`. chosen : a :class:`Worst` that was clicked."""

    chosen = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setHeaderLabels(list(HEADERS))
        for column, words in enumerate(TOLD):
            self.headerItem().setToolTip(column, words)
        self.setRootIsDecorated(False)
        self.setUniformRowHeights(True)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setAccessibleName("Worst tracks and frames")
        head = self.header()
        head.setStretchLastSection(False)
        head.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        head.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        self.itemClicked.connect(lambda entry: self.chosen.emit(entry.data(0, _ROLE)))

    @property
    def row(self) -> Worst | None:
        """The row that is selected."""
        entries = self.selectedItems()
        return entries[0].data(0, _ROLE) if entries else None

    def show_rows(self, rows: tuple[Worst, ...]) -> None:
        """Show these."""
        self.clear()
        for one in rows:
            cells = (one.name, f"{one.error:.2f}", f"{100.0 * one.share:.0f} %",
                     f"{one.sigma:.2g}" if one.sigma else "", f"{one.without:.3f}" if one.without else "")
            entry = QTreeWidgetItem(list(cells))
            entry.setData(0, _ROLE, one)
            for column in range(1, len(HEADERS)):
                entry.setTextAlignment(column, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                entry.setToolTip(column, TOLD[column])
            self.addTopLevelItem(entry)
        look = look_of()
        tall = self.sizeHintForRow(0) if rows else look.row
        self.setFixedHeight(self.header().sizeHint().height() + len(rows) * tall + 2 * self.frameWidth() + 2)


def worst_of(solved: SolvedCamera, document: Document) -> tuple[Worst, ...]:
    """The tracks, then the frames, that the solve misses most."""
    tracks = {track.id: track for track in document.tracks}
    without = {(one.track_id, one.frame): one.without for one in solved.advice}
    seen = np.array([np.isin(tracks[i].frames, solved.frames).sum() if i in tracks else 0
                     for i in solved.track_ids.tolist()], np.float64)
    weight = seen * solved.errors**2
    found = []
    for row in np.argsort(-solved.errors, kind="stable")[:TRACKS]:
        track = tracks.get(int(solved.track_ids[row]))
        if track is None:
            continue
        found.append(Worst(track.name, track.id, None, float(solved.errors[row]),
                           float(weight[row] / max(weight.sum(), 1e-30)), sigma_of(solved, int(row)),
                           without.get((track.id, None), 0.0)))
    squares = solved.by_frame**2
    for row in np.argsort(-solved.by_frame, kind="stable")[:FRAMES]:
        frame = int(solved.frames[row])
        found.append(Worst(f"fr. {frame}", 0, frame, float(solved.by_frame[row]),
                           float(squares[row] / max(squares.sum(), 1e-30)), 0.0, without.get((0, frame), 0.0)))
    return tuple(found)
