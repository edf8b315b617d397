"""Kernels that shape children after they are interpolated: clumping and frizz. Nothing happens at zero."""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.groom.children_kernels import F1, F2, F3, I1, I2, I8, OUT_F3
from core.random import hash32, rand, rand1

WAVES = 64  # different frizz curves; each child takes two
CLUMP_REACH = 0.35  # at this distance from its guide, as a share of its length, a child closes up half as far
REACH = 0.12  # largest frizz at the tip, as a share of the child's length, at frizz 1


def clump_profile(points: int) -> NDArray[np.float32]:
    """How far a child has closed up along its length, (P,) float32, 0 at the root and 1 at the tip."""
    return (np.linspace(0.0, 1.0, points) ** 1.5).astype(np.float32)


def frizz_waves(points: int, seed: int) -> NDArray[np.float32]:
    """Smooth curves of noise growing from 0 at the root, (WAVES, P) float32, about -1 .. 1 at the tip."""
    t = np.linspace(0.0, 1.0, points)
    out = np.zeros((WAVES, points))
    keys = np.arange(WAVES)
    for octave in range(3):
        turns = (0.6 + 1.1 * octave) * (0.7 + 0.6 * rand(keys, seed + 2 * octave))
        phase = rand(keys, seed + 2 * octave + 1)
        out += np.sin(2.0 * pi * (turns[:, None] * t + phase[:, None])) / 1.6**octave
    return (out * t / np.abs(out).max()).astype(np.float32)


@njit(
    types.void(F3, I1, F2, F1, I2, F2, F1, F2, F2, F1, F1, types.int64, I1, types.boolean, I8, I8, OUT_F3),
    cache=True, nogil=True, fastmath={"contract", "reassoc", "nsz", "arcp", "afn"},
)
def shape_children(  # type: ignore[no-untyped-def]
    guides, ids, guide_roots, length, sites, weights, profile, waves, normals, clumps, frizzes, seed, rows, some,
    start, stop, out,
):
    """Draw children towards the curve of their strongest guide, then wave them along the skin.

    Parameters
    ----------
    guides : (G, 4, P) prepared guides. guide_roots : (G, 3) where they stand.
    profile : (P,). waves : (WAVES, P).
    normals : (G, 3) of the guides: frizz is square to the strongest guide's, so that it lowers no hair onto the skin.
    clumps, frizzes : 0 .. 1, (N,), or (1,) when they are the same for all. A child far from its guide, for its
        length, closes up less.
    """
    count = out.shape[2]
    last = np.float32(count - 1)
    for i in range(start, stop):
        r = rows[i] if some else i
        clump, frizz = clumps[r if len(clumps) > 1 else 0], frizzes[r if len(frizzes) > 1 else 0]
        w0, w1 = weights[r, 0], weights[r, 1]
        w2 = np.float32(1.0) - w0 - w1
        s = sites[r, 0] if w0 >= w1 and w0 >= w2 else (sites[r, 1] if w1 >= w2 else sites[r, 2])
        if clump > 0.0:
            far, reach = np.float32(0.0), np.float32(1e-30)
            for c in range(3):
                far += (out[r, c, 0] - guide_roots[s, c]) ** 2
                reach += (out[r, c, count - 1] - out[r, c, 0]) ** 2
            # short hair does not reach over to a far guide: without this, faces and paws grow scales
            near = np.float32(1.0) / (np.float32(1.0) + far / (np.float32(CLUMP_REACH * CLUMP_REACH) * reach))
            for j in range(1, count):
                at = min(np.float32(j) * length[r], last)
                k = min(np.int64(at), count - 2)
                b = at - np.float32(k)
                a = np.float32(1.0) - b
                m = clump * near * profile[j]
                for c in range(3):
                    goal = guide_roots[s, c] + a * guides[s, c, k] + b * guides[s, c, k + 1]
                    out[r, c, j] += m * (goal - out[r, c, j])
        if frizz > 0.0:
            long = np.float32(0.0)
            for j in range(1, count):
                x, y = out[r, 0, j] - out[r, 0, j - 1], out[r, 1, j] - out[r, 1, j - 1]
                z = out[r, 2, j] - out[r, 2, j - 1]
                long += np.float32(sqrt(x * x + y * y + z * z))
            nx, ny, nz = normals[s, 0], normals[s, 1], normals[s, 2]
            # two directions square to the normal, turned at random
            if abs(nx) < np.float32(0.6):
                ux, uy, uz = np.float32(0.0), -nz, ny
            else:
                ux, uy, uz = nz, np.float32(0.0), -nx
            scale = np.float32(1.0) / np.float32(sqrt(ux * ux + uy * uy + uz * uz + np.float32(1e-30)))
            ux, uy, uz = ux * scale, uy * scale, uz * scale
            vx, vy, vz = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
            turn = 2.0 * pi * rand1(ids[r], seed)
            co, si = np.float32(cos(turn)), np.float32(sin(turn))
            ax, ay, az = co * ux + si * vx, co * uy + si * vy, co * uz + si * vz
            bx, by, bz = co * vx - si * ux, co * vy - si * uy, co * vz - si * uz
            h = hash32(ids[r], seed + 1)
            p, q = np.int64(h) % WAVES, (np.int64(h) // WAVES) % WAVES
            size = frizz * np.float32(REACH) * long
            for j in range(1, count):
                d, e = size * waves[p, j], size * waves[q, j]
                out[r, 0, j] += d * ax + e * bx
                out[r, 1, j] += d * ay + e * by
                out[r, 2, j] += d * az + e * bz
