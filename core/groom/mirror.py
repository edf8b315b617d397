"""Mirror: one side of the groom is copied to the other and takes over what stood there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from core.groom.delete import removable
from core.groom.guides import Guides
from core.groom.rows import append_guides, take_rows
from core.mesh.bvh import closest_points
from core.mesh.skin import Skin
from core.mesh.surface import place_roots, root_positions
from core.transform import minimal_rotation


def mirror(
    guides: Guides, skin: Skin, *, axis: int = 0, source: int = 1, centre: float = 0.0, same: float = 1e-4,
    reach: float = 0.05,
) -> Guides:
    """Copy the guides on one side of a plane of the object to the other side.

    Parameters
    ----------
    axis : 0, 1 or 2, the axis square to the plane; the plane lies at `centre` metres.
    source : 1 or -1, the side that is copied (of the selected guides only, where any are selected).
    same : roots this close (as a fraction of the skin's diagonal) to a mirrored root are its counterpart, which keeps
        its id; guides this close to the plane are left alone.
    reach : mirrored roots farther than this fraction of the diagonal from the skin are left out.

    Returns
    -------
    Guides: counterparts reshaped, other guides of the far side gone, missing ones planted. Frozen, held and (where any
    are selected) unselected guides of the far side stay and are not doubled.
    """
    if len(guides) == 0:
        return guides
    flip = np.ones(3)
    flip[axis] = -1.0
    shift = np.zeros(3)
    shift[axis] = 2.0 * centre
    roots = guides.points[:, 0].astype(np.float64)
    offset = source * (roots[:, axis] - centre)
    tolerance = same * skin.diagonal
    from_rows = np.flatnonzero((offset > tolerance) & (guides.selected | (not guides.selected.any())))
    far = np.flatnonzero(offset < -tolerance)
    mirrored = roots[from_rows] * flip + shift
    triangle, barycentric, distance = closest_points(skin.bvh, mirrored.astype(np.float32))
    good = (triangle >= 0) & (distance <= reach * skin.diagonal)
    from_rows, triangle, barycentric = from_rows[good], triangle[good], barycentric[good]
    normals = skin.normals if skin.points is skin.mesh.points else None
    new_roots = place_roots(skin.mesh, skin.triangles, triangle, barycentric, normals)
    places = root_positions(skin.mesh, new_roots)
    points = _mirrored_points(guides, from_rows, flip, new_roots.frames[:, 2], places)

    twin = _counterparts(roots[far], places.astype(np.float64), tolerance)
    matched = twin >= 0
    twin_rows = far[twin[matched]]
    may = removable(guides)
    take_over = may[twin_rows]
    onto, of = twin_rows[take_over], np.flatnonzero(matched)[take_over]
    out_points, hold = guides.points.copy(), guides.hold.copy()
    # the counterpart keeps its own root, which may lie a little beside the mirrored one
    delta = out_points[onto, 0].astype(np.float64) - places[of]
    out_points[onto, 1:] = points[of, 1:] + delta[:, None]
    hold[onto] = guides.hold[from_rows[of]]
    out = guides.replace(points=out_points, hold=hold)
    gone = np.zeros(len(guides), np.bool_)
    gone[far] = True
    gone[twin_rows] = False
    gone &= may
    if gone.any():
        out = take_rows(out, ~gone)
    plant = ~matched
    return append_guides(out, new_roots.take(plant), points[plant], guides.hold[from_rows[plant]])


def _mirrored_points(
    guides: Guides, rows: NDArray[np.int64], flip: NDArray[np.float64], normals: NDArray[np.float32],
    places: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Strands reflected, turned from the reflected normal to the one found there, and set on their new roots."""
    x = guides.points[rows].astype(np.float64)
    shape = (x - x[:, :1]) * flip
    was = guides.roots.frames[rows, 2].astype(np.float64) * flip
    turn = minimal_rotation(was, normals.astype(np.float64))
    # normals equal to rounding: no turn at all, so that a symmetric skin mirrors exactly
    exact = np.einsum("nc,nc->n", was, normals.astype(np.float64)) > 1.0 - 1e-5
    turn[exact] = np.eye(3)
    out = np.einsum("nab,npb->npa", turn, shape) + places[:, None].astype(np.float64)
    points = out.astype(np.float32)
    points[:, 0] = places
    return points


def _counterparts(
    far_roots: NDArray[np.float64], places: NDArray[np.float64], tolerance: float
) -> NDArray[np.int64]:
    """For each place the index of the far root that is its counterpart, -1 for none; no root is used twice."""
    twin = np.full(len(places), -1, np.int64)
    if len(far_roots) == 0 or len(places) == 0:
        return twin
    distance, index = cKDTree(far_roots).query(places)
    order = np.argsort(distance, kind="stable")
    order = order[distance[order] <= tolerance]
    _, first = np.unique(index[order], return_index=True)
    chosen = order[first]
    twin[chosen] = index[chosen]
    return twin
