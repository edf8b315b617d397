"""Clone: a sculpted strand or lock, stamped elsewhere in the frame of the skin there."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from core.groom.collide import push_out
from core.groom.delete import removable
from core.groom.guides import Guides
from core.groom.rows import append_guides, take_rows, with_points
from core.mesh.bvh import closest_points
from core.mesh.distance_field import DistanceField
from core.mesh.skin import Skin
from core.mesh.surface import place_roots, root_positions
from core.random import rand
from core.transform import matrix_from_quaternion, minimal_rotation, quaternion_about

Array = NDArray[np.float64]


def clone(
    guides: Guides,
    skin: Skin,
    source_ids: ArrayLike,
    triangle: int,
    barycentric: ArrayLike,
    *,
    scale: float = 1.0,
    twist: float = 0.0,
    flip: bool = False,
    variation: float = 0.0,
    seed: int = 0,
    radius: float | None = None,
    onto: Literal["new", "strands"] = "new",
    field: DistanceField | None = None,
) -> Guides:
    """Stamp the guides `source_ids` (one strand, or a lock about its middle strand) at a place of the skin.

    Parameters
    ----------
    triangle, barycentric : the place on `skin.triangles` where the middle strand goes.
    scale, twist, flip : of the whole stamp: size, radians about the normal, left and right (along V) exchanged.
    variation : 0 .. 1, how much each strand of the stamp differs in size, turn and lean, keyed on its id and `seed`.
    radius : footprint in metres around the place; by default that of the lock, so that a single strand has none.
    onto : "new" plants new guides and removes those that stood in the footprint; "strands" plants none: each guide in
        the footprint keeps root and id and takes the shape of the nearest strand of the stamp.
    field : signed distance to the skin, to keep the stamp out of it; None ignores it.
    """
    rows = np.flatnonzero(np.isin(guides.ids, np.asarray(source_ids)))
    if len(rows) == 0:
        return guides
    x = guides.points[rows].astype(np.float64)
    frames = guides.roots.frames[rows].astype(np.float64)
    middle = int(np.argmin(np.linalg.norm(x[:, 0] - x[:, 0].mean(axis=0), axis=1)))
    normals = skin.normals if skin.points is skin.mesh.points else None
    place = place_roots(
        skin.mesh, skin.triangles, np.array([triangle], np.int32), np.asarray(barycentric, np.float32).reshape(1, 3),
        normals)
    centre = root_positions(skin.mesh, place)[0].astype(np.float64)
    stamp = _stamp(frames[middle], place.frames[0].astype(np.float64), twist, flip)

    # Where the strands of the lock go: their offsets along the skin, carried over and dropped onto it.
    offsets = x[:, 0] - x[middle, 0]
    along = offsets - (offsets @ frames[middle, 2])[:, None] * frames[middle, 2]
    size, flat = np.linalg.norm(offsets, axis=1), np.linalg.norm(along, axis=1)
    along *= np.where(flat > 0.0, size / np.where(flat > 0.0, flat, 1.0), 0.0)[:, None]
    spots = centre + scale * along @ stamp.T
    on_triangle, weights, _ = closest_points(skin.bvh, spots.astype(np.float32))
    on_triangle[middle], weights[middle] = triangle, np.asarray(barycentric, np.float32)
    good = on_triangle >= 0
    x, frames, on_triangle, weights = x[good], frames[good], on_triangle[good], weights[good]
    roots = place_roots(skin.mesh, skin.triangles, on_triangle, weights, normals)
    places = root_positions(skin.mesh, roots)
    if radius is None:
        radius = scale * float(size.max()) * 1.05

    near = np.linalg.norm(guides.points[:, 0].astype(np.float64) - centre, axis=1) <= radius
    near &= removable(guides)
    if onto == "strands":
        taken = np.flatnonzero(near)
        if len(taken) == 0:
            return guides
        pick = cKDTree(places.astype(np.float64)).query(guides.points[taken, 0].astype(np.float64))[1]
        points = _shaped(x[pick], frames[pick, 2], guides.roots.frames[taken], guides.points[taken, 0], stamp,
                         scale, variation, guides.ids[taken], seed)
        out = with_points(guides, taken, points)
        return out if field is None else push_out(out, field, mask=near)
    new_ids = np.arange(guides.next_id, guides.next_id + len(x))
    points = _shaped(x, frames[:, 2], roots.frames, places, stamp, scale, variation, new_ids, seed)
    kept = take_rows(guides, ~near) if near.any() else guides
    out = append_guides(kept, roots, points)
    if field is not None:
        selected = out.selected
        alone = out.replace(selected=np.zeros(len(out), np.bool_))
        out = push_out(alone, field, mask=np.arange(len(out)) >= len(kept)).replace(selected=selected)
    return out


def _stamp(source: Array, target: Array, twist: float, flip: bool) -> Array:
    """(3, 3): object-space turn (and flip) from the frame of the source to that of the target; rows of frames."""
    c, s = np.cos(twist), np.sin(twist)
    local = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ np.diag([1.0, -1.0 if flip else 1.0, 1.0])
    return np.asarray(target.T @ local @ source)


def _shaped(
    x: Array, normals: Array, frames: NDArray[np.float32], places: NDArray[np.float32], stamp: Array, scale: float,
    variation: float, ids: NDArray[np.int64], seed: int,
) -> NDArray[np.float32]:
    """Strands carried by the stamp, then by the smallest turn to the normal where each one stands."""
    there = frames[:, 2].astype(np.float64)
    turn = minimal_rotation(normals @ stamp.T, there) @ stamp
    factor = np.full(len(x), scale)
    if variation > 0.0:
        factor = factor * (1.0 + 0.5 * variation * (2.0 * rand(ids, seed) - 1.0))
        spin = 0.25 * np.pi * variation * (2.0 * rand(ids, seed + 1) - 1.0)
        lean = 0.15 * np.pi * variation * (2.0 * rand(ids, seed + 2) - 1.0)
        spun = matrix_from_quaternion(quaternion_about(there, spin))
        leant = matrix_from_quaternion(quaternion_about(frames[:, 0].astype(np.float64), lean))
        turn = leant @ spun @ turn
    out = np.einsum("nab,npb->npa", turn, (x - x[:, :1]) * factor[:, None, None])
    points = (out + places[:, None].astype(np.float64)).astype(np.float32)
    points[:, 0] = places
    return points
