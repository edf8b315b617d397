"""Solving the plate in view as a job, with one step of history at its end; again after edits where that is wanted."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer, Signal

from app.window.desk import Desk
from app.window.jobs import Asked, Cancelled, Job, Progress
from core.document import Document
from core.errors import UserError
from core.match.solved import SolvedCamera, SolveSettings
from tools.match_edits import shown_plate
from tools.solve_edits import put_solve, solved_camera, solved_of, tracks_to_solve

STEP = "Solve camera"
PATIENCE = 800  # ms of quiet after an edit before it is solved again
STAGES = 8  # words the solver says of what it does


class SolveJob(QObject):
    """settings : what the next solve is told. changed : they are others, or a solve has begun or ended."""

    changed = Signal()

    def __init__(self, desk: Desk) -> None:
        super().__init__(desk)
        self.desk = desk
        self.job: Job | None = None
        self.settings = SolveSettings()
        self._stale = QTimer(self)
        self._stale.setSingleShot(True)
        self._stale.setInterval(PATIENCE)
        self._stale.timeout.connect(self._solve_again)
        desk.jobs.changed.connect(self._let_go)
        desk.changed.connect(self._document_changed)
        desk.session_replaced.connect(self._session_replaced)

    @property
    def running(self) -> bool:
        """True while a solve goes on."""
        return self.job is not None

    def set_settings(self, settings: SolveSettings) -> None:
        """Take what the next solve is told."""
        self.settings = settings
        self.changed.emit()

    def solve(self) -> None:
        """Solve the plate in view from its tracks that are not hidden; what goes wrong is said as an error."""
        self._start(self.desk.error)

    def _start(self, refused: Callable[[Exception], None]) -> None:
        """Begin a solve.

        Raises
        ------
        UserError
            There is no plate, no track, or a solve goes on already.
        """
        plate = shown_plate(self.desk.document)
        if plate is None:
            raise UserError("There is no plate to solve; open one from the File menu, or drop its folder here.")
        if self.running:
            raise UserError("The camera is being solved; wait for it, or cancel that first.")
        tracks, settings = tracks_to_solve(self.desk.document, plate.id), self.settings

        def work(progress: Progress, cancelled: Asked) -> SolvedCamera:
            said = 0

            def words(said_now: str) -> None:
                nonlocal said
                if cancelled():
                    raise Cancelled
                if said_now:
                    said += 1
                    progress(min(0.95, said / STAGES))

            return solved_camera(plate, tracks, settings, words)

        def done(found: SolvedCamera) -> None:
            if self.job is not job:
                return  # it was cancelled at its last step
            self.job = None
            if any(p.id == plate.id for p in self.desk.document.plates) and self.desk.edit(STEP, put_solve, found):
                self.desk.said.emit(
                    f"{len(found.frames)} cameras ({found.kind}), {len(found.points)} points: median "
                    f"{found.median:.2f} px, RMS {found.rms:.2f} px.")
            self.changed.emit()

        def failed(error: Exception) -> None:
            if self.job is not job:
                return
            self.job = None
            self.changed.emit()
            refused(error)

        self.job = job = self.desk.jobs.start(STEP, work, done, failed, self)
        self.changed.emit()

    def _let_go(self) -> None:
        """A solve that was told to stop is over at once for the hand; its thread ends at its next step."""
        if self.job is not None and self.job.stopping:
            self.job = None
            if not self._stale.isActive():
                self.desk.said.emit("The solve was cancelled; the camera is as before.")
            self.changed.emit()

    def _document_changed(self, old: Document, new: Document) -> None:
        plate = shown_plate(new)
        if plate is None or not self.settings.again or solved_of(new, plate.id) is None:
            return
        if self.desk.session.history.redo_name is not None:
            return  # an undo: another step now would take its redo away
        before, now = tracks_to_solve(old, plate.id), tracks_to_solve(new, plate.id)
        if len(before) != len(now) or any(a is not b for a, b in zip(before, now, strict=True)):
            self._stale.start()
            if self.job is not None:  # it solves what is no more
                self.desk.jobs.cancel(self.job)

    def _solve_again(self) -> None:
        if self.desk.session.stroking:
            self._stale.start()
        elif not self.running:
            self.desk.attempt(self._start, self._say)

    def _say(self, error: Exception) -> None:
        """In the background a refusal is no error: the hand is in the middle of mending."""
        if isinstance(error, UserError):
            self.desk.said.emit(f"The camera stays as it was: {error}")
        else:
            self.desk.error(error)

    def _session_replaced(self) -> None:
        self._stale.stop()
        plate = shown_plate(self.desk.document)
        solved = None if plate is None else solved_of(self.desk.document, plate.id)
        self.settings = SolveSettings() if solved is None else solved.settings
        self.changed.emit()
