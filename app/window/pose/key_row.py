"""Keys of poses below the ruler of the timeline: chosen, moved in time, deleted by the hand."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.window.desk import Desk
from app.window.theme import look_of
from app.window.timeline.curve_view import REACH, STILL, diamond
from app.window.timeline.time_scale import TimeScale
from core.document import Document
from core.workspace import Workspace
from tools.posing_edits import delete_pose_keys, move_pose_keys

_DELETE = (Qt.Key.Key_Delete, Qt.Key.Key_Backspace)


class PoseKeyRow(QWidget):
    """A diamond on every frame that a pose was keyed on; hidden without any, and in the other crafts."""

    def __init__(self, desk: Desk, scale: TimeScale, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._desk, self._scale = desk, scale
        self.frames: tuple[float, ...] = ()
        self.selected: frozenset[float] = frozenset()
        self._from: float | None = None  # where a drag began
        self._by = 0
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Pose keys")
        self.setToolTip("Keys of poses. Click selects one, Shift more; a drag moves them in time, Delete takes them "
                        "away, a double click goes there.")
        desk.changed.connect(self._document_changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Read the keys of the rig on the desk."""
        item = self._desk.posed
        clip = None if item is None or item.rig is None else item.rig.clip
        self.frames = () if clip is None else tuple(clip.start + key for key in clip.keys)
        self.selected &= frozenset(self.frames)
        self.setVisible(bool(self.frames) and self._desk.workspace.craft == "pose")
        self.update()

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(40 * look.text, look.text + 2)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton:
            return
        frame = self._under(event.position().x())
        more = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        if frame is None:
            self.selected = self.selected if more else frozenset()
        elif frame not in self.selected:
            self.selected = self.selected | {frame} if more else frozenset({frame})
        self._from, self._by = (None if frame is None else event.position().x()), 0
        self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        x = event.position().x()
        if self._from is not None and (self._by or abs(x - self._from) > STILL):
            self._by = round(self._scale.frame_along(x) - self._scale.frame_along(self._from))
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        by, self._from, self._by = self._by, None, 0
        item = self._desk.posed
        if by and item is not None and self.selected:
            frames, self.selected = self.selected, frozenset(frame + by for frame in self.selected)
            if not self._desk.edit("Move pose keys", move_pose_keys, item.id, tuple(sorted(frames)), by):
                self.selected = frames
            self.refresh()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        frame = self._under(event.position().x())
        if frame is not None:
            self._scale.go(frame)

    def event(self, event: QEvent) -> bool:
        """The key that deletes is this row's while keys are selected, no hotkey's."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent) \
                and event.key() in _DELETE and self.selected:
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        item = self._desk.posed
        if event.key() in _DELETE and self.selected and item is not None:
            self._desk.edit("Delete pose keys", delete_pose_keys, item.id, tuple(sorted(self.selected)))
        elif event.key() == Qt.Key.Key_Escape and self._from is not None:
            self._from, self._by = None, 0
            self.update()
        else:
            super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        look, painter = look_of(), QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        middle = 0.5 * self.height()
        left, span = self._scale.extent()
        painter.fillRect(QRectF(left, middle - 0.5, span, 1.0), look.theme.colour("line"))
        painter.setPen(Qt.PenStyle.NoPen)
        for frame in self.frames:
            chosen = frame in self.selected
            x = self._scale.x_of(frame + (self._by if chosen else 0)) + 0.5
            if left - 1 <= x <= left + span + 1:
                painter.setBrush(look.theme.colour("accent" if chosen else "text"))
                painter.drawPolygon(diamond(QPointF(x, middle), 4.5))
        if self.hasFocus():
            painter.setPen(look.theme.colour("accent", 0.5))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 5, 5)

    def _under(self, x: float) -> float | None:
        """The key nearest to a place, when it is within reach."""
        near = min(self.frames, key=lambda frame: abs(self._scale.x_of(frame) - x), default=None)
        return near if near is not None and abs(self._scale.x_of(near) - x) <= REACH else None

    def _document_changed(self, old: Document, new: Document) -> None:
        times = (old.first_frame, old.last_frame) != (new.first_frame, new.last_frame)
        if (old.meshes is not new.meshes or times) and not self._desk.session.stroking:
            self.refresh()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.craft != new.craft or old.mesh != new.mesh:
            self.refresh()
