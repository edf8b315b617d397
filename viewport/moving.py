"""The picture while the hand moves: a cached base of meshes and ground, and over it a sparse coat and the guides."""

from __future__ import annotations

from functools import partial
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from core.camera import Camera, view_from_world
from core.workspace import ViewOptions
from viewport.display_target import DisplayTarget, display_target
from viewport.drawables.guides import GuideDrawable
from viewport.drawables.strands import CoatDrawable
from viewport.kept import matched, same
from viewport.light_maps import LightMaps, alike
from viewport.near_side import (
    near_guides,
    roots_of,
    shown_rows,
    sparse_coat,
    sparse_points,
    stands_for,
    turned_to,
)
from viewport.neighbours import Neighbours
from viewport.patch import Patch
from viewport.renderer import Renderer, camera_uniforms, light_directions, light_uniforms
from viewport.ribbons import far_to_near
from viewport.scene import Coat, GuideLines, Scene, mean_width
from viewport.touched import Touched

MOST_ACROSS = 6.0  # strands of a wide ribbon
OPENED_AT_ONCE = 1500  # hairs around moved ones that are taken out of the finished picture in one moving picture
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
        self._turning = False  # the last picture was of another camera
        self._camera: Camera | None = None
        self._base_key: tuple[Any, ...] | None = None
        self._sparse_key: tuple[Any, ...] | None = None
        self._light_key: tuple[Any, ...] | None = None
        self._toward = np.zeros(3)  # the key light that the maps were drawn for
        self._lighting: dict[str, Any] = {}
        self._guides_key: tuple[Any, ...] | None = None
        self.patch = Patch(ctx, renderer.ribbons)
        self.touched: list[tuple[np.ndarray, np.ndarray]] = []  # arrays and their rows changed since the last picture
        self._moved: list[NDArray[np.bool_]] = []  # since the finished picture, of every coat
        self._opened: list[NDArray[np.bool_]] = []  # where they were is a hole
        self._owed: list[NDArray[np.bool_]] = []  # where they are shall be one
        self.opening = False  # more of what is owed is to be done by another picture, changed or not
        self._neighbours: list[Neighbours] = []
        self._shown_before: list[NDArray[np.integer] | None] = []  # which hairs of every coat the last picture drew
        self._still: list[Coat] = []  # what is drawn of every coat, as it was in the finished picture
        self._guides_moved: list[NDArray[np.bool_]] = []
        self._last_guides: list[GuideLines] = []
        self._touched = Touched((0, 0))  # by all that moved since
        self._worked_out: tuple[Any, ...] | None = None  # which hairs amidst which finished picture
        self._sparse: list[tuple[Coat, Coat]] = []  # in the scene, and what is drawn of it
        self._near: list[tuple[GuideLines, GuideLines]] = []

    def rows_changed(self, points: np.ndarray, rows: np.ndarray) -> None:
        """Rows of an array of the scene were written to in place: gather again what is drawn of it."""
        camera = self._camera
        self._sparse = [(c, sparse_points(c, drawn) if c.points is points else drawn) for c, drawn in self._sparse]
        if camera is not None:
            self._near = [
                (g, near_guides(g, camera, self._turning) if g.points is points else near) for g, near in self._near
            ]
        self.touched.append((points, rows))

    def forget_touched(self) -> None:
        """Forget which rows changed: a finished picture is begun that shows them all, in light worked out anew."""
        self.touched = []
        self._worked_out = None

    def draw(
        self, scene: Scene, camera: Camera, target: moderngl.Framebuffer, size: tuple[int, int], options: ViewOptions,
        hairs: int, finished: tuple[LightMaps, dict[str, Any]] | None = None,
        picture: tuple[DisplayTarget, int] | None = None,
    ) -> int:
        """Draw the picture; how many hairs it shows.

        hairs : of each coat, before those on the far side are left out.
        finished : the light's maps of a finished picture in the same light, and the uniforms that describe them.
        picture : the finished picture and its number, when since then only rows were changed: it stays elsewhere.
        """
        self._gather(scene, camera, size, hairs, picture is None)
        drawables: list[CoatDrawable | GuideDrawable] = [*self.coats, *self.guides]
        for drawable in drawables:
            _finish(drawable.upload())
        toward = light_directions(scene, camera)
        maps, lighting = finished if finished is not None else (self.light_maps, self._light(scene, toward["key"]))
        uniforms = camera_uniforms(scene, camera, size, to_display=True) | lighting | light_uniforms(scene, toward)
        self._draw_base(scene, camera, size, options, uniforms, maps)
        assert self.base is not None
        maps.bind()
        # under a brush, amidst a finished picture, one look at the light serves; in a turning view it would shimmer
        softness = {} if picture is None else {"tap_reach": 0}
        self.ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        stale = self._stale(None if picture is None else picture[1])
        for coat, rows in zip(self.coats, stale, strict=True):
            across = {"sparse": self._strands_across(coat) > 1.0}
            _finish(coat.work_out({**uniforms, **softness, **across}, rows))
        for guides in self.guides:
            _finish(guides.work_out(uniforms))
        self.opening = False
        behind = self.base if picture is None else self._patched(scene, camera, picture, uniforms["clip_from_world"])
        self.touched = []
        self.ctx.copy_framebuffer(target, behind.framebuffer)
        view_row = -view_from_world(camera)[2]
        for drawable in drawables:
            strands = _shown(drawable).points
            rows = None if picture is None else self._touched.reached_by(strands, camera)
            order = _finish(far_to_near(strands, view_row, rows=rows))
            points, across = np.arange(drawable.textures.per_strand), self._strands_across(drawable)
            matrix = uniforms["clip_from_world"]
            _finish(self.renderer.ribbons.draw(drawable.textures, order, points, matrix, target, across=across))
        return sum(len(coat.points) for _, coat in self._sparse)

    def _stale(self, number: int | None) -> list[NDArray[np.intp] | None]:
        """Rows of what is drawn of every coat that moved since it was last worked out; None for all of them.

        Amidst the same finished picture nothing else changes: neither camera nor light nor which hairs are drawn.
        """
        now = number, tuple((mine, drawn.order) for mine, (_, drawn) in zip(self.coats, self._sparse, strict=True))
        before, self._worked_out = self._worked_out, now
        if number is None or not same(before, now):
            return [None] * len(self.coats)
        rows: list[NDArray[np.intp] | None] = []
        for coat, drawn in self._sparse:
            moved = np.zeros(len(coat.points), bool)
            for points, changed in self.touched:
                if points is coat.points:
                    moved[changed] = True
            rows.append(np.flatnonzero(moved[drawn.order]))
        return rows

    def _strands_across(self, drawable: CoatDrawable | GuideDrawable) -> float:
        return self._across.get(id(_shown(drawable)), 1.0)

    def keep(self, scene: Scene, camera: Camera, picture: tuple[DisplayTarget, int]) -> None:
        """Keep a finished picture of the scene last drawn; done at rest it need not be done in a stroke."""
        if not same((tuple(coat for coat, _ in self._sparse), self._camera), (scene.coats, camera)):
            return
        self.patch.start(*picture)
        self._moved = [np.zeros(len(coat.points), bool) for coat in scene.coats]
        self._opened = [moved.copy() for moved in self._moved]
        self._owed = [moved.copy() for moved in self._moved]
        self.opening = False
        self._neighbours = [Neighbours(coat, drawn, camera) for coat, drawn in self._sparse]
        self._still = [drawn for _, drawn in self._sparse]
        self._shown_before = [drawn.order for drawn in self._still]
        self._guides_moved = [np.zeros(len(lines.points), bool) for lines in scene.guides]
        self._last_guides = [drawable.lines for drawable in self.renderer.guides]
        self._touched = Touched(picture[0].color.size)

    def _patched(
        self, scene: Scene, camera: Camera, picture: tuple[DisplayTarget, int], matrix: np.ndarray
    ) -> DisplayTarget:
        """The finished picture with holes where hairs and guides have moved since, from and to."""
        patch, renderer = self.patch, self.renderer
        if patch.number != picture[1]:
            self.keep(scene, camera, picture)
        assert self.base is not None
        assert patch.target is not None
        for i, (coat, drawn) in enumerate(self._sparse):
            moving = np.zeros(len(coat.points), bool)  # in this picture; holes of others stay where they are
            for points, rows in self.touched:
                if points is coat.points:
                    moving[rows] = True
                    new = rows[~self._moved[i][rows]]
                    self._moved[i][new] = True
                    self._owed[i][self._neighbours[i].around(new)] = True
            new = np.flatnonzero(self._moved[i] & ~self._opened[i])
            around = np.flatnonzero(self._owed[i] & ~self._opened[i] & ~self._moved[i])
            self.opening |= len(around) > OPENED_AT_ONCE
            new = np.concatenate([new, around[:OPENED_AT_ONCE]])
            self._opened[i][new] = True
            new = new[turned_to(camera, roots_of(coat.points)[new], coat.normals[new])]
            patch.open(renderer.coats[i].textures, new, self.base, matrix)
            self._touched.add(coat.points, new, camera)
            assert drawn.order is not None
            if drawn.order is not self._shown_before[i]:  # other hairs are drawn now
                moving, self._shown_before[i] = self._moved[i], drawn.order
            moved = np.flatnonzero(moving[drawn.order])
            patch.open(self.coats[i].textures, moved, self.base, matrix)
            self._touched.add(drawn.points, moved, camera)
            still = self._still[i]
            assert still.order is not None
            self._touched.add(still.points, np.flatnonzero(moving[still.order]), camera)
        for i, lines in enumerate(scene.guides):
            rows = [rows for points, rows in self.touched if points is lines.points]
            changed = changed_guides(self._last_guides[i], lines)
            changed[np.concatenate([np.zeros(0, np.intp), *rows])] = True
            near = shown_rows(lines, camera, near_only=True)
            near = np.arange(len(lines.points)) if near is None else near
            new = changed & ~self._guides_moved[i]
            self._guides_moved[i] |= changed
            patch.open(renderer.guides[i].textures, near[new[near]], self.base, matrix)
            moved = np.flatnonzero(changed[near])
            patch.open(self.guides[i].textures, moved, self.base, matrix)
            for strands, rows_touched in ((self._last_guides[i].points, near[new[near]]), (lines.points, near[moved])):
                self._touched.add(strands, rows_touched, camera)
        self._last_guides = list(scene.guides)
        return patch.target

    def _gather(self, scene: Scene, camera: Camera, size: tuple[int, int], hairs: int, may_thin: bool) -> None:
        key = (*scene.coats, camera, size, hairs)
        turning = may_thin and self._camera is not None and not same(self._camera, camera)
        self._turning = turning
        if not same(self._sparse_key, key):
            self._sparse_key, self._camera, self._hairs = key, camera, hairs
            self._sparse = [(coat, sparse_coat(coat, camera, hairs, size)) for coat in scene.coats]
        guides_key = (*scene.guides, camera, turning)
        if not same(self._guides_key, guides_key):
            self._guides_key = guides_key
            self._near = [(lines, near_guides(lines, camera, turning)) for lines in scene.guides]
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
        renderer.solids.upload(scene, quick=True)
        self._across = {
            id(drawn): float(np.clip(drawn.look.root_width / max(coat.look.root_width, 1e-12), 1.0, MOST_ACROSS))
            for coat, drawn in self._sparse
        }

    def _light(self, scene: Scene, toward: np.ndarray) -> dict[str, Any]:
        """The maps of a light that has turned but little are those it had: redrawing them costs more than it shows."""
        key = (*scene.surfaces, *scene.quick_feathers, *scene.coats, self._hairs)
        if not same(self._light_key, key) or not alike(self._toward, toward):
            shares = []
            for coat, drawn in self._sparse:
                narrower = mean_width(coat.look) / max(mean_width(drawn.look), 1e-12)
                shares.append(stands_for(coat, self._hairs) * narrower)
            cast, outline = partial(self.renderer.solids.cast_shadows, quick=True), self.renderer.outline.of(scene)
            self._lighting = _finish(self.light_maps.draw(scene, toward, cast, self.coats, outline, shares))
            self._light_key, self._toward = key, toward
        return self._lighting

    def _draw_base(
        self, scene: Scene, camera: Camera, size: tuple[int, int], options: ViewOptions, uniforms: dict[str, Any],
        maps: LightMaps,
    ) -> None:
        lit = (self._light_key, tuple(self._toward.tolist())) if maps is self.light_maps else id(maps)
        key = (
            *scene.surfaces, *scene.quick_feathers, *(coat.look for coat in scene.coats), scene.background,
            scene.exposure, scene.lights, camera, size, options, self.renderer.backdrop.image, lit,
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
        outline = self.renderer.outline.of(scene)
        self.renderer.solids.draw(scene, camera, target, {**uniforms, "tap_reach": 0}, outline, options)

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
        things: list[Any] = [*self.coats, *self.guides, self.light_maps, self.patch]
        for thing in things:
            thing.release()
        self.coats, self.guides = [], []


def changed_guides(before: GuideLines, now: GuideLines) -> NDArray[np.bool_]:
    """(G,) True where the points or the state of a guide differ; both have the same number of guides."""
    changed = np.zeros(len(now.points), bool)
    if before.points is not now.points:
        changed |= (before.points != now.points).any(axis=(1, 2))
    if before.states is not now.states:
        changed |= before.states != now.states
    return changed


def _shown(drawable: CoatDrawable | GuideDrawable) -> Coat | GuideLines:
    return drawable.coat if isinstance(drawable, CoatDrawable) else drawable.lines


def _finish(steps: Any) -> Any:
    """Do all the steps at once; what they return."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
