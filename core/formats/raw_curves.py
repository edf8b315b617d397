"""Curves as a file carries them, before units, axes and records: cleaned, joined, and put on their curve.

Every reader of curves makes a list of :class:`RawCurves` and hands it to :func:`pack`; what comes back is
plain arrays and words, so it can cross from the child process that parsed a stranger's file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

PER_STRAND = ("ids", "root_uvs", "guide_ids", "guide_weights")
PER_POINT = ("points", "widths", "colors")
WEIGHTS = {  # of the four points around a segment, by powers 1, t, t^2, t^3 of its parameter
    "bezier": np.array([[1, -3, 3, -1], [0, 3, -6, 3], [0, 0, 3, -3], [0, 0, 0, 1]], np.float64),
    "bspline": np.array([[1, -3, 3, -1], [4, 0, -6, 3], [1, 3, 3, -3], [0, 0, 0, 1]], np.float64) / 6,
    "catmullRom": np.array([[0, -1, 2, -1], [2, 0, -5, 3], [0, 1, 4, -3], [0, 0, -1, 1]], np.float64) / 2,
}


@dataclass
class RawCurves:
    """One bundle of curves in the space and unit of its file.

    counts : (S,) int64. points : (N, 3) float32, root first. widths : (N,) float32 diameters or None.
    colors : (N, 3) float32 or None. ids : (S,) int32 or None. root_uvs : (S, 2) float32 or None.
    guide_ids, guide_weights : (S, 3) int32 / float32 or None. guides : they are guides, not hairs.
    notes : sentences about what was repaired or left out.
    """

    counts: NDArray[Any]
    points: NDArray[Any]
    widths: NDArray[Any] | None = None
    colors: NDArray[Any] | None = None
    ids: NDArray[Any] | None = None
    root_uvs: NDArray[Any] | None = None
    guide_ids: NDArray[Any] | None = None
    guide_weights: NDArray[Any] | None = None
    guides: bool = False
    notes: list[str] = field(default_factory=list)


def starts(counts: NDArray[Any]) -> NDArray[np.int64]:
    """First row of each curve, (S,) int64."""
    ends: NDArray[np.int64] = np.cumsum(counts, dtype=np.int64)
    return ends - counts


def ramp(counts: NDArray[Any]) -> NDArray[np.int64]:
    """0 .. count - 1 for each curve, one after another."""
    return np.arange(int(counts.sum()), dtype=np.int64) - np.repeat(starts(counts), counts)


def spread(values: NDArray[Any], scope: str, counts: NDArray[Any]) -> NDArray[Any] | None:
    """Values given once ("constant"), per curve ("uniform") or per point ("vertex"), as one per point.

    None when the number of values does not fit the scope (the column is then left out, never guessed).
    """
    total = int(counts.sum())
    if scope == "constant" and len(values) >= 1:
        return np.broadcast_to(values[:1], (total, *values.shape[1:]))
    if scope == "uniform" and len(values) == len(counts):
        return np.repeat(values, counts, axis=0)
    if scope == "vertex" and len(values) == total:
        return values
    return None


class OnCurve:
    """Where the points of a kept polyline lie on curves of a given basis.

    Filoplume works on polylines. A linear curve keeps its points exactly. A cubic one is sampled on the
    curve, never on its control hull: at the joints of its segments and, for Bezier, at thirds between, so
    that the number of points stays about what the author had. Catmull-Rom joints are control points: exact.

    Parameters
    ----------
    basis : "linear", "bezier", "bspline" or "catmullRom".
    wrap : "nonperiodic", "periodic" (the first point is repeated at the end) or "pinned" (the curve reaches
        its end points through phantom points 2 P0 - P1, as OpenUSD defines it).
    counts : (S,) points of each curve; those too short for their basis get a count of 0.
    """

    def __init__(self, basis: str, wrap: str, counts: NDArray[Any]) -> None:
        if basis == "bezier" and wrap == "pinned":  # pinning changes nothing for a Bezier curve
            wrap = "nonperiodic"
        self.basis, self.wrap, self.given = basis, wrap, np.asarray(counts, np.int64)
        n = self.given
        if basis == "linear":
            self.segments = n - 1 if wrap != "periodic" else n
            fits = n >= 2
        elif basis == "bezier":
            self.segments = n // 3 if wrap == "periodic" else (n - 1) // 3
            fits = (n >= 4) | ((wrap == "periodic") & (n >= 3))
        elif wrap == "periodic":
            self.segments, fits = n, n >= 3
        else:
            self.segments, fits = (n - 1, n >= 2) if wrap == "pinned" else (n - 3, n >= 4)
        self.segments = np.where(fits, self.segments, 0)
        self.per_segment = 3 if basis == "bezier" else 1
        self.counts = np.where(self.segments > 0, self.segments * self.per_segment + 1, 0)

    @property
    def keeps_points(self) -> bool:
        """True when the points of the file are the points of the polyline."""
        return self.basis == "linear" and self.wrap != "periodic" and bool((self.given >= 2).all())

    def vertex(self, values: NDArray[Any]) -> NDArray[Any]:
        """(given points, ...) to (kept points, ...): values carried by the basis of the curve."""
        if self.keeps_points:
            return values
        step, segment, t = self._samples()
        if self.basis == "linear":
            local = np.where(segment < np.repeat(self.given, self.counts), segment, 0)
            return values[np.repeat(starts(self.given), self.counts) + local]
        given, first = self.given, starts(self.given)
        if self.wrap == "pinned":
            values, given = _with_phantoms(values, given)
            first = starts(given)
        base, size = np.repeat(first, self.counts), np.repeat(given, self.counts)
        weights = np.stack([np.ones_like(t), t, t * t, t * t * t], axis=-1) @ WEIGHTS[self.basis].T
        out = np.zeros((len(t), *values.shape[1:]))
        for k in range(4):
            row = segment * step + k
            row = row % np.maximum(size, 1) if self.wrap == "periodic" else np.minimum(row, size - 1)
            out += weights[:, k].reshape(-1, *(1,) * (values.ndim - 1)) * values[base + row]
        return out.astype(values.dtype)

    def varying(self, values: NDArray[Any]) -> NDArray[Any] | None:
        """Values at the joints of the segments, linear between; None when their number does not fit."""
        joints = self.segments if self.wrap == "periodic" and self.basis != "linear" else self.segments + 1
        if self.basis == "linear":
            joints = self.given
        if len(values) != int(joints.sum()):
            return None
        _, segment, t = self._samples()
        base, size = np.repeat(starts(joints), self.counts), np.repeat(joints, self.counts)
        here, there = (base + (segment + k) % np.maximum(size, 1) for k in (0, 1))
        u = t.reshape(-1, *(1,) * (values.ndim - 1))
        exact = np.where(u == 0, values[here], values[here] * (1 - u) + values[there] * u)
        return exact.astype(values.dtype)

    def _samples(self) -> tuple[int, NDArray[np.int64], NDArray[np.float64]]:
        """Control points per segment, and each kept point's segment and parameter in it."""
        along = ramp(self.counts)
        segment = along // self.per_segment
        t = (along % self.per_segment) / self.per_segment
        if self.basis != "linear":  # the last point of an open curve is the end of its last segment
            last = np.repeat(self.segments, self.counts) - 1
            over = segment > last
            segment, t = np.where(over, last, segment), np.where(over, 1.0, t)
        return 3 if self.basis == "bezier" else 1, segment, t


