"""Turn the faces of a surface to agree with each other, and outwards where it is closed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from core.mesh.edges import Edges, next_corner, reversed_corners


def orient(
    points: NDArray[np.float64],
    counts: NDArray[np.int64],
    corners: NDArray[np.int64],
    uvs: NDArray[np.float32] | None,
    edges: Edges,
) -> int:
    """Turn faces to agree across the edges two faces share, and outwards where a piece is closed.

    `corners` (and the `uvs` of corners) are changed in place. Each piece follows the greater part of its faces.

    Returns
    -------
    The number of faces that were turned.
    """
    first = np.flatnonzero(np.append(True, edges.group[1:] != edges.group[:-1]))[edges.uses == 2]
    face_of_corner = np.repeat(np.arange(len(counts)), counts)
    one, two = face_of_corner[edges.order[first]], face_of_corner[edges.order[first + 1]]
    clash = edges.forward[first] == edges.forward[first + 1]
    flip = np.zeros(len(counts), np.bool_)
    if clash.any():
        flip = _agree(len(counts), one, two, clash)
    graph = coo_matrix((np.ones(len(one), np.int8), (one, two)), shape=(len(counts), len(counts)))
    total, piece = connected_components(graph, directed=False)
    leaking = np.zeros(total, np.bool_)
    leaking[piece[face_of_corner[edges.order[(edges.uses != 2)[edges.group]]]]] = True
    if clash.any():
        leaking[piece[one[(flip[one] != flip[two]) != clash]]] = True  # a surface with one side has no inside
    flip ^= _inside_out(points, counts, corners, face_of_corner, flip, piece, ~leaking)[piece]
    if flip.any():
        source = np.where(flip[face_of_corner], reversed_corners(counts), np.arange(len(corners)))
        corners[:] = corners[source]
        if uvs is not None:
            uvs[:] = uvs[source]
    return int(flip.sum())


def _agree(
    faces: int, one: NDArray[np.int64], two: NDArray[np.int64], clash: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Which faces to turn, the fewer of each piece, (F,) bool.

    Each face stands twice in a graph, as it is and turned; a shared edge links the copies that agree. The two
    copies of an orientable piece fall into two components.
    """
    other = two + np.where(clash, faces, 0)
    other_turned = two + np.where(clash, 0, faces)
    rows, columns = np.concatenate([one, one + faces]), np.concatenate([other, other_turned])
    graph = coo_matrix((np.ones(len(rows), np.int8), (rows, columns)), shape=(2 * faces, 2 * faces))
    label = connected_components(graph, directed=False)[1]
    as_is, turned = label[:faces], label[faces:]
    size = np.bincount(as_is, minlength=int(label.max()) + 1)  # faces standing unturned in each component
    # keep the copy of the piece in which more faces stand as they are; of equals the lower label
    return (as_is != turned) & (
        (size[as_is] < size[turned]) | ((size[as_is] == size[turned]) & (as_is > turned))
    )


def _inside_out(
    points: NDArray[np.float64],
    counts: NDArray[np.int64],
    corners: NDArray[np.int64],
    face_of_corner: NDArray[np.int64],
    flip: NDArray[np.bool_],
    piece: NDArray[np.int64],
    closed: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Which pieces are closed, have negative volume and lie in no other closed piece's box, (pieces,) bool."""
    wrong = np.zeros(len(closed), np.bool_)
    if not closed.any():
        return wrong
    middle = points.mean(axis=0)
    a = points[corners] - middle
    b = points[corners[next_corner(counts)]] - middle
    centre = np.add.reduceat(a, np.cumsum(counts) - counts) / counts[:, None]
    six = np.einsum("ci,ci->c", np.cross(a, b), centre[face_of_corner]) * np.where(flip, -1.0, 1.0)[face_of_corner]
    wrong = closed & (np.bincount(piece[face_of_corner], six, len(closed)) < 0)
    if wrong.any() and closed.sum() > 1:
        low, high = np.full((len(closed), 3), np.inf), np.full((len(closed), 3), -np.inf)
        np.minimum.at(low, piece[face_of_corner], a)
        np.maximum.at(high, piece[face_of_corner], a)
        shells = np.flatnonzero(closed)
        for row in np.flatnonzero(wrong)[:1000]:
            # the inner wall of a hollow body looks inwards rightly
            wrong[row] = not ((low[shells] < low[row]) & (high[shells] > high[row])).all(axis=1).any()
    return wrong
