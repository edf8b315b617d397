"""What a solved camera sees, drawn by a pinhole and brought onto the plate by a grid, as the lens bends it."""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from viewport.backdrop import picture_texture
from viewport.shaders import program, set_uniforms

Array = NDArray[np.float64]


class Bent(NamedTuple):
    """A picture over a plate.

    pixels : (h, w, 4) uint8, sRGB times what is covered, top row first. places : (R, C, 2) of a grid in it, 0 .. 1 from
    its left upper corner, NaN where it shows nothing. nodes : (R, C, 2) of that grid on the screen, pixels with y down,
    the corners of pixels at whole numbers. opacity : 0 .. 1.
    """

    pixels: NDArray[np.uint8]
    places: Array
    nodes: Array
    opacity: float = 1.0


class ThroughLens:
    """Draws one such picture. Make, use and release it with the context current."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self.program = program(ctx, ("through.vert",), ("display.glsl", "through.frag"))
        self._picture: tuple[NDArray[np.uint8], moderngl.Texture] | None = None

    def draw(
        self, bent: Bent, plate: moderngl.Texture, box: tuple[float, float, float, float], size: tuple[int, int]
    ) -> None:
        """Draw into the bound framebuffer of `size` pixels, over the plate in its box."""
        if self._picture is None or self._picture[0] is not bent.pixels:
            self._forget()
            self._picture = bent.pixels, picture_texture(self.ctx, bent.pixels)
        corners = _corners(bent)
        if not len(corners):
            return
        buffer = self.ctx.buffer(corners.astype(np.float32).tobytes())
        array = self.ctx.vertex_array(self.program, [(buffer, "2f 2f", "place", "found")])
        self._picture[1].use(0)
        plate.use(1)
        set_uniforms(self.program, {
            "picture": 0, "plate": 1, "box": tuple(map(float, box)), "picture_size": (float(size[0]), float(size[1])),
            "screen_height": float(size[1]), "opacity": bent.opacity,
        })
        array.render(moderngl.TRIANGLES)
        array.release()
        buffer.release()

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        self._forget()
        things: list[Any] = [self.program]
        for thing in things:
            thing.release()

    def _forget(self) -> None:
        if self._picture is not None:
            self._picture[1].release()
            self._picture = None


def _corners(bent: Bent) -> Array:
    """(K, 4) places on the screen and in the picture of the corners of all triangles that show something."""
    both = np.concatenate([bent.nodes, bent.places], axis=-1)
    a, b, c, d = both[:-1, :-1], both[:-1, 1:], both[1:, :-1], both[1:, 1:]
    triangles = np.stack([np.stack([a, b, c], axis=2), np.stack([b, d, c], axis=2)], axis=2).reshape(-1, 3, 4)
    return triangles[np.isfinite(triangles).all(axis=(1, 2))].reshape(-1, 4)
