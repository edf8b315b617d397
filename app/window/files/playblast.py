"""Playblast: the frames as the view shows them, into numbered pictures or a movie, beside the window."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSpinBox,
    QWidget,
)

from app.movie import MOVIE_SUFFIXES, write_movie, write_sequence
from app.window.fields.combo import Combo
from app.window.files.opening import choose_file, filter_of
from app.window.jobs import Cancelled, Job
from core.document import FRAMES
from core.errors import UserError

if TYPE_CHECKING:
    from app.window.desk import Desk
    from app.window.jobs import Asked, Progress

LARGEST = 8192  # pixels along a side
KINDS = (("Movie (MP4)", ".mp4"), ("Pictures (PNG)", ".png"))

# Draws a frame at a size (width, height); called on the thread of the window, where its OpenGL lives. It gives pixels
# (height, width, 3) uint8 sRGB, or an iterator of slices of the work whose last item are the pixels.
Draw = Callable[[float, tuple[int, int]], "NDArray[np.uint8] | Iterator[object]"]


class Playblast(NamedTuple):
    """What to draw. path : ends in .png for a sequence (#### is the frame), else in .mp4, .mov or .mkv."""

    path: Path
    first: int
    last: int
    size: tuple[int, int]


def start_playblast(desk: Desk, wanted: Playblast, draw: Draw, done: Callable[[], object] = lambda: None) -> Job:
    """Draw and write it as a job. When it is cancelled, what was drawn by then is kept and said.

    Raises
    ------
    UserError
        The file would be of no kind that is known.
    """
    suffix = wanted.path.suffix.lower()
    if suffix != ".png" and suffix not in MOVIE_SUFFIXES:
        raise UserError(f"{wanted.path.name}: end the name in .png for pictures, or in {', '.join(MOVIE_SUFFIXES)}.")
    frames = range(min(wanted.first, wanted.last), max(wanted.first, wanted.last) + 1)
    fps = desk.document.fps

    def work(progress: Progress, cancelled: Asked) -> int:
        finished = 0

        def before(number: int) -> None:
            nonlocal finished
            finished = number
            progress(number / len(frames))

        def picture(frame: float) -> NDArray[np.uint8]:
            pixels: NDArray[np.uint8] = desk.jobs.on_window(draw, frame, wanted.size)
            return pixels

        try:
            if suffix == ".png":
                return len(write_sequence(wanted.path, frames, picture, before))
            return write_movie(wanted.path, frames, fps, picture, before, Cancelled)
        except Cancelled:
            kept = f"{finished} of {len(frames)} frames are kept in {_where(wanted.path)}."
            raise Cancelled(f"Playblast cancelled: {kept if finished else 'nothing was written.'}") from None

    def told(count: int) -> None:
        desk.said.emit(f"Playblast: {count} frames are in {_where(wanted.path)}.")
        done()

    return desk.jobs.start(f"Playblast {wanted.path.name}", work, told)


class PlayblastDialog(QDialog):
    """Asks for file, range and size; stays open beside the work.

    Parameters
    ----------
    draw : draws a frame. size : of the view, proposed.
    """

    def __init__(
        self, desk: Desk, draw: Draw, size: tuple[int, int] = (1280, 720), parent: QWidget | None = None
    ) -> None:
        super().__init__(parent, Qt.WindowType.Tool)
        self._desk, self._draw = desk, draw
        self.job: Job | None = None
        self.setWindowTitle("Playblast")
        document = desk.document
        self.kind = Combo()
        self.kind.addItems([words for words, _ in KINDS])
        self.kind.setToolTip("One movie to send around, or numbered pictures that any program reads.")
        self.first = self._number(*FRAMES, document.first_frame, "The first frame that is drawn.")
        self.last = self._number(*FRAMES, document.last_frame, "The last frame that is drawn.")
        self.width_box = self._number(16, LARGEST, size[0], "Width of the pictures in pixels.")
        self.height_box = self._number(16, LARGEST, size[1], "Height of the pictures in pixels.")
        self.path = QLineEdit(str(self._propose()))
        self.path.setToolTip("Where it goes; #### in the name of pictures stands for the frame.")
        self.browse = QPushButton("Choose…")
        self.browse.setToolTip("Chooses the folder and the name in a file window.")
        self.start = QPushButton("Start")
        self.start.setToolTip("Draws the frames beside your work; the status line shows how far it is and cancels it.")
        self.start.setDefault(True)
        self.browse.clicked.connect(self._choose)
        self.start.clicked.connect(self.begin)
        self.kind.currentIndexChanged.connect(self._change_kind)
        grid = QGridLayout(self)
        grid.setContentsMargins(16, 16, 16, 16)
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(8)
        for row, (label, widgets) in enumerate((
            ("Kind", (self.kind,)), ("Frames", (self.first, QLabel("–"), self.last)),
            ("Size", (self.width_box, QLabel("×"), self.height_box, QLabel("px"))),
            ("File", (self.path, self.browse)),
        )):
            line = QHBoxLayout()
            line.setSpacing(4)
            for widget in widgets:
                line.addWidget(widget, isinstance(widget, QLineEdit | QComboBox | QSpinBox))
            grid.addWidget(QLabel(label), row, 0)
            grid.addLayout(line, row, 1)
        grid.addWidget(self.start, 4, 1, Qt.AlignmentFlag.AlignRight)
        grid.setColumnMinimumWidth(1, 360)

    def begin(self) -> None:
        """Draw it."""
        if self.job is not None and self.job in self._desk.jobs.running:
            self._desk.said.emit("A playblast goes on; cancel it first, or wait for it.")
            return
        wanted = Playblast(Path(self.path.text().strip()), self.first.value(), self.last.value(),
                           (self.width_box.value(), self.height_box.value()))
        job = self._desk.attempt(start_playblast, self._desk, wanted, self._draw)
        self.job = job if isinstance(job, Job) else None

    def _number(self, least: int, most: int, value: int, tooltip: str) -> QSpinBox:
        box = QSpinBox()
        box.setRange(least, most)
        box.setValue(value)
        box.setToolTip(tooltip)
        box.setButtonSymbols(QSpinBox.ButtonSymbols.NoButtons)
        return box

    def _propose(self) -> Path:
        path = self._desk.session.path
        folder, stem = (Path.home(), "playblast") if path is None else (path.parent, path.stem)
        return self._named(folder / stem)

    def _named(self, path: Path) -> Path:
        suffix = KINDS[self.kind.currentIndex()][1]
        return path.with_name(path.name + (".####.png" if suffix == ".png" else suffix))

    def _change_kind(self) -> None:
        path = Path(self.path.text().strip())
        stem = path.name
        for ending in (".####.png", ".png", *MOVIE_SUFFIXES):
            if stem.lower().endswith(ending):
                stem = stem[: -len(ending)]
                break
        self.path.setText(str(self._named(path.with_name(stem or "playblast"))))

    def _choose(self) -> None:
        words, suffix = KINDS[self.kind.currentIndex()]
        choose_file(self, "Playblast", [filter_of(words, (suffix,))], lambda path: self.path.setText(str(path)),
                    save=suffix, start=Path(self.path.text().strip()))


def _where(path: Path) -> str:
    return str(path.parent if path.suffix.lower() == ".png" else path)
