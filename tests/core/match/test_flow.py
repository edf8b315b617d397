"""Spline flow against known motions."""

import cv2
import numpy as np
import pytest

from core.match.flow import fitted, flow_between
from core.match.flow_kernels import data_term, gather, mixed_covariance, normal_product, overlaps, smaller_gap, spread
from core.workers import Workers
from tests.core.match.plates import texture

HEIGHT, WIDTH = 120, 160
Y, X = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
INNER = np.s_[16:-16, 16:-16]


def pair(u, v):
    """Two frames, the second being the texture itself and the first showing at x what the second has at x + (u, v)."""
    rng = np.random.default_rng(0)
    first, second = texture(X + u, Y + v), texture(X, Y)
    return tuple(np.float32((image + rng.normal(0, 0.5, image.shape)) / 255.0) for image in (first, second))


@pytest.mark.parametrize(
    ("u", "v", "most"),
    [
        (np.full_like(X, 1.7), np.full_like(X, -2.4), 0.05),
        (0.03 * (X - 80) + 1.0, -0.02 * (X - 80) + 0.03 * (Y - 60), 0.05),
        (4.0 * np.sin(X / 25.0), 3.0 * np.cos(Y / 20.0 + X / 40.0), 0.08),
    ],
)
def test_smooth_motion_is_found(u, v, most):
    flow = flow_between(*pair(u, v))
    error = np.hypot(flow.vectors[:, :, 0] - u, flow.vectors[:, :, 1] - v)[INNER]
    assert error.mean() < most
    assert np.isfinite(flow.covariance).all()
    assert (flow.covariance[:, :, 0] > 0).all()


def test_where_there_is_nothing_to_see_the_flow_is_unsure():
    first, second = pair(np.full_like(X, 2.0), np.zeros_like(X))
    for image in (first, second):
        image[:, 80:] = 0.5
    sigma = np.sqrt(flow_between(first, second).covariance[:, :, 0])
    assert np.median(sigma[:, 100:150]) > 5 * np.median(sigma[20:100, 10:60])
    blank = np.full_like(first, 0.5)
    assert np.sqrt(flow_between(blank, blank).covariance[:, :, 0]).min() > 1.0


def test_light_that_changes_over_the_frame_is_no_motion():
    first, second = pair(np.full_like(X, 1.7), np.full_like(X, -2.4))
    second = second * np.float32(0.9) + np.float32(0.002) * X.astype(np.float32)[:, :, None]
    flow = flow_between(first, second)
    error = np.hypot(flow.vectors[:, :, 0] - 1.7, flow.vectors[:, :, 1] + 2.4)[INNER]
    assert error.mean() < 0.1


def test_an_edge_of_the_motion_stays_sharp_and_what_it_hides_is_unsure():
    """A disc before a still wall moves 6 px: the grid alone would smear its edge over twice its spacing."""
    disc = np.hypot(X - 80, Y - 60) < 30
    wall, front = texture(X, Y), texture(X + 500, Y + 300)
    gone = np.hypot(X - 86, Y - 60) < 30
    first = np.where(disc[:, :, None], front, wall)
    second = np.where(gone[:, :, None], texture(X + 494, Y + 300), wall)
    flow = flow_between(*(np.float32(image / 255.0) for image in (first, second)))
    truth = np.where(disc, 6.0, 0.0)
    error = np.hypot(flow.vectors[:, :, 0] - truth, flow.vectors[:, :, 1])
    hidden = gone & ~disc
    inner = np.hypot(X - 80, Y - 60) < 24
    assert np.median(error[~hidden]) < 0.05
    assert error[inner].max() < 0.7
    assert (error[~hidden] > 1.0).mean() < 0.05
    sigma = np.sqrt(flow.covariance[:, :, 0] + flow.covariance[:, :, 2])
    assert np.median(sigma[hidden]) > 20 * np.median(sigma[~hidden])


def test_searches_in_threads_find_the_same():
    first, second = pair(np.full_like(X, 1.7), np.full_like(X, -2.4))
    workers = Workers(2)
    flow = flow_between(first, second, ranges=workers.ranges)
    workers.close()
    np.testing.assert_array_equal(flow.vectors, flow_between(first, second).vectors)


def test_spline_kernels_are_transposes_and_know_scattered_values():
    rng = np.random.default_rng(1)
    grid, field = rng.normal(size=(18, 23)).astype(np.float32), rng.normal(size=(HEIGHT, WIDTH)).astype(np.float32)
    there, back = np.empty_like(field), np.empty_like(grid)
    spread(grid, 8, there)
    gather(field, 8, 1, back)
    assert np.isclose((there * field).sum(dtype=float), (grid * back).sum(dtype=float), rtol=1e-3)
    ramp = np.stack((X, Y), axis=2).astype(np.float32)
    assert np.abs(fitted(ramp, 8) - ramp)[INNER].max() < 0.5


