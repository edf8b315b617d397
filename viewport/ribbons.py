"""Blended ribbons, far to near: the part of drawing that hair and guides share."""

from __future__ import annotations

from collections.abc import Callable

import moderngl
import numpy as np
from numpy.typing import NDArray

from viewport.shaders import program, set_uniforms
from viewport.strand_textures import StrandTextures, points_by_axis

SEGMENTS_AT_ONCE = 1 << 17  # between two calls of the progress
CORNERS = np.array([0, 1, 2, 2, 1, 3], np.uint32)


def far_to_near(points: np.ndarray, view_row: NDArray[np.float64]) -> NDArray[np.uint32]:
    """Order of all segments by decreasing depth of their middle, (N * (P - 1),) uint32, strand-major numbers.

    points : (N, 3, P) or (N, P, 3) float32. view_row : (4,) float64, depth = view_row . (x, y, z, 1).

    Depth is cut into 65,536 steps, so that numpy sorts by radix, in one pass over the data; equal steps keep their
    order, which makes pictures repeat to the bit.
    """
    x, y, z = points_by_axis(points)
    a, b, c = (np.float32(v) for v in view_row[:3])
    depth = x * a
    depth += y * b
    depth += z * c
    middle = (depth[:, 1:] + depth[:, :-1]).reshape(-1)
    if len(middle) == 0:
        return np.zeros(0, np.uint32)
    low, high = float(middle.min()), float(middle.max())
    scale = np.float32(65535.0 / max(high - low, 1e-30))
    steps = ((np.float32(high) - middle) * scale).astype(np.uint16)
    return np.argsort(steps, kind="stable").astype(np.uint32)


class Ribbons:
    """The program and the index buffer that draw any strands whose sides and colours have been worked out."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self.program = program(ctx, ("strand_points.glsl", "ribbon.vert"), ("ribbon.frag",))
        self.indices = ctx.buffer(reserve=SEGMENTS_AT_ONCE * 24, dynamic=True)
        self.vertices = ctx.vertex_array(self.program, [], index_buffer=self.indices, index_element_size=4)

    def draw(
        self, strands: StrandTextures, order: NDArray[np.uint32], clip_from_world: NDArray[np.float64],
        size: tuple[int, int], slice_done: Callable[[float], object],
    ) -> None:
        """Blend the segments into the bound framebuffer in the given order, testing depth but not writing it."""
        strands.bind(self.program)
        strands.sides.use(1)
        strands.colors.use(2)
        set_uniforms(self.program, {
            "strand_sides": 1, "strand_colors": 2, "clip_from_world": clip_from_world, "picture_size": size,
        })
        pieces = np.uint32(strands.per_strand - 1)
        for start in range(0, len(order), SEGMENTS_AT_ONCE):
            segments = order[start : start + SEGMENTS_AT_ONCE]
            strand, piece = np.divmod(segments, pieces)
            first = (strand * np.uint32(strands.per_strand) + piece) * np.uint32(2)
            self.indices.orphan()
            self.indices.write((first[:, None] + CORNERS).data)
            self.vertices.render(moderngl.TRIANGLES, vertices=6 * len(segments))
            slice_done((start + len(segments)) / len(order))

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.vertices, self.indices, self.program):
            thing.release()
