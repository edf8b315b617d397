from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.groom.clone import clone
from core.groom.length import lengths
from core.groom.plant import plant
from core.groom.rows import take_rows
from core.mesh.surface import root_positions
from tests.core.groom.small_grooms import ball, mixed
from tests.core.groom.test_smooth import tangled

SKIN = ball().skin
MIDDLE = np.full(3, 1 / 3, np.float32)


def rotation(axis, angle):
    k = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def one_on(triangle):
    """A bent strand alone in the middle of a triangle."""
    g = plant(take_rows(tangled(1), np.zeros(60, bool)), SKIN, np.array([triangle]), MIDDLE, length=0.4, inherit=0)
    return tangled(2, g, 0.3)


def test_a_strand_cloned_is_the_strand_rotated():
    g = one_on(10)
    for triangle in (11, 200, 900):
        after = clone(g, SKIN, g.ids, triangle, MIDDLE)
        assert len(after) == 2
        f0, f1 = (after.roots.frames[i].astype(np.float64) for i in (0, 1))
        turn = np.outer(f1[0], f0[0]) + np.outer(f1[1], f0[1]) + np.outer(f1[2], f0[2])
        wanted = (g.points[0] - g.points[0, 0]) @ turn.T
        assert np.allclose(after.points[1] - after.points[1, 0], wanted, atol=1e-6)
        assert np.allclose(after.points[1, 0], SKIN.mesh.points[SKIN.triangles.vertices[triangle]].mean(0), atol=1e-6)
        assert np.array_equal(after.points[0], g.points[0])


def test_twist_scale_and_flip_in_closed_form():
    g = one_on(10)
    plain, n = clone(g, SKIN, g.ids, 300, MIDDLE), None
    frame = plain.roots.frames[1].astype(np.float64)
    n = frame[2]
    d = plain.points[1].astype(np.float64) - plain.points[1, 0]
    turned = clone(g, SKIN, g.ids, 300, MIDDLE, twist=0.8, scale=1.5)
    assert np.allclose(turned.points[1] - turned.points[1, 0], 1.5 * d @ rotation(n, 0.8).T, atol=1e-5)
    flipped = clone(g, SKIN, g.ids, 300, MIDDLE, flip=True)
    mirrored = d - 2 * (d @ frame[1])[:, None] * frame[1]
    assert np.allclose(flipped.points[1] - flipped.points[1, 0], mirrored, atol=1e-6)


def test_a_lock_keeps_its_pattern_on_the_skin():
    g = tangled(1, size=0.2)
    near = np.argsort(np.linalg.norm(g.points[:, 0] - g.points[5, 0], axis=1))[:5]
    for twist in (0.0, 2.0):
        after = clone(g, SKIN, g.ids[near], 700, MIDDLE, twist=twist, radius=0.0)
        new = after.points[len(g):, 0].astype(np.float64)
        assert len(new) == 5
        old = g.points[np.sort(near), 0].astype(np.float64)
        def gaps(p):
            return np.linalg.norm(p[:, None] - p[None], axis=-1)
        assert np.allclose(gaps(new), gaps(old), atol=0.08 * gaps(old).max())
        assert np.allclose(lengths(after.points[len(g):]), lengths(g.points[np.sort(near)]), rtol=1e-5)
        assert np.allclose(root_positions(SKIN.mesh, after.roots), after.points[:, 0], atol=1e-6)
        # hair stands to its own normal as it did
        for i, row in enumerate(np.sort(near)):
            a = (g.points[row, -1].astype(float) - g.points[row, 0]) @ g.roots.frames[row, 2]
            copy = after.points[len(g) + i].astype(float)
            b = (copy[-1] - copy[0]) @ after.roots.frames[len(g) + i, 2]
            assert a == pytest.approx(b, abs=1e-5)


def test_new_ones_replace_what_stood_in_the_footprint():
    g = mixed(3, tangled(3))
    centre = SKIN.mesh.points[SKIN.triangles.vertices[700]].mean(axis=0)
    near = np.linalg.norm(g.points[:, 0] - centre, axis=1) <= 0.5
    after = clone(g, SKIN, [g.ids[0]], 700, MIDDLE, radius=0.5)
    stay = ~near | g.frozen | (g.hold.max(axis=1) >= 1) | (~g.selected & g.selected.any())
    assert near.sum() > 2
    assert after.ids.tolist() == [*g.ids[stay].tolist(), g.next_id]
    assert np.array_equal(after.points[:-1], g.points[stay])


def test_strands_in_the_footprint_take_the_shape_over():
    g = tangled(3)
    centre = SKIN.mesh.points[SKIN.triangles.vertices[700]].mean(axis=0)
    near = np.linalg.norm(g.points[:, 0] - centre, axis=1) <= 0.6
    after = clone(g, SKIN, [g.ids[0]], 700, MIDDLE, radius=0.6, onto="strands", scale=0.5)
    assert np.array_equal(after.ids, g.ids)
    assert after.roots is g.roots
    assert np.array_equal(after.points[:, 0], g.points[:, 0])
    assert np.array_equal(after.points[~near], g.points[~near])
    shape = np.linalg.norm(g.points[0].astype(float) - g.points[0, 0], axis=1)
    taken = np.linalg.norm(after.points[near].astype(float) - after.points[near, :1], axis=-1)
    assert near.sum() > 2
    assert np.allclose(taken, 0.5 * shape, atol=1e-5)


def test_variation_is_keyed_on_ids_and_seed():
    g = one_on(10)
    def stamp(**k):
        return clone(g, SKIN, g.ids, 300, MIDDLE, **k).points[1]
    assert np.array_equal(stamp(variation=0.5, seed=3), stamp(variation=0.5, seed=3))
    assert np.abs(stamp(variation=0.5, seed=3) - stamp(variation=0.5, seed=4)).max() > 0.01
    assert np.array_equal(stamp(variation=0.0, seed=3), stamp(seed=4))
    sizes = [lengths(stamp(variation=0.5, seed=s)[None])[0] / 0.4 for s in range(40)]
    assert 0.75 <= min(sizes) < 0.9
    assert 1.1 < max(sizes) <= 1.25


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from(["new", "strands"]))
def test_what_is_kept(seed, onto):
    rng = np.random.default_rng(seed)
    before = mixed(seed, tangled(seed))
    ids = rng.choice(before.ids, 3, replace=False)
    args = {
        "scale": float(rng.uniform(0.3, 2)), "twist": float(rng.uniform(-3, 3)), "flip": bool(rng.integers(2)),
        "variation": float(rng.random()), "seed": seed, "radius": 0.5, "onto": onto, "field": ball().field,
    }
    triangle = int(rng.integers(0, len(SKIN.triangles.vertices)))
    after = clone(before, SKIN, ids, triangle, MIDDLE, **args)
    assert np.isfinite(after.points).all()
    shut = before.frozen | (before.hold.max(axis=1) >= 1) | (~before.selected & before.selected.any())
    at = np.searchsorted(after.ids, before.ids[shut])
    assert np.array_equal(after.ids[at], before.ids[shut])
    assert np.array_equal(after.points[at], before.points[shut])
    assert np.array_equal(after.selected[at], before.selected[shut])
    assert np.array_equal(after.points, clone(before, SKIN, ids, triangle, MIDDLE, **args).points)


def test_ids_that_do_not_exist_change_nothing():
    g = tangled(3)
    assert clone(g, SKIN, [10**6], 3, MIDDLE) is g
