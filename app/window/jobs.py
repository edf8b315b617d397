"""Slow work beside the window: worker threads that see plain data only, and a bar that shows and cancels it.

Nothing is called across threads. A worker puts what it has to say into a queue and wakes the thread of the window by a
queued signal of one bridge object; whoever runs on the thread of the window empties the queue. (PySide from 6.8 dies of
callbacks that another thread lets go of; see PYSIDE-3124.)

USD is loaded here, before there is any worker: it lets other threads run while the system loads it, and one that then
loads a library of its own waits for USD, and USD for it, for ever.
"""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue
from typing import Any, Protocol

import pxr.Kind
import pxr.UsdShade
import pxr.UsdSkel
import pxr.UsdUtils  # noqa: F401 - these bring the rest of it
from PySide6.QtCore import QObject, Qt, QTimer, Signal, Slot
from PySide6.QtWidgets import QHBoxLayout, QLabel, QProgressBar, QPushButton, QWidget
from shiboken6 import isValid

from app.window.theme import look_of
from core.errors import UserError

SHOWN_AFTER = 500  # ms; what is done sooner never appears
POLL = 0.1  # s between two looks of a waiting worker at whether it was cancelled

Progress = Callable[[float], None]
Asked = Callable[[], bool]  # True after a cancel


class Cancelled(Exception):
    """Raised inside a job that was cancelled; its text, if any, says what is kept of it."""


class Job:
    """One piece of work. Its fields are read on the thread of the window only, apart from `stop`.

    name : what it does, for a person. fraction : done of it, 0 .. 1, or -1 while nobody knows. stop : set to cancel it.
    """

    def __init__(
        self, name: str, done: Callable[[Any], None], failed: Callable[[Exception], None] | None,
        owner: QObject | None = None,
    ) -> None:
        self.name, self.done, self.failed, self.owner = name, done, failed, owner
        self.fraction = -1.0
        self.started = time.monotonic()
        self.stop = threading.Event()
        self.thread: threading.Thread | None = None

    @property
    def stopping(self) -> bool:
        """True after it was cancelled and before it has ended."""
        return self.stop.is_set()


class Listener(Protocol):
    """Who is told what jobs came to: a desk. All of it is called on the thread of the window."""

    said: Any  # a signal

    def attempt(self, function: Callable[..., Any], /, *args: Any, **parameters: Any) -> Any:
        """Call a function; what goes wrong in it is told to the artist."""

    def error(self, error: Exception, details: str = "") -> None:
        """Tell the artist what went wrong, with a longer text to copy."""


class _Bridge(QObject):
    woken = Signal()


