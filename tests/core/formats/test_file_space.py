"""Units and axes, by closed form."""

from __future__ import annotations

import numpy as np
import pytest

from core.errors import UserError
from core.formats.file_space import axis_of, from_metres_y_up, metres_of, scaled, to_metres_y_up

POINTS = np.random.default_rng(3).normal(size=(50, 3)).astype(np.float32)


def test_units_by_name_and_number():
    assert [metres_of(u) for u in ("m", "cm", "mm", "in", "ft")] == [1, 0.01, 0.001, 0.0254, 0.3048]
    assert metres_of(0.5) == 0.5
    for bad in ("parsec", 0.0, -1.0, float("nan")):
        with pytest.raises(UserError):
            metres_of(bad)
    assert axis_of("Z") == "z"
    with pytest.raises(UserError):
        axis_of("x")


def test_z_up_is_a_rotation_that_takes_z_to_y():
    turned = to_metres_y_up(np.eye(3, dtype=np.float32), 1.0, "z")
    np.testing.assert_array_equal(turned, [[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    assert np.linalg.det(turned) == pytest.approx(1)


def test_there_and_back():
    for up in "yz":
        there = from_metres_y_up(POINTS, 1.0, up)
        np.testing.assert_array_equal(to_metres_y_up(there, 1.0, up), POINTS)
        centimetres = from_metres_y_up(POINTS, 0.01, up)
        np.testing.assert_allclose(np.abs(centimetres).max(), np.abs(POINTS).max() * 100, rtol=1e-6)
        np.testing.assert_allclose(to_metres_y_up(centimetres, 0.01, up), POINTS, rtol=2e-7)


def test_a_factor_of_one_changes_nothing_and_others_round_once():
    assert np.array_equal(scaled(POINTS, 1.0), POINTS)
    np.testing.assert_array_equal(scaled(POINTS, 0.0254), (POINTS.astype(np.float64) * 0.0254).astype(np.float32))
