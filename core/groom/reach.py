"""How far hair grows from the guides: full up to a part of the reach, thinner from there, none beyond it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.evaluator import Evaluator
from core.falloff import smoothstep
from core.groom.binding import triangle_places
from core.groom.children import Children
from core.groom.guides import Guides
from core.mesh.mesh import Mesh
from core.mesh.skin import Skin, skin_at_rest
from core.mesh.surface import root_positions
from core.mesh.ways import Ways, distances_over, skin_ways

FULL = 0.6  # of the reach, up to which nothing is missing


def presence(
    children: Children, guides: Guides, mesh: Mesh, rest: Skin, reach: float, evaluator: Evaluator
) -> NDArray[np.float32] | None:
    """The share of the hairs (N,) that the reach leaves, in the order of the rows; None when it leaves all.

    Parameters
    ----------
    guides : those the children are bound to. rest : the skin of `mesh` at rest. reach : metres over the surface.
    """
    known = children.near
    if known is None or known[0] is not guides.roots or known[1] != reach:
        known = children.near = guides.roots, reach, _distances(children, guides, mesh, rest, reach, evaluator)
    left = 1.0 - smoothstep(FULL * reach, reach, known[2])
    return None if (left == 1.0).all() else np.asarray(left, np.float32)


def _distances(
    children: Children, guides: Guides, mesh: Mesh, rest: Skin, reach: float, evaluator: Evaluator
) -> NDArray[np.float32]:
    """Metres (N,) from each hair over the surface to the nearest guide; infinite where no way leads or it is too far.

    Ways along the mesh are too long by up to two edges near their ends, the straight line to the guides a hair is bound
    to is too short where the skin folds: what is more of the line and the way less these edges is right where either
    is, and passes smoothly from one to the other.
    """
    ways = evaluator.get(_ways, mesh, evaluator=evaluator)
    triangle, _ = triangle_places(mesh, rest.triangles, guides.roots)
    roots = root_positions(mesh, guides.roots).astype(np.float64)
    corners = rest.triangles.vertices
    starts = corners[triangle]
    offsets = np.linalg.norm(rest.points[starts] - roots[:, None], axis=2)
    longest = _longest_edges(rest)
    over = distances_over(ways, starts.ravel(), offsets.ravel(), reach + 3.0 * float(longest.max(initial=0.0)))
    if children.footing is None:
        children.footing = _footing(children, rest)
    place, own, legs = children.footing
    far, sites, edges = over.astype(np.float32), roots.astype(np.float32), longest.astype(np.float32)
    way, line = far[own[0]] + legs[0], _apart(place, sites[children.sites[:, 0]])
    for k in (1, 2):
        np.minimum(way, far[own[k]] + legs[k], out=way)
        np.minimum(line, _apart(place, sites[children.sites[:, k]]), out=line)
    return np.maximum(np.sqrt(line), way - 2.0 * edges[children.triangle])


class Footing(NamedTuple):
    """What of the hairs stays whatever the guides are: their places (N, 3), the corners (3, N) of their triangles, and
    how far they are from these (3, N), float32."""

    place: NDArray[np.float32]
    corners: NDArray[np.int32]
    legs: NDArray[np.float32]


def _footing(children: Children, rest: Skin) -> Footing:
    own = np.ascontiguousarray(rest.triangles.vertices[children.triangle].T)
    place = np.einsum("nk,knc->nc", children.barycentric(), rest.points[own]).astype(np.float32)
    legs = np.linalg.norm(rest.points[own] - place, axis=2).astype(np.float32)
    return Footing(place, own, legs)


def _apart(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.float32]:
    """Squared distances (N,) of rows (N, 3)."""
    way = a - b
    return np.asarray(np.einsum("nc,nc->n", way, way))


def _longest_edges(rest: Skin) -> NDArray[np.float64]:
    points = rest.points[rest.triangles.vertices].astype(np.float64)
    return np.asarray(np.linalg.norm(points - np.roll(points, 1, axis=1), axis=2).max(axis=1))


def _ways(mesh: Mesh, evaluator: Evaluator) -> Ways:
    skin = skin_at_rest(mesh, evaluator)
    return skin_ways(skin.points, skin.triangles.vertices)
