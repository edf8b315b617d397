"""The ground: a grid that takes a wider step the farther it is seen from, and fades with the distance."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from viewport.shaders import program, set_uniforms

LINES_IN_VIEW = 12.0  # steps between the lower and the upper border, at least; from three times as many on only tenths
REACH = 7.0  # times what is seen from the lower to the upper border
COLOR = (0.16, 0.165, 0.175)
AXES = ((0.42, 0.075, 0.07), (0.06, 0.16, 0.42))  # along the first and the second axis of the ground
COLOR_SHOWN = (0.395, 0.402, 0.416)  # the same on the screen, after the tone curve
AXES_SHOWN = ((0.66, 0.225, 0.21), (0.19, 0.395, 0.66))
VERTICES = 6  # of a line


class GridDrawable:
    """The grid's program; there is nothing to upload."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self.program = program(ctx, ("grid.vert",), ("grid.frag",))
        self.vertices = ctx.vertex_array(self.program, [])

    def draw(
        self, camera: Camera, middle: NDArray[np.float64], uniforms: dict[str, Any], size: tuple[int, int], samples: int
    ) -> None:
        """Blend the grid into the bound framebuffer.

        middle : (3,) of the scene, which says how near its ground is. size : of the target in samples. samples : for
        a pixel, on a side.
        """
        where = grid_uniforms(camera, middle)
        colors = {} if uniforms["to_display"] else {"grid_color": COLOR, "axis_colors": AXES}
        set_uniforms(self.program, {
            "grid_color": COLOR_SHOWN, "axis_colors": AXES_SHOWN, **colors, **uniforms,
            **where, "width": float(samples), "half_pixels": tuple(0.5 * side / samples for side in size),
        })
        self.vertices.render(moderngl.TRIANGLES, vertices=2 * (2 * where["grid_lines"] + 1) * VERTICES)

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        self.vertices.release()
        self.program.release()


def ground_axes(camera: Camera) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit axes (3,) of the ground: X and Z; of an orthographic view from a side the plane it faces."""
    x, y, z = np.eye(3)
    if camera.orthographic and abs(camera.forward[1]) < 0.1:
        return (z, y) if abs(camera.forward[0]) > abs(camera.forward[2]) else (x, y)
    return x, z


def grid_uniforms(camera: Camera, middle: NDArray[np.float64]) -> dict[str, Any]:
    """Where the grid lies and which step it has."""
    away = max(float((middle - camera.position) @ camera.forward), 10.0 * camera.near)
    seen = camera.height if camera.orthographic else 2.0 * np.tan(0.5 * camera.field_of_view) * away
    decades = np.log10(seen / LINES_IN_VIEW)
    step = 10.0 ** np.floor(decades)
    small_part = 1.0 - 2.0 * float(decades - np.floor(decades))
    every = 1 if small_part > 0.0 else 10
    right, forward = ground_axes(camera)
    centre = (middle @ right) * right + (middle @ forward) * forward
    flat = np.array([middle @ right, middle @ forward])
    reach = min(REACH * seen, camera.far)
    return {
        "grid_centre": centre, "grid_right": right, "grid_forward": forward, "grid_reach": reach,
        "grid_lines": 10 * int(np.ceil(0.1 * reach / (every * step))), "grid_every": every, "grid_step": float(step),
        "small_part": small_part,
        "grid_phase": tuple(np.mod(flat, 10.0 * step).tolist()), "grid_origin": tuple((-flat).tolist()),
    }