class Jobs(QObject):
    """The jobs of one desk. Everything but the functions themselves runs on the thread of the window.

    listener : is told how they ended. parent : of this object.

    changed : a job was started, has got on, was cancelled or has ended.
    """

    changed = Signal()

    def __init__(self, listener: Listener, parent: QObject) -> None:
        super().__init__(parent)
        self._listener = listener
        self._jobs: list[Job] = []
        self._news: SimpleQueue[tuple[Job, str, Any]] = SimpleQueue()
        self._own = threading.local()  # `job` is that of the thread
        self._lock = threading.Lock()  # over _closed and the waking
        self._closed = self._awake = False
        self._bridge = _Bridge(self)
        self._bridge.woken.connect(self._listen, Qt.ConnectionType.QueuedConnection)

    @property
    def running(self) -> tuple[Job, ...]:
        """The jobs that have not ended, oldest first."""
        return tuple(self._jobs)

    def start(
        self,
        name: str,
        function: Callable[[Progress, Asked], Any],
        done: Callable[[Any], None],
        failed: Callable[[Exception], None] | None = None,
        owner: QObject | None = None,
    ) -> Job:
        """Run ``function(progress, cancelled)`` on a thread of its own.

        Parameters
        ----------
        name : what it does, for a person: "Open cat.obj".
        function : works on plain data, never on widgets. ``progress(fraction)`` says how far it is and raises
            :class:`Cancelled` when it was cancelled; ``cancelled()`` only tells.
        done : gets the result on the thread of the window; not called for what was cancelled.
        failed : gets the exception instead, a :class:`Cancelled` too. Without it the desk says what went wrong.
        owner : nothing is delivered any more when this widget is gone.
        """
        job = Job(name, done, failed, owner)
        if self._closed:
            return job
        job.thread = threading.Thread(target=self._work, args=(job, function), name=f"job {name}", daemon=True)
        self._jobs.append(job)
        QTimer.singleShot(SHOWN_AFTER, self, self.changed.emit)
        job.thread.start()
        self.changed.emit()
        return job

    def cancel(self, job: Job) -> None:
        """Tell a job to end. It shows as stopping until it has."""
        job.stop.set()
        self.changed.emit()

    def on_window(self, function: Callable[..., Any], *args: Any) -> Any:
        """Called by the function of a job: run something on the thread of the window and wait for what it gives.

        When it gives an iterator, that is stepped one item at a time between the window's events, and its last item is
        the answer: long drawing stays short slices. Raises what it raised, :class:`Cancelled` when the job is.
        """
        job: Job = self._own.job
        answer: SimpleQueue[tuple[bool, Any]] = SimpleQueue()
        self._tell(job, "call", (function, args, answer))
        while True:
            if job.stopping:
                raise Cancelled
            try:
                good, value = answer.get(timeout=POLL)
            except Empty:
                continue
            if good:
                return value
            raise value

    def close(self, seconds: float = 5.0) -> bool:
        """Cancel everything and wait for it; nothing is delivered any more. True when every thread has ended."""
        with self._lock:
            self._closed = True
        for job in self._jobs:
            job.stop.set()
        end = time.monotonic() + seconds
        for job in self._jobs:
            if job.thread is not None:
                job.thread.join(max(0.0, end - time.monotonic()))
        ended = all(job.thread is None or not job.thread.is_alive() for job in self._jobs)
        self._jobs.clear()
        return ended

    def _work(self, job: Job, function: Callable[[Progress, Asked], Any]) -> None:
        def progress(fraction: float) -> None:
            if job.stopping:
                raise Cancelled
            self._tell(job, "progress", float(fraction))

        self._own.job = job
        try:
            result = function(progress, job.stop.is_set)
        except BaseException as error:  # a SystemExit of some library must not end in silence either
            text = traceback.format_exc()
            error.__traceback__ = None  # its frames hold callbacks, which only the window's thread may let go of
            self._tell(job, "failed", (error, text))
        else:
            self._tell(job, "done", result)
        del self._own.job  # its callbacks are let go of by the window's thread only

    def _tell(self, job: Job, what: str, value: Any) -> None:
        self._news.put((job, what, value))
        with self._lock:
            if not (self._closed or self._awake):
                self._awake = True
                self._bridge.woken.emit()

    @Slot()
    def _listen(self) -> None:
        with self._lock:
            self._awake = False
        news: list[tuple[Job, str, Any]] = []
        while True:
            try:
                news.append(self._news.get_nowait())
            except Empty:
                break
        for job, what, value in news:
            if self._closed:
                return
            if what == "progress":
                job.fraction = min(max(value, 0.0), 1.0)
            elif what == "call":
                self._call(job, *value)
            else:
                self._end(job, what, value)
        if news:
            self.changed.emit()

    def _call(self, job: Job, function: Callable[..., Any], args: tuple[Any, ...], answer: SimpleQueue[Any]) -> None:
        try:
            value = function(*args)
        except Exception as error:
            answer.put((False, error))
            return
        if isinstance(value, Iterator):
            self._step(job, value, None, answer)
        else:
            answer.put((True, value))

    def _step(self, job: Job, steps: Iterator[Any], last: Any, answer: SimpleQueue[Any]) -> None:
        if job.stopping:
            return
        try:
            last = next(steps)
        except StopIteration:
            answer.put((True, last))
        except Exception as error:
            answer.put((False, error))
        else:
            QTimer.singleShot(0, self, lambda: self._step(job, steps, last, answer))

    def _end(self, job: Job, what: str, value: Any) -> None:
        self._jobs.remove(job)
        if job.thread is not None:
            job.thread.join()  # it has nothing left to do
        if job.owner is not None and not isValid(job.owner):
            return
        if what == "done" and not job.stopping:
            self._listener.attempt(job.done, value)
            return
        error, text = value if what == "failed" else (Cancelled(), "")
        if job.failed is not None:
            self._listener.attempt(job.failed, error)
        elif isinstance(error, Cancelled):
            self._listener.said.emit(str(error) or f"{job.name}: cancelled.")
        elif isinstance(error, UserError):
            self._listener.error(error)
        else:
            self._listener.error(
                UserError(f"{job.name} did not work: {error}. This is our fault; copy the details."), text)


class JobsBar(QWidget):
    """Name, bar and Cancel of the job that goes on longest; hidden while nothing takes long."""

    def __init__(self, jobs: Jobs, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._jobs = jobs
        self.name, self.bar, self.stop = QLabel(), QProgressBar(), QPushButton("Cancel")
        self.bar.setTextVisible(False)
        self.bar.setMaximum(1000)
        self.stop.setToolTip("Ends this work; the document stays as it was before it began.")
        self.stop.clicked.connect(self.cancel)
        line = QHBoxLayout(self)
        line.setContentsMargins(0, 0, 0, 0)
        line.setSpacing(8)
        for widget in (self.name, self.bar, self.stop):
            line.addWidget(widget)
        self._jobs.changed.connect(self.refresh)
        self.refresh()

    @property
    def job(self) -> Job | None:
        """The job shown."""
        now = time.monotonic()
        long = (job for job in self._jobs.running if now - job.started >= 0.001 * SHOWN_AFTER - 0.02)
        return next(long, None)

    def cancel(self) -> None:
        """End the job shown."""
        if (job := self.job) is not None:
            self._jobs.cancel(job)

    def refresh(self) -> None:
        """Show the present state."""
        job = self.job
        self.setVisible(job is not None)
        if job is None:
            return
        others = len(self._jobs.running) - 1
        words = f"{job.name}: stopping…" if job.stopping else job.name
        self.name.setText(f"{words}  (and {others} more)" if others else words)
        known = job.fraction >= 0.0
        self.bar.setRange(0, 1000 if known else 0)
        self.bar.setValue(round(1000 * job.fraction) if known else 0)
        look = look_of()
        self.bar.setFixedSize(look.text * 12, look.grid + 2)
        self.stop.setEnabled(not job.stopping)
