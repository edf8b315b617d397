"""Keyed curves over time: cubic Bezier segments that never run backwards."""

from __future__ import annotations

import itertools
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.record import Record, number

Array = NDArray[np.float64]
Tangent = Literal["step", "linear", "smooth", "free", "aligned"]
HANDLED = ("free", "aligned")  # tangents that follow the handle of the key
Extrapolation = Literal["hold", "linear", "cycle"]

MAX_KEYS = 100_000
CLOSEST = 1e-6  # frames between two keys


class Key(Record):
    """One key.

    frame, value : where it stands.
    arrive, leave : the tangent before and after it. "step" (of `leave`) holds the value until the next key;
        "linear" aims at the neighbour; "smooth" never overshoots (flat at extremes, the monotone slopes of Fritsch
        and Carlson, SIAM J. Numer. Anal. 1980, in Butland's form); "free" follows the handle, and so does
        "aligned", whose two handles a hand turns as one (core/curve_edit.py).
    arrive_handle, leave_handle : (frames, value) from the key to its Bezier handle, of "free" and "aligned" tangents;
        frames <= 0 before the key, >= 0 after it. A handle that reaches past the neighbouring key is shortened to it.
    """

    frame: float
    value: float
    arrive: Tangent = "smooth"
    leave: Tangent = "smooth"
    arrive_handle: tuple[float, float] = (0.0, 0.0)
    leave_handle: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        number(self, "frame", least=-1e9, most=1e9)
        number(self, "value", "arrive_handle", "leave_handle", least=-1e30, most=1e30)
        if self.arrive_handle[0] > 0.0 or self.leave_handle[0] < 0.0:
            raise ValueError("Key handles must not point backwards in time")


class Curve(Record, tag="curve"):
    """Keys in order of time, and what happens before the first and after the last."""

    keys: tuple[Key, ...]
    before: Extrapolation = "hold"
    after: Extrapolation = "hold"

    def __post_init__(self) -> None:
        if not 1 <= len(self.keys) <= MAX_KEYS:
            raise ValueError(f"Curve needs 1 to {MAX_KEYS} keys")
        frames = [key.frame for key in self.keys]
        if any(b - a < CLOSEST for a, b in itertools.pairwise(frames)):
            raise ValueError(f"Curve keys must stand at increasing frames, at least {CLOSEST:g} apart")

    @property
    def animated(self) -> bool:
        """False when it is the same number at every frame."""
        first = self.keys[0]
        flat = all(k.value == first.value and k.arrive_handle[1] == 0.0 == k.leave_handle[1] for k in self.keys)
        return not flat


def curve_at(curve: Curve, frames: ArrayLike) -> Array:
    """Values of a curve at any frames, float64 in their shape."""
    f = np.asarray(frames, np.float64)
    if len(curve.keys) == 1:
        return np.full(f.shape, curve.keys[0].value)
    x, y = control_points(curve)
    first, last = x[0, 0], x[-1, 3]
    early, late = f < first, f > last
    inside = np.clip(f, first, last)
    for outside, how in ((early, curve.before), (late, curve.after)):
        if how == "cycle":
            inside = np.where(outside, first + np.mod(f - first, last - first), inside)
    out = _inside(curve, x, y, inside)
    if curve.before == "linear":
        out = np.where(early, y[0, 0] + (f - first) * _end_slope(curve, x, y, last=False), out)
    if curve.after == "linear":
        out = np.where(late, y[-1, 3] + (f - last) * _end_slope(curve, x, y, last=True), out)
    return out


def value_range(curve: Curve) -> tuple[float, float]:
    """About the lowest and the highest value from the first key to the last: of keys and eight places between them."""
    frames = np.array([key.frame for key in curve.keys])
    if len(frames) > 1:
        frames = np.append(frames[:-1, None] + np.diff(frames)[:, None] * np.linspace(0.0, 1.0, 9)[:-1], frames[-1])
    values = curve_at(curve, frames)
    return float(values.min()), float(values.max())


def _inside(curve: Curve, x: Array, y: Array, frames: Array) -> Array:
    segment = np.clip(np.searchsorted(x[:, 0], frames, side="right") - 1, 0, len(x) - 1)
    px, py = x[segment], y[segment]
    s = _parameter(px, frames)
    out = _bezier(py, s)
    steps = np.array([key.leave == "step" for key in curve.keys[:-1]])[segment]
    out = np.where(steps, py[..., 0], out)
    return np.where(frames >= x[-1, 3], y[-1, 3], out)  # the last key itself, after a step


