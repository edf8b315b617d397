"""Triangles of skin on the graphics card."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from viewport.scene import Surface
from viewport.shaders import program, set_uniforms


class MeshPrograms:
    """The programs every mesh is drawn with: in light, and as depth alone."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.shaded = program(ctx, ("mesh.vert",), ("lighting.glsl", "mesh.frag"))
        self.depth = program(ctx, ("mesh.vert",), ("depth_only.frag",))

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        self.shaded.release()
        self.depth.release()


class MeshDrawable:
    """Buffers of one surface, kept as long as its arrays are the same ones."""

    def __init__(self, ctx: moderngl.Context, programs: MeshPrograms, surface: Surface) -> None:
        self.surface = surface
        self.programs = programs
        self.positions = ctx.buffer(np.ascontiguousarray(surface.points, np.float32).tobytes() or bytes(12))
        self.normals = ctx.buffer(np.ascontiguousarray(surface.normals, np.float32).tobytes() or bytes(12))
        self.indices = ctx.buffer(np.ascontiguousarray(surface.triangles, np.int32).tobytes() or bytes(12))
        self.shaded = ctx.vertex_array(
            programs.shaded, [(self.positions, "3f", "in_position"), (self.normals, "3f", "in_normal")],
            index_buffer=self.indices, index_element_size=4,
        )
        self.depth = ctx.vertex_array(
            programs.depth, [(self.positions, "3f", "in_position")], index_buffer=self.indices, index_element_size=4
        )

    def holds(self, surface: Surface) -> bool:
        """True when the buffers hold just these arrays."""
        mine = self.surface
        return (
            mine.points is surface.points and mine.normals is surface.normals and mine.triangles is surface.triangles
        )

    def update(self, surface: Surface) -> bool:
        """Take other points or normals of the same size and triangles (a pose); False when that is not the case."""
        mine = self.surface
        if surface.triangles is not mine.triangles or surface.points.shape != mine.points.shape:
            return False
        if surface.points is not mine.points:
            self.positions.write(np.ascontiguousarray(surface.points, np.float32).tobytes())
        if surface.normals is not mine.normals:
            self.normals.write(np.ascontiguousarray(surface.normals, np.float32).tobytes())
        self.surface = surface
        return True

    def draw(self, color: tuple[float, float, float], lighting: dict[str, Any]) -> None:
        """Draw in light; `lighting` holds the uniforms of lighting.glsl and of the camera."""
        if len(self.surface.triangles):
            set_uniforms(self.programs.shaded, {**lighting, "surface_color": color})
            self.shaded.render(moderngl.TRIANGLES, vertices=3 * len(self.surface.triangles))

    def draw_depth(self, clip_from_world: np.ndarray) -> None:
        """Draw depth alone."""
        if len(self.surface.triangles):
            set_uniforms(self.programs.depth, {"clip_from_world": clip_from_world})
            self.depth.render(moderngl.TRIANGLES, vertices=3 * len(self.surface.triangles))

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.shaded, self.depth, self.positions, self.normals, self.indices):
            thing.release()
