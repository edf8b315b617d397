from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.groom.mirror import mirror
from core.mesh.surface import root_positions
from core.record import freeze
from tests.core.groom.small_grooms import ball, fur, mixed
from tests.core.groom.test_smooth import tangled

SKIN = ball().skin
FLIP = np.array([-1.0, 1.0, 1.0])


def by_place(guides):
    order = np.lexsort(np.round(guides.points[:, 0], 4).T)
    return guides.points[order].astype(np.float64), guides.hold[order]


def test_one_side_becomes_the_image_of_the_other():
    g = tangled(3)
    after = mirror(g, SKIN)
    right = g.points[g.points[:, 0, 0] > 0].astype(np.float64)
    assert len(after) == 2 * len(right)
    left = after.points[after.points[:, 0, 0] < 0].astype(np.float64)
    order_a, order_b = (np.lexsort(np.round(p[:, 0], 3).T) for p in (left, right * FLIP))
    assert np.allclose(left[order_a], (right * FLIP)[order_b], atol=2e-5)
    kept = np.isin(g.ids, after.ids)
    assert np.array_equal(kept, g.points[:, 0, 0] > 0)
    assert np.array_equal(after.points[: len(right)], g.points[kept])
    assert np.allclose(root_positions(SKIN.mesh, after.roots), after.points[:, 0], atol=1e-6)


def test_mirrored_there_and_back_is_the_identity_on_a_symmetric_skin():
    once = mirror(tangled(4), SKIN)
    back = mirror(once, SKIN, source=-1)
    assert np.array_equal(back.ids, once.ids)
    assert back.next_id == once.next_id
    assert np.allclose(back.points, once.points, atol=1e-6)
    again = mirror(once, SKIN)
    assert np.array_equal(again.ids, once.ids)
    assert np.allclose(again.points, once.points, atol=1e-7)


def test_counterparts_keep_their_ids_and_take_the_shape_and_hold():
    once = mirror(fur(), SKIN)
    rng = np.random.default_rng(0)
    x, hold = once.points.copy(), once.hold.copy()
    x[:, 1:] += rng.normal(0, 0.03, (len(once), 1, 3)).astype(np.float32)
    hold[:] = 0.4 * rng.random(hold.shape)
    ruffled = once.replace(points=freeze(x), hold=freeze(hold))
    after = mirror(ruffled, SKIN, source=-1)
    assert np.array_equal(after.ids, once.ids)
    assert np.array_equal(after.points[:, 0], once.points[:, 0])
    half = len(once) // 2
    assert np.array_equal(after.points[half:], ruffled.points[half:])
    assert np.allclose(after.points[:half], ruffled.points[half:] * FLIP, atol=1e-6)
    assert np.allclose(after.hold[:half], ruffled.hold[half:])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from([-1, 1]))
def test_what_may_not_change_stays(seed, source):
    before = mixed(seed, tangled(seed))
    after = mirror(before, SKIN, source=source)
    assert np.isfinite(after.points).all()
    shut = before.frozen | (before.hold.max(axis=1) >= 1) | (~before.selected & before.selected.any())
    shut |= source * before.points[:, 0, 0] > 0  # what is copied
    at = np.searchsorted(after.ids, before.ids[shut])
    assert np.array_equal(after.ids[at], before.ids[shut])
    assert np.array_equal(after.points[at], before.points[shut])
    assert np.array_equal(after.points, mirror(before, SKIN, source=source).points)


def test_frozen_counterparts_are_not_doubled():
    once = mirror(fur(), SKIN)
    frozen = once.replace(frozen=freeze(once.points[:, 0, 0] < 0))
    after = mirror(frozen, SKIN)
    assert np.array_equal(after.ids, once.ids)
    assert np.array_equal(after.points, once.points)


def test_only_the_selected_are_copied():
    g = fur()
    right = np.flatnonzero(g.points[:, 0, 0] > 0.1)
    selected = np.zeros(len(g), bool)
    selected[right[0]] = True
    after = mirror(g.replace(selected=selected), SKIN)
    assert len(after) == len(g) + 1
    assert np.allclose(after.points[-1], g.points[right[0]] * FLIP, atol=1e-5)


def test_on_a_skin_that_is_not_symmetric_roots_still_stand_on_it():
    context = ball(0.12)
    g = fur(60, 0.4, 0.12)
    after = mirror(g, context.skin)
    new = after.ids >= g.next_id
    assert new.any()
    assert np.allclose(root_positions(context.skin.mesh, after.roots), after.points[:, 0], atol=1e-6)
    d = after.points[:, -1].astype(np.float64) - after.points[:, 0]
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    assert (d * after.roots.frames[:, 2]).sum(1)[new] == pytest.approx(1, abs=1e-3)  # still along the normal
