"""Triangles of skin on the graphics card."""

from __future__ import annotations

from typing import Any

import cv2
import moderngl
import numpy as np
from numpy.typing import NDArray

from viewport.scene import RAMPS, Color, Surface
from viewport.shaders import program, set_uniforms

RAMP_UNIT = 7
EDGE_NEARER = 2e-4  # of the depth range, for lines on their own triangles
GHOST_OPACITY = 0.10  # where a ghost faces the viewer; more at its edges


class MeshPrograms:
    """The programs every mesh is drawn with: in light, as depth alone, as edges; and the colours of maps."""

    def __init__(self, ctx: moderngl.Context) -> None:
        skin = ("display.glsl", "lighting.glsl", "skin.glsl")
        self.shaded = program(ctx, ("mesh.vert",), (*skin, "mesh.frag"))
        self.quick = program(ctx, (*skin, "mesh_quick.vert"), ("mesh_quick.frag",))
        self.depth = program(ctx, ("mesh_depth.vert",), ("depth_only.frag",))
        self.edges = program(ctx, ("mesh_edges.vert",), ("display.glsl", "mesh_edges.frag"))
        rows = np.stack([map_colors(), map_colors(), signed_colors()])  # as scene.RAMPS
        self.ramp = ctx.texture((256, len(rows)), 4, dtype="f4", data=rows.tobytes())
        self.ramp.filter = (moderngl.LINEAR, moderngl.LINEAR)
        self.ramp.repeat_x = False

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.shaded, self.quick, self.depth, self.edges, self.ramp):
            thing.release()


def map_colors() -> NDArray[np.float32]:
    """(256, 4) float32: linear RGB of a map's values from 0 to 1, and 1. Viridis: even steps look like even steps."""
    return _linear(cv2.applyColorMap(np.arange(256, dtype=np.uint8)[:, None], cv2.COLORMAP_VIRIDIS)[:, 0, ::-1] / 255.0)


def signed_colors() -> NDArray[np.float32]:
    """As :func:`map_colors`, of values about 0.5: blue below, grey where there is nothing, orange above."""
    stops = np.array([[30, 80, 190], [110, 165, 230], [176, 176, 178], [238, 160, 80], [190, 50, 20]]) / 255.0
    at = np.linspace(0.0, len(stops) - 1.0, 256)
    return _linear(np.stack([np.interp(at, np.arange(len(stops)), stops[:, k]) for k in range(3)], axis=1))


def _linear(steps: NDArray[np.float64]) -> NDArray[np.float32]:
    out = np.ones((256, 4), np.float32)
    out[:, :3] = np.where(steps <= 0.04045, steps / 12.92, ((steps + 0.055) / 1.055) ** 2.4)
    return out


def triangle_edges(triangles: np.ndarray) -> NDArray[np.int32]:
    """(E, 2) int32: every edge of the triangles (T, 3) once."""
    pairs = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    return np.unique(pairs, axis=0).astype(np.int32).reshape(-1, 2)


class MeshDrawable:
    """Buffers of one surface, kept as long as its arrays are the same ones."""

    def __init__(self, ctx: moderngl.Context, programs: MeshPrograms, surface: Surface) -> None:
        self.ctx = ctx
        self.surface = surface
        self.programs = programs
        self.positions = ctx.buffer(_bytes(surface.points, np.float32))
        self.normals = ctx.buffer(_bytes(surface.normals, np.float32))
        self.values = ctx.buffer(_bytes(_values(surface), np.float32))
        self.indices = ctx.buffer(_bytes(surface.triangles, np.int32))
        self.lines: tuple[moderngl.Buffer, moderngl.VertexArray, int] | None = None
        columns = [
            (self.positions, "3f", "in_position"), (self.normals, "3f", "in_normal"), (self.values, "1f", "in_value")
        ]
        self.shaded, self.quick = (
            ctx.vertex_array(program, columns, index_buffer=self.indices, index_element_size=4)
            for program in (programs.shaded, programs.quick)
        )
        self.depth = ctx.vertex_array(
            programs.depth, [(self.positions, "3f", "in_position")], index_buffer=self.indices, index_element_size=4
        )

    def holds(self, surface: Surface) -> bool:
        """True when the buffers hold just these arrays."""
        mine = self.surface
        return (
            mine.points is surface.points and mine.normals is surface.normals
            and mine.triangles is surface.triangles and mine.values is surface.values and mine.edges is surface.edges
        )

    def update(self, surface: Surface) -> bool:
        """Take other points, normals or values of the same size and triangles (a pose); False when they differ."""
        mine = self.surface
        if surface.triangles is not mine.triangles or surface.points.shape != mine.points.shape:
            return False
        if surface.points is not mine.points:
            self.positions.write(_bytes(surface.points, np.float32))
        if surface.normals is not mine.normals:
            self.normals.write(_bytes(surface.normals, np.float32))
        if surface.values is not mine.values:
            self.values.write(_bytes(_values(surface), np.float32))
        if surface.edges is not mine.edges:
            self._release_lines()
        self.surface = surface
        return True

    def draw(self, uniforms: dict[str, Any], color: Color | None = None, quick: bool = False) -> None:
        """Draw in light, or as `manner` and `opacity` among the uniforms say; with them those of lighting.glsl.

        color : linear RGB in the place of the surface's own. quick : light the vertices alone.
        """
        if len(self.surface.triangles):
            self.programs.ramp.use(RAMP_UNIT)
            vertices = self.quick if quick else self.shaded
            set_uniforms(vertices.program, {
                "manner": 0, "opacity": 1.0, **uniforms, "surface_color": color or self.surface.color,
                "ramp": RAMP_UNIT, "show_map": self.surface.values is not None,
                "ramp_row": RAMPS.index(self.surface.ramp),
            })
            vertices.render(moderngl.TRIANGLES, vertices=3 * len(self.surface.triangles))

    def draw_edges(self, color: tuple[float, float, float, float], uniforms: dict[str, Any]) -> None:
        """Draw the edges as lines; linear RGB and opacity."""
        if self.lines is None:
            edges = triangle_edges(self.surface.triangles) if self.surface.edges is None else self.surface.edges
            indices = self.ctx.buffer(_bytes(edges, np.int32))
            self.lines = indices, self.ctx.vertex_array(
                self.programs.edges, [(self.positions, "3f", "in_position")], index_buffer=indices,
                index_element_size=4,
            ), 2 * len(edges)
        if self.lines[2]:
            set_uniforms(self.programs.edges, {**uniforms, "edge_color": color, "nearer": EDGE_NEARER})
            self.lines[1].render(moderngl.LINES, vertices=self.lines[2])

    def draw_depth(self, clip_from_world: np.ndarray) -> None:
        """Draw depth alone."""
        if len(self.surface.triangles):
            set_uniforms(self.programs.depth, {"clip_from_world": clip_from_world})
            self.depth.render(moderngl.TRIANGLES, vertices=3 * len(self.surface.triangles))

    def _release_lines(self) -> None:
        if self.lines is not None:
            self.lines[1].release()
            self.lines[0].release()
            self.lines = None

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        self._release_lines()
        for thing in (self.shaded, self.quick, self.depth, self.positions, self.normals, self.values, self.indices):
            thing.release()


def _bytes(values: np.ndarray, dtype: type) -> bytes:
    return np.ascontiguousarray(values, dtype).tobytes() or bytes(12)


def _values(surface: Surface) -> np.ndarray:
    return np.zeros(len(surface.points), np.float32) if surface.values is None else surface.values
