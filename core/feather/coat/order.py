"""Which feather lies over which: one order of the whole coat, by growth.

Feathers lie like roof tiles: a feather is over those behind it, the back over the flanks. What each pair of neighbours
says is gathered into one rank by least squares, which has no cycles; ranks belong to the feathers at rest and are
never made anew for a frame. (Growth order: Liu et al. 2015; the ranking: Jiang, Lim, Yao and Ye, "Statistical ranking
and combinatorial Hodge theory", 2011.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import cg

SIDEWAYS = 0.3  # weight of lying beside against lying behind


def roll_sides(frames: NDArray[np.float32]) -> NDArray[np.float64]:
    """How far each feather is rolled so that the back lies over the flanks, -1 .. 1, (N,): 0 along the midlines."""
    return -np.asarray(frames[:, 0, 1], np.float64)


def growth_order(
    roots: NDArray[np.float32], frames: NDArray[np.float32], near: NDArray[np.int32], sides: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Rank (N,) float64 of every feather: the lower lies over the higher.

    Parameters
    ----------
    roots : (N, 3). frames : (N, 3, 3), rows right, along, out. near : (N, K) int32, -1 for none.
    sides : (N,), see :func:`roll_sides`: the right edge is raised where it is above 0.
    """
    count = len(roots)
    i, k = np.nonzero(near >= 0)
    if not len(i):
        return np.arange(count, dtype=np.float64)
    j = near[i, k].astype(np.int64)
    step = roots[j].astype(np.float64) - roots[i]
    along = frames[i, 1].astype(np.float64) + frames[j, 1]
    across = frames[i, 0] * sides[i][:, None] + frames[j, 0] * sides[j][:, None]
    # a raised right edge lies over what is at the right
    score = 0.5 * np.einsum("nc,nc->n", step, along + SIDEWAYS * across)
    weight = 1.0 / np.maximum(np.einsum("nc,nc->n", step, step), 1e-30)
    # minimise sum of weight (rank_j - rank_i - score)^2
    adjacency = coo_array((weight, (i, j)), shape=(count, count)).tocsr()
    adjacency = adjacency + adjacency.T
    degree = np.asarray(adjacency.sum(axis=1)).ravel()
    right = np.bincount(j, weight * score, minlength=count) - np.bincount(i, weight * score, minlength=count)
    scale = 1.0 / np.sqrt(np.maximum(degree, 1e-300))
    laplacian = diags_array(degree * (1.0 + 1e-9)) - adjacency
    scaled = diags_array(scale) @ laplacian @ diags_array(scale)
    found, _ = cg(scaled, right * scale, rtol=1e-5, maxiter=400)
    return np.asarray(found * scale)
