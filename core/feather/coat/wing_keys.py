"""Keys on the body that lie as the rows of a wing do where they run on into its skin."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from core.evaluator import Evaluator
from core.feather.coat.frames import unit
from core.feather.coat.posing import LENGTH
from core.feather.coat.wing import WING_IDS, Wing
from core.feather.coat.wing_pose import lay_wings
from core.mesh.bvh import closest_points
from core.mesh.mesh import Mesh
from core.mesh.roots import Roots
from core.mesh.skin import Skin
from core.mesh.surface import place_roots

CLEAR = 0.8  # of their length, around keys beside a wing, in which no others stand
INNERMOST = 4  # feathers of a row of a wing that keys stand beside; every second one of a tail
COVERTS = "covert"  # rows whose parts are called so lie on the skin


class Beside(NamedTuple):
    """K keys: where they stand, their directions (K, 3) along the skin, and lengths (K,), metres."""

    roots: Roots
    along: NDArray[np.float64]
    lengths: NDArray[np.float64]


def keys_beside(wings: tuple[Wing, ...], mesh: Mesh, skin: Skin, evaluator: Evaluator) -> Beside:
    """Keys on the skin below feathers of the rows of coverts that begin on the body, lying as they do."""
    chosen = tuple(
        wing.replace(rows=tuple(row for row in wing.rows if COVERTS in row.part and row.anchors[0] == 0))
        for wing in wings)
    laid = lay_wings(chosen, mesh.points, mesh.points, 0.0)
    tails = np.isin((laid.ids - WING_IDS) >> 16, [wing.id for wing in wings if wing.kind == "tail"])
    first = np.where(tails, laid.ids % 2 == 0, (laid.ids & 255) < INNERMOST)
    triangle, weights, _ = closest_points(skin.bvh, laid.roots[first], workers=evaluator.workers)
    found = triangle >= 0
    roots = place_roots(mesh, skin.triangles, triangle[found], weights[found].astype(np.float32), skin.normals)
    normals = roots.frames[:, 2].astype(np.float64)
    along = laid.frames[first][found][:, 1].astype(np.float64)
    along = unit(along - normals * np.einsum("nc,nc->n", along, normals)[:, None])
    return Beside(roots, along, laid.poses[first][found][:, LENGTH])


def clear_of(
    places: NDArray[np.float32], beside: NDArray[np.float32], lengths: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Which of the places (N, 3) of other keys are not so near that they would speak against those at `beside`."""
    away = cKDTree(beside).query(places)[0] if len(beside) else np.full(len(places), np.inf)
    return np.asarray(away > CLEAR * float(np.median(lengths)) if len(lengths) else away > 0.0)
