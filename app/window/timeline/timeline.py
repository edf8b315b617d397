"""The timeline: a ruler of frames that is dragged, buttons to play, and fields for range and rate."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPolygonF, QWheelEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QLineEdit, QSizePolicy, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.icons import IconButton
from app.window.pose.key_row import PoseKeyRow
from app.window.theme import Look, look_of, text_font
from app.window.timeline.dope_row import DopeRow
from app.window.timeline.playback import Playback
from app.window.timeline.time_scale import TimeScale
from core.document import Document
from core.workspace import Workspace
from tools.document_edits import set_document
from tools.frames import clip_range

STEPS = (1, 2, 5)  # times a power of ten: frames between two numbers of the ruler
LATE = 0.9  # of the rate: below it is said how many frames are shown
WHEEL = 120  # an eighth of a degree each: one notch


class Ruler(QWidget):
    """Frames from first to last: numbers, the current one, the clip, what is cached. Dragging it scrubs."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._desk = desk
        self.scale = TimeScale(desk, self)
        self._cached: tuple[tuple[int, int], ...] = ()
        self._clip: tuple[float, float] | None = None
        self._hover: int | None = None
        self._turned = 0
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Timeline")
        self.setToolTip(
            "Drag to scrub; the wheel and the arrows go one frame on or back, Home and End to the ends. "
            "Green: cached, plays at full speed. Grey line: the clip of the mesh.")
        self.read(desk.document)

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(40 * look.text, 2 * look.row + look.grid)

    def read(self, document: Document) -> None:
        """Read the clip of a document anew."""
        self._clip = clip_range(document)
        self.update()

    def set_cached(self, frames: Iterable[int]) -> None:
        """Show these frames, ascending, as cached."""
        runs = tuple(_runs(frames))
        if runs != self._cached:
            self._cached = runs
            self.update()

    def frame_at(self, x: float) -> int:
        """The frame of the timeline nearest to a place."""
        return self.scale.frame_at(x)

    def x_of(self, frame: float) -> float:
        """Where a frame stands, in pixels; frames outside the timeline lie outside the ruler."""
        return self.scale.x_of(frame)

    # -- the hand --------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.scale.go(self.frame_at(event.position().x()))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        self._hover = self.frame_at(event.position().x())
        if event.buttons() & Qt.MouseButton.LeftButton:
            self.scale.go(self._hover)
        self.update()

    def leaveEvent(self, event: object) -> None:
        self._hover = None
        self.update()

    def wheelEvent(self, event: QWheelEvent) -> None:
        self._turned += event.angleDelta().y()
        notches, self._turned = int(self._turned / WHEEL), self._turned - WHEEL * int(self._turned / WHEEL)
        if notches:
            self.scale.go(round(self._desk.workspace.frame) - notches)
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        document, frame = self._desk.document, round(self._desk.workspace.frame)
        moves = {
            Qt.Key.Key_Left: frame - 1, Qt.Key.Key_Right: frame + 1,
            Qt.Key.Key_PageUp: frame - 10, Qt.Key.Key_PageDown: frame + 10,
            Qt.Key.Key_Home: document.first_frame, Qt.Key.Key_End: document.last_frame,
        }
        wanted = moves.get(Qt.Key(event.key()))
        if wanted is None or event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier:
            super().keyPressEvent(event)
        else:
            self.scale.go(wanted)

    # -- the picture -----------------------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        painter.setFont(text_font(look, look.small))
        numbers = look.small + look.grid  # height of the row of numbers
        bottom = self.height() - look.grid - 2.0
        self._paint_ticks(painter, look, numbers, bottom)
        self._paint_clip(painter, look, bottom)
        if self._hover is not None:
            painter.fillRect(QRectF(round(self.x_of(self._hover)), numbers, 1.0, bottom - numbers),
                             look.theme.colour("dim"))
        self._paint_current(painter, look, numbers, bottom)

    def _paint_ticks(self, painter: QPainter, look: Look, numbers: float, bottom: float) -> None:
        document = self._desk.document
        first, last = document.first_frame, document.last_frame
        widest = painter.fontMetrics().horizontalAdvance(str(max(abs(first), abs(last))) + "-")
        step = _step(last - first, int(self.scale.extent()[1] / (widest + 3 * look.text)))
        minor = step // 2 if step % 2 == 0 else step // 5 if step % 5 == 0 else step
        left, span = self.scale.extent()
        current = min(max(round(self.x_of(self._desk.workspace.frame)), left), left + span)
        wide = painter.fontMetrics().horizontalAdvance(_words(self._desk.workspace.frame))
        for frame in range(first, last + 1, max(1, minor)):
            large = (frame - first) % step == 0
            x = round(self.x_of(frame))
            height = (bottom - numbers) * (0.75 if large else 0.4)
            painter.fillRect(QRectF(x, bottom - 4 - height, 1.0, height),
                             look.theme.colour("dim" if large else "line", 0.7 if large else 1.0))
            if large and abs(x - current) > 0.5 * (wide + widest) + look.grid:
                self._number(painter, frame, x, numbers, look.theme.colour("dim"))

    def _number(self, painter: QPainter, frame: float, x: float, height: float, colour: object) -> None:
        painter.setPen(colour)  # type: ignore[call-overload] # a QColor
        painter.drawText(QRectF(x - 50, 0, 100, height), Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop,
                         _words(frame))

    def _paint_clip(self, painter: QPainter, look: Look, bottom: float) -> None:
        left, span = self.scale.extent()
        if self._clip is not None:
            a, b = (min(max(self.x_of(f), left), left + span) for f in self._clip)
            painter.fillRect(QRectF(a, bottom + 1, max(b - a, 1.0), 1.0), look.theme.colour("dim"))
        half = 0.5 * span / max(1, self._desk.document.last_frame - self._desk.document.first_frame)
        for first, last in self._cached:
            a, b = max(left, self.x_of(first) - half), min(left + span, self.x_of(last) + half)
            if b > a:
                painter.fillRect(QRectF(a, bottom, b - a, float(look.grid)), look.theme.colour("cached"))

    def _paint_current(self, painter: QPainter, look: Look, numbers: float, bottom: float) -> None:
        frame = self._desk.workspace.frame
        left, span = self.scale.extent()
        x = min(max(round(self.x_of(frame)), left), left + span)
        accent = look.theme.colour("accent")
        painter.fillRect(QRectF(x - 0.5, numbers + 2, 2.0, bottom - numbers - 2), accent)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setBrush(accent)
        painter.setPen(Qt.PenStyle.NoPen)
        half, middle = 0.5 * look.text, x + 0.5
        painter.drawPolygon(QPolygonF([
            QPointF(middle - half, numbers), QPointF(middle + half, numbers), QPointF(middle, numbers + 1.2 * half)]))
        if self.hasFocus():
            painter.setPen(look.theme.colour("accent", 0.5))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 5, 5)
        self._number(painter, frame, x, numbers, accent)


