from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.groom.comb import comb
from core.groom.smooth import smooth
from core.record import freeze
from tests.core.groom.small_grooms import ball, fur, mixed, radial_depth, segment_lengths, stays, view


def tangled(seed, guides=None, size=0.5):
    g = fur() if guides is None else guides
    q = np.diff(g.points.astype(np.float64), axis=1)
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    q = q / length + np.random.default_rng(seed).normal(0, size, q.shape)
    q *= length / np.linalg.norm(q, axis=-1, keepdims=True)
    x = np.concatenate([g.points[:, :1], g.points[:, :1] + np.cumsum(q, axis=1)], axis=1)
    return g.replace(points=freeze(x.astype(np.float32)))


def bends(guides):
    q = np.diff(guides.points.astype(np.float64), axis=1)
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    return np.arccos(np.clip((q[:, 1:] * q[:, :-1]).sum(-1), -1, 1))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.floats(0, 1), st.floats(0, 1))
def test_what_is_kept(seed, along, across):
    before = tangled(seed, mixed(seed))
    weights = np.random.default_rng(seed).random(before.hold.shape)
    after = smooth(before, along=along, across=across, weights=weights)
    stays(before, after)
    assert np.abs(segment_lengths(after) / segment_lengths(before) - 1).max() < 1e-5
    assert np.array_equal(after.points, smooth(before, along=along, across=across, weights=weights).points)


def test_bends_even_out_along_the_strand():
    before = tangled(1)
    after = [bends(smooth(before, iterations=i)).mean() for i in (1, 4, 40)]
    assert bends(before).mean() > after[0] > after[1] > after[2]
    assert after[2] < 0.1 * bends(before).mean()


def test_a_straight_strand_and_an_arc_inside_stay():
    g = fur()
    assert np.allclose(smooth(g).points, g.points, atol=1e-6)
    angle = np.linspace(0, 1, 11)[None, :, None]
    n = g.roots.frames[:, 2][:, None].astype(np.float64)
    t = g.roots.frames[:, 0][:, None].astype(np.float64)
    q = np.cos(angle) * n + np.sin(angle) * t
    x = np.concatenate([g.points[:, :1], g.points[:, :1] + np.cumsum(0.03 * q, axis=1)], axis=1)
    arc = g.replace(points=freeze(x.astype(np.float32)))
    once = smooth(arc, iterations=1)
    assert np.allclose(bends(once)[:, 2:-2], bends(arc)[:, 2:-2], atol=1e-4)


def test_neighbours_come_to_agree():
    g = fur(400, 0.4)
    # each strand leans along its own direction, all in their own frames
    lean = np.random.default_rng(0).normal(0, 0.6, (len(g), 2))
    f = g.roots.frames.astype(np.float64)
    d = f[:, 2] + lean[:, :1] * f[:, 0] + lean[:, 1:] * f[:, 1]
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    s = np.linspace(0, 0.4, 12)[None, :, None]
    ruffled = g.replace(points=freeze((g.points[:, :1] + s * d[:, None]).astype(np.float32)))

    def disorder(guides):
        d = guides.points[:, -1].astype(np.float64) - guides.points[:, 0]
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        return np.arccos(np.clip((d * f[:, 2]).sum(1), -1, 1)).mean()

    after = smooth(ruffled, along=0.0, across=0.7, iterations=10)
    assert disorder(after) < 0.5 * disorder(ruffled)
    assert np.allclose(smooth(ruffled, along=0.0, across=0.0).points, ruffled.points, atol=1e-6)
    # hair that stands alike everywhere, in the frames of the skin, is left as it is
    assert np.abs(smooth(g, along=0.0, across=1.0).points - g.points).max() < 0.02


def test_smoothing_over_the_skin_stays_out_of_it():
    g = fur(60, 0.4, 0.12)
    context = ball(0.12)
    rng = np.random.default_rng(2)
    for _ in range(15):
        path = rng.uniform(80, 320, 2) + np.cumsum(rng.normal(0, 40, (4, 2)), axis=0)
        g = comb(g, view(tuple(rng.normal(size=3))), path, 80, field=context.field)
    out = smooth(g, along=1.0, iterations=30, field=context.field)
    x = out.points.astype(np.float64)
    samples = np.concatenate([x[:, 1:] * t + x[:, :-1] * (1 - t) for t in (0.25, 0.5, 0.75, 1.0)], axis=1)
    assert radial_depth(context, samples).max() < 0.02 * context.field.cell
    assert radial_depth(context, smooth(g, along=1.0, iterations=30).points[:, 1:]).max() > 0.01


def test_nothing_to_do_is_the_same_object():
    g = fur()
    assert smooth(g, weights=np.zeros(g.hold.shape)) is g
    solid = g.replace(frozen=np.ones(len(g), bool))
    assert smooth(solid) is solid
    assert bends(g).max() == pytest.approx(0, abs=1e-3)


def test_hair_on_the_other_side_of_thin_skin_is_no_neighbour():
    g = fur()
    other = int(np.argmin(g.roots.frames[:, 2] @ g.roots.frames[0, 2]))  # with the opposite normal
    near = np.full((len(g), 1), other)
    only_first = np.zeros(g.hold.shape)
    only_first[0] = 1.0
    ruffled = tangled(3)
    alone = smooth(ruffled, along=0.0, across=1.0, weights=only_first, near=near)
    assert np.allclose(alone.points[0], ruffled.points[0], atol=1e-6)
    beside = np.full((len(g), 1), int(np.argsort(-(g.roots.frames[:, 2] @ g.roots.frames[0, 2]))[1]))
    assert np.abs(smooth(ruffled, along=0.0, across=1.0, weights=only_first, near=beside).points[0]
                  - ruffled.points[0]).max() > 0.01
