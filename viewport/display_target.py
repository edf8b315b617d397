"""Where pictures that are shown are drawn."""

from __future__ import annotations

from typing import NamedTuple

import moderngl


class DisplayTarget(NamedTuple):
    """Displayed colours with depth. `alone` is a framebuffer of the colours alone, to copy from where depth differs."""

    color: moderngl.Texture
    depth: moderngl.Texture
    framebuffer: moderngl.Framebuffer
    alone: moderngl.Framebuffer

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.alone, self.framebuffer, self.depth, self.color):
            thing.release()


def display_target(ctx: moderngl.Context, size: tuple[int, int]) -> DisplayTarget:
    """A new target of this size in pixels."""
    color, depth = ctx.texture(size, 4), ctx.depth_texture(size)
    depth.compare_func = ""
    for texture in (color, depth):
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return DisplayTarget(color, depth, ctx.framebuffer([color], depth), ctx.framebuffer([color]))
