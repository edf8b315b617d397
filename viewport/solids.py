"""Everything that is not hair: meshes in the manner wanted, their edges, ghosts, feathers, and the ground."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from core.feather.pieces import FeatherMesh
from core.workspace import ViewOptions
from viewport.drawables.feathers import FeatherDrawable, FeatherPrograms
from viewport.drawables.grid import GridDrawable
from viewport.drawables.mesh import GHOST_OPACITY, MeshDrawable, MeshPrograms
from viewport.drawables.strands import ABSORPTION
from viewport.kept import matched
from viewport.outline import extent
from viewport.scene import Color, Look, Scene

WIRE = (0.34, 0.36, 0.40, 1.0)  # linear RGB and opacity of edges alone
WIRE_OVER = (0.010, 0.011, 0.013, 0.55)  # over shaded triangles
WIRE_GHOST = (0.20, 0.22, 0.26, 0.25)
FLAT = (0.060, 0.062, 0.068)  # of triangles that only hide the lines behind them
CLAY = (0.33, 0.27, 0.235)
PLAIN = ViewOptions(grid=False, axes=False)


def fur_color(look: Look) -> Color:
    """What skin under few hairs is painted in while the hand moves: as the whole coat looks from afar."""
    r, g, b = (0.75 * root + 0.6 * tip for root, tip in zip(look.root, look.tip, strict=True))
    return (r, g, b)


def lit_uniforms(scene: Scene, camera: Camera, uniforms: dict[str, Any]) -> dict[str, Any]:
    """What the programs of meshes and feathers are told, beside `uniforms` of camera and light."""
    depth = max((coat.look.depth for coat in scene.coats), default=1.0)
    right, up = camera.world_from_camera[:3, 0], camera.world_from_camera[:3, 1]
    return {**uniforms, "absorption": ABSORPTION * depth, "view_right": right, "view_up": up}


class Solids:
    """Buffers and programs of all surfaces of a scene and of the ground."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self.programs = MeshPrograms(ctx)
        self.grid = GridDrawable(ctx)
        self.meshes: list[MeshDrawable] = []
        self.feather_programs: FeatherPrograms | None = None  # made with the first feather
        self.feathers: list[FeatherDrawable] = []
        self.quick_feathers: list[FeatherDrawable] = []

    def upload(self, scene: Scene, quick: bool = False) -> None:
        """Bring the surfaces onto the card; feathers those of finished pictures, or `quick` of moving ones."""
        self.meshes = matched(self.meshes, scene.surfaces, lambda s: MeshDrawable(self.ctx, self.programs, s))
        if (scene.feathers or scene.quick_feathers) and self.feather_programs is None:
            self.feather_programs = FeatherPrograms(self.ctx)
        programs = self.feather_programs

        def made(mesh: FeatherMesh) -> FeatherDrawable:
            return FeatherDrawable(self.ctx, programs, mesh)

        if quick:
            self.quick_feathers = matched(self.quick_feathers, scene.quick_feathers, made)
        else:
            self.feathers = matched(self.feathers, scene.feathers, made)

    def cast_shadows(self, clip_from_world: NDArray[np.float64], quick: bool = False) -> Iterator[None]:
        """Draw the depth of all that keeps light off the rest, in steps."""
        for mesh in self.meshes:
            if not mesh.surface.ghost:
                mesh.draw_depth(clip_from_world)
        yield
        for feathers in self.quick_feathers if quick else self.feathers:
            for part in feathers.slices:
                feathers.draw_depth(clip_from_world, part)
                yield

    def draw(
        self, scene: Scene, camera: Camera, target: moderngl.Framebuffer, uniforms: dict[str, Any],
        outline: NDArray[np.float32], options: ViewOptions,
    ) -> None:
        """Draw all of a moving picture at once into color and depth of the target, which were cleared."""
        uniforms = lit_uniforms(scene, camera, uniforms)
        self.fill(scene, target, uniforms, options, quick=True)
        for _ in self.plumage(target, uniforms, quick=True):
            pass
        self.finish(camera, target, uniforms, outline, options, quick=True)

    def fill(
        self, scene: Scene, target: moderngl.Framebuffer, uniforms: dict[str, Any], options: ViewOptions,
        quick: bool = False,
    ) -> None:
        """Draw what hides other things, but for feathers.

        uniforms : of :func:`lit_uniforms`. quick : light vertices alone.
        """
        self._begin(target)
        if options.shading != "wire":
            self._fill(self._solid(), scene, uniforms, options.shading, quick)
        self._end()

    def plumage(
        self, target: moderngl.Framebuffer, uniforms: dict[str, Any], quick: bool = False
    ) -> Iterator[float]:
        """Draw the feathers, in steps; the done part 0 .. 1. quick : those of moving pictures."""
        drawn = self.quick_feathers if quick else self.feathers
        slices = [(feathers, part) for feathers in drawn for part in feathers.slices]
        for number, (feathers, part) in enumerate(slices):
            self._begin(target)
            feathers.draw(uniforms, part, quick)
            self._end()
            yield (number + 1) / len(slices)

    def finish(
        self, camera: Camera, target: moderngl.Framebuffer, uniforms: dict[str, Any], outline: NDArray[np.float32],
        options: ViewOptions, samples: int = 1, quick: bool = False,
    ) -> None:
        """Draw what lies over the rest: edges, the ground, ghosts.

        outline : of the scene, (M, 3). samples : of the target for a pixel, on a side.
        """
        ctx = self.ctx
        self._begin(target)
        ctx.enable(moderngl.BLEND)
        ctx.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        if options.edges:
            color = WIRE if options.shading in ("wire", "lines") else WIRE_OVER
            for mesh in self._solid():
                mesh.draw_edges(color, uniforms)
        target.depth_mask = False
        if options.grid:
            low, high = extent(outline)
            self.grid.draw(camera, 0.5 * (low + high), uniforms, target.viewport[2:], samples)
        ctx.enable(moderngl.CULL_FACE)
        for mesh in self.meshes:
            if mesh.surface.ghost:
                mesh.draw({**uniforms, "opacity": GHOST_OPACITY, "manner": 1}, quick=quick)
                if options.edges:
                    mesh.draw_edges(WIRE_GHOST, uniforms)
        target.depth_mask = True
        self._end()

    def _solid(self) -> list[MeshDrawable]:
        return [mesh for mesh in self.meshes if not mesh.surface.ghost]

    def _begin(self, target: moderngl.Framebuffer) -> None:
        target.use()
        self.ctx.enable(moderngl.DEPTH_TEST)
        self.ctx.disable(moderngl.BLEND | moderngl.CULL_FACE)

    def _end(self) -> None:
        self.ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)

    @staticmethod
    def _fill(
        meshes: Sequence[MeshDrawable], scene: Scene, uniforms: dict[str, Any], shading: str, quick: bool
    ) -> None:
        for mesh in meshes:
            covered = mesh.surface.covered
            under = bool(scene.coats) if covered is None else covered
            manner = {"matcap": 1, "lines": 2}.get(shading, 0)
            hair = quick and under and shading == "shaded"
            color = {"lines": FLAT, "matcap": mesh.surface.color if under else CLAY}.get(shading, mesh.surface.color)
            if hair and scene.coats:
                color = fur_color(scene.coats[0].look)
            more = {"covered": 1.0 if under else 0.0, "manner": manner, "stands_for_hair": hair}
            mesh.draw({**uniforms, **more}, color, quick)

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        things: list[Any] = [*self.meshes, *self.feathers, *self.quick_feathers, self.grid, self.programs]
        things += [] if self.feather_programs is None else [self.feather_programs]
        for thing in things:
            thing.release()
        self.meshes, self.feathers, self.quick_feathers, self.feather_programs = [], [], [], None
