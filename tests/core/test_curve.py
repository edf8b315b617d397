"""Truths: scipy's PCHIP and Hermite splines, exact Bezier points, and monotony in time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator
from scipy.optimize import brentq

from core.curve import Curve, Key, curve_at, smooth_slopes

rng = np.random.default_rng(11)
FRAMES = np.array([1001.0, 1004.0, 1005.5, 1012.0, 1020.0, 1021.0, 1040.0])
VALUES = np.array([0.0, 2.0, 2.5, -1.0, -1.0, 3.0, 0.5])


def keyed(frames, values, **same):
    return tuple(Key(frame=float(f), value=float(v), **same) for f, v in zip(frames, values, strict=True))


def test_smooth_is_monotone_hermite():
    x = np.linspace(FRAMES[0], FRAMES[-1], 777)
    slopes = smooth_slopes(FRAMES, VALUES)
    truth = PchipInterpolator(FRAMES, VALUES).derivative()(FRAMES)
    assert np.allclose(slopes[1:-1], truth[1:-1])
    assert slopes[0] == slopes[-1] == 0
    got = curve_at(Curve(keys=keyed(FRAMES, VALUES)), x)
    assert np.allclose(got, CubicHermiteSpline(FRAMES, VALUES, slopes)(x))
    for i in range(len(FRAMES) - 1):  # never beyond the keys on either side
        inside = got[(x >= FRAMES[i]) & (x <= FRAMES[i + 1])]
        assert inside.min() >= min(VALUES[i:i + 2]) - 1e-12
        assert inside.max() <= max(VALUES[i:i + 2]) + 1e-12


def test_linear_and_step():
    x = np.linspace(FRAMES[0] - 5, FRAMES[-1] + 5, 555)
    linear = curve_at(Curve(keys=keyed(FRAMES, VALUES, arrive="linear", leave="linear")), x)
    assert np.allclose(linear, np.interp(x, FRAMES, VALUES))
    step = curve_at(Curve(keys=keyed(FRAMES, VALUES, leave="step")), x)
    assert np.array_equal(step, VALUES[np.clip(np.searchsorted(FRAMES, x, "right") - 1, 0, 6)])


def test_every_key_is_met():
    kinds = ["smooth", "linear", "free", "smooth", "free", "linear", "smooth"]
    keys = tuple(
        Key(frame=f, value=v, arrive=k, leave=k, arrive_handle=(-2.0, 1.0), leave_handle=(1.5, -2.0))
        for f, v, k in zip(FRAMES, VALUES, kinds, strict=True)
    )
    assert np.allclose(curve_at(Curve(keys=keys), FRAMES), VALUES)


@pytest.mark.parametrize("handles", [
    ((1.0, 0.0), (-1.0, 0.0)), ((10.0, 3.0), (-10.0, -3.0)), ((0.0, 5.0), (0.0, -5.0)), ((10.0, 0.0), (0.0, 0.0)),
    ((3.3, -8.0), (-9.9, 2.0)), ((10.0, 1.0), (-10.0, 1.0)),
])
def test_free_handles_against_a_root_finder(handles):
    leave, arrive = handles
    curve = Curve(keys=(
        Key(frame=0.0, value=1.0, leave="free", leave_handle=leave),
        Key(frame=10.0, value=4.0, arrive="free", arrive_handle=arrive),
    ))
    px, py = [0.0, leave[0], 10.0 + arrive[0], 10.0], [1.0, 1.0 + leave[1], 4.0 + arrive[1], 4.0]

    def bezier(p, s):
        return p[0] * (1 - s)**3 + 3 * p[1] * s * (1 - s)**2 + 3 * p[2] * s * s * (1 - s) + p[3] * s**3

    for x in np.linspace(0.2, 9.8, 49):
        s = brentq(lambda s, x=x: bezier(px, s) - x, 0, 1, xtol=1e-15)
        if bezier(px, s + 1e-4) - bezier(px, s - 1e-4) > 1e-6:  # else it stands upright there
            assert curve_at(curve, x) == pytest.approx(bezier(py, s), abs=1e-9)


def test_handles_that_reach_too_far_are_shortened_with_their_slope():
    long = Curve(keys=(Key(frame=0.0, value=0.0, leave="free", leave_handle=(30.0, 15.0)), Key(frame=10.0, value=1.0)))
    short = Curve(keys=(Key(frame=0.0, value=0.0, leave="free", leave_handle=(10.0, 5.0)), Key(frame=10.0, value=1.0)))
    x = np.linspace(0, 10, 50)
    assert np.array_equal(curve_at(long, x), curve_at(short, x))


def test_before_and_after():
    keys = keyed([0, 4, 10], [1, 2, 5], arrive="linear", leave="linear")
    out = np.array([-6.0, -1.0, 11.0, 16.0, 33.0])
    assert np.array_equal(curve_at(Curve(keys=keys), out), [1, 1, 5, 5, 5])
    straight = Curve(keys=keys, before="linear", after="linear")
    assert np.allclose(curve_at(straight, out), [1 - 1.5, 1 - 0.25, 5.5, 8, 16.5])
    around = Curve(keys=keys, before="cycle", after="cycle")
    assert np.allclose(curve_at(around, out), np.interp(np.mod(out, 10), [0, 4, 10], [1, 2, 5]))
    flat = Curve(keys=keyed([0, 4, 10], [1, 2, 5], leave="step"), before="linear", after="linear")
    assert np.array_equal(curve_at(flat, out), [1, 1, 5, 5, 5])
    single = Curve(keys=keyed([5], [7]), before="linear", after="cycle")
    assert np.array_equal(curve_at(single, out), np.full(5, 7))


finite = st.floats(-1e6, 1e6)


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.tuples(finite, finite, st.sampled_from(["step", "linear", "smooth", "free"]),
                       st.sampled_from(["linear", "smooth", "free"]), st.floats(0, 1e6), finite, st.floats(-1e6, 0),
                           finite),
             min_size=1, max_size=6, unique_by=lambda row: round(row[0], 3)),
    st.lists(st.floats(-2e6, 2e6), min_size=1, max_size=9), st.sampled_from(["hold", "linear", "cycle"]),
)
def test_any_curve_is_finite_and_meets_its_keys(rows, frames, ends):
    rows = sorted(rows)
    keys = tuple(
        Key(frame=f, value=v, leave=a, arrive=b, leave_handle=(lx, ly), arrive_handle=(ax, ay))
        for f, v, a, b, lx, ly, ax, ay in rows
    )
    curve = Curve(keys=keys, before=ends, after=ends)
    got = curve_at(curve, frames)
    assert np.isfinite(got).all()
    assert np.array_equal(got, [curve_at(curve, f) for f in frames])
    if ends != "cycle":
        assert np.allclose(curve_at(curve, [k.frame for k in keys]), [k.value for k in keys], atol=1e-6, rtol=1e-6)


def test_refusals():
    a = Key(frame=1.0, value=2.0)
    for wrong in (
        lambda: Curve(keys=()), lambda: Curve(keys=(a, a)), lambda: Curve(keys=(a, a.replace(frame=0.0))),
        lambda: a.replace(value=float("nan")), lambda: a.replace(frame=float("inf")),
        lambda: a.replace(leave_handle=(-1.0, 0.0)), lambda: a.replace(arrive_handle=(1.0, 0.0)),
        lambda: Curve(keys=(a, a.replace(frame=1.0 + 1e-9))), lambda: a.replace(arrive_handle=(0.0, float("nan"))),
            lambda: a.replace(value=1e31),
    ):
        with pytest.raises(ValueError):
            wrong()
