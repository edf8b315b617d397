"""Strands on the graphics card: textures that hold whole strands in every row, so that changed rows upload alone."""

from __future__ import annotations

import moderngl
import numpy as np

from viewport.shaders import set_uniforms

LARGEST_SIDE = 16384


class StrandTextures:
    """Points of N strands of P points and what is worked out for them on the card.

    `points` : R32F, the array as it came. `sides` : RGBA16F, one texel a point: normal of the line on the screen, half
    its width in pixels. `colors` : RGBA16F, one texel a point.
    """

    def __init__(self, ctx: moderngl.Context, points: np.ndarray) -> None:
        if points.ndim != 3 or 3 not in points.shape[1:]:
            raise ValueError(f"strands must have shape (N, 3, P) or (N, P, 3), not {points.shape}")
        self.ctx = ctx
        self.count = len(points)
        by_axis = points.shape[1] == 3
        self.per_strand = int(points.shape[2] if by_axis else points.shape[1])
        if not 2 <= self.per_strand <= LARGEST_SIDE // 3:
            raise ValueError(f"strands need 2 to {LARGEST_SIDE // 3} points, not {self.per_strand}")
        self.axis_stride, self.point_stride = (self.per_strand, 1) if by_axis else (1, 3)
        fitting = min(LARGEST_SIDE // (3 * self.per_strand), max(self.count, 1))
        self.per_row = 1 << (fitting.bit_length() - 1)
        self.rows = max(1, -(-self.count // self.per_row))
        if self.rows > LARGEST_SIDE:
            raise ValueError(f"at most {self.per_row * LARGEST_SIDE} strands of {self.per_strand} points can be drawn")
        self.points = self._texture(self.per_row * 3 * self.per_strand, 1, "f4")
        self.sides = self._texture(self.per_row * self.per_strand, 4, "f2")
        self.colors = self._texture(self.per_row * self.per_strand, 4, "f2")
        self.target = ctx.framebuffer([self.sides, self.colors])
        self.write(self.points, points.reshape(self.count, 3 * self.per_strand))

    def _texture(self, width: int, components: int, dtype: str) -> moderngl.Texture:
        texture = self.ctx.texture((width, self.rows), components, dtype=dtype, alignment=4)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def per_strand_texture(self, values: np.ndarray) -> moderngl.Texture:
        """A new texture with one RGBA32F texel for each strand, of `values` (N, 4) float32."""
        texture = self._texture(self.per_row, 4, "f4")
        self.write(texture, values)
        return texture

    def write(self, texture: moderngl.Texture, values: np.ndarray, start: int = 0, stop: int | None = None) -> None:
        """Upload the strands from `start` to before `stop` of `values` (N, K) float32, by whole rows of the texture."""
        stop = self.count if stop is None else min(stop, self.count)
        if start >= stop:
            return
        values = np.ascontiguousarray(values, dtype=np.float32)
        wide = values.shape[1] // texture.components
        first, full = start // self.per_row, stop // self.per_row
        if full > first:
            block = values[first * self.per_row : full * self.per_row]
            texture.write(block.data, viewport=(0, first, self.per_row * wide, full - first))
        rest = stop - full * self.per_row
        if rest > 0:
            block = values[full * self.per_row : stop]
            texture.write(block.data, viewport=(0, full, rest * wide, 1))

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


def points_by_axis(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Views x, y, z, each (N, P), of strands (N, 3, P) or (N, P, 3)."""
    if points.shape[1] == 3:
        return points[:, 0], points[:, 1], points[:, 2]
    return points[..., 0], points[..., 1], points[..., 2]