def _bezier(p: Array, s: Array) -> Array:
    r = 1.0 - s
    return r * r * r * p[..., 0] + 3.0 * s * r * r * p[..., 1] + 3.0 * s * s * r * p[..., 2] + s * s * s * p[..., 3]


def _parameter(x: Array, frames: Array) -> Array:
    """Where on each segment its time is `frames`: Newton's steps, kept inside a bracket that halves when they fail.

    Times are monotone because every handle ends within its segment, so there is one answer.
    """
    length = x[..., 3] - x[..., 0]
    p = (x - x[..., :1]) / length[..., None]
    target = (frames - x[..., 0]) / length
    s, low, high = target.copy(), np.zeros_like(target), np.ones_like(target)
    for _ in range(64):
        error = _bezier(p, s) - target
        moving = np.abs(error) > 1e-15
        if not moving.any():
            break
        low, high = np.where(error < 0.0, s, low), np.where(error > 0.0, s, high)
        r = 1.0 - s
        slope = 3.0 * (r * r * p[..., 1] + 2.0 * s * r * (p[..., 2] - p[..., 1]) + s * s * (1.0 - p[..., 2]))
        with np.errstate(all="ignore"):
            step = s - error / slope
        step = np.where((step > low) & (step < high), step, 0.5 * (low + high))
        s = np.where(moving, step, s)  # one that has arrived stays, so that a value never depends on its neighbours
    return s


def control_points(curve: Curve) -> tuple[Array, Array]:
    """Frames and values (K - 1, 4) of the Bezier control points of every segment."""
    keys = curve.keys
    f = np.array([key.frame for key in keys])
    v = np.array([key.value for key in keys])
    length, rise = np.diff(f), np.diff(v)
    smooth = smooth_slopes(f, v)
    x = np.stack([f[:-1], f[:-1] + length / 3.0, f[1:] - length / 3.0, f[1:]], axis=1)
    y = np.stack([v[:-1], v[:-1] + rise / 3.0, v[1:] - rise / 3.0, v[1:]], axis=1)
    for i, (a, b) in enumerate(itertools.pairwise(keys)):
        if a.leave == "smooth":
            y[i, 1] = v[i] + smooth[i] * length[i] / 3.0
        elif a.leave in HANDLED:
            scale = _shorten(a.leave_handle[0], length[i])
            x[i, 1], y[i, 1] = f[i] + a.leave_handle[0] * scale, v[i] + a.leave_handle[1] * scale
        if b.arrive == "smooth":
            y[i, 2] = v[i + 1] - smooth[i + 1] * length[i] / 3.0
        elif b.arrive in HANDLED:
            scale = _shorten(-b.arrive_handle[0], length[i])
            x[i, 2], y[i, 2] = f[i + 1] + b.arrive_handle[0] * scale, v[i + 1] + b.arrive_handle[1] * scale
    return x, np.clip(y, -1e30, 1e30)


def _shorten(reach: float, length: float) -> float:
    return float(length / reach) if reach > length else 1.0


def smooth_slopes(frames: Array, values: Array) -> Array:
    """Slopes (K,) at keys that keep the curve monotone between them: flat at extremes and at both ends.

    Between neighbours of one direction: the weighted harmonic mean of Fritsch and Butland (SIAM J. Sci. Stat. Comput.
    1984), as in the PCHIP of Matlab and scipy.
    """
    length = np.diff(frames)
    slope = np.diff(values) / length
    out = np.zeros(len(frames))
    a, b = slope[:-1], slope[1:]
    w1, w2 = 2.0 * length[1:] + length[:-1], length[1:] + 2.0 * length[:-1]
    same = a * b > 1e-200  # of one sign; what is smaller is flat
    out[1:-1] = np.where(same, (w1 + w2) * a * b / np.where(same, w1 * b + w2 * a, 1.0), 0.0)
    return out


def _end_slope(curve: Curve, x: Array, y: Array, last: bool) -> float:
    """Slope with which the curve goes on: of its first or last handle that has any length."""
    if last:
        if curve.keys[-2].leave == "step":
            return 0.0
        ends = [(x[-1, 3] - x[-1, i], y[-1, 3] - y[-1, i]) for i in (2, 1, 0)]
    else:
        if curve.keys[0].leave == "step":
            return 0.0
        ends = [(x[0, i] - x[0, 0], y[0, i] - y[0, 0]) for i in (1, 2, 3)]
    dx, dy = next((end for end in ends if end[0] > 1e-9 * (x[-1, 3] - x[0, 0])), (1.0, 0.0))
    return float(dy / dx)
