"""The picture of what lies on the desk: follows the session, draws while things move, finishes at rest.

Knows no events and no timers: the viewport calls :meth:`LivePicture.paint` for a frame and, while nothing moves,
:meth:`LivePicture.rest` for one short slice of finishing after another, always with its OpenGL context current.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import moderngl
import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from core.errors import UserError
from core.overlay import Overlay
from core.workspace import ViewOptions
from tools.session import Session
from viewport.density import DensityController
from viewport.hud import TextImage
from viewport.live_scene import Change, Done, Job, LiveScene
from viewport.panes import Pane, Panes
from viewport.scene import Scene
from viewport.view import HudLine, View3D

StartJob = Callable[[Job, Callable[[Done], None], Callable[[Exception], None]], None]
"""Runs a job on another thread; calls back on this one with its result or with what went wrong."""

CATCH_UP = 0.012  # seconds of a slice


class LivePicture:
    """The moving and the finished picture of one session.

    density : how many hairs are drawn while things move. shown : hairs in the last moving picture; total : in the
    scene. troubles : what cannot be shown as the document says, in sentences.
    """

    def __init__(
        self, ctx: moderngl.Context, session: Session, text: TextImage, start_job: StartJob,
        adopted: Callable[[], None], budget_ms: float,
        dress: Callable[[Scene], tuple[Pane, ...]] = lambda scene: (Pane(scene),),
    ) -> None:
        self.view = View3D(ctx, text=text)
        self.panes = Panes(self.view)
        self.dress = dress
        self.density = DensityController(budget_ms=budget_ms)
        self.shown = self.total = 0
        self.troubles: tuple[str, ...] = ()
        self._start_job, self._adopted = start_job, adopted
        self._refining: Iterator[float] | None = None
        self._finished = False
        self._scene = Scene()
        self._size, self._options = (1, 1), ViewOptions()
        self._jobs = 0
        self.session = session
        self.live = LiveScene(session.evaluator, plumages=session.plumages)

    def replace_session(self, session: Session) -> None:
        """Show another session from now on; what jobs still bring for the old one is dropped."""
        self.session, self.live = session, LiveScene(session.evaluator, plumages=session.plumages)
        self._jobs = 0
        self._finished = False

    @property
    def settled(self) -> bool:
        """True when the picture shows everything, finished, and no job is out that would change it."""
        return self._finished and not self._jobs

    @property
    def growing(self) -> bool:
        """True while a job is out that will change the picture."""
        return self._jobs > 0

    def follow(self, camera: Camera, size: tuple[int, int], moving: bool) -> bool:
        """Take the session as it is now; True when the picture must be drawn anew.

        moving : a hand or the timeline moves things, so nothing slow is begun.
        """
        workspace = self.session.workspace
        self._size, self._options = size, shown_options(self.session)
        change = self.live.update(
            self.session.document, workspace.frame, self._options, moving, self.density.drawn, workspace.groom)
        changed = self._take(change, camera)
        if not moving:
            self._ask()
        return changed or self.view.opening

    def draw(self) -> None:
        """Draw the moving picture."""
        self.shown = self.panes.draw_interactive(self.density.drawn)
        self._refining, self._finished = None, False

    def present(
        self, framebuffer: moderngl.Framebuffer, whole: tuple[int, int], overlays: Sequence[Overlay],
        hud: Sequence[HudLine], ratio: float,
    ) -> None:
        """Bring the best picture there is, with marks and words over it, to a screen of `whole` pixels."""
        self.panes.present(framebuffer, whole, overlays, hud, ratio)

    def rest(self, camera: Camera) -> bool:
        """One short slice of what is still to be done; False when there is nothing more."""
        change = self.live.catch_up(CATCH_UP)
        if change is not None:
            self._take(change, camera)
            self._refining, self._finished = None, False
            return True
        if self._finished:
            return False
        self._ask()
        if self._refining is None:
            self._refining = self.panes.refine()
        if next(self._refining, None) is None:
            self._refining, self._finished = None, True
        return not self._finished

    def frame_at(self, frame: float, camera: Camera, size: tuple[int, int]) -> Iterator[float]:
        """Make the finished picture of another frame and size in the view, slice by slice, without marks and words."""
        session = self.session
        options = shown_options(session).replace(hud=False, axes=False)
        change = self.live.update(session.document, frame, options, True, None, session.workspace.groom)
        self._size, self._options = size, options
        self._take(change, camera, single=True)
        yield from self.view.refine()

    def clear_picture(
        self, frame: float, camera: Camera, size: tuple[int, int]
    ) -> Iterator[NDArray[np.uint8] | float | None]:
        """Draw the scene at a frame with nothing behind it, in slices; the last item is (h, w, 4) uint8.

        None instead of it says that something is still made on another thread: ask again when it was adopted.
        """
        session, live = self.session, self.live
        options = shown_options(session)
        change = live.update(session.document, frame, options, False, None, session.workspace.groom)
        self._ask()
        if self._jobs:
            yield None
            return
        while (more := live.catch_up(CATCH_UP)) is not None:
            for points, rows in more.rows:
                self.view.rows_changed(points, rows)
            change = more
            yield 0.0
        for part in self.view.clear_picture(change.scene, camera, size, options):
            yield 0.5 if part is None else part

    def release(self) -> None:
        """Give everything on the graphics card back."""
        self.panes.release()
        self.view.release()

    def _take(self, change: Change, camera: Camera, single: bool = False) -> bool:
        self._scene, self.troubles = change.scene, change.troubles
        self.total = sum(len(c.ids if c.order is None else c.order) for c in change.scene.coats)
        self.density.limit(max((len(c.ids if c.order is None else c.order) for c in change.scene.coats), default=0))
        panes = (Pane(change.scene),) if single else self.dress(change.scene)
        changed = self.panes.begin(panes, camera, self._size, self._options)
        for points, rows in change.rows:
            self.view.rows_changed(points, rows)
        if changed or change.rows:
            self._refining, self._finished = None, False
        return changed or bool(change.rows)

    def _ask(self) -> None:
        live = self.live
        for job in live.wanted_jobs():
            self._jobs += 1
            self._start_job(
                job, lambda done, live=live: self._adopt(live, done),
                lambda error, live=live, job=job: self._abandon(live, job, error))

    def _adopt(self, live: LiveScene, done: Done) -> None:
        if live is self.live:
            self._jobs -= 1
            live.adopt(done)
            self._adopted()

    def _abandon(self, live: LiveScene, job: Job, error: Exception) -> None:
        if live is self.live:
            self._jobs -= 1
            live.abandon(job, error if isinstance(error, UserError) else UserError(str(error) or "it was cancelled"))
            self._adopted()


def shown_options(session: Session) -> ViewOptions:
    """The options of the view; guides also show while the tool is about guides, and where there is no hair to see."""
    view = session.workspace.view
    if view.guides:
        return view
    tool = session.tool
    bare = not view.hair or all(groom.coat.count == 0 for groom in session.document.grooms)
    if bare or tool.at_rest or tool.edits in ("selection", "hold"):
        shown: ViewOptions = view.replace(guides=True)
        return shown
    return view
