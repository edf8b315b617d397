"""Small scenes with known answers."""

from __future__ import annotations

import numpy as np

from core.camera import Camera, look_at
from viewport.scene import Coat, Look, Surface

FLAT = Look(value_variation=0.0, hue_variation=0.0, root_width=0.01, tip_width=0.01)


def camera(eye=(0.0, 0.0, 4.0), target=(0.0, 0.0, 0.0), **fields) -> Camera:
    return Camera(world_from_camera=look_at(eye, target), near=0.1, far=50.0, **fields)


def hairs(roots, tips, points=8, look=FLAT, ids=None, normals=None, tints=None) -> Coat:
    """Straight hairs, (N, 3, P)."""
    roots, tips = np.atleast_2d(np.asarray(roots, float)), np.atleast_2d(np.asarray(tips, float))
    u = np.linspace(0.0, 1.0, points)
    xyz = roots[:, :, None] * (1 - u) + tips[:, :, None] * u
    n = len(roots)
    if normals is None:
        normals = np.tile([0.0, 0.0, 1.0], (n, 1))
    return Coat(
        np.ascontiguousarray(xyz, np.float32), np.arange(n) if ids is None else np.asarray(ids),
        np.asarray(normals, np.float32), look, None if tints is None else np.asarray(tints, np.float32),
    )


def quad(z=0.0, half=1.0, color=(0.3, 0.3, 0.3)) -> Surface:
    """A square facing +z."""
    points = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]], np.float32)
    normals = np.tile(np.array([0, 0, 1], np.float32), (4, 1))
    return Surface(points, normals, np.array([[0, 1, 2], [0, 2, 3]], np.int32), color)


def ball(count=4000, length=0.2, look=FLAT, seed=3) -> tuple[Surface, Coat]:
    """A sphere of radius 1 with hairs that stand on it, leaning down."""
    rng = np.random.default_rng(seed)
    n = rng.normal(size=(count, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    a, b = np.linspace(0, np.pi, 33), np.linspace(0, 2 * np.pi, 65)
    p = np.stack(
        [np.outer(np.sin(a), np.cos(b)), np.outer(np.cos(a), np.ones_like(b)), np.outer(np.sin(a), -np.sin(b))], -1
    ).reshape(-1, 3).astype(np.float32)
    i = (np.arange(32)[:, None] * 65 + np.arange(64)).reshape(-1)
    triangles = np.concatenate([np.stack([i, i + 65, i + 1], 1), np.stack([i + 1, i + 65, i + 66], 1)])
    skin = Surface(p, p, triangles.astype(np.int32), (0.05, 0.03, 0.02))
    return skin, hairs(n, n * (1 + length) + [0, -length, 0], look=look, normals=n)