class NumberField(QLineEdit):
    """A small number that is typed; what is no number is put back."""

    def __init__(self, tooltip: str, take: Callable[[float], object], letters: int = 6) -> None:
        super().__init__()
        self._take, self._letters, self._value = take, letters, ""
        self.setToolTip(tooltip)
        self.setAccessibleName(tooltip)
        self.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.editingFinished.connect(self._finished)

    def show_number(self, number: float | None) -> None:
        """Show a number (None: nothing, for several), unless another is being typed."""
        self._value = "" if number is None else f"{number:.10g}"
        if not (self.hasFocus() and self.isModified()):
            self.setText(self._value)

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(round(0.62 * look.text * self._letters) + 2 * look.gap, look.row)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.setText(self._value)
            self.clearFocus()
        else:
            super().keyPressEvent(event)

    def _finished(self) -> None:
        if self.isModified():
            try:
                wanted = float(self.text().strip().replace(",", "."))
            except ValueError:
                wanted = float("nan")
            self.setText(self._value)  # until the document says otherwise
            if abs(wanted) < 1e12:
                self._take(wanted)


class Timeline(QWidget):
    """Buttons, ruler with the keys below it, range and rate. `playback` plays it; tell :meth:`set_cached` what is
    cached. `curves` is the button that asks for the curves over it. speed : see :class:`Playback`."""

    def __init__(
        self, desk: Desk, parent: QWidget | None = None, speed: Callable[[], float] = lambda: 1.0
    ) -> None:
        super().__init__(parent)
        self._desk = desk
        self.playback = Playback(desk, self, speed=speed)
        self.ruler = Ruler(desk)
        self.keys = DopeRow(desk.keys, self.ruler.scale)
        self.pose_keys = PoseKeyRow(desk, self.ruler.scale)
        self.play = IconButton("play", "Plays the frames in a loop at the rate of the project, or stops.")
        self.frame = NumberField("The current frame; type another to go there.", self._type_frame)
        self.first = NumberField("The first frame of the timeline; type another to change the range.",
                                 lambda f: self._edit_range(f, self._desk.document.last_frame))
        self.last = NumberField("The last frame of the timeline; type another to change the range.",
                                lambda f: self._edit_range(self._desk.document.first_frame, f))
        self.rate = NumberField("Frames per second of the project; type another to play faster or slower.",
                                lambda fps: self._desk.edit("Frame rate", set_document, fps=fps), 5)
        self._unit, self._dash = QLabel("fps"), QLabel("–")
        self.first_button = self._button("first", "Goes to the first frame of the timeline.",
                                         lambda: self._go(self._desk.document.first_frame))
        self.previous_button = self._button("previous", "Goes one frame back.", lambda: self._step(-1))
        self.next_button = self._button("next", "Goes one frame on.", lambda: self._step(1))
        self.last_button = self._button("last", "Goes to the last frame of the timeline.",
                                        lambda: self._go(self._desk.document.last_frame))
        self.play.clicked.connect(self.playback.toggle)
        line = QHBoxLayout(self)
        line.setContentsMargins(12, 4, 12, 4)
        line.setSpacing(4)
        for widget in (self.first_button, self.previous_button, self.play, self.next_button, self.last_button,
                       self.frame):
            line.addWidget(widget)
        times = QVBoxLayout()
        times.setSpacing(0)
        times.addWidget(self.ruler)
        times.addWidget(self.keys)
        times.addWidget(self.pose_keys)
        line.addLayout(times, 1)
        for widget in (self.first, self._dash, self.last):
            line.addWidget(widget)
        line.addSpacing(8)
        line.addWidget(self.rate)
        line.addWidget(self._unit)
        self.curves = IconButton("curve", "Shows or hides the curves of keyed values over the timeline.")
        line.addWidget(self.curves)
        self.playback.changed.connect(lambda: self.play.set_icon("pause" if self.playback.playing else "play"))
        self.playback.changed.connect(self._tell_rate)
        desk.changed.connect(self._changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.stroke_ended.connect(self.refresh)
        desk.session_replaced.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the document as it is."""
        document = self._desk.document
        self.ruler.read(document)
        self.keys.update()
        self.first.show_number(document.first_frame)
        self.last.show_number(document.last_frame)
        self.rate.show_number(document.fps)
        self.frame.show_number(self._desk.workspace.frame)

    def set_cached(self, frames: Iterable[int]) -> None:
        """Show these whole frames, ascending, as cached: LiveScene.cached_frames knows them."""
        self.ruler.set_cached(frames)

    def _button(self, icon: str, tooltip: str, run: Callable[[], None]) -> IconButton:
        button = IconButton(icon, tooltip)
        button.setAutoRepeat(icon in ("previous", "next"))
        button.clicked.connect(run)
        return button

    def _changed(self, old: Document, new: Document) -> None:
        if self._desk.session.stroking:
            return
        times = (old.first_frame, old.last_frame, old.fps) != (new.first_frame, new.last_frame, new.fps)
        if times or old.meshes is not new.meshes:
            self.refresh()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.frame != new.frame:
            self.frame.show_number(new.frame)
            self.ruler.update()
            self._tell_rate()

    def _tell_rate(self) -> None:
        """While it plays and frames are left out, how many a second are shown stands beside the rate."""
        shown = self.playback.reached
        late = self.playback.playing and 0.0 < shown < LATE * self._desk.document.fps
        self._unit.setText(f"fps, {shown:.0f} shown" if late else "fps")

    def _go(self, frame: float) -> None:
        self._desk.set_workspace(frame=float(frame))

    def _step(self, frames: int) -> None:
        document, frame = self._desk.document, round(self._desk.workspace.frame) + frames
        self._go(min(max(frame, document.first_frame), document.last_frame))

    def _type_frame(self, frame: float) -> None:
        if abs(frame) < 2**31 - 1:
            self._go(frame)

    def _edit_range(self, first: float, last: float) -> None:
        first, last = sorted((round(first), round(last)))
        self._desk.edit("Frame range", set_document, first_frame=first, last_frame=last)


def _words(frame: float) -> str:
    return f"{round(frame, 2):g}" if abs(frame) < 1e5 else f"{frame:.0f}"


def _step(frames: int, most: int) -> int:
    """The smallest 1, 2 or 5 times a power of ten that gives at most so many numbers."""
    size = 1
    while True:
        for factor in STEPS:
            if frames / (factor * size) <= max(1, most):
                return factor * size
        size *= 10


def _runs(frames: Iterable[int]) -> list[tuple[int, int]]:
    """First and last of every run of frames that follow one another."""
    ordered = list(frames)
    if not ordered:
        return []
    cuts = [i + 1 for i, (a, b) in enumerate(pairwise(ordered)) if b != a + 1]
    return [(ordered[a], ordered[b - 1]) for a, b in pairwise([0, *cuts, len(ordered)])]
