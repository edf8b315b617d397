"""One view or several side by side: the same camera at different scenes, each in a part of the screen with its name.

One :class:`View3D` draws all of them in turn, so that nothing is kept twice; with a single pane it is shown directly.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import moderngl
import numpy as np

from core.camera import Camera
from core.overlay import Label, Overlay, Polyline
from core.workspace import ViewOptions
from viewport.kept import same
from viewport.legend import Legend, LegendDrawing
from viewport.overlay_drawing import LETTER, labels, marks
from viewport.scene import Scene
from viewport.shaders import program, set_uniforms
from viewport.view import TEXT_PIXELS, HudLine, View3D

NAME_X, NAME_Y = 26.0, 28.0  # pixels from the upper right corner of a pane to the foot of its name


class Pane(NamedTuple):
    """A scene, its name in the picture, and what its colours mean."""

    scene: Scene
    name: str = ""
    legend: Legend | None = None


def grid_of(count: int, whole: tuple[int, int]) -> tuple[int, int]:
    """Columns and rows of so many panes on a screen: up to three in a line along its longer side."""
    if count > 3:
        return 2, (count + 1) // 2
    return (count, 1) if whole[0] > whole[1] else (1, count)


def size_of(count: int, whole: tuple[int, int]) -> tuple[int, int]:
    """Width and height of a pane, pixels."""
    columns, rows = grid_of(count, whole)
    return max(whole[0] // columns, 1), max(whole[1] // rows, 1)


def corner_of(number: int, count: int, whole: tuple[int, int]) -> tuple[int, int]:
    """The upper left corner of a pane, pixels with y down."""
    (columns, _), (width, height) = grid_of(count, whole), size_of(count, whole)
    return number % columns * width, number // columns * height


def pane_at(x: float, y: float, count: int, whole: tuple[int, int]) -> int:
    """The pane a pixel is in, or is nearest to."""
    (columns, rows), (width, height) = grid_of(count, whole), size_of(count, whole)
    column, row = (min(max(int(at + 0.5) // side, 0), most - 1)
                   for at, side, most in ((x, width, columns), (y, height, rows)))
    return min(column + columns * row, count - 1)


class Panes:
    """Draws panes through one view. Make, use and release it with the context current."""

    def __init__(self, view: View3D) -> None:
        self.view = view
        self.shown: tuple[Pane, ...] = (Pane(Scene()),)
        self.legends = LegendDrawing(view.ctx, view.images)
        self.copy = program(view.ctx, ("fullscreen.vert",), ("pane.frag",))
        self.copy_triangle = view.ctx.vertex_array(self.copy, [])
        self.pictures: list[tuple[moderngl.Texture, moderngl.Framebuffer]] = []
        self.camera: Camera | None = None
        self.size, self.options = (1, 1), ViewOptions()
        self._version = 0

    def begin(
        self, panes: Sequence[Pane], camera: Camera, size: tuple[int, int], options: ViewOptions
    ) -> bool:
        """Say what is to be shown; True when that differs from before. `size` is that of one pane."""
        shown = tuple(panes)
        if len(shown) == 1:
            again = len(self.shown) != 1
            self.shown, self.camera, self.size, self.options = shown, camera, size, options
            self._keep(0)
            return self.view.begin(shown[0].scene, camera, size, options) or again
        before = tuple(pane.scene for pane in self.shown), self.camera, self.size, self.options
        after = tuple(pane.scene for pane in shown), camera, size, options
        self.shown, self.camera, self.size, self.options = shown, camera, size, options
        if same(before, after):
            return False
        self._version += 1
        return True

    def draw_interactive(self, hairs: int) -> int:
        """Draw the moving picture of every pane; how many hairs the last shows."""
        if len(self.shown) == 1:
            return self.view.draw_interactive(hairs)
        self._keep(len(self.shown))
        self._version += 1
        shown = 0
        for number in range(len(self.shown)):
            self._turn_to(number)
            shown = self.view.draw_interactive(hairs)
            self._take(number)
        return shown

    def refine(self) -> Iterator[float]:
        """As that of the view, of one pane after the other; the done part 0 .. 1."""
        if len(self.shown) == 1:
            yield from self.view.refine()
            return
        version, count = self._version, len(self.shown)
        self._keep(count)
        for number in range(count):
            self._turn_to(number)
            for part in self.view.refine():
                yield (number + part) / count
                if version != self._version:
                    return
            self._take(number)
            self.view.picture_changed = True
            yield (number + 1) / count

    def present(
        self, framebuffer: moderngl.Framebuffer, whole: tuple[int, int], overlays: Sequence[Overlay] = (),
        hud: Sequence[HudLine] = (), ratio: float = 1.0,
    ) -> None:
        """Bring the pictures to a screen of `whole` pixels; the overlays, in pixels of a pane, are drawn over each."""
        view = self.view
        if len(self.shown) == 1:
            view.present(framebuffer, self.size, overlays, hud, ratio)
            self._over(0, (), ratio)
            return
        ctx = view.ctx
        ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        framebuffer.use()
        framebuffer.viewport = (0, 0, *whole)
        framebuffer.clear(0.0, 0.0, 0.0, 1.0)
        for number, (texture, _) in enumerate(self.pictures):
            x, y = corner_of(number, len(self.shown), whole)
            corner = x, whole[1] - y - self.size[1]
            framebuffer.viewport = (*corner, *self.size)
            texture.use(0)
            set_uniforms(self.copy, {"picture": 0, "corner": corner})
            self.copy_triangle.render(moderngl.TRIANGLES, vertices=3)
            self._over(number, overlays, ratio)
        framebuffer.viewport = (0, 0, *whole)
        view.marks.draw(marks(_borders(len(self.shown), whole), view.tones, ratio), whole, ratio)
        view.picture_changed = False

    def _over(self, number: int, overlays: Sequence[Overlay], ratio: float) -> None:
        """Marks, the name and the legend over a pane; the viewport is there."""
        pane, view, size = self.shown[number], self.view, self.size
        if pane.name:
            left = size[0] - (NAME_X + LETTER * len(pane.name)) * ratio
            name = Label(max(left, 0.0), NAME_Y * ratio, pane.name, "accent", plate=True)
            overlays = (*overlays, name)
        if overlays:
            view.marks.draw(marks(overlays, view.tones, ratio), size, ratio)
            view.images.draw_words(labels(overlays, view.tones), TEXT_PIXELS * ratio, size)
        if pane.legend is not None:
            self.legends.draw(pane.legend, size, TEXT_PIXELS * ratio, ratio)

    def _turn_to(self, number: int) -> None:
        assert self.camera is not None
        self.view.begin(self.shown[number].scene, self.camera, self.size, self.options)

    def _take(self, number: int) -> None:
        """Keep the picture that the view has drawn as that of a pane."""
        self.view.ctx.copy_framebuffer(self.pictures[number][1], self.view.picture)

    def _keep(self, count: int) -> None:
        """Have room for so many pictures of the size of now."""
        if len(self.pictures) == count and (not count or self.pictures[0][0].size == self.size):
            return
        for texture, target in self.pictures:
            target.release()
            texture.release()
        self.pictures = []
        for _ in range(count):
            texture = self.view.ctx.texture(self.size, 4)
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self.pictures.append((texture, self.view.ctx.framebuffer([texture])))

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        self._keep(0)
        for thing in (self.legends, self.copy_triangle, self.copy):
            thing.release()


def _borders(count: int, whole: tuple[int, int]) -> list[Overlay]:
    (columns, rows), size = grid_of(count, whole), size_of(count, whole)
    across = [Polyline(np.array([[x * size[0], 0.0], [x * size[0], whole[1]]]), "faint") for x in range(1, columns)]
    down = [Polyline(np.array([[0.0, y * size[1]], [whole[0], y * size[1]]]), "faint") for y in range(1, rows)]
    return [*across, *down]
