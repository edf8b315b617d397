"""An outline drawn over a feather becomes its own attributes again."""

from __future__ import annotations

import numpy as np
import pytest

from core.errors import UserError
from core.feather.outline import fitted_barb, fitted_outline, outline_of
from core.feather.presets import preset_values
from core.feather.surface import BARB_BASE, BARB_CURVE, BARB_MIDDLE, BARB_TIP, END, START


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("name", ["goldfinch-breast", "peregrine-primary", "duck-speculum"])
def test_the_outline_of_another_feather_is_taken_over(name: str, side: int) -> None:
    wanted = outline_of(preset_values(name), side)
    found = outline_of(fitted_outline(preset_values("contour"), side, wanted[::-1] * [1 - 2 * side, 1]), side)
    np.testing.assert_allclose(found[[0, -1], 1], wanted[[0, -1], 1], atol=1e-6)
    off = np.interp(wanted[:, 1], found[:, 1], found[:, 0]) - wanted[:, 0]
    assert np.abs(off).max() < 0.02  # of the shaft's length


def test_a_line_along_a_part_leaves_the_other_side_and_both_ends() -> None:
    values = preset_values("contour")
    edge = outline_of(values, 1)
    bulge = edge[20:40] + np.array([0.03, 0.0])
    made = fitted_outline(values, 1, bulge)
    np.testing.assert_array_equal(outline_of(made, 0), outline_of(values, 0))
    np.testing.assert_array_equal(outline_of(made, 1)[[0, -1], 1], edge[[0, -1], 1])
    assert outline_of(made, 1)[30, 0] > edge[30, 0] + 0.008


def test_a_dot_is_no_outline() -> None:
    with pytest.raises(UserError, match="too short"):
        fitted_outline(preset_values("contour"), 0, np.array([[0.1, 0.5], [0.1, 0.5]]))


def test_a_drawn_barb_is_one_of_the_barbs_of_its_side() -> None:
    values = preset_values("contour")
    s = np.linspace(0.0, 1.0, 12)
    drawn = np.stack([-0.2 * s, 0.4 + 0.25 * (s + 0.5 * (s * s - s))], axis=1)
    made = fitted_barb(values, 0, drawn)
    u = (0.65 - made[START]) / (made[END] - made[START])
    angle = (1 - u) ** 2 * made[BARB_BASE] + 2 * u * (1 - u) * made[BARB_MIDDLE] + u * u * made[BARB_TIP]
    np.testing.assert_allclose(np.tan(angle), 0.2 / 0.25, rtol=1e-5)
    np.testing.assert_allclose(made[BARB_CURVE], 0.5, rtol=1e-5)
    np.testing.assert_array_equal(made[BARB_BASE + 1], values[BARB_BASE + 1])
