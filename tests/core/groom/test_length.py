from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from core.groom.length import cut_at_line, cut_with_ring, grow, lengths, scale_length, set_length
from core.groom.region import distance_to_path
from core.groom.resample import with_point_count
from tests.core.groom.small_grooms import fur, may_change, mixed, stays, view


def bent(seed):
    """Curly fur: straight strands would not tell cutting from scaling."""
    g = mixed(seed)
    rng = np.random.default_rng(seed)
    x = g.points.copy()
    wave = 0.05 * np.sin(np.linspace(0, 6, x.shape[1]))[None, :, None] * rng.normal(size=(len(g), 1, 3))
    x[:, 1:] += wave[:, 1:].astype(np.float32)
    return g.replace(points=x)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.floats(-0.6, 0.6), st.sampled_from(["grow", "set", "scale"]))
def test_lengths_change_as_asked_where_allowed(seed, amount, kind):
    before = bent(seed)
    now, may = lengths(before.points), may_change(before)
    free = 1.0 - before.hold.max(axis=1)
    if kind == "grow":
        after, wanted = grow(before, amount, minimum=0.02), now + free * amount
    elif kind == "set":
        after, wanted = set_length(before, abs(amount), minimum=0.02), now + free * (abs(amount) - now)
    else:
        after, wanted = scale_length(before, 1 + amount, minimum=0.02), now * (1 + amount) ** free
    stays(before, after)
    wanted = np.where(may, np.maximum(wanted, 0.02), now)
    assert np.allclose(lengths(after.points), wanted, rtol=2e-5, atol=1e-7)


def test_shrinking_keeps_the_course_and_scaling_the_shape():
    none = np.zeros(60, bool)
    before = bent(3).replace(hold=np.zeros((60, 12), np.float32), frozen=none, selected=none)
    short = grow(before, -0.1)
    x = before.points.astype(np.float64)
    # every new point lies near the old curve
    t = np.linspace(0, 1, 40)[:, None]
    dense = np.concatenate([x[:, i, None] * (1 - t) + x[:, i + 1, None] * t for i in range(11)], axis=1)
    gap = np.linalg.norm(short.points[:, :, None].astype(np.float64) - dense[:, None], axis=-1).min(axis=2)
    assert gap.max() < 0.02
    half = scale_length(before, 0.5)
    assert np.allclose(half.points - half.points[:, :1], 0.5 * (x - x[:, :1]), atol=1e-6)


def test_weights_and_the_minimum():
    g = fur()
    w = np.linspace(0, 1, len(g))
    assert np.allclose(lengths(grow(g, 0.2, w).points), 0.4 + 0.2 * w, atol=1e-5)
    assert np.allclose(lengths(grow(g, -9.0, minimum=0.05).points), 0.05, rtol=1e-4)
    assert np.allclose(lengths(scale_length(g, 1e-6, minimum=0.05).points), 0.05, rtol=1e-4)
    assert np.allclose(lengths(grow(g, -9.0, minimum=5.0).points), 0.4, rtol=1e-4)  # shrinking never lengthens
    assert np.array_equal(grow(g, 0.3, w * 0).points, g.points)


def test_a_cut_leaves_everything_on_the_side_of_the_root():
    g = bent(8).replace(hold=np.zeros((60, 12), np.float32), selected=np.zeros(60, bool))
    for orthographic in (True, False):
        v = view((0.3, -0.2, -1), orthographic)
        column = 285.0
        after = cut_at_line(g, v, [[column, -900], [column, 1300]], minimum=0.0)
        stays(g, after)
        before_x, x = v.pixels(g.points)[0][..., 0], v.pixels(after.points)[0][..., 0]
        left = before_x[:, :1] < column
        crosses = ((before_x > column) == left).any(axis=1)
        cut = crosses & may_change(g)
        assert cut.sum() >= 3
        assert (np.where(left, x - column, column - x)[cut] < 0.02).all()
        assert np.abs(x[cut, -1] - column).max() < 0.02  # the tip is at the line, in perspective too
        assert np.array_equal(after.points[~cut], g.points[~cut])


def test_a_cut_by_a_short_line_spares_what_passes_beside_it():
    g, v = fur(), view()
    after = cut_at_line(g, v, [[200, 40], [200, 60]])
    moved = (after.points != g.points).any(axis=(1, 2))
    assert moved.sum() < 5
    assert np.array_equal(cut_at_line(g, v, [[200, 40]]).points, g.points)


def test_a_ring_cuts_where_strands_enter_it():
    g, v = fur(), view()
    path, radius = np.array([[80.0, 80.0], [320.0, 100.0]]), 30.0
    after = cut_with_ring(g, v, path, radius, minimum=0.0)
    stays(g, after)
    t = np.linspace(0, 1, 300)[None, :, None]
    x = g.points.astype(np.float64)
    dense = v.pixels(x[:, :1] * (1 - t) + x[:, -1:] * t)[0]  # fur is straight
    inside = distance_to_path(dense, path) < radius
    moved = (after.points != g.points).any(axis=(1, 2))
    assert moved.sum() > 5
    assert not moved[~(distance_to_path(dense, path) < radius + 0.5).any(axis=1)].any()
    tips = distance_to_path(v.pixels(after.points[:, -1])[0], path)
    outside_root = inside.any(axis=1) & ~inside[:, 0]
    assert np.abs(tips[outside_root & moved] - radius).max() < 0.05
    assert np.allclose(lengths(after.points)[inside[:, 0]], 0, atol=1e-6)


def test_held_hair_is_not_cut():
    g = fur().replace(hold=np.ones((60, 12), np.float32))
    assert np.array_equal(cut_at_line(g, view(), [[-500, 290], [900, 290]]).points, g.points)


def test_a_mask_keeps_the_far_side_from_the_scissors():
    g, v = fur(), view()
    front = g.points[:, 0, 2] > 0
    after = cut_at_line(g, v, [[290, -500], [290, 900]], mask=front)
    moved = (after.points != g.points).any(axis=(1, 2))
    assert moved.any()
    assert not moved[~front].any()


def test_a_long_segment_toward_the_eye_is_cut_where_the_line_crosses_its_picture():
    g = with_point_count(fur(), 2)
    x = g.points.copy()
    x[:, 1] = x[:, 0] + np.array([1.0, 0.3, 3.5], np.float32)  # the eye is at z = 6
    g, v = g.replace(points=x), view(orthographic=False)
    pixels = v.pixels(x)[0][..., 0]
    crosses = (pixels[:, 0] < 300) & (pixels[:, 1] > 300)
    after = cut_at_line(g, v, [[300, -9000], [300, 9000]])
    assert crosses.sum() > 20
    assert np.abs(v.pixels(after.points[crosses, -1])[0][:, 0] - 300).max() < 0.01
