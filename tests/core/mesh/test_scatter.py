import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from core.errors import UserError
from core.mesh.scatter import Scatter, count_for_density, scatter
from core.workers import Workers


def _sheet(cells: int = 20, size: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    side = np.linspace(0, size, cells + 1)
    x, z = np.meshgrid(side, side)
    points = np.stack([x, 0 * x, z], -1).reshape(-1, 3).astype(np.float32)
    i = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    triangles = np.concatenate(
        [np.stack([i, i + cells + 1, i + cells + 2], 1), np.stack([i, i + cells + 2, i + 1], 1)]
    )
    return points, triangles.astype(np.int32)


def _places(points: np.ndarray, triangles: np.ndarray, found: Scatter) -> np.ndarray:
    return (points[triangles[found.triangle]].astype(np.float64) * found.barycentric[:, :, None]).sum(1)


def _first(found: Scatter, count: int) -> Scatter:
    return Scatter(found.triangle[:count], found.barycentric[:count])


def _nearest(places: np.ndarray) -> np.ndarray:
    return cKDTree(places).query(places, 2)[0][:, 1]


def _evenness(places: np.ndarray) -> float:
    near = _nearest(places)
    return float(near.std() / near.mean())


def test_any_prefix_is_even_and_random_is_not() -> None:
    points, triangles = _sheet()
    found = scatter(points, triangles, 40_000)
    for share in (0.01, 0.1, 0.37, 0.5, 1.0):
        count = int(40_000 * share)
        near = _nearest(_places(points, triangles, _first(found, count)))
        ideal = np.sqrt(2 / (np.sqrt(3) * count))
        assert near.std() / near.mean() <= 0.16
        assert near.min() >= 0.52 * ideal
    random = np.random.default_rng(0).uniform(size=(40_000, 2))
    assert _evenness(random) > 0.45


def test_no_power_at_low_frequencies() -> None:
    """White noise has mean power 1 below half the hexagonal frequency; an even set has little."""
    points, triangles = _sheet()
    count = 5000
    places = _places(points, triangles, scatter(points, triangles, count))[:, [0, 2]]
    top = int(0.5 * np.sqrt(2 / np.sqrt(3) * count))

    def power(xy: np.ndarray) -> float:
        waves = [(k, m) for k in range(-top, top + 1, 3) for m in range(1, top + 1, 3) if k * k + m * m < top * top]
        phases = np.exp(-2j * np.pi * xy @ np.array(waves, float).T)
        return float((np.abs(phases.sum(0)) ** 2 / count).mean())

    assert power(places) < 0.35
    assert power(np.random.default_rng(1).uniform(size=(count, 2))) > 0.8


def test_a_larger_count_begins_with_the_smaller_one() -> None:
    points, triangles = _sheet()
    large = scatter(points, triangles, 20_000, seed=5)
    for count in (1, 2, 17, 1000, 10_000, 19_999):
        small = scatter(points, triangles, count, seed=5)
        np.testing.assert_array_equal(small.triangle, large.triangle[:count])
        np.testing.assert_array_equal(small.barycentric, large.barycentric[:count])


def test_a_prefix_holds_under_a_density_too() -> None:
    points, triangles = _sheet()
    density = (points[:, 0] ** 2).astype(np.float32)
    large = scatter(points, triangles, 9000, density=density)
    small = scatter(points, triangles, 3000, density=density)
    np.testing.assert_array_equal(small.triangle, large.triangle[:3000])
    np.testing.assert_array_equal(small.barycentric, large.barycentric[:3000])


def test_the_same_seed_gives_the_same_bits_with_any_threads_and_another_seed_does_not() -> None:
    points, triangles = _sheet()
    first = scatter(points, triangles, 30_000, seed=3)
    for threads in (2, 3, 5):
        workers = Workers(threads)
        try:
            again = scatter(points, triangles, 30_000, seed=3, workers=workers)
        finally:
            workers.close()
        np.testing.assert_array_equal(first.triangle, again.triangle)
        np.testing.assert_array_equal(first.barycentric, again.barycentric)
    other = scatter(points, triangles, 30_000, seed=4)
    assert (other.triangle == first.triangle).mean() < 0.05


def test_places_lie_within_their_triangles() -> None:
    points, triangles = _sheet()
    found = scatter(points, triangles, 5000)
    assert found.triangle.dtype == np.int32
    assert found.barycentric.dtype == np.float32
    assert (found.barycentric >= 0).all()
    np.testing.assert_allclose(found.barycentric.sum(1), 1, atol=1e-6)


@pytest.mark.parametrize("count", [0, 1, 2, 63, 64, 65, 1000])
def test_counts_are_exact(count: int) -> None:
    assert len(scatter(*_sheet(3), count).triangle) == count


@pytest.mark.filterwarnings("error")
def test_counts_are_exact_where_nothing_is_good() -> None:
    flat = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], np.float32)
    one = np.array([[0, 1, 2]], np.int32)
    assert len(scatter(flat, one, 500).triangle) == 500
    sliver = np.array([[0, 0, 0], [1, 0, 0], [2, 1e-7, 0]], np.float32)
    assert len(scatter(sliver, one, 5000).triangle) == 5000
    tiny = np.array([[0, 0, 0], [1e-6, 0, 0], [0, 1e-6, 0]], np.float32) + np.float32(100)
    assert len(scatter(tiny, one, 5000).triangle) == 5000
    broken = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nan, 0, 0]], np.float32)
    found = scatter(broken, np.array([[0, 1, 3], [0, 1, 2]], np.int32), 700)
    assert len(found.triangle) == 700
    assert (found.triangle == 1).all()
    pixel = np.zeros(21 * 21, np.float32)
    pixel[200] = 1e-4
    assert len(scatter(*_sheet(), 3000, density=pixel).triangle) == 3000


