"""The outline of a scene bounds it, and is that of now."""

import numpy as np
import pytest

from tests.viewport.scenes import ball, hairs
from viewport.outline import Outline, extent
from viewport.scene import Scene, bounding_points, point_arrays


@pytest.mark.parametrize("stretch", [(1, 1, 1), (4, 1, 1), (1, 0.2, 3)])
def test_it_bounds_the_scene(stretch):
    skin, coat = ball(3000)
    size = np.array(stretch, np.float32)
    scene = Scene((skin._replace(points=skin.points * size),), (coat._replace(points=coat.points * size[:, None]),))
    every = np.concatenate([bounding_points(points) for points in point_arrays(scene)])
    outline = Outline().of(scene)
    assert len(outline) < 1500
    low, high = extent(outline)
    np.testing.assert_array_equal(low, every.min(axis=0))
    np.testing.assert_array_equal(high, every.max(axis=0))
    toward = np.random.default_rng(5).normal(size=(200, 3))
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    missed = (every @ toward.T).max(axis=0) - (outline @ toward.T).max(axis=0)
    across = np.ptp(every @ toward.T, axis=0)
    assert (missed / across).max() < 0.02  # the box of the light is wider than the outline by that on each side


def test_it_is_remembered_until_something_is_written_to_in_place():
    coat = hairs([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    scene, outline = Scene(coats=(coat,)), Outline()
    first = outline.of(scene)
    assert outline.of(scene._replace(exposure=2.0)) is first
    coat.points[0, 0, -1] = 7.0
    outline.changed(coat.points)
    assert extent(outline.of(scene))[1].tolist() == [7.0, 0.0, 1.0]
    moved = hairs([0.0, 0.0, 0.0], [3.0, 0.0, 1.0])
    assert extent(outline.of(Scene(coats=(coat, moved))))[1].tolist() == [7.0, 0.0, 1.0]
    assert extent(outline.of(Scene(coats=(moved,))))[1].tolist() == [3.0, 0.0, 1.0]
    outline.changed(moved.points)
    assert extent(outline.of(Scene()))[0].tolist() == [-0.5] * 3
