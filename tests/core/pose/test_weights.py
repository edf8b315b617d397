"""Truths: sums of rows, a dense table changed by hand, and symmetry."""

import numpy as np
import pytest

from core.errors import UserError
from core.pose.skeleton import SkinWeights
from core.pose.weights import (
    compacted,
    limited,
    mirrored,
    no_skin,
    normalized_weights,
    painted,
    pruned,
    smoothed,
    weights_of,
)

rng = np.random.default_rng(6)
JOINTS = 7


def some_skin(vertices=300, influences=4):
    joints = np.argsort(rng.random((vertices, JOINTS)), axis=1)[:, :influences].astype(np.int32)
    return SkinWeights(joints=joints, weights=rng.dirichlet(np.ones(influences), vertices).astype(np.float32))


def table(skin, joints=JOINTS):
    out = np.zeros((len(skin.joints), joints))
    for v, (js, ws) in enumerate(zip(skin.joints, skin.weights)):
        for j, w in zip(js, ws):
            out[v, j] += w
    return out


def sums_to_one(skin):
    return np.abs(skin.weights.sum(axis=1, dtype=np.float64) - 1.0).max() < 1e-5 and skin.weights.min() >= 0


@pytest.mark.parametrize(("mode", "value"), [("replace", 0.8), ("add", 0.3), ("add", -0.3), ("scale", 0.25)])
def test_painting_in_closed_form(mode, value):
    skin = some_skin()
    amounts = np.where(rng.random(300) < 0.5, rng.random(300), 0.0)
    was = table(skin)
    want = {"replace": value, "add": was[:, 2] + value, "scale": was[:, 2] * value}[mode]
    truth = was.copy()
    truth[:, 2] = np.clip(was[:, 2] + amounts * (want - was[:, 2]), 0, 1)
    others = np.delete(np.arange(JOINTS), 2)
    truth[:, others] *= ((1 - truth[:, 2]) / was[:, others].sum(axis=1))[:, None]
    after = painted(skin, 2, amounts, value, mode)
    assert np.abs(table(after) - truth).max() < 1e-6
    assert sums_to_one(after)
    still = amounts == 0.0
    assert np.array_equal(after.weights[still, :4], skin.weights[still])
    assert np.array_equal(after.joints[still, :4], skin.joints[still])


def test_locked_joints_keep_their_weights():
    skin = some_skin()
    was = table(skin)
    for after in (
        painted(skin, 2, np.ones(300), 1.0, locked=(0, 5)),
        smoothed(skin, np.column_stack([np.arange(299), np.arange(1, 300)]), np.ones(300), locked=(0, 5)),
        limited(skin, 3, locked=(0, 5)),
        pruned(skin, 0.2, locked=(0, 5)),
    ):
        now = table(after)
        assert np.abs(now - was)[:, [0, 5]].max() < 1e-6
        assert sums_to_one(after)
        assert np.abs(now - was).max() > 0.05
    assert painted(skin, 0, np.ones(300), 1.0, locked=(0,)) is skin
    full = painted(skin, 2, np.ones(300), 1.0, locked=(0, 5))
    assert np.allclose(table(full)[:, 2], 1.0 - was[:, 0] - was[:, 5], atol=1e-6)


def test_taking_all_of_the_only_joint_leaves_it():
    lone = SkinWeights(joints=np.zeros((4, 1), np.int32), weights=np.ones((4, 1), np.float32))
    assert np.allclose(weights_of(painted(lone, 0, np.ones(4), 0.0), 0), 1.0)
    assert np.allclose(weights_of(painted(lone, 3, np.ones(4), 0.25), 3), 0.25)


def test_smoothing_is_the_mean_of_the_neighbours():
    ring = np.column_stack([np.arange(40), (np.arange(40) + 1) % 40])
    joints = np.tile(np.int32([0, 1]), (40, 1))
    first = np.where(np.arange(40) < 20, 1.0, 0.0).astype(np.float32)
    skin = SkinWeights(joints=joints, weights=np.column_stack([first, 1 - first]))
    truth = 0.5 * (np.roll(first, 1) + np.roll(first, -1))
    twice = np.concatenate([ring, ring[::-1]])  # edges named twice weigh no more
    for edges in (ring, twice):
        assert np.allclose(weights_of(smoothed(skin, edges, np.ones(40)), 0), truth, atol=1e-6)
    half = smoothed(skin, ring, np.full(40, 0.5), joint=0)
    assert np.allclose(weights_of(half, 0), 0.5 * (first + truth), atol=1e-6)
    for _ in range(600):
        skin = smoothed(skin, ring, np.full(40, 0.9))
    assert np.allclose(weights_of(skin, 0), 0.5, atol=0.01)