def test_what_cannot_be_is_said_in_a_sentence() -> None:
    points, triangles = _sheet()
    with pytest.raises(UserError, match="no faces"):
        scatter(points, triangles[:0], 10)
    with pytest.raises(UserError, match="density is zero"):
        scatter(points, triangles, 10, density=np.zeros(len(points), np.float32))
    with pytest.raises(UserError, match="count"):
        scatter(points, triangles, -1)
    with pytest.raises(UserError, match="finite"):
        scatter(points * np.float32(np.nan), triangles, 10)


def test_density_is_followed_and_stays_even() -> None:
    """A ramp of 10 to 1: counts by strips, and nearest distances measured in the local spacing."""
    points, triangles = _sheet(40)
    ramp = (0.1 + 0.9 * points[:, 0]).astype(np.float32)
    count = 30_000
    places = _places(points, triangles, scatter(points, triangles, count, density=ramp))
    strips, edges = np.histogram(places[:, 0], 10, (0, 1))
    middle = (edges[1:] + edges[:-1]) / 2
    wanted = (0.1 + 0.9 * middle) / (0.1 + 0.9 * middle).sum() * count
    np.testing.assert_allclose(strips, wanted, rtol=0.05)
    local = _nearest(places) * np.sqrt(0.1 + 0.9 * places[:, 0])
    assert local.std() / local.mean() < 0.16


def test_nothing_stands_outside_a_painted_region() -> None:
    points, triangles = _sheet()
    painted = ((points[:, 0] > 0.3) & (points[:, 2] < 0.6)).astype(np.float32)
    found = scatter(points, triangles, 4000, density=painted)
    assert (painted[triangles[found.triangle]].max(1) > 0).all()
    at_root = (painted[triangles[found.triangle]] * found.barycentric).sum(1)
    assert (at_root > 0).all()
    inner = at_root == 1
    assert 0.85 < inner.mean() < 1


