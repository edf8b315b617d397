"""Every attribute of a feather does something: turned alone, it changes the feather that is drawn."""

from __future__ import annotations

from functools import cache

import numpy as np

from core.feather.attributes import COLUMNS, NAMES, defaults, limits
from core.feather.levels import Level, feather_mesh

FEW = {  # so that a feather is small, and still has everything
    "barbCount": 20.0, "barbuleCount": 3.0, "downHairDensityVane": 9.0, "downHairFringeVane": 1.0,
    "afterfeatherHairs": 3.0, "gapLength": 0.06,
}
SHARE = 0.37  # of the way to the farther end of its range, by which an attribute is turned


def _with_everything() -> np.ndarray:
    """A feather on which nothing is idle: bars, spots, splits, gaps, ruffles ... all at once."""
    low, high = limits()
    values = defaults().copy()
    idle = (values == 0.0) | (values == low)
    least = np.maximum(low, 0.0)
    values[idle] = (least + 0.3 * (high - least))[idle]
    for name in NAMES:
        column = COLUMNS[name]
        values[column] = next((few for start, few in FEW.items() if name.startswith(start)), values[column])
    return values


def _seen(values: np.ndarray, level: Level) -> list[np.ndarray]:
    mesh = feather_mesh(values, 3, level)
    optics = np.array([*mesh.optics.under, mesh.optics.film_index, mesh.optics.film_spread])
    return [*mesh[:9], optics]


def test_every_attribute_changes_what_is_drawn() -> None:
    start = _with_everything()
    low, high = limits()
    before = cache(lambda level: _seen(start, level))
    idle = []
    for column, name in enumerate(NAMES):
        values = start.copy()
        up, down = high[column] - start[column], start[column] - low[column]
        values[column] += SHARE * up if up > down else -SHARE * down
        levels: tuple[Level, ...] = ("barbules",) if name.startswith("barbule") else ("vane", "barbs", "barbules")
        if not any(
            a.shape != b.shape or not np.array_equal(a, b)
            for level in levels for a, b in zip(_seen(values, level), before(level), strict=True)
        ):
            idle.append(name)
    assert idle == []
