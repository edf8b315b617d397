"""The viewport: a native window with a picture in it, inside the main window.

A ``QOpenGLWindow`` in ``createWindowContainer`` costs a tenth of a ``QOpenGLWidget`` and keeps its context when it is
docked elsewhere. Its price: no widget can lie over it, so ring, words and figures are drawn in GL. Its framebuffer is
number 0, whose size moderngl does not know: sizes are those of the window times ``devicePixelRatio``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import moderngl
import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPoint, QPointF, QRect, Qt, QTimer, Signal
from PySide6.QtGui import (
    QCursor,
    QExposeEvent,
    QFocusEvent,
    QGuiApplication,
    QKeyEvent,
    QMouseEvent,
    QNativeGestureEvent,
    QResizeEvent,
    QTabletEvent,
    QWheelEvent,
)
from PySide6.QtOpenGL import QOpenGLWindow
from PySide6.QtWidgets import QWidget

from app.window.commands import Commands
from app.window.desk import Desk
from app.window.gestures import BrushDrag, Gestures
from app.window.gl_surface import driver_of, no_gl, surface_format
from app.window.hotkeys import Hotkeys
from app.window.letters import letters
from app.window.match.view import PlateView
from app.window.navigation import CameraDrag, Eye
from app.window.pose.overlay import skeleton_of
from app.window.pose.views import PoseViews
from app.window.tablet import BUTTON_NAMES, modifier_names, mouse_pointer, pen_pointer, place_pointer
from app.window.theme import look_of
from app.window.view_figures import ViewFigures
from core.camera import Camera
from core.document import Document
from core.errors import UserError
from core.gate import gate_box, seen_through
from core.overlay import Overlays
from core.workspace import Workspace
from tools.ground import Pointer, Sight
from tools.match_edits import shown_plate
from tools.solve_edits import solved_of
from viewport.gate import gate_marks
from viewport.panes import corner_of, pane_at, size_of
from viewport.scene import Scene
from viewport.view import TEXT_PIXELS, HudLine

if TYPE_CHECKING:
    from app.window.live_picture import LivePicture
    from viewport.live_scene import Done, Job
    from viewport.renderer import Renderer

CALM_MS = 120  # after the last movement, before the picture is finished


class Viewport(QOpenGLWindow):
    """The picture of a desk and the hand on it.

    painted : a picture is on the screen. settled : nothing is left to do. failed : there is no OpenGL to draw with.
    hint : what goes on under the hand has changed, in words; empty when nothing does.
    playing : set while the timeline plays, so that nothing slow is begun.
    """

    hint = Signal(str)
    painted = Signal()
    settled = Signal()
    failed = Signal(str)

    def __init__(self, desk: Desk, hotkeys: Hotkeys, commands: Commands, window: QWidget, budget_ms: float) -> None:
        super().__init__(QOpenGLWindow.UpdateBehavior.NoPartialUpdate)
        self.setFormat(surface_format())
        self.desk = desk
        self.playing = False
        self._window = window
        self.views = PoseViews(desk)
        self.views.fresh.connect(self.redraw)
        self._pane = 0  # the one the pointer is in
        self.plate = PlateView(desk, self.pixels, window)
        self.plate.doors.draw_scene = self.draw_over_plate
        self.plate.fresh.connect(self.redraw)
        self.eye = Eye(desk, self.pixels, self.devicePixelRatio, self.redraw, self.plate.eye)
        self.gestures = Gestures(desk, self.eye, hotkeys, commands, window)
        self.gestures.pictures.shape = self._shape_of
        self._hinted = ""
        self.picture: LivePicture | None = None
        self.frames = self.refined_frames = 0
        self._budget_ms = budget_ms
        self._ctx: moderngl.Context | None = None
        self._beside: Renderer | None = None  # of scenes in panels, made for the first of them
        self._screen: moderngl.Framebuffer | None = None
        self._stale = True
        self._wants_paint = True
        self._awaits_size = False  # the window system has been asked for another size
        self._lent = 0  # to who draws frames with it
        self._moved = False  # the picture being painted was drawn anew
        self._pointer: Pointer | None = None
        self._pen = False  # the pen is down: what the system makes of it as a mouse is no event of its own
        self.figures = ViewFigures(desk)
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.timeout.connect(self._rest_a_little)
        self.frameSwapped.connect(self._swapped)
        desk.changed.connect(self._document_changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self._session_replaced)
        desk.stroke_ended.connect(self._stroke_ended)

    # -- what is shown -----------------------------------------------------------------------------------

    def pixels(self) -> tuple[int, int]:
        """Width and height of the picture, of one pane where there are several, in pixels of the framebuffer."""
        return size_of(max(len(self.views.methods), 1), self._whole())

    def _whole(self) -> tuple[int, int]:
        size = self.size() * self.devicePixelRatio()  # halves are rounded as Qt does, else the picture is a pixel off
        return max(size.width(), 1), max(size.height(), 1)

    def _in_pane(self, pointer: Pointer) -> Pointer:
        """A pointer in pixels of its pane; what goes on stays in the pane it began in."""
        count = len(self.views.methods)
        if count < 2:
            return pointer
        if self.gestures.drag is None:
            self._pane = pane_at(pointer.x, pointer.y, count, self._whole())
        x, y = corner_of(self._pane, count, self._whole())
        return pointer._replace(x=pointer.x - x, y=pointer.y - y)

    def repaint_soon(self) -> None:
        """Paint once more, what is drawn or what lies over it."""
        self._wants_paint = True
        self.update()
        self._tell()

    def redraw(self) -> None:
        """Something that is shown has changed."""
        self._stale = True
        self._rest.stop()
        self.repaint_soon()

    def await_size(self) -> None:
        """Another size is on its way: the next picture waits one turn for it, or it would be drawn twice."""
        self._awaits_size = True

    @property
    def pending(self) -> bool:
        """True while something that has happened is not on the screen yet."""
        return self._stale or self._wants_paint

    @property
    def at_rest(self) -> bool:
        """True when the picture is finished and nothing more will change it."""
        picture = self.picture
        if picture is not None and self.plate.shown:
            return self.plate.settled and not self.pending
        return picture is not None and picture.settled and not self.pending and not self._rest.isActive()

    def draw_frame(self, frame: float, size: tuple[int, int]) -> Iterator[object]:
        """Draw a finished frame at a size in short slices; the last item is (height, width, 3) uint8 sRGB.

        It is what the film gate takes, where it is shown.

        The picture on the screen stands still meanwhile.
        """
        picture, ctx = self.picture, self._ctx
        if picture is None or ctx is None:
            raise UserError("Nothing can be drawn without OpenGL 3.3.")
        self._lent += 1
        try:
            view = self.desk.workspace.view
            camera = self.eye.camera
            if view.gate is not None and view.gate_shown:
                camera = seen_through(view.gate, camera)
            for slice_of in picture.frame_at(frame, camera, size):
                yield slice_of
                self.makeCurrent()
            texture = ctx.texture(size, 4)
            target = ctx.framebuffer([texture])
            picture.view.present(target, size)
            pixels = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(size[1], size[0], 3)
            target.release()
            texture.release()
            yield np.ascontiguousarray(pixels[::-1])
        finally:
            self._lent -= 1
            self.redraw()

    def draw_over_plate(self, frame: int) -> Iterator[object]:
        """Draw what stands in the document as the solved camera sees it on a frame of the plate, as its files count, in
        short slices; see :meth:`SceneOver.drawn`."""
        picture, plate = self.picture, shown_plate(self.desk.document)
        solved = None if plate is None else solved_of(self.desk.document, plate.id)
        if picture is None or solved is None:
            yield None
            return
        self._lent += 1
        try:
            self.makeCurrent()
            for part in self.plate.scene.drawn(picture, solved, frame):
                yield part
                self.makeCurrent()
        finally:
            self._lent -= 1
            self.redraw()

    def draw_beside(
        self, scene: Scene, camera: Camera, size: tuple[int, int]
    ) -> Iterator[NDArray[np.uint8] | None]:
        """Draw a small scene of a panel in short slices; the last item is (height, width, 3) uint8 sRGB."""
        ctx = self._ctx
        if ctx is None:
            return
        from viewport.renderer import Renderer

        self.makeCurrent()
        if self._beside is None:
            self._beside = Renderer(ctx)
        renderer, color = self._beside, ctx.renderbuffer(size, 3)
        target = ctx.framebuffer([color])
        try:
            for _ in renderer.steps(scene, camera, target, size, 2):
                ctx.finish()
                yield None
                if self._beside is not renderer:  # the window was closed
                    return
                self.makeCurrent()
            pixels = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(size[1], size[0], 3)
            yield np.ascontiguousarray(pixels[::-1])
        finally:
            if self._beside is renderer:
                self.makeCurrent()
                target.release()
                color.release()

    def gate_rect(self) -> QRect:
        """What the film gate takes of the view in device pixels; all of it where none is shown."""
        (width, height), view = self.pixels(), self.desk.workspace.view
        shown = view.gate if view.gate_shown and not self.plate.shown else None
        box = None if shown is None else gate_box(shown, self.eye.camera, width, height)
        if box is None:
            return QRect(0, 0, width, height)
        left, top, right, bottom = (round(edge + 0.5) for edge in box)
        return QRect(left, top, right - left, bottom - top).intersected(QRect(0, 0, width, height))

    def scale_density(self, factor: float) -> None:
        """Draw so many times as many hairs while the hand moves."""
        if self.picture is not None:
            density = self.picture.density
            density.budget_ms *= factor
            density.hairs = max(round(density.hairs * factor), density.floor)
            self.redraw()

    def set_budget(self, milliseconds: float) -> None:
        """How long a moving picture may take."""
        self._budget_ms = milliseconds
        if self.picture is not None:
            self.picture.density.budget_ms = milliseconds

    def release_gl(self) -> None:
        """Give back everything on the graphics card, while there is a context to do it in."""
        self._rest.stop()
        if self.picture is not None and self.context() is not None:
            self.makeCurrent()
            self.plate.release()
            self.picture.release()
            self.picture = None
            if self._beside is not None:
                self._beside.release()
                self._beside = None
            if self._ctx is not None:
                self._ctx.release()
                self._ctx = self._screen = None
            self.doneCurrent()

    # -- painting ----------------------------------------------------------------------------------------

    def initializeGL(self) -> None:
        """Take hold of the context Qt made; say so when it is too old."""
        from app.window.live_picture import LivePicture  # with every kernel of a coat: an empty window does without

        try:
            self._ctx = moderngl.create_context(require=330)
        except Exception:  # glcontext raises bare Exceptions
            self.failed.emit(no_gl(self.context()))
            return
        self._ctx.gc_mode = "context_gc"
        self.figures.driver = driver_of(self._ctx)
        self._screen = self._ctx.detect_framebuffer(0)
        try:
            self.picture = LivePicture(
                self._ctx, self.desk.session, letters, self._start_job, self.redraw, self._budget_ms,
                self.views.panes)
        except Exception:  # a driver that promises 3.3 and fails at the first shader
            self.failed.emit(no_gl(self.context()))

    def paintGL(self) -> None:
        """One picture: drawn anew when something changed, else the one there is with the ring over it."""
        self._wants_paint = False
        if self.picture is None or self._screen is None or self._lent:
            return
        picture, drawing = self.picture, self._stale
        self._moved = False
        if self.plate.shown:
            self._stale = False
            self.plate.paint(
                picture.view, self._screen, self._whole(), self._overlays(), self._pointer, self._mark_ratio())
            return
        if drawing:
            self._stale = False
            self.figures.drawing.start()
            moving = self.desk.session.stroking or self.playing
            if picture.follow(self.eye.camera, self.pixels(), moving) or picture.shown < 0:
                picture.draw()
                self._moved = True
        picture.present(
            self._screen, self._whole(), self._overlays(), self._hud_lines(), self._mark_ratio())

    def _mark_ratio(self) -> float:
        """Device pixels for a pixel of marks and words, which grow with the window's text."""
        return self.devicePixelRatio() * look_of().text / TEXT_PIXELS

    def resizeGL(self, width: int, height: int) -> None:
        """Another size is another picture."""
        self._stale = True

    def _swapped(self) -> None:
        if self._moved and self.picture is not None:
            self._moved = False
            took = self.figures.drawing.stop()
            self.frames += 1
            if took is not None:
                self.picture.density.frame(took)
            if self.picture.view.opening:
                self.redraw()
        self.painted.emit()
        if self.plate.shown:
            if self.plate.settled:
                self.settled.emit()
            elif self.plate.scene.wanted and not self._rest.isActive() and not self._busy():
                self._rest.start(CALM_MS)
            return
        if self.picture is not None and not self.picture.settled and not self._rest.isActive() and not self._busy():
            self._rest.start(CALM_MS)

    def _busy(self) -> bool:
        return self.gestures.drag is not None or self.playing

    def _rest_a_little(self) -> None:
        """One slice of finishing; the next comes after whatever events there are."""
        picture = self.picture
        if picture is None or self._lent or self._busy() or self._stale or not self.isExposed():
            return
        if self.plate.shown:
            self.makeCurrent()
            if self.plate.scene.rest(picture):
                self._rest.start(0)
            if not self.plate.scene.wanted:
                self.repaint_soon()
            return
        prepare = self.desk.session.hand.preparation()
        if prepare is not None:  # so that the next press need not wait for it
            self.desk.jobs.start(
                "Preparing the skin for the hand", lambda progress, cancelled: prepare(), lambda found: None)
        self.makeCurrent()
        more = picture.rest(self.eye.camera)
        if picture.view.picture_changed:
            self.refined_frames += 1
            self.repaint_soon()
        if more:
            self._rest.start(0)
        elif picture.settled:
            self.figures.forget()
            self.repaint_soon()
            self.settled.emit()

    def _start_job(self, job: Job, done: Callable[[Done], None], failed: Callable[[Exception], None]) -> None:
        self.desk.jobs.start(job.name, lambda progress, cancelled: job.run(), done, failed)

    # -- what is drawn over it ---------------------------------------------------------------------------

    def _overlays(self) -> Overlays:
        gestures, pointer = self.gestures, self._pointer
        under: Overlays = () if self.plate.shown else gate_marks(
            self.desk.workspace.view, self.eye.camera, self.pixels(), self._mark_ratio())
        under += skeleton_of(self.desk, self.eye.camera, self.pixels(), self._mark_ratio())
        if pointer is None or isinstance(gestures.drag, CameraDrag):
            return under + gestures.overlays()
        if isinstance(gestures.drag, BrushDrag):
            pointer = pointer._replace(x=gestures.drag.x, y=gestures.drag.y)
        width, height = self.pixels()
        stroke = gestures.stroke
        sight = Sight(self.eye.camera, width, height) if stroke is None else stroke.sight
        try:
            ring = self.desk.session.hand.hover(sight, pointer if stroke is None else stroke.pointer)
        except Exception as error:  # of a studio's own tool: the picture goes on without its marks
            self.desk.error(UserError(f"{self.desk.session.tool.label} cannot show its ring ({error})."))
            ring = ()
        return under + ring + gestures.overlays()

    def _hud_lines(self) -> list[HudLine]:
        return [] if self.picture is None else self.figures.lines(self.picture)

    # -- what changes ------------------------------------------------------------------------------------

    def _document_changed(self, old: Document, new: Document) -> None:
        self.redraw()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        seen = ("frame", "view", "groom", "cameras", "tool", "craft")
        if any(getattr(old, name) is not getattr(new, name) for name in seen):
            self.redraw()
        else:
            self.figures.forget()
            self.repaint_soon()

    def _session_replaced(self) -> None:
        self.gestures.drag = None
        if self.picture is not None:
            self.picture.replace_session(self.desk.session)
        self.figures.forget()
        self.redraw()

    def _stroke_ended(self) -> None:
        if self.picture is not None:
            self.picture.density.end_stroke()
        self.redraw()

    # -- events ------------------------------------------------------------------------------------------

    def event(self, event: QEvent) -> bool:
        """Gathered samples go to the hand just before a picture; keys of what goes on here are no hotkeys."""
        kind = event.type()
        if kind == QEvent.Type.UpdateRequest:
            if self._awaits_size:
                self._awaits_size = False
                self.update()
                return True
            self._frame()
        elif kind == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            if self.gestures.takes(Qt.Key(event.key())):
                event.accept()
                return True
        elif kind == QEvent.Type.Leave:
            self._pointer = None
            self.repaint_soon()
        elif kind == QEvent.Type.Enter:
            self._take_focus()
        elif kind == QEvent.Type.NativeGesture and isinstance(event, QNativeGestureEvent):
            return self._pinch(event)
        return super().event(event)

    def exposeEvent(self, event: QExposeEvent) -> None:
        """Shown or hidden: go on finishing, or stop."""
        super().exposeEvent(event)
        if self.isExposed():
            self.repaint_soon()
        else:
            self._rest.stop()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Another size is another picture."""
        super().resizeEvent(event)
        self._awaits_size = False
        self.eye.resized()
        self.redraw()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """A button goes down."""
        button = BUTTON_NAMES.get(event.button())
        self.requestActivate()
        if button is not None and not self._pen:
            self._press(button, event.modifiers(), self._in_pane(mouse_pointer(event, self.devicePixelRatio())),
                        event.globalPosition().toPoint())

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """The second press of a quick pair is a press."""
        self.mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """The mouse moved."""
        if not self._pen:
            if event.buttons() == Qt.MouseButton.NoButton:
                self.gestures.all_up()
            self._move(self._in_pane(mouse_pointer(event, self.devicePixelRatio())), event.globalPosition().toPoint())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """A button goes up."""
        button = BUTTON_NAMES.get(event.button())
        if button is not None and not self._pen:
            self._release(button)

    def tabletEvent(self, event: QTabletEvent) -> None:
        """A pen: accepted whatever it says, so that the system makes no mouse of it."""
        event.accept()
        pointer = self._in_pane(pen_pointer(event, self.devicePixelRatio()))
        place, button = event.globalPosition().toPoint(), BUTTON_NAMES.get(event.button(), "LMB")
        if event.type() == QEvent.Type.TabletPress:
            self._pen = True
            self.requestActivate()
            self._press(button, event.modifiers(), pointer, place)
        elif event.type() == QEvent.Type.TabletRelease:
            self._release(button)
            self._pen = False
        else:
            self._move(pointer, place)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """The wheel, or two fingers."""
        notches = event.angleDelta().y() / 120.0 or event.angleDelta().x() / 120.0  # Alt turns the wheel sideways
        place = self._in_pane(place_pointer(event.position(), self.devicePixelRatio(), event.modifiers()))
        if notches:
            self.gestures.wheel(notches, modifier_names(event.modifiers()), place)
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """A key that is no hotkey."""
        if event.isAutoRepeat() and not isinstance(self.gestures.drag, BrushDrag):
            return
        pointer = self._pointer or self._in_pane(place_pointer(
            QPointF(self.mapFromGlobal(QCursor.pos())), self.devicePixelRatio(), event.modifiers()))
        if not self.gestures.key(
            Qt.Key(event.key()), event.text(), modifier_names(event.modifiers()), pointer, QCursor.pos()
        ):
            self._change_modifiers(event.modifiers())
            event.ignore()
        self.repaint_soon()

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """A key goes up."""
        if not event.isAutoRepeat():
            self.gestures.key_up(Qt.Key(event.key()))
            self._tell()
            self._change_modifiers(QGuiApplication.queryKeyboardModifiers())

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Without the keyboard no key is held."""
        self.gestures.leave()
        self._tell()
        super().focusOutEvent(event)

    def _press(self, button: str, modifiers: Qt.KeyboardModifier, pointer: Pointer, place: QPoint) -> None:
        self._pointer = pointer
        self.gestures.press(button, modifier_names(modifiers), pointer, place)
        drag = self.gestures.drag
        if self.gestures.stroke is not None and self.picture is not None:
            self.picture.density.begin_stroke()
        if isinstance(drag, CameraDrag):
            self.setCursor(Qt.CursorShape.ClosedHandCursor)
        self._rest.stop()
        self.repaint_soon()

    def _move(self, pointer: Pointer, place: QPoint) -> None:
        self._pointer = pointer
        if self.gestures.radial is not None:
            self.gestures.radial.point_to(place)
            return
        self.gestures.move(pointer)
        self.repaint_soon()

    def _release(self, button: str) -> None:
        if self.gestures.radial is not None:
            self.gestures.radial.let_go()
            return
        self.gestures.release(button)
        if self.gestures.drag is None:
            self.unsetCursor()
        self.repaint_soon()

    def _tell(self) -> None:
        """Say what goes on, when that is something else now."""
        words = self.gestures.doing()
        if words != self._hinted:
            self._hinted = words
            self.hint.emit(words)

    def _shape_of(self, path: str) -> tuple[int, int] | None:
        pixels = None if self.picture is None else self.picture.view.pictures.pixels(path)
        return None if pixels is None else (pixels.shape[0], pixels.shape[1])

    def _frame(self) -> None:
        stroking = self.gestures.stroke is not None
        if stroking:
            self.figures.dabbing.start()
        self.gestures.frame()
        if stroking:
            self.figures.dabbing.stop()

    def _pinch(self, event: QNativeGestureEvent) -> bool:
        if event.gestureType() != Qt.NativeGestureType.ZoomNativeGesture or self.gestures.drag is not None:
            return False
        place = self._in_pane(place_pointer(event.position(), self.devicePixelRatio(), event.modifiers()))
        self.eye.pinch(place.x, place.y, 1.0 / max(1.0 + event.value(), 0.1))
        return True

    def _change_modifiers(self, modifiers: Qt.KeyboardModifier) -> None:
        """The ring shows what Shift or Ctrl would do now."""
        if self._pointer is not None:
            names = modifier_names(modifiers)
            self._pointer = self._pointer._replace(shift="Shift" in names, ctrl="Ctrl" in names, alt="Alt" in names)
            self.repaint_soon()

    def _take_focus(self) -> None:
        """Keys go where the hand is, unless something is being typed."""
        focus = self._window.focusWidget()  # also while a closing menu has left no window with the keyboard
        typing = focus is not None and focus.property("readOnly") is not None
        if not typing and QGuiApplication.focusWindow() is not None and not self.isActive():
            return
        if not typing:
            self.requestActivate()
