import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from core.falloff import SHAPES, falloff, falloff1, smoothstep

d = np.linspace(0, 1.5, 301)


@pytest.mark.parametrize("shape", SHAPES)
def test_full_at_centre_never_rising_zero_beyond_rim(shape):
    w = falloff(d, shape)
    assert w[0] == 1.0
    assert np.all(np.diff(w) <= 0)
    assert np.all(w[d >= 1.0] == 0.0)
    assert np.array_equal(w, [falloff1(SHAPES.index(shape), x, 0.25) for x in d])
    assert falloff(float("nan"), shape) == 0.0


def test_smooth_is_the_hermite_cubic():
    truth = CubicHermiteSpline([0, 1], [1, 0], [0, 0])
    inside = d[d < 1]
    assert np.allclose(falloff(inside, "smooth"), truth(inside))
    assert np.allclose(falloff(inside, "flat", 0.25), np.where(inside < 0.25, 1, truth((inside - 0.25) / 0.75)))


def test_closed_forms():
    inside = d[d < 1].reshape(-1, 4)
    assert np.allclose(falloff(inside, "linear"), 1 - inside)
    assert np.allclose(falloff(inside, "sharp"), (1 - inside) ** 2)
    assert np.all(falloff(inside, "constant") == 1)
    assert np.array_equal(falloff(inside, "flat", 1.0), np.ones_like(inside))


def test_smoothstep():
    x = np.linspace(-1, 3, 41)
    truth = CubicHermiteSpline([0.5, 2], [0, 1], [0, 0])(np.clip(x, 0.5, 2))
    assert np.allclose(smoothstep(0.5, 2.0, x), truth)
    assert np.array_equal(smoothstep(1.0, 1.0, [0.9, 1.0, 1.1]), [0, 1, 1])
