"""From a groom to its hairs: scatter, bind, evaluate, settle. The static part is remembered, the rest is per frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.evaluator import Evaluator
from core.groom.binding import triangle_places
from core.groom.children import Children, evaluate, update_roots
from core.groom.coat_values import set_coat
from core.groom.collision import collision, settle_rows
from core.groom.dress import Stage, no_stages
from core.groom.groom import Groom, Map
from core.groom.maps import density_at
from core.groom.resample import with_point_count
from core.groom.settle import inside_segments
from core.mesh.bvh import closest_points
from core.mesh.edges import is_closed
from core.mesh.intrinsic import Binding, bind
from core.mesh.mesh import Mesh
from core.mesh.roots import Roots
from core.mesh.scatter import Scatter, scatter
from core.mesh.skin import Skin, skin_at_rest
from core.mesh.surface import root_normals, strands_on_deformed
from core.record import freeze


def grow(
    groom: Groom, mesh: Mesh, evaluator: Evaluator, skin: Skin | None = None, frame: float = 1001.0,
    stage: Stage = no_stages,
) -> Children:
    """The hairs of a groom, evaluated.

    Parameters
    ----------
    mesh : the mesh the groom grows on, at rest; roots are scattered and bound there.
    skin : the mesh in the pose wanted; at rest when None. Guides and hairs turn with it.
    frame : what animated values of the coat are taken at.
    """
    rest = skin_at_rest(mesh, evaluator)
    skin = rest if skin is None else skin
    coat, workers = groom.coat, evaluator.workers
    guides = groom.guides
    if guides.points.shape[1] != coat.points:
        guides = with_point_count(guides, coat.points)
    if len(guides) == 0:
        raise UserError("this groom has no guides; plant some before hair can grow")
    with stage("scatter"):
        thickness = None if coat.density_map is None else groom.map(coat.density_map)
        places = evaluator.get(scattered, mesh, thickness, count=coat.count, seed=coat.seed, evaluator=evaluator)
    with stage("bind"):
        binding = evaluator.get(
            _bound, mesh, guides.roots, places.triangle, places.barycentric, seed=coat.seed, evaluator=evaluator
        )
        uvs = None if mesh.uvs is None else mesh.uvs[rest.triangles.corners]
        children = Children(
            places.triangle, places.barycentric, binding, rest.triangles.vertices, uvs, coat.points, workers.ranges
        )
    with stage("evaluate"):
        set_coat(children, groom, mesh, rest, frame, evaluator)
        posed = skin is not rest
        points = strands_on_deformed(mesh, guides.roots, guides.points, skin.points) if posed else guides.points
        normals = root_normals(mesh, guides.roots, skin.points if posed else None)
        update_roots(children, skin.points, skin.normals)
        evaluate(children, points, normals, workers, shape=children.traits.shape)
    with stage("settle"):
        settle_rows(children.points, None, collision(mesh, skin.points, evaluator), workers)
    return children


def scattered(mesh: Mesh, density: Map | None, count: int, seed: int, evaluator: Evaluator) -> Scatter:
    """Roots of the hairs, once for a mesh, a density map, a count and a seed."""
    skin = skin_at_rest(mesh, evaluator)
    places = scatter(
        skin.points, skin.triangles.vertices, count, seed=seed, density=density_at(density, mesh, skin.triangles),
        workers=evaluator.workers,
    )
    return Scatter(freeze(places.triangle), freeze(places.barycentric))


def _bound(
    mesh: Mesh, roots: Roots, triangle: NDArray[np.int32], barycentric: NDArray[np.float32], seed: int,
    evaluator: Evaluator,
) -> Binding:
    """Hairs bound to guides, once for these roots of both; combing does not come here."""
    skin = skin_at_rest(mesh, evaluator)
    site_triangle, site_weights = triangle_places(mesh, skin.triangles, roots)
    return bind(
        skin.points, skin.triangles.vertices, site_triangle, site_weights, triangle, barycentric, seed,
        evaluator.workers,
    )


class Figures(NamedTuple):
    """root_error_max : largest distance of a root from the skin over the bounding-box diagonal.
    inside_segments : segments of hairs inside the skin, None where the skin is not closed."""

    root_error_max: float
    inside_segments: int | None


def measure(groom: Groom, mesh: Mesh, children: Children, evaluator: Evaluator) -> Figures:
    """How well hairs at rest stand on their skin."""
    skin = skin_at_rest(mesh, evaluator)
    roots = np.ascontiguousarray(children.points[:, :, 0])
    _, _, distance = closest_points(skin.bvh, roots, workers=evaluator.workers)
    error = float(distance.max()) / skin.diagonal if len(roots) else 0.0
    if not is_closed(mesh):
        return Figures(error, None)
    hard = collision(mesh, skin.points, evaluator)
    assert hard.signed is not None  # the skin is closed
    inside = inside_segments(children.points, hard.field, hard.signed, hard.tolerance, evaluator.workers)
    return Figures(error, int(inside.sum()))
