"""A finished picture that stays while the hand works on a part of it.

Where hair has moved the picture is taken back to what is behind the hair, and only there moving hair is drawn: the
depth of all the rest is the nearest there is, which nothing passes.
"""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from viewport.display_target import DisplayTarget, display_target
from viewport.ribbons import Ribbons, ribbon_corners
from viewport.shaders import program, set_uniforms
from viewport.strand_textures import StrandTextures

MARGIN = 2.5  # pixels around every hair that moved


class Patch:
    """The finished picture with holes, and which picture it was made of."""

    def __init__(self, ctx: moderngl.Context, ribbons: Ribbons) -> None:
        self.ctx = ctx
        self.ribbons = ribbons
        self.program = program(ctx, ("strand_points.glsl", "ribbon.vert"), ("ribbon_erase.frag",))
        self.vertices = ctx.vertex_array(self.program, [], index_buffer=ribbons.indices, index_element_size=4)
        self.target: DisplayTarget | None = None
        self.number: int | None = None

    def start(self, picture: DisplayTarget, number: int) -> None:
        """Begin with a finished picture, whose number says which it is."""
        size = picture.color.size
        if self.target is None or self.target.color.size != size:
            self._release_target()
            self.target = display_target(self.ctx, size)
        self.target.framebuffer.clear(depth=0.0)
        self.ctx.copy_framebuffer(self.target.framebuffer, picture.alone)
        self.number = number

    def open(
        self, strands: StrandTextures, rows: NDArray[np.integer], base: DisplayTarget, matrix: NDArray[np.float64]
    ) -> None:
        """Make holes where these strands lie as they were last worked out."""
        assert self.target is not None
        if len(rows) == 0 or strands.count == 0:
            return
        pieces = strands.per_strand - 1
        order = (rows.astype(np.int64)[:, None] * pieces + np.arange(pieces)).astype(np.uint32).reshape(-1)
        target = self.target.framebuffer
        target.use()
        self.ctx.disable(moderngl.BLEND | moderngl.CULL_FACE)
        self.ctx.enable(moderngl.DEPTH_TEST)
        self.ctx.depth_func = "1"
        strands.bind(self.program)
        strands.sides.use(1)
        base.color.use(2)
        base.depth.use(3)
        set_uniforms(self.program, {
            "strand_sides": 1, "base_color": 2, "base_depth": 3, "clip_from_world": matrix, "margin": MARGIN,
            "picture_size": (float(target.width), float(target.height)), "samples_per_pixel": 1.0,
        })
        for numbers in ribbon_corners(order, np.arange(pieces + 1), strands.per_strand):
            self.ribbons.indices.orphan()
            self.ribbons.indices.write(numbers.data)
            self.vertices.render(moderngl.TRIANGLES, vertices=numbers.size)
        self.ctx.depth_func = "<"
        self.ctx.disable(moderngl.DEPTH_TEST)

    def _release_target(self) -> None:
        if self.target is not None:
            self.target.release()
            self.target = None

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        self._release_target()
        self.vertices.release()
        self.program.release()
