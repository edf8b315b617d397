"""A picture of a feather of ours becomes that feather again; noise and bare ground are refused in words."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from core.errors import UserError
from core.feather.attributes import COLUMNS
from core.feather.levels import flat_feather
from core.feather.outline import outline_of
from core.feather.presets import preset_values
from core.feather.trace import traced

NO_DOWN = [COLUMNS["downHairDensityVaneLeft"], COLUMNS["downHairDensityVaneRight"]]


def photograph(values: NDArray[np.float32], turn: float) -> NDArray[np.uint8]:
    """The feather flat on a blue ground, turned by degrees."""
    card = flat_feather(values).picture
    wide = np.zeros((900, 900, 4), np.uint8)
    high, across = card.shape[:2]
    top, left = (900 - high) // 2, (900 - across) // 2
    wide[top : top + high, left : left + across] = card[::-1]
    turned = cv2.warpAffine(wide, cv2.getRotationMatrix2D((450, 450), turn, 1.0), (900, 900))
    cover = turned[..., 3:] / 255.0
    return np.asarray(turned[..., :3] * cover + np.array([40, 70, 190]) * (1.0 - cover), np.uint8)


@pytest.mark.parametrize(("name", "turn"), [("goldfinch-breast", 0.0), ("duck-speculum", 130.0)])
def test_a_picture_of_a_feather_gives_its_outline_and_colours(name: str, turn: float) -> None:
    truth = preset_values(name).copy()
    truth[NO_DOWN] = 0.0
    found = traced(photograph(truth, turn), preset_values("contour"))
    for side in (0, 1):
        wanted, made = outline_of(truth, side), outline_of(found, side)
        off = np.interp(wanted[5:-5, 1], made[:, 1], made[:, 0]) - wanted[5:-5, 0]
        assert np.abs(off).mean() < 0.025  # of the shaft's length
    middle = COLUMNS["colorMiddleRed"]
    np.testing.assert_allclose(found[middle : middle + 3], truth[middle : middle + 3], atol=0.12)


def test_bare_ground_is_no_feather() -> None:
    with pytest.raises(UserError, match="plain ground"):
        traced(np.full((80, 60, 3), 200, np.uint8), preset_values("contour"))
