"""The interactive view: a moving picture at the hand, a finished one at rest, marks and words over both.

For a window (its OpenGL context current in every call, made with ``gc_mode="context_gc"``)::

    view = View3D(ctx, text=letters_of_the_window)
    controller = DensityController(budget_ms=26.0)

    # whenever something may have changed (cheap when nothing has)
    view.begin(scene, camera, (width, height), options)      # True when the picture must be drawn anew
    view.rows_changed(points, rows)                          # arrays of the scene that were written to in place

    # paint, while the hand moves or after a change
    drawn = view.draw_interactive(controller.drawn)
    view.present(framebuffer, (width, height), overlays, hud)

    # at rest, from a timer of 0 ms; any change ends the iteration
    refining = view.refine()
    part = next(refining, None)                              # None: finished, or something changed
    if view.picture_changed: present                         # a finer picture is there

    # only the pointer moved
    view.present(framebuffer, (width, height), overlays, hud)

    view.release()                                           # before the context goes

Sizes are pixels of the framebuffer (logical size times ``devicePixelRatio``). A framebuffer's own idea of its size is
not looked at, so ``ctx.detect_framebuffer()`` of a ``QOpenGLWindow`` serves.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from core.navigate import with_clipping
from core.overlay import Overlay
from core.workspace import ViewOptions
from viewport.context import collect
from viewport.display_target import DisplayTarget, display_target
from viewport.hud import LINE, ScreenImages, TextImage, plain_text
from viewport.kept import same
from viewport.light_maps import LightMaps, alike
from viewport.moving import Moving
from viewport.outline import extent
from viewport.overlay_drawing import TONES, Byte3, MarkDrawing, Words, axes_marks, labels, marks
from viewport.pictures import Pictures, read_image
from viewport.renderer import Prepared, Renderer, light_directions
from viewport.scene import Scene
from viewport.shaders import program, set_uniforms

SLICE_MS = 14.0  # work is added to a slice until it has taken so long; the last piece may take as long again
FULL_PART = 0.4  # of the refinement is done when all hairs are shown
FINISHED_SAMPLES = 2
WINDOW_TILE = 2048  # samples on a side: memory for more takes longer to get than a window may stand still
COATED_PIXELS, COATED_OPACITY = 1.0, 0.13  # of plain guides over a coat: seen when looked for
TEXT_PIXELS = 12.0
HUD_MARGIN = 14.0

HudLine = str | tuple[str, str]
"""Words, or (words, tone of core.overlay.Tone)."""


class View3D:
    """One view of one scene. Make, use and release it with the context current.

    Parameters
    ----------
    ctx : with ``gc_mode="context_gc"``.
    text : draws words, see :data:`viewport.hud.TextImage`.
    image : reads an image file as (H, W, 3 or 4) uint8 or returns None; by default through OpenCV.
    tones : sRGB colours of the tones of overlays.
    shadow_side : of the maps of the light of finished pictures.
    """

    def __init__(
        self, ctx: moderngl.Context, text: TextImage = plain_text,
        image: Callable[[str], NDArray[np.uint8] | None] = read_image, tones: Mapping[str, Byte3] = TONES,
        shadow_side: int = 1024,
    ) -> None:
        self.ctx = ctx
        self.tones = tones
        self.renderer = Renderer(ctx, shadow_side, WINDOW_TILE)
        self.moving = Moving(ctx, self.renderer)
        self.marks = MarkDrawing(ctx)
        self.images = ScreenImages(ctx, text)
        self.pictures = Pictures(ctx, image)
        self.copy = program(ctx, ("fullscreen.vert",), ("copy.frag",))
        self.copy_triangle = ctx.vertex_array(self.copy, [])
        self.scene = Scene()
        self.camera: Camera | None = None
        self.size = (0, 0)
        self.options = ViewOptions()
        self.picture_changed = False
        self._given: tuple[Any, ...] | None = None
        self._targets: list[DisplayTarget] = []
        self._version = 0
        # what the finished maps of the light were drawn for, and their light
        self._lit: tuple[tuple[Any, ...], NDArray[np.float64]] | None = None
        self._lighting: dict[str, Any] = {}
        self._finished: tuple[Any, ...] | None = None  # what the last finished picture shows, and its number
        self._finished_number = 0

    # what is shown

    def begin(self, scene: Scene, camera: Camera, size: tuple[int, int], options: ViewOptions | None = None) -> bool:
        """Say what is to be shown; True when that differs from before, which ends a refinement.

        Nothing is drawn. Arrays are compared by identity, so a scene may be made anew for every frame.
        """
        options = ViewOptions() if options is None else options
        size = (max(int(size[0]), 1), max(int(size[1]), 1))
        given = (scene, camera, size, options)
        if same(self._given, given):
            return False
        self._given = given
        coats, guides = scene.coats if options.hair else (), scene.guides if options.guides else ()
        if coats:  # hair is seen first
            guides = tuple(
                lines._replace(pixels=min(lines.pixels, COATED_PIXELS), opacity=COATED_OPACITY) for lines in guides
            )
        self.scene = scene._replace(coats=coats, guides=guides)
        self.camera, self.size, self.options = camera, size, options
        self.renderer.backdrop.set_plate(self.pictures.pixels(options.background))
        self.pictures.keep({options.background, *(reference.path for reference in options.references)})
        self._version += 1
        return True

    def rows_changed(self, points: np.ndarray, rows: np.ndarray) -> None:
        """Rows of an array of hairs or guides in the scene were written to in place."""
        if len(rows):
            self.renderer.rows_changed(points, rows)
            self.moving.rows_changed(points, np.asarray(rows))
            self._version += 1

    # drawing

    def draw_interactive(self, hairs: int) -> int:
        """Draw the moving picture: at most `hairs` of every coat, those on the near side; how many those are.

        Follow it with :meth:`present`.
        """
        if self.camera is None:
            return 0
        self._version += 1
        finished = None
        if self._lit is not None and self._lit_alike():
            finished = self.renderer.light_maps, self._lighting
        target, picture = self._target(0), None
        if self._finished is not None and same(self._finished, self._picture_key()):
            picture = self._targets[0], self._finished_number
        else:
            self._finished = None
        shown = self.moving.draw(
            self.scene, self.camera, target, self.size, self.options, hairs, finished, picture
        )
        self.picture_changed = True
        return shown

    @property
    def opening(self) -> bool:
        """True when one more moving picture shows more of what has changed, though nothing changes any more."""
        return self.moving.opening

    def refine(self) -> Iterator[float]:
        """Make the picture finer, a slice of about 25 ms at every ``next``; the done part 0 .. 1.

        First all hairs are drawn, then all of it finished. The picture changes (:attr:`picture_changed`) when a
        finer one is complete. The iteration ends by itself when anything changes.
        """
        version = self._version
        steps = self._refinement()
        part = 0.0
        while self._version == version:
            start = time.perf_counter()
            while time.perf_counter() - start < 1e-3 * SLICE_MS:
                try:
                    part = next(steps)
                except StopIteration:
                    yield 1.0
                    return
                self.ctx.finish()
            yield part

    def _refinement(self) -> Iterator[float]:
        if self.camera is None:
            return
        scene, renderer = self.scene, self.renderer
        lit, key = self._light_key(), self._picture_key()
        self._lit = None  # the maps are being drawn anew
        self.moving.forget_touched()
        preparing = renderer.prepare(scene, self.camera, self.size, self.options)
        prepared: Prepared | None = None
        while prepared is None:
            try:
                yield 0.5 * FULL_PART * next(preparing)
            except StopIteration as end:
                prepared = end.value
        self._lighting = {name: prepared.uniforms[name] for name in LightMaps.UNIFORMS}
        self._lit = lit
        for samples, near_only, low, high in (
            (1, True, 0.5 * FULL_PART, FULL_PART), (FINISHED_SAMPLES, False, FULL_PART, 1.0)
        ):
            for part in renderer.paint(prepared, self._target(1), samples, near_only):
                yield low + (high - low) * part
            self._targets.reverse()
            self._finished = key
            self._finished_number += 1
            self.picture_changed = True
        yield 1.0
        self.moving.keep(scene, self.camera, (self._targets[0], self._finished_number))
        yield 1.0

    def clear_picture(
        self, scene: Scene, camera: Camera, size: tuple[int, int], options: ViewOptions
    ) -> Iterator[NDArray[np.uint8] | None]:
        """Draw a finished picture with nothing behind it, in slices; the last item is (h, w, 4) uint8, top row first:
        sRGB times what is covered, and that. What is shown stays."""
        options = options.replace(grid=False, axes=False, hud=False, background=None)
        scene = scene._replace(coats=scene.coats if options.hair else (), guides=(), clear=True)
        low, high = extent(self.renderer.outline.of(scene))
        corners = np.array([np.where([i & 1, i & 2, i & 4], high, low) for i in range(8)])
        camera = with_clipping(camera, corners)
        self._lit = None  # the maps of the light are drawn for another eye
        self._version += 1
        texture = self.ctx.texture(size, 4)
        target = self.ctx.framebuffer([texture])
        try:
            for _ in self.renderer.steps(scene, camera, target, size, FINISHED_SAMPLES, options):
                self.ctx.finish()
                yield None
            pixels = np.frombuffer(target.read(components=4, alignment=1), np.uint8).reshape(size[1], size[0], 4)
        finally:
            target.release()
            texture.release()
        yield np.ascontiguousarray(pixels[::-1])

    def present(
        self, framebuffer: moderngl.Framebuffer, size: tuple[int, int], overlays: Sequence[Overlay] = (),
        hud: Sequence[HudLine] = (), ratio: float = 1.0,
    ) -> None:
        """Copy the best picture there is and draw reference images, axes, overlays and the HUD over it.

        ratio : device pixels for a logical one; words and lines grow with it. Overlays are in device pixels.
        """
        ctx = self.ctx
        ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        framebuffer.use()
        framebuffer.viewport = (0, 0, *size)
        if self._targets and (framebuffer.glo == 0 or framebuffer.size == self.size):
            ctx.copy_framebuffer(framebuffer, self._targets[0].alone)
            framebuffer.use()
        elif self._targets:
            self._targets[0].color.use(0)
            set_uniforms(self.copy, {"picture": 0})
            self.copy_triangle.render(moderngl.TRIANGLES, vertices=3)
        self._draw_references(size)
        self.draw_over(size, overlays, hud if self.options.hud else (), ratio, self.options.axes)
        self.picture_changed = False

    def draw_over(
        self, size: tuple[int, int], overlays: Sequence[Overlay], hud: Sequence[HudLine], ratio: float, axes: bool
    ) -> None:
        """Draw marks and words over what is in the bound framebuffer."""
        rows = [marks(overlays, self.tones, ratio)]
        words = labels(overlays, self.tones)
        if axes and self.camera is not None:
            lines, names = axes_marks(self.camera, size, ratio)
            rows.insert(0, lines)
            words += names
        self.marks.draw(np.concatenate(rows), size, ratio)
        if hud or self.options.hud:
            words += self._hud_words(hud, ratio)
        self.images.draw_words(words, TEXT_PIXELS * ratio, size)

    def _draw_references(self, size: tuple[int, int]) -> None:
        for reference in self.options.references:
            texture = self.pictures.texture(reference.path)
            if texture is not None:
                left, top, width = reference.x * size[0], reference.y * size[1], reference.width * size[0]
                box = (left, top, left + width, top + width * texture.height / texture.width)
                self.images.draw(texture, box, size, (1.0, 1.0, 1.0, reference.opacity))

    def _hud_words(self, hud: Sequence[HudLine], ratio: float) -> list[Words]:
        lines = [(line, "plain") if isinstance(line, str) else line for line in hud]
        lines += [(f"{name} cannot be shown; choose another image", "trouble") for name in self.pictures.unreadable]
        return [
            Words(
                HUD_MARGIN * ratio, (HUD_MARGIN + TEXT_PIXELS * (0.9 + LINE * number)) * ratio, line,
                self.tones.get(tone, self.tones["plain"]),
            )
            for number, (line, tone) in enumerate(lines)
        ]

    @property
    def picture(self) -> moderngl.Framebuffer:
        """The best picture there is of what is shown, displayed colours alone; one must have been drawn."""
        return self._targets[0].alone

    # what is kept

    def _light_key(self) -> tuple[tuple[Any, ...], NDArray[np.float64]]:
        assert self.camera is not None
        toward = light_directions(self.scene, self.camera)
        scene = self.scene
        return (*scene.surfaces, *scene.feathers, bool(scene.coats), scene.lights), toward["key"]

    def _lit_alike(self) -> bool:
        """True when the finished maps of the light do for a moving picture of now."""
        lit, (key, toward) = self._lit, self._light_key()
        return lit is not None and same(lit[0], key) and alike(lit[1], toward)

    def _picture_key(self) -> tuple[Any, ...]:
        """All that may not change for a finished picture to stay where nothing moves: all but points in place."""
        guides = tuple(
            lines._replace(points=lines.points.shape, states=lines.states.shape)  # type: ignore[arg-type]
            for lines in self.scene.guides
        )
        return self.scene._replace(guides=()), guides, self.camera, self.size, self.options

    def _target(self, number: int) -> moderngl.Framebuffer:
        """The shown picture (0) or the one being drawn (1)."""
        if self._targets and self._targets[0].color.size != self.size:
            self._release_targets()
        while len(self._targets) <= number:
            self._targets.append(display_target(self.ctx, self.size))
        return self._targets[number].framebuffer

    def _release_targets(self) -> None:
        for target in self._targets:
            target.release()
        self._targets = []

    def release(self) -> None:
        """Give back everything; the context must be current."""
        self._version += 1
        self._release_targets()
        for thing in (
            self.moving, self.renderer, self.marks, self.images, self.pictures, self.copy_triangle, self.copy
        ):
            thing.release()
        collect(self.ctx)