def _with_phantoms(values: NDArray[Any], counts: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Each curve with a point 2 P0 - P1 before and 2 Pn - Pn-1 behind it."""
    keep = counts >= 2
    padded = np.where(keep, counts + 2, counts)
    out = np.empty((int(padded.sum()), *values.shape[1:]), values.dtype)
    out[np.repeat(starts(padded) + keep, counts) + ramp(counts)] = values
    first, end = starts(padded)[keep], (starts(padded) + padded - 1)[keep]
    out[first] = 2 * out[first + 1] - out[first + 2]
    out[end] = 2 * out[end - 1] - out[end - 2]
    return out, padded


def on_points(values: NDArray[Any] | None, scope: str, shape: OnCurve) -> NDArray[Any] | None:
    """Values of any scope ("constant", "uniform", "varying", "faceVarying", "vertex") as one per kept point.

    None when there are none, or their number fits nothing.
    """
    if values is None or not len(values):
        return None
    if scope in ("varying", "faceVarying"):
        on_joints = shape.varying(values)
        if on_joints is not None:
            return on_joints
        scope = "vertex"  # a common slip: one value per point, called varying
    if scope == "vertex":
        return shape.vertex(values) if len(values) == int(shape.given.sum()) else None
    return spread(values, scope, shape.counts)


def as_ids(values: NDArray[Any] | None) -> NDArray[np.int32] | None:
    """Whole numbers that fit int32, or None."""
    if values is None:
        return None
    whole = np.asarray(values, np.float64)
    fits = np.isfinite(whole).all() and (np.abs(whole) < 2**31).all() and (whole == np.round(whole)).all()
    return whole.astype(np.int32) if fits else None


def scale_of(world: NDArray[np.float64]) -> float:
    """How much a diameter grows in the (4, 4) transform `world`: the mean of its scales."""
    return abs(float(np.linalg.det(world[:3, :3]))) ** (1 / 3)


def clean(raw: RawCurves, where: str) -> RawCurves:
    """Leave out curves of fewer than 2 points or with values that are not numbers; say so in the notes."""
    counts = raw.counts
    bad = counts < 2
    for values, per_point in [(raw.points, True), (raw.widths, True), (raw.colors, True),
                              (raw.root_uvs, False), (raw.guide_weights, False)]:  # fmt: skip
        if values is None or np.isfinite(values.sum(dtype=np.float64)):
            continue
        rows = ~np.isfinite(values.reshape(len(values), -1).sum(axis=1, dtype=np.float64))
        bad |= np.bincount(np.repeat(np.arange(len(counts)), counts)[rows], minlength=len(counts)) > 0 \
            if per_point else rows  # fmt: skip
    if not bad.any():
        return raw
    keep, keep_points = ~bad, np.repeat(~bad, counts)
    raw.notes.append(f"{int(bad.sum())} curves of {where} were left out: too short, or not finite numbers.")
    for name in PER_STRAND + PER_POINT:
        values = getattr(raw, name)
        if values is not None:
            setattr(raw, name, values[keep_points if name in PER_POINT else keep])
    raw.counts = counts[keep]
    return raw


def merge(bundles: Sequence[RawCurves]) -> RawCurves:
    """Bundles one after another. A column some of them lack is dropped; ids that collide are dropped too."""
    if len(bundles) == 1:
        return bundles[0]
    joined: dict[str, Any] = {}
    for item in fields(RawCurves):
        values = [getattr(bundle, item.name) for bundle in bundles]
        if item.name == "guides":
            joined[item.name] = values[0]
        elif item.name == "notes":
            joined[item.name] = [note for notes in values for note in notes]
        else:
            joined[item.name] = None if any(v is None for v in values) else np.concatenate(values)
            if joined[item.name] is None and any(v is not None for v in values):
                joined.setdefault("lost", []).append(item.name)
    lost = joined.pop("lost", [])
    merged = RawCurves(**joined)
    if lost:
        merged.notes.append(f"Only some of the curves carry {', '.join(lost)}; these columns were left out.")
    return merged


def pack(bundles: Sequence[RawCurves], **values: Any) -> dict[str, Any]:
    """Arrays named "guides.points", "children.counts" ... beside the given plain values and "notes"."""
    answer: dict[str, Any] = dict(values)
    notes = list(answer.pop("notes", []))
    for role, guides in (("guides", True), ("children", False)):
        chosen = [b for b in bundles if b.guides is guides and len(b.counts)]
        if not chosen:
            continue
        raw = merge(chosen)
        if raw.ids is not None and len(np.unique(raw.ids)) != len(raw.ids):
            raw.notes.append(f"The ids of the {role} are not unique; they were left out.")
            raw.ids = None
        notes += raw.notes
        if raw.guide_ids is None or raw.guide_weights is None:
            raw.guide_ids = raw.guide_weights = None
        dtypes = {"counts": np.int32, "ids": np.int32, "guide_ids": np.int32}
        for name in ("counts", *PER_POINT, *PER_STRAND):
            column = getattr(raw, name)
            if column is not None:
                answer[f"{role}.{name}"] = np.ascontiguousarray(column, dtypes.get(name, np.float32))
    notes += [note for bundle in bundles if not len(bundle.counts) for note in bundle.notes]
    return {**answer, "notes": notes}
