from __future__ import annotations

import numpy as np

from core.groom.freeze import freeze, freeze_others, unfreeze
from tests.core.groom.small_grooms import fur


def flags(*rows):
    out = np.zeros(60, bool)
    out[list(rows)] = True
    return out


def test_freezing_and_thawing():
    g = fur().replace(selected=flags(1, 2))
    cold = freeze(g)
    assert np.array_equal(cold.frozen, flags(1, 2))
    assert not cold.selected.any()
    assert np.array_equal(freeze_others(g).frozen, ~flags(1, 2))
    assert np.array_equal(freeze_others(g).selected, flags(1, 2))
    assert np.array_equal(unfreeze(cold, flags(1)).frozen, flags(2))
    assert not unfreeze(cold).frozen.any()
    assert unfreeze(g) is g
    assert freeze(cold) is cold
    assert cold.points is g.points
