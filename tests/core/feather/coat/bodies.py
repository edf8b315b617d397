"""Bodies to dress in tests, and crossing tests that share nothing with the kernels."""

from __future__ import annotations

import itertools

import numpy as np

from core.mesh.mesh import Mesh


def egg(rings: int = 16, around: int = 24) -> Mesh:
    """A closed egg lying along z, about 1.2 m long, with UVs (u around, v along)."""
    angles = np.linspace(0.0, np.pi, rings + 1)[1:-1]
    turn = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    radius = 0.3 * np.sin(angles) * (1.0 + 0.25 * np.cos(angles))
    ring = np.stack([np.outer(radius, np.cos(turn)), np.outer(radius, np.sin(turn)),
                     np.repeat(-0.6 * np.cos(angles)[:, None], around, 1)], axis=-1).reshape(-1, 3)
    points = np.concatenate([ring, [[0.0, 0.0, -0.6], [0.0, 0.0, 0.6]]]).astype(np.float32)
    at = np.arange(len(angles) * around).reshape(-1, around)
    right = np.roll(at, -1, axis=1)
    quads = np.stack([at[:-1], right[:-1], right[1:], at[1:]], axis=-1).reshape(-1, 4)  # outward
    first, last = len(ring), len(ring) + 1
    caps = [(first, right[0, k], at[0, k]) for k in range(around)]
    caps += [(last, at[-1, k], right[-1, k]) for k in range(around)]
    corners = np.concatenate([quads.ravel(), np.array(caps).ravel()]).astype(np.int32)
    counts = np.concatenate([np.full(len(quads), 4), np.full(len(caps), 3)]).astype(np.int32)
    place = np.stack([np.arctan2(points[:, 1], points[:, 0]) / (2.0 * np.pi) + 0.5, points[:, 2] / 1.2 + 0.5], axis=1)
    return Mesh(
        points=points, counts=counts, corners=corners, uvs=place[corners].astype(np.float32),
        parts=np.zeros(len(counts), np.int32), part_names=("egg",),
    )


def cells(vane: np.ndarray) -> np.ndarray:
    """The triangles (T, 3, 3) float64 of a vane (R, C, 3), cut as they are written to files."""
    a, b, c, d = vane[:-1, :-1], vane[:-1, 1:], vane[1:, 1:], vane[1:, :-1]
    both = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2)
    return both.reshape(-1, 3, 3).astype(np.float64)


def meet(first: np.ndarray, second: np.ndarray) -> bool:
    """True when triangles (A, 3, 3) and (B, 3, 3) pass through each other: edges solved against planes."""
    near = (first.min(axis=1)[:, None] <= second.max(axis=1)).all(axis=2)
    near &= (second.min(axis=1) <= first.max(axis=1)[:, None]).all(axis=2)
    i, j = np.nonzero(near)
    return _edges_through(first[i], second[j]) or _edges_through(second[j], first[i])


def _edges_through(edges_of: np.ndarray, plates: np.ndarray) -> bool:
    """True when an edge of a triangle (K, 3, 3) goes through its plate (K, 3, 3)."""
    for i, j in itertools.combinations(range(3), 2):
        p, q = edges_of[:, i], edges_of[:, j]
        a, u, v = plates[:, 0], plates[:, 1] - plates[:, 0], plates[:, 2] - plates[:, 0]
        matrix = np.stack([u, v, p - q], axis=-1)
        solvable = np.abs(np.linalg.det(matrix)) > 1e-18
        matrix = np.where(solvable[:, None, None], matrix, np.eye(3))
        s, t, along = np.linalg.solve(matrix, (p - a)[..., None])[..., 0].T
        if np.any(solvable & (s >= 0) & (t >= 0) & (s + t <= 1) & (along >= 0) & (along <= 1)):
            return True
    return False


def crossing_by_solving(vanes: np.ndarray) -> set[tuple[int, int]]:
    """Every pair of vanes (N, R, C, 3) that passes through each other, by brute force."""
    low, high = vanes.min(axis=(1, 2)), vanes.max(axis=(1, 2))
    triangles = [cells(vane) for vane in vanes]
    found = set()
    for i in range(len(vanes)):
        near = np.flatnonzero((low[i + 1:] <= high[i]).all(1) & (high[i + 1:] >= low[i]).all(1)) + i + 1
        found |= {(i, int(j)) for j in near if meet(triangles[i], triangles[j])}
    return found
