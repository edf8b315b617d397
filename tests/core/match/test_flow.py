"""Spline flow against known motions."""

import cv2
import numpy as np
import pytest

from core.match.flow import fitted, flow_between
from core.match.flow_kernels import gather, spread
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


def test_spline_kernels_are_transposes_and_know_scattered_values():
    rng = np.random.default_rng(1)
    grid, field = rng.normal(size=(18, 23)).astype(np.float32), rng.normal(size=(HEIGHT, WIDTH)).astype(np.float32)
    there, back = np.empty_like(field), np.empty_like(grid)
    spread(grid, 8, there)
    gather(field, 8, 1, back)
    assert np.isclose((there * field).sum(dtype=float), (grid * back).sum(dtype=float), rtol=1e-3)
    ramp = np.stack((X, Y), axis=2).astype(np.float32)
    assert np.abs(fitted(ramp, 8) - ramp)[INNER].max() < 0.5


def test_flow_is_read_by_another_library(tmp_path):
    from core.formats.flow_file import read_flo, write_flow

    flow = flow_between(*pair(np.full_like(X, 1.0), np.full_like(X, 2.0)))
    write_flow(tmp_path / "a.flo", flow, ".flo")
    np.testing.assert_array_equal(cv2.readOpticalFlow(str(tmp_path / "a.flo")), flow.vectors)
    np.testing.assert_array_equal(read_flo(tmp_path / "a.flo"), flow.vectors)
