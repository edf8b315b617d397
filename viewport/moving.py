"""The picture while the hand moves: a cached base of meshes and ground, and over it a sparse coat and the guides."""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl
import numpy as np

from core.camera import Camera, view_from_world
from core.workspace import ViewOptions
from viewport.drawables.guides import GuideDrawable
from viewport.drawables.strands import CoatDrawable
from viewport.kept import matched, same
from viewport.light_maps import LightMaps
from viewport.near_side import near_guides, sparse_coat, sparse_points, stands_for
from viewport.renderer import Renderer, camera_uniforms, light_directions, light_uniforms
from viewport.ribbons import far_to_near
from viewport.scene import Coat, GuideLines, Scene, mean_width

MOST_ACROSS = 6.0  # strands of a wide ribbon
MAP_SIDE = 256  # of the light's maps that are drawn anew whenever the light turns


class Moving:
    """Draws moving pictures into a framebuffer of displayed colours with depth; uses what a renderer keeps."""

    def __init__(self, ctx: moderngl.Context, renderer: Renderer) -> None:
        self.ctx = ctx
        self.renderer = renderer
        self.light_maps = LightMaps(ctx, MAP_SIDE)
        self.coats: list[CoatDrawable] = []
        self.guides: list[GuideDrawable] = []
        self.base: DisplayTarget | None = None
        self.behind: tuple[moderngl.Texture, moderngl.Framebuffer] | None = None
        self._behind_key: tuple[Any, ...] | None = None
        self._across: dict[int, float] = {}
        self._hairs = 0
        self._base_key: tuple[Any, ...] | None = None
        self._sparse_key: tuple[Any, ...] | None = None
        self._light_key: tuple[Any, ...] | None = None
        self._lighting: dict[str, Any] = {}
        self._sparse: list[tuple[Coat, Coat]] = []  # in the scene, and what is drawn of it
        self._near: list[tuple[GuideLines, GuideLines]] = []

    def rows_changed(self) -> None:
        """Arrays of the scene were written to in place: gather again what is drawn of them."""
        self._sparse = [(coat, sparse_points(coat, drawn)) for coat, drawn in self._sparse]
        self._near = [(lines, near_guides(lines, self._camera)) for lines, _ in self._near]

    def draw(
        self, scene: Scene, camera: Camera, target: moderngl.Framebuffer, size: tuple[int, int], options: ViewOptions,
        hairs: int, finished: tuple[LightMaps, dict[str, Any]] | None,
    ) -> int:
        """Draw the picture; how many hairs it shows.

        hairs : of each coat, before those on the far side are left out.
        finished : the light's maps of a finished picture in the same light, and the uniforms that describe them.
        """
        self._gather(scene, camera, size, hairs)
        toward = light_directions(scene, camera)
        maps, lighting = finished if finished is not None else (self.light_maps, self._light(scene, toward["key"]))
        uniforms = camera_uniforms(scene, camera, size, to_display=True) | lighting | light_uniforms(scene, toward)
        self._draw_base(scene, camera, size, options, uniforms, maps)
        assert self.base is not None
        self.ctx.copy_framebuffer(target, self.base.framebuffer)
        maps.bind()
        view_row = -view_from_world(camera)[2]
        for drawable in (*self.coats, *self.guides):
            self.ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
            _finish(drawable.upload())
            shown = drawable.coat if isinstance(drawable, CoatDrawable) else drawable.lines
            across = self._across.get(id(shown), 1.0)
            _finish(drawable.work_out({**uniforms, "sparse": across > 1.0}))
            order = _finish(far_to_near(shown.points, view_row))
            points = np.arange(drawable.textures.per_strand)
            matrix = uniforms["clip_from_world"]
            _finish(self.renderer.ribbons.draw(drawable.textures, order, points, matrix, target, across=across))
        return sum(len(coat.points) for _, coat in self._sparse)

    def _gather(self, scene: Scene, camera: Camera, size: tuple[int, int], hairs: int) -> None:
        key = (*scene.coats, *scene.guides, camera, size, hairs)
        if not same(self._sparse_key, key):
            self._sparse_key, self._camera, self._hairs = key, camera, hairs
            self._sparse = [(coat, sparse_coat(coat, camera, hairs, size)) for coat in scene.coats]
            self._near = [(lines, near_guides(lines, camera)) for lines in scene.guides]
        ctx, renderer = self.ctx, self.renderer
        self.coats = matched(
            self.coats, [drawn for _, drawn in self._sparse],
            lambda coat: CoatDrawable(ctx, renderer.strand_programs, coat, room=hairs),
        )
        rooms = {id(drawn): len(lines.points) for lines, drawn in self._near}
        self.guides = matched(
            self.guides, [drawn for _, drawn in self._near],
            lambda lines: GuideDrawable(ctx, renderer.guide_programs, lines, room=rooms[id(lines)]),
        )
        renderer.solids.upload(scene)
        self._across = {
            id(drawn): float(np.clip(drawn.look.root_width / max(coat.look.root_width, 1e-12), 1.0, MOST_ACROSS))
            for coat, drawn in self._sparse
        }

    def _light(self, scene: Scene, toward: np.ndarray) -> dict[str, Any]:
        key = (*scene.surfaces, self._sparse_key, tuple(toward.tolist()))
        if not same(self._light_key, key):
            for coat in self.coats:
                _finish(coat.upload())
            shares = []
            for coat, drawn in self._sparse:
                shares.append(stands_for(coat, self._hairs) * mean_width(coat.look) / mean_width(drawn.look))
            drawables = self.renderer.solids.meshes
            self._lighting = _finish(self.light_maps.draw(scene, toward, drawables, self.coats, shares))
            self._light_key = key
        return self._lighting

    def _draw_base(
        self, scene: Scene, camera: Camera, size: tuple[int, int], options: ViewOptions, uniforms: dict[str, Any],
        maps: LightMaps,
    ) -> None:
        lit = self._light_key if maps is self.light_maps else id(maps)
        key = (
            *scene.surfaces, bool(scene.coats), scene.background, scene.exposure, scene.lights, camera, size, options,
            self.renderer.backdrop.image, lit,
        )
        if self.base is not None and same(self._base_key, key):
            return
        self._base_key = key
        if self.base is None or self.base.color.size != size:
            self._release_base()
            self.base = display_target(self.ctx, size)
        target = self.base.framebuffer
        target.use()
        target.clear(depth=1.0)
        self._draw_backdrop(scene, size)
        target.use()
        maps.bind()
        self.renderer.solids.draw(scene, camera, target, {**uniforms, "tap_reach": 0}, options, quick=True)

    def _draw_backdrop(self, scene: Scene, size: tuple[int, int]) -> None:
        """Copy the background, which does not turn with the camera, into the base."""
        assert self.base is not None
        key = scene.background, size, self.renderer.backdrop.image
        if self.behind is None or not same(self._behind_key, key):
            if self.behind is None or self.behind[0].size != size:
                self._release_behind()
                color = self.ctx.texture(size, 4)
                self.behind = color, self.ctx.framebuffer([color])
            self._behind_key = key
            self.behind[1].use()
            self.renderer.backdrop.draw(scene, size)
        self.ctx.copy_framebuffer(self.base.framebuffer, self.behind[1])

    def _release_base(self) -> None:
        if self.base is not None:
            self.base.release()
            self.base = None

    def _release_behind(self) -> None:
        if self.behind is not None:
            for thing in reversed(self.behind):
                thing.release()
            self.behind = None

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        self._release_base()
        self._release_behind()
        for thing in (*self.coats, *self.guides, self.light_maps):
            thing.release()
        self.coats, self.guides = [], []


class DisplayTarget(NamedTuple):
    """Displayed colours with depth. `alone` is a framebuffer of the colours alone, to copy from where depth differs."""

    color: moderngl.Texture
    depth: moderngl.Renderbuffer
    framebuffer: moderngl.Framebuffer
    alone: moderngl.Framebuffer

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.alone, self.framebuffer, self.depth, self.color):
            thing.release()


def display_target(ctx: moderngl.Context, size: tuple[int, int]) -> DisplayTarget:
    """A new target of this size in pixels."""
    color = ctx.texture(size, 4)
    color.filter = (moderngl.NEAREST, moderngl.NEAREST)
    depth = ctx.depth_renderbuffer(size)
    return DisplayTarget(color, depth, ctx.framebuffer([color], depth), ctx.framebuffer([color]))


def _finish(steps: Any) -> Any:
    """Do all the steps at once; what they return."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
