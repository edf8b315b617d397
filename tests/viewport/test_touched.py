"""Strands that may reach into what has changed are found, and no others far from it."""

from __future__ import annotations

import numpy as np

from core.camera import Camera, frame_points, project
from viewport.touched import CELL, MOVED_MARGIN, REACH_MARGIN, Touched

SIZE = (640, 400)


def _strands(count: int, seed: int) -> tuple[np.ndarray, Camera]:
    rng = np.random.default_rng(seed)
    roots = rng.uniform(-1.0, 1.0, (count, 1, 3))
    points = (roots + np.linspace(0.0, 0.2, 8)[:, None] * rng.normal(size=(count, 1, 3))).astype(np.float32)
    return points, frame_points(points.reshape(-1, 3), aspect=1.6)


def _boxes(points: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    xy = project(camera, points, *SIZE).xy
    return xy.min(axis=1), xy.max(axis=1)


def test_whoever_overlaps_what_moved_is_found_and_none_far_away() -> None:
    points, camera = _strands(400, 1)
    moved = np.arange(0, 400, 57)
    touched = Touched(SIZE)
    touched.add(points, moved, camera)
    found = np.isin(np.arange(400), touched.reached_by(points, camera))
    low, high = _boxes(points, camera)
    gap = np.maximum(low[:, None] - high[None, moved], low[None, moved] - high[:, None]).max(axis=2).min(axis=1)
    assert found[gap <= 0].all()
    assert not found[gap > MOVED_MARGIN + REACH_MARGIN + 2 * CELL].any()
    assert (gap > MOVED_MARGIN + REACH_MARGIN + 2 * CELL).sum() > 50


def test_both_layouts_of_points_are_the_same_strands() -> None:
    points, camera = _strands(100, 2)
    by_axis = np.ascontiguousarray(points.transpose(0, 2, 1))
    one, other = Touched(SIZE), Touched(SIZE)
    one.add(points, np.arange(3), camera)
    other.add(by_axis, np.arange(3), camera)
    np.testing.assert_array_equal(one.cells, other.cells)
    np.testing.assert_array_equal(one.reached_by(points, camera), other.reached_by(by_axis, camera))


def test_nothing_moved_reaches_nothing_and_what_passes_the_eye_reaches_all() -> None:
    points, camera = _strands(50, 3)
    touched = Touched(SIZE)
    touched.add(points, np.zeros(0, np.intp), camera)
    assert len(touched.reached_by(points, camera)) == 0
    behind = (camera.position - 2.0 * camera.forward).astype(np.float32) + np.zeros((1, 8, 3), np.float32)
    touched.add(behind, np.arange(1), camera)
    assert len(touched.reached_by(points, camera)) == 50


def test_what_lies_beside_the_picture_touches_no_cell_in_it() -> None:
    points, camera = _strands(50, 4)
    aside = points[:1] + 50.0 * np.asarray(camera.world_from_camera[:3, 0], np.float32)
    touched = Touched(SIZE)
    touched.add(aside, np.arange(1), camera)
    assert not touched.cells.any()
