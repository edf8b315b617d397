"""The solve of the plate in view: what it is told, how good it is, what may be wrong, and what to mend by a click."""

from __future__ import annotations

from typing import Any

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QListWidget, QListWidgetItem, QPushButton, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.match.error_curve import ErrorCurve
from app.window.match.solve_job import SolveJob
from app.window.match.solve_table import SolveTable, Worst, worst_of
from app.window.params_panel import RecordForm, Setting
from core.match.solved import Advice, SolvedCamera
from core.match.solved_scene import misses
from tools.match_edits import select_tracks, set_tracks, shown_plate
from tools.solve_edits import solved_of

_ROLE = Qt.ItemDataRole.UserRole
MOST_ROWS = 8


class SolvePanel(QWidget):
    """Settings, a button, figures, warnings and advice."""

    def __init__(self, desk: Desk, job: SolveJob, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk, self.job = desk, job
        self.form = RecordForm(job.settings, Setting(unit=desk.document.unit, maps=()))
        self.form.changed.connect(self._edited)
        self.start = QPushButton("Solve camera")
        self.start.setToolTip("Finds the camera of the plate from its tracks; hidden tracks are left out.")
        self.start.clicked.connect(lambda checked=False: desk.attempt(job.solve))
        self.figures, self.warnings = QLabel(), QLabel()
        for label in (self.figures, self.warnings):
            label.setWordWrap(True)
            label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.curve = ErrorCurve()
        self.curve.chosen.connect(self._go_to)
        self.table = SolveTable()
        self.table.chosen.connect(self.follow)
        self.table.itemSelectionChanged.connect(self._choose_row)
        self.space = QPushButton("In space")
        self.space.setToolTip("Shows or hides path, points and camera in space beside the plate.")
        self.advice = QListWidget()
        self.advice.setToolTip("What to mend next, the most helpful first. A click goes to the frame or the track.")
        self.advice.setWordWrap(True)
        self.advice.itemClicked.connect(lambda entry: self.follow(entry.data(_ROLE)))
        self.advice.itemSelectionChanged.connect(self._choose_advice)
        self.without = QPushButton("Leave out and solve")
        self.without.setToolTip("Hides the track of the chosen row or advice and solves again without it.")
        self.without.clicked.connect(lambda checked=False: desk.attempt(self._leave_out))
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        line = QHBoxLayout()
        line.setSpacing(4)
        line.addWidget(self.start)
        line.addWidget(self.space)
        column.addWidget(self.form)
        column.addLayout(line)
        for widget in (self.figures, self.curve, self.warnings, self.table, self.advice, self.without):
            column.addWidget(widget)
        self._seen: tuple[object, ...] = ()
        desk.changed.connect(lambda old, new: self.refresh())
        desk.workspace_changed.connect(lambda old, new: self._mark_frame())
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)
        job.changed.connect(self.refresh)
        self.refresh()

    @property
    def solved(self) -> SolvedCamera | None:
        """The solve of the plate in view."""
        plate = shown_plate(self.desk.document)
        return None if plate is None else solved_of(self.desk.document, plate.id)

    def refresh(self) -> None:
        """Show what is on the desk now."""
        plate, solved = shown_plate(self.desk.document), self.solved
        self._mark_frame()
        seen = (None if plate is None else plate.id, solved, self.job.settings, self.job.running)
        if seen == self._seen or self.desk.session.stroking:
            return
        self._seen = seen
        self.setVisible(plate is not None)
        self.form.set_record(self.job.settings)
        self.start.setEnabled(not self.job.running)
        self.start.setText("Solving ..." if self.job.running else "Solve camera" if solved is None else "Solve again")
        self.figures.setVisible(solved is not None)
        self.curve.setVisible(solved is not None)
        self.warnings.setVisible(solved is not None and bool(solved.warnings))
        self.advice.clear()
        self.advice.setVisible(solved is not None and bool(solved.advice))
        self.without.setVisible(solved is not None)
        self.space.setEnabled(solved is not None)
        self.table.setVisible(solved is not None)
        if solved is not None:
            self.table.show_rows(worst_of(solved, self.desk.document))
            self.figures.setText(figures_of(solved))
            self.warnings.setText("\n".join(solved.warnings))
            for one in solved.advice:
                entry = QListWidgetItem(one.words)
                entry.setData(_ROLE, one)
                self.advice.addItem(entry)
            rows = min(MOST_ROWS, len(solved.advice))
            self.advice.setFixedHeight(2 * self.advice.frameWidth() + rows * 2 * self.advice.fontMetrics().height() + 6)
        self._enable()

    def follow(self, advice: Advice | Worst) -> None:
        """Go to the frame of an advice, or select its track and go to where the solve misses it most."""
        plate, solved = shown_plate(self.desk.document), self.solved
        if plate is None or solved is None:
            return
        frame = advice.frame
        if advice.track_id:
            self.desk.edit("Select tracks", select_tracks, (advice.track_id,))
            track = next((t for t in self.desk.document.tracks if t.id == advice.track_id), None)
            if track is not None and len(track.frames):
                frames, off = misses(solved, track)
                frame = int(frames[np.nanargmax(off)] if np.isfinite(off).any()
                            else track.frames[len(track.frames) // 2])
        if frame is not None:
            self._go_to(frame)

    def _mark_frame(self) -> None:
        plate = shown_plate(self.desk.document)
        if plate is not None:
            self.curve.show_solve(self.solved, round(self.desk.workspace.frame) - plate.offset)

    def _go_to(self, frame: int) -> None:
        plate = shown_plate(self.desk.document)
        if plate is not None:
            self.desk.set_workspace(frame=float(frame + plate.offset))

    @property
    def _chosen(self) -> int:
        """Id of the track that is chosen in the table or in the advice; 0 for none."""
        chosen = self.advice.selectedItems()
        advice: Advice | None = chosen[0].data(_ROLE) if chosen else None
        one = self.table.row or advice
        return 0 if one is None else one.track_id

    def _choose_row(self) -> None:
        if self.table.row is not None:
            self.advice.clearSelection()
        self._enable()

    def _choose_advice(self) -> None:
        if self.advice.selectedItems():
            self.table.clearSelection()
        self._enable()

    def _leave_out(self) -> None:
        track = self._chosen
        if track and self.desk.edit("Hide tracks", set_tracks, (track,), hidden=True):
            self.job.solve()

    def _enable(self) -> None:
        self.without.setEnabled(bool(self._chosen) and not self.job.running)

    def _edited(self, settings: Any, final: bool) -> None:
        self.job.set_settings(settings)


def figures_of(solved: SolvedCamera) -> str:
    """What a solve says of itself: a sentence, and three lines of figures."""
    low, high = float(np.min(solved.focal)), float(np.max(solved.focal))
    focal = f"{low:.1f} px" if high - low < 0.05 else f"{low:.1f} to {high:.1f} px"
    doubt = f" +- {solved.focal_sigma:.1f}" if solved.focal_sigma else ""
    return (
        f"{verdict_of(solved)}\n"
        f"{len(solved.frames)} cameras ({solved.kind}), {len(solved.points)} points\n"
        f"median {solved.median:.2f}   RMS {solved.rms:.2f}   95 % {solved.p95:.2f} px\n"
        f"focal length {focal}{doubt}"
    )


def verdict_of(solved: SolvedCamera) -> str:
    """Why a camera is to be trusted, or that something is to be looked at first."""
    if solved.warnings:
        return "Look at the warnings below before you trust this camera."
    left = sum("left out" in one.words for one in solved.advice)
    out = f"; {left} that did not fit {'is' if left == 1 else 'are'} left out" if left else ""
    return f"The camera holds: {len(solved.points)} points move as one with it{out}."
