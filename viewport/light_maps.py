"""What the key light sees: depth of the skin, first depth of everything, and the hair behind that first depth."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from viewport.drawables.strands import CoatDrawable
from viewport.outline import extent
from viewport.scene import Scene, direction
from viewport.shaders import program, set_uniforms
from viewport.strand_textures import points_by_axis

LITTLE_TURN = float(np.cos(np.radians(4.0)))
LAYERS = np.array([0.06, 0.16, 0.36, 0.8])  # ends of the layers as parts of a hair's length


def light_frame(
    outline: NDArray[np.float32], toward: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Matrix light_from_world (4, 4) of a parallel light that sees the whole scene, and the box's size (3,), metres.

    outline : (M, 3), see :class:`viewport.outline.Outline`.
    """
    z = direction(toward)
    x = direction(np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z))
    axes = np.stack([x, np.cross(z, x), z])
    low, high = extent((outline @ axes.T).astype(np.float32))
    size = high - low
    size = 1.04 * np.maximum(size, 1e-3 * max(float(size.max()), 1e-6))
    middle = 0.5 * (low + high)
    matrix = np.eye(4)
    matrix[:3, :3] = axes * (np.array([2.0, 2.0, -2.0]) / size)[:, None]
    matrix[:3, 3] = -middle * np.array([2.0, 2.0, -2.0]) / size
    return matrix, size


def alike(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """True when maps of a light from direction `a` (3,) do for one from `b`, for a moving picture."""
    return float(a @ b) > LITTLE_TURN


def usual_length(scene: Scene) -> float:
    """Median distance from root to tip over all hairs (a few thousand of each coat are looked at), metres."""
    lengths = []
    for coat in scene.coats:
        some = coat.points[:: max(1, len(coat.points) // 4000)]
        if len(some):
            x, y, z = points_by_axis(some)
            lengths.append(np.sqrt(sum((v[:, -1] - v[:, 0]).astype(np.float64) ** 2 for v in (x, y, z))))
    return float(np.median(np.concatenate(lengths))) if lengths else 0.0


class LightMaps:
    """Textures drawn from the key light and the uniforms that let lighting.glsl read them (units 4, 5, 6)."""

    UNIFORMS = (
        "first_depth", "skin_depth", "coat_opacity", "light_from_world", "layer_ends", "light_range", "tap_spread",
        "tap_reach", "skin_bias",
    )  # fmt: skip

    def __init__(self, ctx: moderngl.Context, side: int = 1024) -> None:
        self.ctx = ctx
        self.side = side
        self.skin_depth = ctx.depth_texture((side, side))
        self.first_depth = ctx.depth_texture((side, side))
        for texture in (self.skin_depth, self.first_depth):
            texture.compare_func = ""
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            texture.repeat_x = texture.repeat_y = False
        self.sums = ctx.texture((side, side), 4, dtype="f2")
        self.sums.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self.sums.repeat_x = self.sums.repeat_y = False
        self.skin_target = ctx.framebuffer([], self.skin_depth)
        self.first_target = ctx.framebuffer([], self.first_depth)
        self.sums_target = ctx.framebuffer([self.sums])
        self.depth_copy = program(ctx, ("fullscreen.vert",), ("depth_copy.frag",))
        self.whole = ctx.vertex_array(self.depth_copy, [])

    def draw(
        self, scene: Scene, toward: NDArray[np.float64], cast_shadows: Callable[[NDArray[np.float64]], Iterable[None]],
        coats: Sequence[CoatDrawable],
        outline: NDArray[np.float32], shares: Sequence[float] = (),
    ) -> Generator[None, None, dict[str, Any]]:
        """Draw the maps in steps; returns the uniforms of lighting.glsl that describe them.

        cast_shadows : draws the depth of all that is not hair, in steps. outline : of the scene, (M, 3).
        shares : of each coat, see :meth:`CoatDrawable.draw_opacity`; 1 when not given.
        """
        ctx = self.ctx
        matrix, size = light_frame(outline, toward)
        # texels are square in metres only when the box is: the mean serves the opacity, which is a ratio of areas
        texel = float(np.sqrt(size[0] * size[1])) / self.side
        length = max(usual_length(scene), 1e-6 * float(size.max()))
        ends = tuple(float(v) for v in LAYERS * length)
        ctx.disable(moderngl.BLEND | moderngl.CULL_FACE)
        ctx.enable(moderngl.DEPTH_TEST)
        self.skin_target.use()
        self.skin_target.clear(depth=1.0)
        for _ in cast_shadows(matrix):
            yield
            self.skin_target.use()
            ctx.disable(moderngl.BLEND | moderngl.CULL_FACE)
            ctx.enable(moderngl.DEPTH_TEST)
        self._copy_skin()
        for coat in coats:
            for _ in coat.draw_depth(matrix):
                yield
                self.first_target.use()
                ctx.enable(moderngl.DEPTH_TEST)
        self.sums_target.clear()
        described: dict[str, Any] = {
            "first_depth": 4, "light_from_world": matrix, "layer_ends": ends, "light_range": float(size[2]),
        }
        for coat, share in zip(coats, shares or [1.0] * len(coats), strict=True):
            steps = coat.draw_opacity(texel, described, share)
            while True:
                self.sums_target.use()
                ctx.disable(moderngl.DEPTH_TEST)
                ctx.enable(moderngl.BLEND)
                ctx.blend_func = moderngl.ONE, moderngl.ONE
                self.first_depth.use(4)
                more = next(steps, self) is None
                ctx.disable(moderngl.BLEND)
                if not more:
                    break
                yield
        return {
            **described, "skin_depth": 5, "coat_opacity": 6, "tap_spread": 2.0, "tap_reach": 1,
            "skin_bias": max(0.12 * length, 4.0 * texel),
        }

    def _copy_skin(self) -> None:
        """Begin the nearest depths of hair or skin with those of skin."""
        self.first_target.use()
        self.ctx.enable(moderngl.DEPTH_TEST)
        self.ctx.depth_func = "1"
        self.skin_depth.use(5)
        set_uniforms(self.depth_copy, {"depths": 5})
        self.whole.render(moderngl.TRIANGLES, vertices=3)
        self.ctx.depth_func = "<"

    def bind(self) -> None:
        """Make the maps readable (texture units 4, 5, 6)."""
        self.first_depth.use(4)
        self.skin_depth.use(5)
        self.sums.use(6)

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (
            self.skin_target, self.first_target, self.sums_target, self.skin_depth, self.first_depth, self.sums,
            self.whole, self.depth_copy,
        ):
            thing.release()
