"""Draws scenes from a camera into a framebuffer, keeping on the graphics card what did not change."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from core.camera import Camera, clip_from_world, pixel_scale, view_from_world
from core.workspace import ViewOptions
from viewport.backdrop import Backdrop
from viewport.drawables.guides import GuideDrawable, GuidePrograms
from viewport.drawables.strands import CoatDrawable, StrandPrograms
from viewport.kept import matched
from viewport.light_maps import LightMaps
from viewport.near_side import shown_rows
from viewport.outline import Outline, extent
from viewport.ribbons import Ribbons, drawn_points, far_to_near
from viewport.scene import Coat, GuideLines, Scene, direction
from viewport.solids import PLAIN, Solids, lit_uniforms

LARGEST_TILE = 4096  # samples on a side
TILE_STEP = 512  # sizes of tiles are multiples of it, so that another size of a window seldom asks for another one
MUCH_TOO_LARGE = 5.0  # times; a window paints with one sample and with four in turns
SAMPLES_AT_ONCE = 1 << 18  # of meshes and of the way to pixels, drawn between two steps

Progress = Callable[[float], object]


class Prepared(NamedTuple):
    """A scene whose light, shading and layout on the screen are on the card, ready to be painted."""

    scene: Scene
    camera: Camera
    size: tuple[int, int]
    uniforms: dict[str, Any]
    options: ViewOptions


class _Tile(NamedTuple):
    """What samples of a tile are painted into, from the lower left corner."""

    light: moderngl.Texture
    depth: moderngl.Renderbuffer
    target: moderngl.Framebuffer

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.target, self.depth, self.light):
            thing.release()


class Renderer:
    """Everything one context needs to draw. Make, use and release it with the context current.

    Buffers are kept as long as the arrays of the scene are the same objects; another array of the same size is
    written into the same buffer. Arrays whose rows were changed in place are named with :meth:`rows_changed`.

    Drawing goes in steps that leave the state of the context as they found it and take a few dozen milliseconds at
    the most, so that a window can stop between any two of them.
    """

    def __init__(self, ctx: moderngl.Context, shadow_side: int = 1024, largest_tile: int = LARGEST_TILE) -> None:
        self.ctx = ctx
        self.largest_tile = largest_tile
        self.solids = Solids(ctx)
        self.strand_programs = StrandPrograms(ctx)
        self.guide_programs = GuidePrograms(ctx)
        self.ribbons = Ribbons(ctx)
        self.light_maps = LightMaps(ctx, shadow_side)
        self.backdrop = Backdrop(ctx)
        self.outline = Outline()
        self.coats: list[CoatDrawable] = []
        self.guides: list[GuideDrawable] = []
        self.tile: _Tile | None = None  # kept, for fresh memory of that size takes 50 ms

    def rows_changed(self, points: np.ndarray, rows: np.ndarray) -> None:
        """Upload again, before the next picture, these rows of an array of hairs or guides written to in place."""
        self.outline.changed(points)
        for coat in self.coats:
            if coat.coat.points is points:
                coat.textures.mark(rows)
        for guides in self.guides:
            if guides.lines.points is points:
                guides.textures.mark(rows)

    def draw(
        self, scene: Scene, camera: Camera, framebuffer: moderngl.Framebuffer, size: tuple[int, int],
        samples: int = 1, progress: Progress | None = None, options: ViewOptions = PLAIN,
    ) -> None:
        """Draw into `size` (width, height) pixels from the lower left corner of the framebuffer.

        samples : samples on a side of every pixel (2 gives 4 a pixel).
        progress : called with the done part 0 .. 1 between steps; an exception it raises stops the drawing.
        """
        for part in self.steps(scene, camera, framebuffer, size, samples, options):
            self.ctx.finish()
            if progress is not None:
                progress(part)

    def steps(
        self, scene: Scene, camera: Camera, framebuffer: moderngl.Framebuffer, size: tuple[int, int],
        samples: int = 1, options: ViewOptions = PLAIN,
    ) -> Iterator[float]:
        """Draw as :meth:`draw` does, a little at every step; the done part 0 .. 1."""
        prepared = yield from _scaled(self.prepare(scene, camera, size, options), 0.0, 0.4)
        yield from _scaled(self.paint(prepared, framebuffer, samples), 0.4, 1.0)

    def prepare(
        self, scene: Scene, camera: Camera, size: tuple[int, int], options: ViewOptions = PLAIN
    ) -> Generator[float, None, Prepared]:
        """Upload, draw the light's maps and shade every point, in steps; the done part 0 .. 1."""
        yield from self._upload(scene)
        toward = light_directions(scene, camera)
        maps = self.light_maps.draw(scene, toward["key"], self.solids.cast_shadows, self.coats, self.outline.of(scene))
        lighting = yield from _told(maps, 0.3)
        uniforms = camera_uniforms(scene, camera, size) | lighting | light_uniforms(scene, toward)
        for things in (self.coats, self.guides):
            for thing in things:
                steps = thing.work_out(uniforms)
                self._before_shading()
                for _ in steps:
                    yield 0.7
                    self._before_shading()
        yield 1.0
        return Prepared(scene, camera, size, uniforms, options)

    def _before_shading(self) -> None:
        self.ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self.light_maps.bind()

    def paint(
        self, prepared: Prepared, framebuffer: moderngl.Framebuffer, samples: int = 1, near_only: bool = False
    ) -> Iterator[float]:
        """Draw what was prepared, in steps; the done part 0 .. 1.

        near_only : leave out hairs that stand on the side of the skin that is turned away, and short pieces.
        """
        scene, camera, size = prepared.scene, prepared.camera, prepared.size
        view_row = -view_from_world(camera)[2]
        low, high = extent(self.outline.of(scene))
        away = 1.0 if camera.orthographic else max(float(view_row @ [*(0.5 * (low + high)), 1.0]), camera.near)
        scale = pixel_scale(camera, size[1]) * (0.5 if near_only else samples) / away
        pieces, orders = [], []
        every: list[Coat | GuideLines] = [*scene.coats, *scene.guides]
        for strands in every:
            rows = shown_rows(strands, camera, near_only)
            pieces.append(drawn_points(strands.points, scale))
            orders.append((yield from _told(far_to_near(strands.points, view_row, pieces[-1], rows), 0.1)))
        tiles = _tiles(size, samples, self.largest_tile)
        for number, tile in enumerate(tiles):
            painted = self._paint_tile(prepared, samples, tile, orders, pieces)
            yield from _scaled(painted, 0.1 + 0.9 * number / len(tiles), 0.1 + 0.9 * (number + 1) / len(tiles))
            assert self.tile is not None
            light = self.tile.light
            band = max(1, 2 * SAMPLES_AT_ONCE // (tile[2] * samples**2))
            for bottom in range(0, tile[3], band):
                framebuffer.scissor = (tile[0], tile[1] + bottom, tile[2], min(band, tile[3] - bottom))
                self.backdrop.resolved(light, scene, size, samples, tile, framebuffer)
                framebuffer.scissor = None  # type: ignore[assignment]
                yield 0.1 + 0.9 * (number + 1) / len(tiles)
        yield 1.0

    def _upload(self, scene: Scene) -> Iterator[float]:
        ctx = self.ctx
        self.solids.upload(scene)
        self.coats = matched(self.coats, scene.coats, lambda c: CoatDrawable(ctx, self.strand_programs, c))
        self.guides = matched(self.guides, scene.guides, lambda g: GuideDrawable(ctx, self.guide_programs, g))
        yield 0.02
        for things in (self.coats, self.guides):
            for thing in things:
                for _ in thing.upload():
                    yield 0.1

    def _paint_tile(
        self, prepared: Prepared, samples: int, tile: tuple[int, int, int, int], orders: list[NDArray[np.uint32]],
        pieces: list[NDArray[np.intp]],
    ) -> Iterator[float]:
        scene, camera, size = prepared.scene, prepared.camera, prepared.size
        matrix = _tile_from_picture(size, tile) @ clip_from_world(camera, *size)
        width, height = tile[2] * samples, tile[3] * samples
        yield from self._make_room(width, height)
        assert self.tile is not None
        target = self.tile.target
        target.viewport = (0, 0, width, height)
        target.use()
        target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0, viewport=target.viewport)
        uniforms = {**prepared.uniforms, "clip_from_world": matrix}
        rows = max(1, SAMPLES_AT_ONCE // width)
        bands = [(0, bottom, width, min(rows, height - bottom)) for bottom in range(0, height, rows)]
        lit = lit_uniforms(scene, camera, uniforms)
        for band in bands:
            target.scissor = band
            self.light_maps.bind()
            self.solids.fill(scene, target, lit, prepared.options)
            target.scissor = None  # type: ignore[assignment]
            yield 0.02 * band[1] / height
        self.light_maps.bind()
        for part in self.solids.plumage(target, lit):
            yield 0.02 + 0.02 * part
            self.light_maps.bind()
        for band in bands:
            target.scissor = band
            self.light_maps.bind()
            self.solids.finish(camera, target, lit, self.outline.of(scene), prepared.options, samples)
            target.scissor = None  # type: ignore[assignment]
            yield 0.04 + 0.01 * band[1] / height
        drawn = [coat.textures for coat in self.coats] + [guides.textures for guides in self.guides]
        total, before = max(sum(len(order) for order in orders), 1), 0.0
        for textures, order, points in zip(drawn, orders, pieces, strict=True):
            share = 0.95 * len(order) / total
            for part in self.ribbons.draw(textures, order, points, matrix, target, samples):
                yield 0.05 + before + part * share
            before += share

    def _make_room(self, width: int, height: int) -> Iterator[float]:
        """See to a tile of at least so many samples, in steps."""
        wide, high = (-(-side // TILE_STEP) * TILE_STEP for side in (width, height))
        if self.tile is not None:
            have = self.tile.light.size
            if have[0] >= width and have[1] >= height and have[0] * have[1] <= MUCH_TOO_LARGE * wide * high:
                return
            self.tile.release()
            self.tile = None
            yield 0.0
        light = self.ctx.texture((wide, high), 4, dtype="f2")
        light.filter = (moderngl.NEAREST, moderngl.NEAREST)
        yield 0.0
        depth = self.ctx.depth_renderbuffer((wide, high))
        self.tile = _Tile(light, depth, self.ctx.framebuffer([light], depth))
        yield 0.0

    def release(self) -> None:
        """Give back everything; the context must be current."""
        if self.tile is not None:
            self.tile.release()
        things: list[Any] = [*self.coats, *self.guides, self.backdrop, self.solids]
        things += [self.light_maps, self.ribbons, self.strand_programs, self.guide_programs]
        for thing in things:
            thing.release()
        self.coats, self.guides, self.tile = [], [], None


def _scaled(steps: Any, low: float, high: float) -> Generator[float, None, Any]:
    """The same steps, their done part between `low` and `high`; returns what they return."""
    while True:
        try:
            part = next(steps)
        except StopIteration as end:
            return end.value
        yield low + (high - low) * part


def _told(steps: Any, part: float) -> Generator[float, None, Any]:
    """The same steps, which do not say how much is done."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
        yield part


def light_directions(scene: Scene, camera: Camera) -> dict[str, NDArray[np.float64]]:
    """Unit directions (3,) in world towards the key, fill and rim light."""
    turned = camera.world_from_camera[:3, :3] if scene.lights.follow_camera else np.eye(3)
    return {name: turned @ direction(getattr(scene.lights, name)) for name in ("key", "fill", "rim")}


def camera_uniforms(scene: Scene, camera: Camera, size: tuple[int, int], to_display: bool = False) -> dict[str, Any]:
    """Where things lie on the screen, and whether a target holds light or what is shown."""
    return {
        "clip_from_world": clip_from_world(camera, *size), "picture_size": (float(size[0]), float(size[1])),
        "pixels_at_one": pixel_scale(camera, size[1]), "exposure": scene.exposure, "to_display": to_display,
        "sparse": False, "stands_for_hair": False,
        "eye_position": camera.position, "eye_backward": -camera.forward, "parallel_view": camera.orthographic,
    }


def light_uniforms(scene: Scene, toward: dict[str, NDArray[np.float64]]) -> dict[str, Any]:
    """Directions and strengths of the lights."""
    lights = scene.lights
    return {
        "key_direction": toward["key"], "fill_direction": toward["fill"], "rim_direction": toward["rim"],
        "up_direction": (0.0, 1.0, 0.0), "key_color": lights.key_color, "fill_color": lights.fill_color,
        "rim_color": lights.rim_color, "sky_color": lights.sky_color, "ground_color": lights.ground_color,
    }


def _tiles(size: tuple[int, int], samples: int, largest: int) -> list[tuple[int, int, int, int]]:
    """Even rectangles x, y, width, height in pixels that cover the picture, at most `largest` samples a side."""
    (width, height), most = size, max(largest // samples, 1)
    across, up = (-(-side // -(-side // most)) for side in size)
    return [
        (x, y, min(across, width - x), min(up, height - y))
        for y in range(0, height, up) for x in range(0, width, across)
    ]


def _tile_from_picture(size: tuple[int, int], tile: tuple[int, int, int, int]) -> NDArray[np.float64]:
    """Clip space of one tile from clip space of the whole picture."""
    x, y, width, height = tile
    matrix = np.eye(4)
    matrix[0, 0], matrix[1, 1] = size[0] / width, size[1] / height
    matrix[0, 3] = (size[0] - 2.0 * x - width) / width
    matrix[1, 3] = (size[1] - 2.0 * y - height) / height
    return matrix
