"""Every preset at every level of detail: its silhouette keeps to that of the next finer one."""

from __future__ import annotations

import functools
import itertools

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from core.feather.attributes import COLUMNS
from core.feather.levels import LEVELS, Level, feather_mesh
from core.feather.pieces import FeatherMesh
from core.feather.presets import preset_names, preset_values

PIXELS = 600  # of the length of a feather
BOUND = 0.01  # of the length of a feather
VIEWS = ((0.0, 0.0), (0.6, 0.0), (0.25, 0.5))  # radians: turned about the shaft, and leaned towards the eye


@functools.cache
def _mesh(preset: str, level: Level) -> FeatherMesh:
    return feather_mesh(preset_values(preset), 5, level)


def _seen(mesh: FeatherMesh, length: float, turn: float, lean: float) -> NDArray[np.float64]:
    """Where the vertices of a feather are seen (V, 2), in pixels."""
    x, y, z = (mesh.points.astype(np.float64) / length).T
    x, z = x * np.cos(turn) + z * np.sin(turn), z * np.cos(turn) - x * np.sin(turn)
    y = y * np.cos(lean) + z * np.sin(lean)
    return np.stack([x, y], axis=1) * PIXELS


def _silhouette(mesh: FeatherMesh, seen: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.uint8]:
    """What a feather covers (H, W), 0 or 255: its triangles, each with its picture where it is a card."""
    out = np.zeros(size, np.uint8)
    if mesh.picture is None:
        for triangle in np.round(seen * 16.0).astype(np.int32)[mesh.triangles]:
            cv2.fillConvexPoly(out, triangle, 255, cv2.LINE_8, 4)
        return out
    high, wide = mesh.picture.shape[:2]
    texels = (mesh.flat - np.array(mesh.corner)) / np.array(mesh.extent) * [wide, high] - 0.5
    covered = (mesh.picture[..., 3] > 0).astype(np.uint8) * 255
    for triangle in mesh.triangles:
        to, start = seen[triangle], texels[triangle]
        left, top = np.floor(to.min(axis=0)).astype(int) - 1
        right, bottom = np.ceil(to.max(axis=0)).astype(int) + 2
        inside = np.zeros((bottom - top, right - left), np.uint8)
        cv2.fillConvexPoly(inside, np.round((to - [left, top]) * 16.0).astype(np.int32), 255, cv2.LINE_8, 4)
        y, x = np.nonzero(inside)
        sides = np.stack([to[1] - to[0], to[2] - to[0]], axis=1)
        weights = np.clip((np.stack([x + left, y + top], axis=1) - to[0]) @ np.linalg.pinv(sides).T, 0.0, 1.0)
        u, v = np.round(start[0] + weights @ np.stack([start[1] - start[0], start[2] - start[0]])).astype(int).T
        drawn = covered[np.clip(v, 0, high - 1), np.clip(u, 0, wide - 1)]
        out[y + top, x + left] |= drawn
    return out


def apart(preset: str, coarse: Level, fine: Level, view: tuple[float, float]) -> tuple[float, float]:
    """How far the silhouettes of two levels stick out of one another (Hausdorff), in lengths of the feather: the
    coarse one out of the fine one, and the fine out of the coarse."""
    length = float(preset_values(preset)[COLUMNS["shaftLength"]])
    meshes = [_mesh(preset, level) for level in (coarse, fine)]
    seen = [_seen(mesh, length, *view) for mesh in meshes]
    low = np.minimum(seen[0].min(axis=0), seen[1].min(axis=0)) - 4.0
    size = np.ceil(np.maximum(seen[0].max(axis=0), seen[1].max(axis=0)) - low).astype(int) + 8
    drawn = [_silhouette(mesh, at - low, (size[1], size[0])) for mesh, at in zip(meshes, seen, strict=True)]
    away = [cv2.distanceTransform(255 - one, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) / PIXELS for one in drawn]
    return float(away[1][drawn[0] > 0].max()), float(away[0][drawn[1] > 0].max())


@pytest.mark.parametrize(("coarse", "fine"), list(itertools.pairwise(LEVELS)))
@pytest.mark.parametrize("preset", preset_names())
def test_a_level_of_detail_keeps_to_the_silhouette_of_the_finer_one(preset: str, coarse: Level, fine: Level) -> None:
    for view in VIEWS:
        assert max(apart(preset, coarse, fine, view)) <= BOUND
