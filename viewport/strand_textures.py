"""Strands on the graphics card: textures that hold whole strands in every row, so that changed rows upload alone."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import numpy as np
from numpy.typing import NDArray

from viewport.shaders import set_uniforms

LARGEST_SIDE = 16384
VALUES_AT_ONCE = 1 << 19  # floats uploaded between two steps
POINTS_AT_ONCE = 1 << 17  # points shaded between two steps
SMALL = 64  # rows of textures that are kept for however few strands


class StrandTextures:
    """Points of N strands of P points and what is worked out for them on the card.

    `points` : R32F, the array as it came. `sides` : RGBA16F, one texel a point: normal of the line on the screen, half
    its width in pixels. `colors` : RGBA16F, one texel a point. `stale` : which rows of the texture of points must be
    uploaded, all of them at first; there is room for `room` strands or as many as there are.
    """

    def __init__(self, ctx: moderngl.Context, points: np.ndarray, room: int = 0) -> None:
        if points.ndim != 3 or 3 not in points.shape[1:]:
            raise ValueError(f"strands must have shape (N, 3, P) or (N, P, 3), not {points.shape}")
        self.ctx = ctx
        self.count = len(points)
        by_axis = points.shape[1] == 3
        self.per_strand = int(points.shape[2] if by_axis else points.shape[1])
        if not 2 <= self.per_strand <= LARGEST_SIDE // 3:
            raise ValueError(f"strands need 2 to {LARGEST_SIDE // 3} points, not {self.per_strand}")
        self.axis_stride, self.point_stride = (self.per_strand, 1) if by_axis else (1, 3)
        room = max(self.count, room, 1)
        fitting = min(LARGEST_SIDE // (3 * self.per_strand), room)
        self.per_row = 1 << (fitting.bit_length() - 1)
        self.rows = -(-room // self.per_row)
        if self.rows > LARGEST_SIDE:
            raise ValueError(f"at most {self.per_row * LARGEST_SIDE} strands of {self.per_strand} points can be drawn")
        self.points = self._texture(self.per_row * 3 * self.per_strand, 1, "f4")
        self.sides = self._texture(self.per_row * self.per_strand, 4, "f2")
        self.colors = self._texture(self.per_row * self.per_strand, 4, "f2")
        self.target = ctx.framebuffer([self.sides, self.colors])
        self.stale = np.ones(self.rows, bool)

    def resize(self, points: np.ndarray) -> bool:
        """Take points of another number of strands; False when they do not fit, would waste room, or lie otherwise."""
        by_axis = points.shape[1] == 3
        per_strand = points.shape[2] if by_axis else points.shape[1]
        same = per_strand == self.per_strand and self.point_stride == (1 if by_axis else 3)
        wanted = -(-len(points) // self.per_row)
        if not same or not wanted <= self.rows <= max(SMALL, 2 * wanted):
            return False
        self.count = len(points)
        self.stale[:] = True
        return True

    def mark(self, rows: np.ndarray) -> None:
        """Strands that must be uploaded again."""
        self.stale[np.asarray(rows) // self.per_row] = True

    def upload(self, points: np.ndarray) -> Iterator[None]:
        """Upload the stale rows of points shaped as those it was made for; a step for every few of them."""
        values = points.reshape(self.count, 3 * self.per_strand)
        at_once = max(1, VALUES_AT_ONCE // (self.per_row * 3 * self.per_strand))
        used = -(-self.count // self.per_row)
        for first, last in runs(self.stale[:used], at_once):
            self.write(self.points, values[first * self.per_row : last * self.per_row], first * self.per_row)
            self.stale[first:last] = False
            yield
        self.stale[:] = False

    def shading(self) -> Iterator[None]:
        """Make the textures of sides and colours the target, a few rows of them at each step."""
        used = -(-self.count // self.per_row)
        at_once = max(1, POINTS_AT_ONCE // (self.per_row * self.per_strand))
        for first in range(0, used, at_once):
            self.target.viewport = (0, first, self.sides.width, min(at_once, used - first))
            self.target.use()
            yield

    def _texture(self, width: int, components: int, dtype: str) -> moderngl.Texture:
        texture = self.ctx.texture((width, self.rows), components, dtype=dtype, alignment=4)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def per_strand_texture(self) -> moderngl.Texture:
        """A new texture with one RGBA32F texel for each strand."""
        return self._texture(self.per_row, 4, "f4")

    def write(self, texture: moderngl.Texture, values: np.ndarray, start: int = 0) -> None:
        """Upload `values` (n, K) float32 of the strands from `start` on, which begins a row of the texture."""
        values = np.ascontiguousarray(values, dtype=np.float32)
        wide = values.shape[1] // texture.components
        first, full = start // self.per_row, len(values) // self.per_row
        if full > 0:
            texture.write(values[: full * self.per_row].data, viewport=(0, first, self.per_row * wide, full))
        rest = values[full * self.per_row :]
        if len(rest):
            texture.write(rest.data, viewport=(0, first + full, len(rest) * wide, 1))

    def bind(self, prog: moderngl.Program) -> None:
        """Make the points readable by a program with strand_points.glsl (texture unit 0)."""
        self.points.use(0)
        set_uniforms(prog, {
            "strand_points": 0, "points_per_strand": self.per_strand, "strands_per_row": self.per_row,
            "axis_stride": self.axis_stride, "point_stride": self.point_stride, "strand_count": self.count,
        })

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.target, self.points, self.sides, self.colors):
            thing.release()


def runs(marked: NDArray[np.bool_], longest: int) -> Iterator[tuple[int, int]]:
    """First and one past the last of every run of marked entries (N,), cut up where it is longer than `longest`."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]])))
    for start, stop in edges.reshape(-1, 2).tolist():
        for first in range(start, stop, longest):
            yield first, min(first + longest, stop)


def points_by_axis(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Views x, y, z, each (N, P), of strands (N, 3, P) or (N, P, 3)."""
    if points.shape[1] == 3:
        return points[:, 0], points[:, 1], points[:, 2]
    return points[..., 0], points[..., 1], points[..., 2]
