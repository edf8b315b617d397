import numpy as np
import pytest
import trimesh
from numba import njit
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from core.mesh.bvh import (
    any_hit_segment,
    build_bvh,
    cast_rays,
    closest_one,
    closest_points,
    hit_segments,
    new_stack,
    refit,
)
from core.workers import Workers


def _bumpy(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    ball = trimesh.creation.icosphere(4)
    points = ball.vertices * (1 + 0.2 * np.sin(7 * ball.vertices[:, :1]) * np.cos(5 * ball.vertices[:, 1:2]))
    return points.astype(np.float32), ball.faces.astype(np.int32)


def _soup(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of any shape all over each other, with degenerate ones among them."""
    random = np.random.default_rng(seed)
    points = (random.normal(size=(count, 1, 3)) + random.normal(size=(count, 3, 3)) * 0.3).reshape(-1, 3)
    triangles = np.arange(3 * count).reshape(-1, 3)
    triangles[::7, 2] = triangles[::7, 1]
    triangles[::11] = triangles[::11, :1]
    return points.astype(np.float32), triangles.astype(np.int32)


def _queries(count: int, size: float = 1.6, seed: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-size, size, (count, 3)).astype(np.float32)


def _on_triangles(points: np.ndarray, triangles: np.ndarray, index: np.ndarray, weights: np.ndarray) -> np.ndarray:
    return (points[triangles[index]].astype(np.float64) * weights[:, :, None]).sum(1)


def _brute_distance(points: np.ndarray, triangles: np.ndarray, query: np.ndarray) -> float:
    corners = points[triangles].astype(np.float64)
    near = trimesh.triangles.closest_point(corners, np.broadcast_to(query.astype(np.float64), (len(corners), 3)))
    return float(np.linalg.norm(near - query, axis=1).min())


@pytest.mark.parametrize("mesh", ["bumpy", "soup"])
def test_closest_points_against_every_triangle(mesh: str) -> None:
    points, triangles = _bumpy() if mesh == "bumpy" else _soup(300, 1)
    # trimesh divides by the size of degenerate triangles, so it sees the others only; they add points and segments
    good = np.linalg.norm(
        np.cross(points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]),
        axis=1,
    ) > 1e-7
    queries = _queries(200)
    bvh = build_bvh(points, triangles[good])
    index, weights, distance = closest_points(bvh, queries)
    brute = [_brute_distance(points, triangles[good], query) for query in queries]
    np.testing.assert_allclose(distance, brute, atol=1e-5)
    on_skin = _on_triangles(points, triangles[good], index, weights)
    np.testing.assert_allclose(np.linalg.norm(on_skin - queries, axis=1), distance, atol=1e-5)
    assert (weights > -1e-6).all()
    np.testing.assert_allclose(weights.sum(1), 1, atol=1e-6)


def test_one_triangle_against_a_minimiser() -> None:
    """An independent truth without any region logic: minimise the distance over the simplex with scipy."""
    points = np.array([[0, 0, 0], [2, 0, 0.5], [0.3, 1, -0.2]], np.float32)
    bvh = build_bvh(points, np.array([[0, 1, 2]], np.int32))
    queries = _queries(40, 3.0)
    _, _, distance = closest_points(bvh, queries)
    for query, found in zip(queries, distance, strict=True):
        best = min(
            minimize(
                lambda w, q=query: ((np.array([1 - w[0] - w[1], w[0], w[1]]) @ points - q) ** 2).sum(),
                start, method="SLSQP", bounds=[(0, 1), (0, 1)],
                constraints={"type": "ineq", "fun": lambda w: 1 - w[0] - w[1]}, options={"ftol": 1e-14},
            ).fun
            for start in ([0.1, 0.1], [0.8, 0.1], [0.1, 0.8])
        )
        assert found == pytest.approx(np.sqrt(best), abs=2e-4)


def test_close_to_a_cloud_of_the_surface() -> None:
    points, triangles = _bumpy()
    random = np.random.default_rng(5)
    index = random.integers(0, len(triangles), 400_000)
    cloud = _on_triangles(points, triangles, index, random.dirichlet((1, 1, 1), len(index)))
    queries = _queries(2000)
    _, _, distance = closest_points(build_bvh(points, triangles), queries)
    upper = cKDTree(cloud).query(queries)[0]
    assert (distance <= upper + 1e-6).all()
    assert (upper - distance).max() < 0.03


def test_degenerate_triangles_count_as_segments_and_points() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [5, 5, 5]], np.float32)
    bvh = build_bvh(points, np.array([[0, 1, 1], [2, 2, 2], [0, 1, 0]], np.int32))
    _, _, distance = closest_points(bvh, np.array([[0.5, 2, 0], [5, 5, 7], [-3, 0, 0]], np.float32))
    np.testing.assert_allclose(distance, [2, 2, 3], atol=1e-6)
    assert (cast_rays(bvh, np.float32([[0.5, 1, 0]]), np.float32([[0, -1, 0]]))[1] == -1).all()


def test_bounds_are_kept_and_what_is_not_finite_finds_nothing() -> None:
    points, triangles = _bumpy()
    bvh = build_bvh(points, triangles)
    queries = _queries(3000)
    _, _, free = closest_points(bvh, queries)
    index, weights, distance = closest_points(bvh, queries, 0.2)
    within = free <= 0.2
    assert 100 < within.sum() < 2900
    np.testing.assert_array_equal(index >= 0, within)
    np.testing.assert_allclose(distance[within], free[within], atol=1e-7)
    assert np.isinf(distance[~within]).all()
    assert (weights[~within] == 0).all()
    odd = np.array([[np.nan, 0, 0], [np.inf, 0, 0], [0, 0, -np.inf]], np.float32)
    assert (closest_points(bvh, odd)[0] == -1).all()
    assert (cast_rays(bvh, odd, np.ones_like(odd))[1] == -1).all()
    assert (cast_rays(bvh, np.zeros_like(odd), odd)[1] == -1).all()
    assert (cast_rays(bvh, np.zeros_like(odd), np.zeros_like(odd))[1] == -1).all()


def test_a_vertex_that_is_not_finite_spoils_only_its_own_faces() -> None:
    points, triangles = _bumpy()
    broken = points.copy()
    broken[7] = np.nan
    keep = (triangles != 7).all(1)
    queries = _queries(500)
    index, _, distance = closest_points(build_bvh(broken, triangles), queries)
    assert keep[index].all()
    np.testing.assert_array_equal(distance, closest_points(build_bvh(points, triangles[keep]), queries)[2])
    refitted = refit(build_bvh(points, triangles), broken)
    np.testing.assert_array_equal(closest_points(refitted, queries)[2], distance)


def test_no_triangles_no_answers() -> None:
    bvh = build_bvh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
    assert closest_points(bvh, _queries(5))[0].tolist() == [-1] * 5
    assert cast_rays(bvh, _queries(5), _queries(5))[1].tolist() == [-1] * 5
    assert closest_points(bvh, _queries(0))[0].shape == (0,)


def test_many_triangles_at_one_place_do_not_overflow() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    bvh = build_bvh(points, np.tile(np.array([[0, 1, 2]], np.int32), (100_000, 1)))
    _, _, distance = closest_points(bvh, np.array([[0.2, 0.2, 3]], np.float32))
    assert distance[0] == pytest.approx(3)


def test_sizes_that_grow_geometrically_stay_within_the_stack() -> None:
    scale = (1.5 ** np.arange(-45, 45)).astype(np.float32)
    points = (np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)[None] * scale[:, None, None]).reshape(-1, 3)
    triangles = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
    index, _, _ = closest_points(build_bvh(points, triangles), points.reshape(-1, 3, 3).mean(1))
    assert (index == np.arange(len(triangles))).all()


@pytest.mark.parametrize("kind", ["slivers", "needles", "sizes", "far"])
def test_no_bad_shape_loses_the_nearest_triangle(kind: str) -> None:
    """The float32 pass over a leaf may only drop what is farther: the tree against every triangle tested alone."""
    random = np.random.default_rng(1)
    count = 400
    corners = random.normal(size=(count, 3, 3))
    if kind == "slivers":
        along = random.uniform(-1, 2, (count, 1))
        corners[:, 2] = corners[:, 0] + (corners[:, 1] - corners[:, 0]) * along
        corners[:, 2] += random.normal(size=(count, 3)) * 10.0 ** random.uniform(-6, -1, (count, 1))
    elif kind == "needles":
        corners[:, 1] = corners[:, 0] + random.normal(size=(count, 3)) * 10.0 ** random.uniform(-6, -1, (count, 1))
    elif kind == "sizes":
        corners = random.normal(size=(count, 1, 3)) * 3 + corners * 10.0 ** random.uniform(-5, 0.5, (count, 1, 1))
    else:
        corners = corners + np.array([1000, 0, 0])
    points = corners.reshape(-1, 3).astype(np.float32)
    triangles = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    queries = _queries(150, 3.0) + np.float32([1000, 0, 0] if kind == "far" else [0, 0, 0])
    _, _, distance = closest_points(build_bvh(points, triangles), queries)
    alone = np.full(len(queries), np.inf, np.float32)
    for t in range(count):
        alone = np.minimum(alone, closest_points(build_bvh(points, triangles[t : t + 1]), queries)[2])
    np.testing.assert_allclose(distance, alone, rtol=2e-7)


@pytest.mark.parametrize("mesh", ["bumpy", "soup"])
def test_rays_against_every_triangle(mesh: str) -> None:
    """Moeller and Trumbore over all pairs in plain numpy float64."""
    points, triangles = _bumpy() if mesh == "bumpy" else _soup(400, 2)
    origins, directions = _queries(150, seed=8), _queries(150, seed=9)
    bvh = build_bvh(points, triangles)
    distance, index, weights = cast_rays(bvh, origins, directions)
    a, b, c = (points[triangles[:, k]].astype(np.float64) for k in range(3))
    hits = 0
    for ray in range(len(origins)):
        o, d = origins[ray].astype(np.float64), directions[ray].astype(np.float64)
        p = np.cross(d, c - a)
        det = (p * (b - a)).sum(1)
        with np.errstate(all="ignore"):
            u = ((o - a) * p).sum(1) / det
            q = np.cross(o - a, b - a)
            v = (q @ d) / det
            t = (q * (c - a)).sum(1) / det
            t = np.where((np.abs(det) > 1e-12) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0), t, np.inf)
        if np.isinf(t.min()):
            assert index[ray] == -1
            continue
        hits += 1
        assert distance[ray] == pytest.approx(t.min(), rel=1e-5, abs=1e-6)
        place = (weights[ray].astype(np.float64)[:, None] * points[triangles[index[ray]]]).sum(0)
        np.testing.assert_allclose(place, o + t.min() * d, atol=2e-5)
    assert hits > 30


def test_no_ray_slips_between_two_triangles() -> None:
    points, triangles = _bumpy()
    random = np.random.default_rng(4)
    # aimed exactly at edges and vertices from inside a closed skin
    edges = triangles[random.integers(0, len(triangles), 20_000)]
    share = random.choice([0.0, 0.25, 0.5, 0.75, 1.0], (20_000, 1))
    targets = (points[edges[:, 0]] * (1 - share) + points[edges[:, 1]] * share).astype(np.float32)
    distance, index, _ = cast_rays(build_bvh(points, triangles), np.zeros_like(targets), targets)
    assert (index >= 0).all()
    np.testing.assert_allclose(distance, 1, atol=1e-3)


def test_rays_along_an_axis_and_both_sides() -> None:
    box = trimesh.creation.box((2, 2, 2))
    bvh = build_bvh(box.vertices.astype(np.float32), box.faces.astype(np.int32))
    directions = np.array([[1, 0, 0], [0, -1, 0], [0, 0, 2], [-0.0, 1, 0.0]], np.float32)
    inside, _, _ = cast_rays(bvh, np.zeros((4, 3), np.float32), directions)
    np.testing.assert_allclose(inside, [1, 1, 0.5, 1])
    outside, _, _ = cast_rays(bvh, -3 * directions, directions)
    np.testing.assert_allclose(outside, [2, 2, 2.5, 2])
    assert (cast_rays(bvh, -3 * directions, directions, 1.9)[1] == -1).all()
    assert (cast_rays(bvh, 3 * directions, directions)[1] == -1).all()  # behind the origin


def test_segments_agree_with_rays() -> None:
    points, triangles = _bumpy()
    bvh = build_bvh(points, triangles)
    starts, ends = _queries(5000, seed=1), _queries(5000, seed=2)
    distance, _, _ = cast_rays(bvh, starts, ends - starts)
    np.testing.assert_array_equal(hit_segments(bvh, starts, ends), distance <= 1)


def test_a_refitted_tree_answers_like_a_new_one() -> None:
    points, triangles = _bumpy()
    moved = (points * [1, 2, 0.5] + np.sin(points[:, [1, 2, 0]] * 4) * 0.3).astype(np.float32)
    queries = _queries(2000)
    refitted = refit(build_bvh(points, triangles), moved)
    fresh = build_bvh(moved, triangles)
    np.testing.assert_array_equal(closest_points(refitted, queries)[2], closest_points(fresh, queries)[2])


def test_threads_change_nothing() -> None:
    points, triangles = _bumpy()
    bvh = build_bvh(points, triangles)
    queries = _queries(10_000)
    workers = Workers(3)
    try:
        for one, many in zip(
            closest_points(bvh, queries), closest_points(bvh, queries, workers=workers), strict=True
        ):
            np.testing.assert_array_equal(one, many)
        for one, many in zip(
            cast_rays(bvh, queries, queries[::-1]), cast_rays(bvh, queries, queries[::-1], workers=workers), strict=True
        ):
            np.testing.assert_array_equal(one, many)
    finally:
        workers.close()


def test_inner_functions_work_inside_another_kernel() -> None:
    @njit
    def both(boxes, children, corners, blocks, x, y, z):  # type: ignore[no-untyped-def]
        stack, keys = new_stack()
        q = np.float32(x), np.float32(y), np.float32(z)
        near = closest_one(boxes, children, corners, blocks, q[0], q[1], q[2], np.inf, stack, keys)
        return near[1], any_hit_segment(boxes, children, corners, x, y, z, 0.0, 0.0, 0.0, stack, keys)

    box = trimesh.creation.box((2, 2, 2))
    bvh = build_bvh(box.vertices.astype(np.float32), box.faces.astype(np.int32))
    assert both(bvh.boxes, bvh.children, bvh.corners, bvh.blocks, 3.0, 0.25, 0.0) == (pytest.approx(4), True)
    assert both(bvh.boxes, bvh.children, bvh.corners, bvh.blocks, 0.5, 0.25, 0.0) == (pytest.approx(0.25), False)