def test_smoothing_a_joint_that_moves_nothing_yet_changes_nothing():
    skin = compacted([[0, 1], [0, 1]], [[0.5, 0.5], [0.25, 0.75]])
    after = smoothed(skin, [[0, 1]], np.ones(2), joint=3)
    np.testing.assert_allclose(weights_of(after, 0), weights_of(skin, 0), atol=1e-7)
    assert not weights_of(after, 3).any()


def test_limit_and_prune():
    skin = some_skin(influences=6)
    was = table(skin)
    few = limited(skin, 2)
    assert few.joints.shape[1] == 2
    order = np.argsort(-was, axis=1)
    for v in range(300):
        kept = order[v, :2]
        assert set(few.joints[v]) == set(kept)
        assert np.allclose(table(few)[v, kept], was[v, kept] / was[v, kept].sum(), atol=1e-6)
    clean = table(pruned(skin, 0.15))
    assert clean[clean > 0].min() >= 0.15
    assert np.allclose(clean.sum(axis=1), 1.0, atol=1e-5)
    assert (clean.argmax(axis=1) == was.argmax(axis=1)).all()
    with pytest.raises(UserError, match="More joints are locked"):
        limited(skin, 2, locked=(0, 1, 2, 3, 4))
    with pytest.raises(UserError, match="at least one"):
        limited(skin, 0)


def test_rows_are_made_to_sum_to_one_around_locked_joints():
    skin = some_skin()
    joints, weights = skin.joints, skin.weights.copy() * 3
    weights[0] = 0.0
    weights[1, 0] = np.nan
    after = normalized_weights(skin, joints, weights)
    assert sums_to_one(after)
    assert np.allclose(table(after)[0], table(skin)[0], atol=1e-6)
    assert np.allclose(table(after)[5:], table(skin)[5:], atol=1e-6)
    free = skin.weights * 0.5
    held = np.where(joints == 4, skin.weights, free)
    assert np.allclose(table(normalized_weights(skin, joints, held, locked=(4,))), table(skin), atol=1e-6)


def test_mirror_gives_symmetry_and_twice_the_same():
    half = rng.uniform(0.05, 1.0, (150, 3))
    middle = rng.uniform(-1, 1, (30, 3)) * [0, 1, 1]
    points = np.concatenate([half, half * [-1, 1, 1], middle])
    swap = np.array([0, 2, 1, 4, 3, 5, 6])
    skin = some_skin(len(points))
    once, lost = mirrored(skin, points, swap)
    now = table(once)
    assert not len(lost)
    assert np.abs(now[150:300] - now[:150][:, swap]).max() < 1e-6
    assert np.array_equal(now[:150], np.asarray(table(compacted(skin.joints, skin.weights))[:150]))
    assert np.abs(now[300:] - now[300:][:, swap]).max() < 1e-6
    again, _ = mirrored(once, points, swap)
    assert np.abs(table(again) - now).max() < 1e-6
    other, _ = mirrored(skin, points, swap, source="negative")
    assert np.abs(table(other)[:150] - table(skin)[150:300][:, swap]).max() < 1e-6
    moved = points.copy()
    moved[:150, 1] += 50.0
    kept, lost = mirrored(skin, moved, swap, reach=1e-3)
    assert np.array_equal(lost, np.arange(150, 300))
    assert np.abs(table(kept)[150:300] - table(skin)[150:300]).max() < 1e-6
    with pytest.raises(UserError, match="every joint"):
        mirrored(skin, points, swap[:3])


def test_compacting_adds_up_and_trims():
    skin = compacted([[3, 3, 1, 0]], [[0.25, 0.25, 0.5, 0.0]])
    assert skin.joints.shape == (1, 2)
    assert np.allclose(table(skin), [[0, 0.5, 0, 0.5, 0, 0, 0]])
    with pytest.raises(UserError, match="no weights"):
        compacted([[0, 1]], [[0.0, -1.0]])
    assert compacted(np.zeros((5, 0)), np.zeros((5, 0))).joints.shape == no_skin(5).joints.shape == (5, 0)
