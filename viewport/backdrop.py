"""What is behind everything, and how light becomes what a screen shows."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from viewport.scene import Scene
from viewport.shaders import program, set_uniforms

PLATE_UNIT = 3


class Backdrop:
    """The programs that draw the background alone, and pictures of light over it."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self.alone = program(ctx, ("fullscreen.vert",), ("background.glsl", "background.frag"))
        self.resolve = program(ctx, ("fullscreen.vert",), ("display.glsl", "background.glsl", "resolve.frag"))
        self.alone_triangle = ctx.vertex_array(self.alone, [])
        self.resolve_triangle = ctx.vertex_array(self.resolve, [])
        self.plate: moderngl.Texture | None = None
        self.image: np.ndarray | None = None

    def set_plate(self, image: np.ndarray | None) -> None:
        """Show an image (H, W, 3 or 4) uint8, sRGB, top row first, behind everything; None for none."""
        if image is self.image:
            return
        if self.plate is not None:
            self.plate.release()
        self.image = image
        self.plate = None if image is None else picture_texture(self.ctx, image)

    def _uniforms(self, scene: Scene, size: tuple[int, int]) -> dict[str, Any]:
        box = (0.0, 0.0, 0.0, 0.0)
        if self.plate is not None:
            self.plate.use(PLATE_UNIT)
            box = letterbox(self.plate.size, size)
        return {
            "picture_height": float(size[1]), "top_color": scene.background[0], "bottom_color": scene.background[1],
            "plate": PLATE_UNIT, "plate_box": box,
        }

    def draw(self, scene: Scene, size: tuple[int, int]) -> None:
        """Fill the bound framebuffer."""
        self.ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        set_uniforms(self.alone, self._uniforms(scene, size))
        self.alone_triangle.render(moderngl.TRIANGLES, vertices=3)

    def resolved(
        self, light: moderngl.Texture, scene: Scene, size: tuple[int, int], samples: int,
        tile: tuple[int, int, int, int], framebuffer: moderngl.Framebuffer,
    ) -> None:
        """Draw one tile (x, y, width, height in pixels) of a picture of `size` from its samples of light."""
        self.ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        framebuffer.use()
        framebuffer.viewport = tile
        light.use(0)
        set_uniforms(self.resolve, {
            **self._uniforms(scene, size), "samples": 0, "samples_per_side": samples,
            "origin": (float(tile[0]), float(tile[1])), "exposure": scene.exposure,
            "clear": scene.clear,
        })
        self.resolve_triangle.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        self.set_plate(None)
        for thing in (self.alone_triangle, self.resolve_triangle, self.alone, self.resolve):
            thing.release()


def picture_texture(ctx: moderngl.Context, image: np.ndarray) -> moderngl.Texture:
    """A texture, smooth between pixels, of an image (H, W, 3 or 4) uint8, first row first."""
    height, width, components = image.shape
    data = np.ascontiguousarray(image, np.uint8)
    texture = ctx.texture((width, height), components, data.tobytes(), alignment=1)
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture


def letterbox(image: tuple[int, int], size: tuple[int, int]) -> tuple[float, float, float, float]:
    """Left, bottom, right, top of the largest box with the aspect of an image (width, height) amid a picture."""
    scale = min(size[0] / image[0], size[1] / image[1])
    width, height = image[0] * scale, image[1] * scale
    x, y = 0.5 * (size[0] - width), 0.5 * (size[1] - height)
    return x, y, x + width, y + height
