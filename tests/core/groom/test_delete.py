from __future__ import annotations

import numpy as np
import pytest

from core.groom.delete import delete
from tests.core.groom.small_grooms import mixed


@pytest.mark.parametrize("seed", range(8))
def test_deleting_spares_the_frozen_the_held_and_the_unselected(seed):
    before = mixed(seed)
    mask = np.random.default_rng(seed).random(60) < 0.5
    after = delete(before, mask)
    stay = ~mask | before.frozen | (before.hold.max(axis=1) >= 1)
    if before.selected.any():
        stay |= ~before.selected
    assert np.array_equal(after.ids, before.ids[stay])
    assert np.array_equal(after.points, before.points[stay])
    assert np.array_equal(after.hold, before.hold[stay])
    assert np.array_equal(after.roots.weights, before.roots.weights[stay])
    assert after.next_id == before.next_id
    assert delete(before, ~np.ones(60, bool)) is before
