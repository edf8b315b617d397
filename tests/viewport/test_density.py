"""The controller of density, simulated: it settles, keeps calm, and never grows a coat under the hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewport.density import FLOOR, DensityController


def simulated(controller: DensityController, frames: int, milliseconds, seed: int, noise: float = 0.1) -> list[int]:
    """Numbers of hairs of so many frames on a machine that takes `milliseconds(hairs, frame)`, give or take."""
    rng = np.random.default_rng(seed)
    drawn = []
    for frame in range(frames):
        hairs = controller.drawn
        spike = 50.0 if rng.random() < 0.02 else 0.0
        controller.frame(milliseconds(hairs, frame) * (1.0 + noise * rng.normal()) + spike)
        drawn.append(hairs)
    return drawn


@pytest.mark.parametrize("per_thousand", [0.2, 1.0, 3.0])
def test_it_settles_within_the_budget_and_stays_there(per_thousand):
    controller = DensityController(26.0)
    drawn = simulated(controller, 900, lambda hairs, _: 6.0 + per_thousand * hairs / 1000.0, 1)
    end = drawn[-200:]
    assert len(set(end)) == 1, "it came to rest"
    assert 6.0 + per_thousand * end[0] / 1000.0 < 1.15 * 26.0
    assert 6.0 + per_thousand * end[0] * 1.3**2 / 1000.0 > 0.7 * 26.0, "no more than it must give away"
    turns = np.sign(np.diff(drawn))[np.diff(drawn) != 0]
    assert np.count_nonzero(np.diff(turns)) <= 2, "it does not swing to and fro"


def test_a_burst_of_load_is_answered_quickly():
    slow = DensityController(26.0, hairs=12000)
    drawn = simulated(slow, 80, lambda hairs, frame: hairs / 1000.0 * (5.0 if frame >= 20 else 2.0), 2)
    assert drawn[19] == 12000
    assert drawn[60] * 5.0 / 1000.0 < 1.15 * 26.0


@given(st.lists(st.floats(0.0, 500.0), max_size=120), st.integers(0, 200_000), st.integers(0, 200_000))
def test_inside_a_stroke_it_only_goes_down_and_never_below_the_floor(times, start, most):
    controller = DensityController(26.0, hairs=start)
    controller.limit(most)
    controller.begin_stroke()
    before = controller.drawn
    for milliseconds in times:
        now = controller.frame(milliseconds)
        assert now <= before
        assert now >= min(FLOOR, most)
        assert now <= most
        before = now


def test_after_the_stroke_it_may_grow_again_but_not_beyond_what_there_is():
    controller = DensityController(26.0, hairs=3000)
    controller.limit(20_000)
    controller.begin_stroke()
    for _ in range(100):
        controller.frame(2.0)
    assert controller.drawn == 3000
    controller.end_stroke()
    for _ in range(1000):
        controller.frame(2.0)
    assert controller.drawn == 20_000
    assert controller.hairs < 1.3 * 20_000
