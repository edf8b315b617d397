"""Surfaces to sculpt on."""

import numpy as np

from core.mesh.mesh import Mesh


def grid(n=21, size=1.0, z=None):
    """A square of n x n vertices in the plane z = 0, facing +z, about the origin."""
    u = np.linspace(-0.5 * size, 0.5 * size, n)
    x, y = np.meshgrid(u, u)
    height = np.zeros(n * n) if z is None else z(x.ravel(), y.ravel())
    points = np.stack([x.ravel(), y.ravel(), height], axis=1).astype(np.float32)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    corners = np.stack([a, a + 1, a + n + 1, a + n], axis=1).astype(np.int32)
    return Mesh(
        points=points, counts=np.full(len(corners), 4, np.int32), corners=corners.reshape(-1),
        parts=np.zeros(len(corners), np.int32), part_names=("grid",),
    )


def joined(first, second):
    """Two meshes as one, without joining their vertices."""
    return Mesh(
        points=np.concatenate([first.points, second.points]), counts=np.concatenate([first.counts, second.counts]),
        corners=np.concatenate([first.corners, second.corners + np.int32(len(first.points))]),
        parts=np.zeros(len(first.counts) + len(second.counts), np.int32), part_names=("both",),
    )


def sphere(n=48):
    """A closed unit sphere of quads and two fans, poles on z; (V, 3) exactly on it but for rounding."""
    theta = np.linspace(0.0, np.pi, n + 1)[1:-1]
    phi = np.linspace(0.0, 2.0 * np.pi, 2 * n, endpoint=False)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    body = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1).reshape(-1, 3)
    points = np.concatenate([body, [[0, 0, 1], [0, 0, -1]]]).astype(np.float32)
    wide = 2 * n
    i, k = np.meshgrid(np.arange(n - 2), np.arange(wide), indexing="ij")
    j = (k + 1) % wide
    quads = np.stack([i * wide + k, (i + 1) * wide + k, (i + 1) * wide + j, i * wide + j], axis=-1).reshape(-1, 4)
    around, following = np.arange(wide), (np.arange(wide) + 1) % wide
    last = (n - 2) * wide
    top = np.stack([np.full(wide, len(body)), around, following], axis=1)
    low = np.stack([np.full(wide, len(body) + 1), last + following, last + around], axis=1)
    corners = np.concatenate([quads.ravel(), top.ravel(), low.ravel()]).astype(np.int32)
    counts = np.concatenate([np.full(len(quads), 4), np.full(2 * wide, 3)]).astype(np.int32)
    return Mesh(
        points=points, counts=counts, corners=corners, parts=np.zeros(len(counts), np.int32), part_names=("sphere",),
    )
