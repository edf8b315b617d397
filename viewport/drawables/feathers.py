"""Feathers on the graphics card: triangles with a direction of fibre."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from core.feather.pieces import FeatherMesh
from viewport.shaders import program, set_uniforms

PICTURE_UNIT = 8
AT_ONCE = 1 << 13  # triangles: a few dozen milliseconds in software
COLUMNS = (
    ("points", "3f", "in_position"), ("normals", "3f", "in_normal"), ("fibres", "3f", "in_fibre"),
    ("colors", "3f", "in_color"), ("light", "4f", "in_light"), ("film", "2f", "in_film"),
    ("opacity", "1f", "in_opacity"), ("flat", "2f", "in_flat"),
)  # fmt: skip
EVERYTHING = tuple(name for name, _, _ in COLUMNS)
IN_DEPTH = ("points", "opacity", "flat")


class FeatherPrograms:
    """The programs all feathers are drawn with: in light, lit at vertices alone, and as depth alone."""

    def __init__(self, ctx: moderngl.Context) -> None:
        paint, cover = "feather_paint.glsl", "feather_cover.glsl"
        light = ("display.glsl", "lighting.glsl", "feather_light.glsl", paint)
        self.shaded = program(ctx, ("feather.vert",), (*light, cover, "feather.frag"))
        self.quick = program(ctx, (*light, "feather_quick.vert"), (paint, cover, "feather_quick.frag"))
        self.depth = program(ctx, ("feather_depth.vert",), (paint, cover, "feather_depth.frag"))

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.shaded, self.quick, self.depth):
            thing.release()


class FeatherDrawable:
    """Buffers of one mesh of feathers, kept as long as its arrays are the same ones."""

    def __init__(self, ctx: moderngl.Context, programs: FeatherPrograms, mesh: FeatherMesh) -> None:
        self.mesh = mesh
        self.programs = programs
        self.buffers = {name: ctx.buffer(_bytes(getattr(mesh, name), np.float32)) for name, _, _ in COLUMNS}
        self.indices = ctx.buffer(_bytes(mesh.triangles, np.int32))
        self.picture: moderngl.Texture | None = None
        if mesh.picture is not None:
            high, wide = mesh.picture.shape[:2]
            self.picture = ctx.texture((wide, high), 4, np.ascontiguousarray(mesh.picture).tobytes())
            self.picture.build_mipmaps()
            self.picture.repeat_x = self.picture.repeat_y = False
        self.shaded, self.quick, self.depth = (
            ctx.vertex_array(prog, [
                (self.buffers[name], kind, given) for name, kind, given in COLUMNS if name in wanted
            ], index_buffer=self.indices, index_element_size=4)
            for prog, wanted in (
                (programs.shaded, EVERYTHING), (programs.quick, EVERYTHING), (programs.depth, IN_DEPTH))
        )  # fmt: skip

    def holds(self, mesh: FeatherMesh) -> bool:
        """True when the buffers hold just these arrays."""
        mine = self.mesh
        names = [name for name, _, _ in COLUMNS] + ["triangles", "picture"]
        return all(getattr(mine, name) is getattr(mesh, name) for name in names)

    def update(self, mesh: FeatherMesh) -> bool:
        """Take another mesh with the same triangles (another pose); False when they differ."""
        mine = self.mesh
        if mesh.triangles is not mine.triangles or mesh.picture is not mine.picture or (
            mesh.points.shape != mine.points.shape
        ):
            return False
        for name, _, _ in COLUMNS:
            if getattr(mesh, name) is not getattr(mine, name):
                self.buffers[name].write(_bytes(getattr(mesh, name), np.float32))
        self.mesh = mesh
        return True

    @property
    def slices(self) -> list[tuple[int, int]]:
        """Triangles (first, how many) that are drawn at once without the window standing still."""
        count = len(self.mesh.triangles)
        return [(first, min(AT_ONCE, count - first)) for first in range(0, count, AT_ONCE)]

    def draw(self, uniforms: dict[str, Any], part: tuple[int, int], quick: bool = False) -> None:
        """Draw some triangles in light; with the uniforms of lighting.glsl. quick : lit at their vertices alone."""
        optics = self.mesh.optics
        more = {"under": optics.under, "film_index": optics.film_index, "film_spread": optics.film_spread}
        self._render(self.quick if quick else self.shaded, {**uniforms, **more}, part)

    def draw_depth(self, clip_from_world: np.ndarray, part: tuple[int, int]) -> None:
        """Draw the depth of some triangles alone."""
        self._render(self.depth, {"clip_from_world": clip_from_world}, part)

    def _render(self, vertices: moderngl.VertexArray, uniforms: dict[str, Any], part: tuple[int, int]) -> None:
        if self.picture is not None:
            self.picture.use(PICTURE_UNIT)
        set_uniforms(vertices.program, {
            **uniforms, "has_picture": self.picture is not None, "picture": PICTURE_UNIT,
            "picture_corner": self.mesh.corner, "picture_extent": self.mesh.extent,
        })  # fmt: skip
        vertices.render(moderngl.TRIANGLES, first=3 * part[0], vertices=3 * part[1])

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.shaded, self.quick, self.depth, *self.buffers.values(), self.indices, self.picture):
            if thing is not None:
                thing.release()


def _bytes(values: np.ndarray, dtype: type) -> bytes:
    return np.ascontiguousarray(values, dtype).tobytes() or bytes(16)
