"""Where the demo animal's fur is long, short, thin or missing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from core.demo.shape import PARTS, opposites
from core.falloff import smoothstep
from core.mesh.mesh import Mesh

Array = NDArray[np.float64]

BARE = ("nose", "eyes", "pads")


def maps(mesh: Mesh) -> dict[str, NDArray[np.float32]]:
    """Maps "length" and "density", (V,) float32 in 0 .. 1, of the animal's mesh: fractions of the coat's full values.

    Nose, eyes and pads are bare; the face, ears and lower legs short; the tail, ruff and nape long.
    """
    x, y, z = mesh.points.astype(np.float64).T
    on = {name: _share(mesh, index) for index, name in enumerate(PARTS)}
    throat = (1.0 - smoothstep(0.225, 0.270, y)) * (1.0 - smoothstep(0.175, 0.215, z))
    head = 0.42 - 0.30 * smoothstep(0.225, 0.285, z) + 0.45 * throat
    ruff = smoothstep(0.060, 0.125, z) * (1.0 - smoothstep(0.190, 0.250, y))
    nape = smoothstep(0.215, 0.245, y) * (1.0 - smoothstep(0.150, 0.175, z))
    body = 0.50 + 0.42 * np.maximum(ruff, 0.7 * nape)
    legs = 0.14 + 0.36 * smoothstep(0.03, 0.125, y)
    tail = 1.0 - 0.35 * smoothstep(-0.310, -0.200, z)
    weights = np.stack([on["body"], on["head"], on["ears"], on["legs"], on["tail"]])
    weights = weights / np.maximum(weights.sum(axis=0), 1e-9)
    length = (weights * np.stack([body, head, np.full_like(x, 0.16), legs, tail])).sum(axis=0)
    density = 1.0 - 0.35 * weights[2]
    average = _averages(mesh)
    for _ in range(8):
        length, density = average @ length, average @ density
    bare = sum((on[name] for name in BARE), np.zeros_like(x)) > 0.0
    rim = 1.0 * ~bare
    for _ in range(2):  # thins out towards what is bare, without growing on it
        rim = np.minimum(rim, average @ rim)
    length, density = length * (0.4 + 0.6 * rim) * ~bare, density * rim * ~bare
    pairs = opposites(mesh.points)
    return {
        "length": (0.5 * (length + length[pairs])).astype(np.float32),
        "density": (0.5 * (density + density[pairs])).astype(np.float32),
    }


def _share(mesh: Mesh, part: int) -> Array:
    """Fraction (V,) of the faces at each vertex that belong to a part."""
    owner = np.repeat(mesh.parts == part, mesh.counts)
    faces = np.bincount(mesh.corners, minlength=len(mesh.points))
    return np.bincount(mesh.corners, owner, minlength=len(mesh.points)) / np.maximum(faces, 1)


def _averages(mesh: Mesh) -> csr_matrix:
    """(V, V), rows summing to 1: each vertex and its neighbours along edges in equal parts."""
    quads = mesh.corners.reshape(-1, 4)
    a, b = quads.ravel(), np.roll(quads, -1, axis=1).ravel()  # closed and oriented: every edge comes both ways
    own = np.arange(len(mesh.points))
    rows, columns = np.concatenate([a, own]), np.concatenate([b, own])
    degree = np.bincount(rows, minlength=len(own))
    return csr_matrix((1.0 / degree[rows], (rows, columns)), shape=(len(own), len(own)))
