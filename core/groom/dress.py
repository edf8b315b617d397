"""From a bare animal to a groom: guides laid by a style, and the coat to grow from them."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

import numpy as np

from core.errors import UserError
from core.evaluator import Evaluator
from core.groom.collide import push_out
from core.groom.flow import Flow, flow_field
from core.groom.groom import WIDEST, Coat, Groom, Map
from core.groom.maps import density_at
from core.groom.style import Style, lay_guides, length_factors
from core.mesh.mesh import Mesh
from core.mesh.scatter import scatter
from core.mesh.skin import Skin, distance_field, skin_at_rest
from core.mesh.surface import place_roots, root_positions
from core.record import freeze
from core.value import constant

Stage = Callable[[str], AbstractContextManager[None]]


def no_stages(name: str) -> AbstractContextManager[None]:
    """Stages nobody listens to."""
    return nullcontext()


def dress(
    mesh: Mesh, style: Style, evaluator: Evaluator, guides: int = 4000, hairs: int = 100_000,
    length: float | None = None, maps: tuple[Map, ...] = (), density_map: str | None = None,
    length_map: str | None = None, seed: int = 0, mesh_id: int = 1, name: str = "coat", stage: Stage = no_stages,
) -> Groom:
    """A groom of exactly `guides` guides laid by `style`, with a coat of exactly `hairs` children to grow.

    Parameters
    ----------
    length : metres of a guide at factor 1; the style's share of the bounding-box diagonal when None.
    maps : maps of the groom; `density_map` and `length_map` name those that drive density and length.

    Raises
    ------
    UserError
        The mesh has no surface to grow on, or the map leaves none.
    """
    with stage("skin"):
        skin = skin_at_rest(mesh, evaluator)
        if not skin.diagonal > 0.0:
            raise UserError("the mesh has no surface to grow hair on")
        flow = skin_flow(skin)
    with stage("field"):
        field = distance_field(mesh, evaluator)
    with stage("guides"):
        density = density_at(next((m for m in maps if m.name == density_map), None), mesh, skin.triangles)
        where = scatter(
            skin.points, skin.triangles.vertices, guides, seed=seed + 1, density=density, workers=evaluator.workers
        )
        roots = place_roots(mesh, skin.triangles, where.triangle, where.barycentric, skin.normals)
        factors = length_factors(
            skin.points, skin.triangles.vertices, skin.normals, flow, skin.bvh, style, evaluator.workers
        )
        corners = skin.triangles.vertices[where.triangle]
        lengths = np.einsum("nk,nk->n", where.barycentric, factors[corners]) * np.float32(
            style.length * skin.diagonal if length is None else length
        )
        root_flow = np.einsum("nk,nkc->nc", where.barycentric, flow.directions[corners])
        laid = lay_guides(
            roots, root_positions(mesh, roots), root_flow, lengths, skin.bvh, skin.points, skin.triangles.vertices,
            skin.normals, flow.directions, style, seed=seed, workers=evaluator.workers,
        )
        laid = push_out(laid, field, ranges=evaluator.workers.ranges)
    coat = Coat(
        count=hairs, seed=seed, width_root=constant(min(style.width_root * skin.diagonal, WIDEST)),
        width_tip=constant(min(style.width_tip * skin.diagonal, WIDEST)),
        color_root=style.color_root, color_tip=style.color_tip, clump=constant(style.clump),
        frizz=constant(style.frizz), length_variation=constant(style.length_variation),
        density_map=density_map, length_map=length_map,
    )
    return Groom(id=1, name=name, mesh_id=mesh_id, guides=laid, coat=coat, maps=maps)


def skin_flow(skin: Skin, nose: int | None = None) -> Flow:
    """The direction a coat lies in on this skin (see ``core.groom.flow``), frozen; from a known nose, or one found."""
    flow = flow_field(skin.points, skin.triangles.vertices, skin.normals, nose=nose)
    return Flow(freeze(flow.directions), freeze(flow.distance), flow.nose)
