"""What passes through what: against linear algebra and against every pair of boxes."""

import numpy as np

from core.feather.coat.crossing import crossing_pairs, skin_crossings, touching_boxes, triangles_meet, vane_boxes
from core.mesh.bvh import build_bvh
from tests.core.feather.coat.bodies import cells, crossing_by_solving, meet


def test_triangles_meet_where_an_edge_of_one_goes_through_the_other():
    rng = np.random.default_rng(3)
    first, second = rng.normal(size=(400, 3, 3)), rng.normal(size=(400, 3, 3))
    found = [bool(triangles_meet(a, b)) for a, b in zip(first, second, strict=True)]
    assert found == [meet(a[None], b[None]) for a, b in zip(first, second, strict=True)]
    assert 20 < sum(found) < 380


def test_vanes_cross_where_their_triangles_do():
    rng = np.random.default_rng(4)
    vanes = (rng.normal(size=(60, 1, 1, 3)) + 0.5 * rng.normal(size=(60, 4, 3, 3))).astype(np.float32)
    boxes = vane_boxes(vanes)
    a, b = touching_boxes(np.ascontiguousarray(boxes[:, -1]))
    hit = crossing_pairs(vanes, boxes, a, b)
    assert set(zip(a[hit].tolist(), b[hit].tolist(), strict=True)) == crossing_by_solving(vanes)


def test_boxes_that_touch_are_found_once_each_and_all_of_them():
    rng = np.random.default_rng(5)
    low = rng.uniform(-3, 3, (150, 3))
    size = rng.uniform(0.0, 0.6, (150, 3))
    size[7] = 9.0  # one feather much longer than the rest
    boxes = np.concatenate([low, low + size], axis=1).astype(np.float32)
    a, b = touching_boxes(boxes)
    found = sorted(zip(a.tolist(), b.tolist(), strict=True))
    truth = [
        (i, j) for i in range(150) for j in range(i + 1, 150)
        if (boxes[i, :3] <= boxes[j, 3:]).all() and (boxes[j, :3] <= boxes[i, 3:]).all()
    ]
    assert found == truth


def test_a_vane_through_the_skin_is_found_and_one_over_it_is_not():
    rng = np.random.default_rng(6)
    points = rng.uniform(-1, 1, (80, 3)).astype(np.float32)
    triangles = rng.integers(0, 80, (60, 3)).astype(np.int32)
    triangles = triangles[(triangles[:, 0] != triangles[:, 1]) & (triangles[:, 1] != triangles[:, 2])]
    vanes = (rng.uniform(-1, 1, (40, 1, 1, 3)) + 0.15 * rng.normal(size=(40, 3, 3, 3))).astype(np.float32)
    vanes[0] += 5.0
    found = skin_crossings(vanes, vane_boxes(vanes), build_bvh(points, triangles))
    truth = [meet(cells(vane), points[triangles].astype(np.float64)) for vane in vanes]
    assert found.tolist() == truth
    assert not found[0]
    assert found.any()
