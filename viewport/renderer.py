"""Draws scenes from a camera into a framebuffer, keeping on the graphics card what did not change."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from core.camera import Camera, clip_from_world, pixel_scale, view_from_world
from viewport.drawables.guides import GuideDrawable, GuidePrograms
from viewport.drawables.mesh import MeshDrawable, MeshPrograms
from viewport.drawables.strands import ABSORPTION, CoatDrawable, StrandPrograms
from viewport.light_maps import LightMaps
from viewport.ribbons import Ribbons, drawn_points, far_to_near
from viewport.scene import Scene, direction, scene_extent
from viewport.shaders import program, set_uniforms

LARGEST_TILE = 4096  # samples on a side

Progress = Callable[[float], object]


class Renderer:
    """Everything one context needs to draw. Make, use and release it with the context current.

    Buffers are kept as long as the arrays of the scene are the same objects; another array of the same size is
    written into the same buffer. Arrays whose rows were changed in place are named with :meth:`rows_changed`.
    """

    def __init__(self, ctx: moderngl.Context, shadow_side: int = 1024) -> None:
        self.ctx = ctx
        self.mesh_programs = MeshPrograms(ctx)
        self.strand_programs = StrandPrograms(ctx)
        self.guide_programs = GuidePrograms(ctx)
        self.ribbons = Ribbons(ctx)
        self.light_maps = LightMaps(ctx, shadow_side)
        self.resolve = program(ctx, ("fullscreen.vert",), ("resolve.frag",))
        self.resolve_triangle = ctx.vertex_array(self.resolve, [])
        self.meshes: list[MeshDrawable] = []
        self.coats: list[CoatDrawable] = []
        self.guides: list[GuideDrawable] = []
        self.tile: tuple[moderngl.Texture, moderngl.Renderbuffer, moderngl.Framebuffer] | None = None

    def rows_changed(self, points: np.ndarray, start: int, stop: int) -> None:
        """Upload hairs or guides `start` to before `stop` of an array on the card that was written to in place."""
        for coat in self.coats:
            if coat.coat.points is points:
                coat.upload_rows(coat.coat, start, stop)
        for guides in self.guides:
            if guides.lines.points is points:
                guides.upload_rows(guides.lines, start, stop)

    def draw(
        self, scene: Scene, camera: Camera, framebuffer: moderngl.Framebuffer, size: tuple[int, int],
        samples: int = 1, progress: Progress | None = None,
    ) -> None:
        """Draw into `size` (width, height) pixels from the lower left corner of the framebuffer.

        samples : samples on a side of every pixel (2 gives 4 a pixel).
        progress : called with the done part 0 .. 1 between slices; an exception it raises stops the drawing.
        """
        told = progress if progress is not None else _nobody
        self._upload(scene)
        told(0.05)
        toward = {name: self._world_direction(scene, camera, name) for name in ("key", "fill", "rim")}
        lighting = self.light_maps.draw(scene, toward["key"], self.meshes, self.coats)
        lighting |= _light_uniforms(scene, camera, toward)
        told(0.2)
        view_row = -view_from_world(camera)[2]
        strands = [coat.points for coat in scene.coats] + [lines.points for lines in scene.guides]
        low, high = scene_extent(scene)
        away = 1.0 if camera.orthographic else max(float(view_row @ [*(0.5 * (low + high)), 1.0]), camera.near)
        scale = pixel_scale(camera, size[1]) * samples / away
        pieces = [drawn_points(points, scale) for points in strands]
        orders = [far_to_near(points, view_row, drawn) for points, drawn in zip(strands, pieces, strict=True)]
        tiles = _tiles(size, samples)
        for number, tile in enumerate(tiles):
            def tile_told(part: float, number: int = number) -> None:
                told(0.2 + 0.8 * (number + part) / len(tiles))

            self._draw_tile(scene, camera, size, samples, tile, lighting, orders, pieces, tile_told)
            self._resolve_tile(scene, framebuffer, size, samples, tile)
        told(1.0)

    def _upload(self, scene: Scene) -> None:
        ctx = self.ctx
        self.meshes = _matched(self.meshes, scene.surfaces, lambda s: MeshDrawable(ctx, self.mesh_programs, s))
        self.coats = _matched(self.coats, scene.coats, lambda c: CoatDrawable(ctx, self.strand_programs, c))
        self.guides = _matched(self.guides, scene.guides, lambda g: GuideDrawable(ctx, self.guide_programs, g))

    @staticmethod
    def _world_direction(scene: Scene, camera: Camera, name: str) -> NDArray[np.float64]:
        vector = direction(getattr(scene.lights, name))
        return camera.world_from_camera[:3, :3] @ vector if scene.lights.follow_camera else vector

    def _draw_tile(
        self, scene: Scene, camera: Camera, size: tuple[int, int], samples: int, tile: tuple[int, int, int, int],
        lighting: dict[str, Any], orders: list[NDArray[np.uint32]], pieces: list[NDArray[np.intp]], told: Progress,
    ) -> None:
        _, _, width, height = tile
        wide, high = width * samples, height * samples
        matrix = _tile_from_picture(size, tile) @ clip_from_world(camera, *size)
        uniforms = {
            **lighting, "clip_from_world": matrix, "picture_size": (float(wide), float(high)),
            "pixels_at_one": pixel_scale(camera, size[1]) * samples,
        }
        ctx = self.ctx
        ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self.light_maps.bind()
        for coat in self.coats:
            coat.work_out(uniforms)
        for guides in self.guides:
            guides.work_out(uniforms, samples)
        target = self._tile_target(wide, high)
        target.use()
        target.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        ctx.enable(moderngl.DEPTH_TEST)
        depth = max((coat.look.depth for coat in scene.coats), default=1.0)
        covered = {"absorption": ABSORPTION * depth, "covered": 1.0 if scene.coats else 0.0}
        for mesh, surface in zip(self.meshes, scene.surfaces, strict=True):
            mesh.draw(surface.color, {**uniforms, **covered})
        ctx.enable(moderngl.BLEND)
        ctx.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        target.depth_mask = False
        drawn = [coat.textures for coat in self.coats] + [guides.textures for guides in self.guides]
        total, before = sum(len(order) for order in orders), 0
        try:
            for textures, order, points in zip(drawn, orders, pieces, strict=True):
                def slice_told(part: float, before: int = before, count: int = len(order)) -> None:
                    self.ctx.finish()
                    told((before + part * count) / total)

                self.ribbons.draw(textures, order, points, matrix, (wide, high), slice_told)
                before += len(order)
        finally:
            target.depth_mask = True
            ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST)

    def _tile_target(self, width: int, height: int) -> moderngl.Framebuffer:
        if self.tile is None or self.tile[0].size != (width, height):
            self._release_tile()
            color = self.ctx.texture((width, height), 4, dtype="f2")
            color.filter = (moderngl.NEAREST, moderngl.NEAREST)
            depth = self.ctx.depth_renderbuffer((width, height))
            self.tile = (color, depth, self.ctx.framebuffer([color], depth))
        return self.tile[2]

    def _resolve_tile(
        self, scene: Scene, framebuffer: moderngl.Framebuffer, size: tuple[int, int], samples: int,
        tile: tuple[int, int, int, int],
    ) -> None:
        assert self.tile is not None
        framebuffer.use()
        framebuffer.viewport = tile
        self.tile[0].use(0)
        set_uniforms(self.resolve, {
            "samples": 0, "samples_per_side": samples, "origin": (float(tile[0]), float(tile[1])),
            "picture_height": float(size[1]), "top_color": scene.background[0], "bottom_color": scene.background[1],
            "exposure": scene.exposure,
        })
        self.resolve_triangle.render(moderngl.TRIANGLES, vertices=3)

    def _release_tile(self) -> None:
        if self.tile is not None:
            for thing in reversed(self.tile):
                thing.release()
            self.tile = None

    def release(self) -> None:
        """Give back everything; the context must be current."""
        self._release_tile()
        things: list[Any] = [*self.meshes, *self.coats, *self.guides, self.resolve_triangle, self.resolve]
        things += [self.light_maps, self.ribbons, self.mesh_programs, self.strand_programs, self.guide_programs]
        for thing in things:
            thing.release()
        self.meshes, self.coats, self.guides = [], [], []


def _nobody(_: float) -> None:
    return None


def _matched(kept: list[Any], wanted: tuple[Any, ...], make: Callable[[Any], Any]) -> list[Any]:
    """Drawables for the wanted things: one with just these arrays, else one that can take them, else a new one."""
    spare = list(kept)
    found: list[Any] = [None] * len(wanted)
    for turn in ("holds", "update"):
        for i, thing in enumerate(wanted):
            if found[i] is not None:
                continue
            match = next((d for d in spare if getattr(d, turn)(thing)), None)
            if match is not None:
                spare.remove(match)
                match.update(thing)
                found[i] = match
    for drawable in spare:
        drawable.release()
    return [make(thing) if drawable is None else drawable for drawable, thing in zip(found, wanted, strict=True)]


def _light_uniforms(scene: Scene, camera: Camera, toward: dict[str, NDArray[np.float64]]) -> dict[str, Any]:
    lights = scene.lights
    return {
        "key_direction": toward["key"], "fill_direction": toward["fill"], "rim_direction": toward["rim"],
        "up_direction": (0.0, 1.0, 0.0), "key_color": lights.key_color, "fill_color": lights.fill_color,
        "rim_color": lights.rim_color, "sky_color": lights.sky_color, "ground_color": lights.ground_color,
        "eye_position": camera.position, "eye_backward": -camera.forward, "parallel_view": camera.orthographic,
    }


def _tiles(size: tuple[int, int], samples: int) -> list[tuple[int, int, int, int]]:
    """Rectangles x, y, width, height in pixels that cover the picture, at most LARGEST_TILE samples a side."""
    side = max(1, LARGEST_TILE // samples)
    width, height = size
    return [
        (x, y, min(side, width - x), min(side, height - y))
        for y in range(0, height, side) for x in range(0, width, side)
    ]


def _tile_from_picture(size: tuple[int, int], tile: tuple[int, int, int, int]) -> NDArray[np.float64]:
    """Clip space of one tile from clip space of the whole picture."""
    x, y, width, height = tile
    matrix = np.eye(4)
    matrix[0, 0], matrix[1, 1] = size[0] / width, size[1] / height
    matrix[0, 3] = (size[0] - 2.0 * x - width) / width
    matrix[1, 3] = (size[1] - 2.0 * y - height) / height
    return matrix