def test_cells_that_no_free_vertex_reaches_add_nothing_to_the_normal_equations():
    rng = np.random.default_rng(2)
    xx, xy, yy = (rng.normal(size=(HEIGHT, WIDTH)).astype(np.float32) for _ in range(3))
    grid = np.zeros((2, 18, 23), np.float32)
    grid[:, 5, 7], grid[:, 17, 22] = 1.0, -2.0
    u, v = (np.empty((HEIGHT, WIDTH), np.float32) for _ in range(2))
    for part, field in zip(grid, (u, v), strict=True):
        spread(part, 8, field)
    expected = np.empty_like(grid)
    for part, field in zip(expected, (xx * u + xy * v, xy * u + yy * v), strict=True):
        gather(field, 8, 1, part)
    made = np.empty_like(grid)
    normal_product(grid, np.ones((15, 20), bool), xx, xy, yy, 8, 0, 15, made)
    np.testing.assert_allclose(made, expected, atol=1e-3)
    busy = np.zeros((15, 20), bool)
    busy[2:6, 4:8] = busy[14:, 19:] = True  # the cells of the two vertices
    halves = [made, np.empty_like(made)]
    for half, (first, stop) in zip(halves, ((0, 7), (7, 15)), strict=True):
        normal_product(grid, busy, xx, xy, yy, 8, first, stop, half)
    np.testing.assert_allclose(halves[0] + halves[1], expected, atol=1e-3)


@pytest.mark.parametrize(("side", "step"), [(120, 8), (33, 16), (5, 32)])
def test_overlaps_of_splines_are_a_spline_put_back_onto_its_grid(side, step):
    """Also in the vertices that only a part of the line reaches."""
    count = (side - 1) // step + 4
    bands = np.empty((count, 7), np.float32)
    overlaps(side, step, bands)
    matrix = np.zeros((count, count + 6))
    for i, band in enumerate(bands):
        matrix[i, i : i + 7] = band
    for i in range(count):
        one, line, back = np.zeros((4, count), np.float32), np.empty((1, side), np.float32), np.empty((4, count), "f4")
        one[:, i] = 1.0
        spread(one, step, line)
        gather(line, step, 1, back)
        np.testing.assert_allclose(matrix[i, 3:-3], back.sum(axis=0), atol=1e-4)  # the weights of rows are together 1


def test_the_smaller_gap_there_and_back_counts_with_the_common_lean():
    flow, fine, coarse = (np.full((1, 2, 2), value, np.float32) for value in (1.0, -4.0, -1.5))
    fine[0, 1] = (-1.0, -3.0)  # 2 px off, the other way back 0.7
    coarse[0, 1] = (4.0, 4.0)
    gap = np.empty((1, 2, 3), np.float32)
    smaller_gap(flow, fine, coarse, gap)
    np.testing.assert_allclose(gap[0], [[0.25, 0.25, 0.25], [0.0, 0.0, 4.0]])
    made = np.full((1, 2, 3), 10.0, np.float32)
    lean = np.float32([[[1.0, 2.0], [0.0, 0.0]]])
    mixed_covariance(gap, lean, np.float32([[2.0, 3.0]]), np.float32(0.1), made)
    np.testing.assert_allclose(made[0], [[3.5, 5.5, 9.5], [1.0, 1.0, 13.0]], rtol=1e-6)


def test_pixels_that_end_outside_the_frame_say_nothing():
    flow = np.zeros((3, 4, 2), np.float32)
    flow[1, 0, 0], flow[1, 3, 0], flow[0, 1, 1], flow[2, 1, 1], flow[2, 2, 0] = -0.5, 0.5, -1.0, 1.0, 1.0
    gone = np.zeros((3, 4), bool)
    gone[1, 0] = gone[1, 3] = gone[0, 1] = gone[2, 1] = True
    rest, gx, gy = (np.full((3, 4), value, np.float32) for value in (0.3, 2.0, -1.0))
    xx, xy, yy, bx, by, square, inside = out = np.empty((7, 3, 4), np.float32)
    data_term(rest, flow, gx, gy, np.float32(0.1), 1, *out)
    np.testing.assert_array_equal(inside, ~gone)
    assert (out[:, gone] == 0.0).all()
    for part, expected in zip((xx, xy, yy, bx, by), (1.0, -0.5, 0.25, -0.15, 0.075), strict=True):
        np.testing.assert_allclose(part[~gone], expected, rtol=1e-5)  # residual at three sigma: a quarter of the weight
    np.testing.assert_allclose(square[~gone], 0.09, rtol=1e-5)
    some = np.empty((7, 2, 2), np.float32)
    data_term(rest, flow, gx, gy, np.float32(0.1), 2, *some)
    np.testing.assert_array_equal(some, out[:, ::2, ::2])


def test_flow_is_read_by_another_library(tmp_path):
    from core.formats.flow_file import read_flo, write_flow

    flow = flow_between(*pair(np.full_like(X, 1.0), np.full_like(X, 2.0)))
    write_flow(tmp_path / "a.flo", flow, ".flo")
    np.testing.assert_array_equal(cv2.readOpticalFlow(str(tmp_path / "a.flo")), flow.vectors)
    np.testing.assert_array_equal(read_flo(tmp_path / "a.flo"), flow.vectors)