def test_a_density_function_sees_detail_finer_than_faces() -> None:
    points, triangles = _sheet(4)

    def stripes(triangle: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        x = (points[triangles[triangle]] * barycentric[:, :, None]).sum(1)[:, 0]
        return (np.floor(x * 20) % 2).astype(np.float32)

    found = scatter(points, triangles, 20_000, density=stripes)
    x = _places(points, triangles, found)[:, 0]
    assert (np.floor(x * 20) % 2 == 1).all()
    strips = np.histogram(x, 20, (0, 1))[0][1::2]
    np.testing.assert_allclose(strips, 2000, rtol=0.06)
    half = scatter(points, triangles, 10_000, density=stripes)
    np.testing.assert_array_equal(half.triangle, found.triangle[:10_000])


def test_islands_get_their_share_and_sheets_do_not_see_each_other() -> None:
    points, triangles = _sheet()
    gap = np.float32([0, 1e-4, 0])
    small, _ = _sheet(20, 0.5)
    everything = np.concatenate([points, points[:, ::-1] * 0 + points - gap, small + np.float32([5, 0, 0])])
    flipped = triangles[:, ::-1] + len(points)
    faces = np.concatenate([triangles, flipped, triangles + 2 * len(points)]).astype(np.int32)
    found = scatter(everything, faces, 9000)
    island = found.triangle // len(triangles)
    np.testing.assert_allclose(np.bincount(island) / 9000, np.array([1, 1, 0.25]) / 2.25, rtol=0.02)
    for number in range(2):  # each side of the thin sheet is even in itself, as if the other were not there
        assert _evenness(_places(everything, faces, found)[island == number]) < 0.16


def test_far_from_the_origin_is_as_even() -> None:
    points, triangles = _sheet()
    far = points + np.float32([10_000, 0, 10_000])
    found = scatter(far, triangles, 2000)
    near_home = _places(points, triangles, found)
    assert _evenness(near_home) < 0.17


def test_count_from_a_density_per_square_metre() -> None:
    points, triangles = _sheet(20, 2.0)
    assert count_for_density(points, triangles, 1000) == 4000
    ramp = (points[:, 0] / 2).astype(np.float32)
    assert count_for_density(points, triangles, 1000, ramp) == 2000

    def half(triangle: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        return np.full(len(triangle), 0.5, np.float32)

    assert count_for_density(points, triangles, 1000, half) == 2000


def test_a_sphere_has_no_seams() -> None:
    ball = trimesh.creation.icosphere(3)
    points, triangles = ball.vertices.astype(np.float32), ball.faces.astype(np.int32)
    ways = np.random.default_rng(2).normal(size=(200, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    spreads = []
    for seed in range(8):
        places = _places(points, triangles, scatter(points, triangles, 8000, seed=seed))
        assert _evenness(places) < 0.16
        # roots in caps of equal area, in many directions, against the binomial spread of random placing
        caps = (places / np.linalg.norm(places, axis=1)[:, None] @ ways.T > 0.9).sum(0)
        spreads.append(caps.std() / np.sqrt(8000 * 0.05 * 0.95))
    assert np.mean(spreads) < 0.39  # one seed alone comes to anything from 0.34 to 0.45


def test_the_cat_at_every_density() -> None:
    if "FILOPLUME_DATA" not in os.environ:
        pytest.skip("FILOPLUME_DATA is not set")
    path = Path(os.environ["FILOPLUME_DATA"]) / "meshes/odedstein_A/cat/cat-low-resolution.obj"
    mesh = trimesh.load(path, process=False)
    points, triangles = mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32)
    found = scatter(points, triangles, 200_000)
    for share in (0.01, 0.1, 1.0):
        part = _first(found, int(200_000 * share))
        assert _evenness(_places(points, triangles, part)) <= 0.16
    half = scatter(points, triangles, 100_000)
    np.testing.assert_array_equal(half.triangle, found.triangle[:100_000])
    np.testing.assert_array_equal(half.barycentric, found.barycentric[:100_000])
