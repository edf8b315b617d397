"""How sure a solve is, told from the factors of the last normal equations.

A parameter that was held fixed is tested by the derivative of the cost along it (Rao's score test): residuals alone
stay small when a wrong focal length bends the path.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from core.match.solve.bundle import Free, Reduced, normal_equations, reduced
from core.match.solve.slides import correlation
from core.match.solve.solution import Solution
from core.match.solve.state import (
    ASPECT,
    CENTRE_X,
    CENTRE_Y,
    FOCAL,
    FRAME_FOCAL,
    K1,
    LENS_NAMES,
    Array,
    Rows,
    residuals,
)
from core.random import rand

TESTED = (FOCAL, K1, ASPECT, CENTRE_X, CENTRE_Y)
SAMPLES = 24
TOLD = 1e-9  # of the strongest: a move that is held by what is known
MOST = 300  # points the certainty is told from
FLAT = 4.0  # standard deviations of the points: a plane as well as can be told


class Test(NamedTuple):
    """A parameter that was held fixed. gain : by how many variances the squares would fall. better : its value then."""

    name: str
    gain: float
    better: float


class Fix(NamedTuple):
    """What leaving out a track or a frame would do, told from the last normal equations without solving again.

    kind : "track" or "frame". row : of it. rms_px : of what is left. share : how far the path would move, over what it
    is unsure by.
    """

    kind: str
    row: int
    rms_px: float
    share: float


def _most_seen(solution: Solution) -> Rows:
    """Rows of the points that certainty is told from: with more than `MOST` of them the rest are left out, which makes
    it look a little worse than it is."""
    held = np.flatnonzero(solution.held).astype(np.int32)
    if len(held) <= MOST:
        return held
    seen = np.bincount(solution.observations.track[solution.used], minlength=len(solution.held))[held]
    if solution.free.pull is not None:
        seen[np.isin(held, solution.free.pull.points())] = len(solution.known) + 1
    return np.sort(held[np.argsort(-seen, kind="stable")[:MOST]])


class Certainty:
    """Factors of the normal equations at the end, of what was found and of what might have been."""

    def __init__(self, solution: Solution) -> None:
        self._solution = solution
        state = solution.state
        self._held = _most_seen(solution)
        self._known = np.flatnonzero(solution.known)
        number = np.full(len(solution.held), -1, np.int32)
        number[self._held] = np.arange(len(self._held))
        place = np.full(len(solution.known), -1, np.int32)
        place[self._known] = np.arange(len(self._known))
        part = solution.observations.take(solution.used & (number[solution.observations.track] >= 0))
        part = part._replace(frame=place[part.frame], track=number[part.track])
        self._part = part
        self._state = state._replace(
            rotation=np.ascontiguousarray(state.rotation[self._known]), translation=state.translation[self._known],
            points=state.points[self._held], focal=state.focal[self._known],
        )
        # what wanders from frame to frame counts as fewer observations (of an autoregressive noise)
        wander = min(max(correlation(self._state, part), 0.0), 0.95)
        self._slow = (1.0 + wander) / (1.0 - wander)
        self._poses = tuple(c for c in solution.free.frame if c != FRAME_FOCAL)
        columns = (*self._poses, FRAME_FOCAL)
        self._nodal = len(self._poses) == 3
        self._lens = tuple(sorted({*TESTED, *solution.free.lens}))
        free = Free(frame=columns, lens=self._lens, zoom=None)
        normal = normal_equations(self._state, part, 0.0, free)
        self._whole = self._pulled(reduced(normal, part, free, 1e-9, frames_out=True))
        zoom = solution.free.zoom
        self._zoom = None if zoom is None else zoom[np.ix_(self._known, self._known)]
        self.points = np.full((len(solution.held), 3, 3), np.nan)
        self._root = self._factor()

    def _pulled(self, whole: Reduced | None) -> Reduced | None:
        """The system with what is known of the points, which weighs as it did in the solve: in units of its noise."""
        pull = self._solution.free.pull
        if whole is None or pull is None:
            return whole
        _, right, matrix = pull.normal(self._solution.state.points)
        columns = (3 * self._held[:, None] + np.arange(3)).ravel()
        at = len(self._lens) + np.arange(len(columns))
        noise = self._solution.sigma**2
        whole.matrix[np.ix_(at, at)] += noise * matrix[np.ix_(columns, columns)]
        whole.right[at] += noise * right.ravel()[columns]
        return whole

    def _gauge(self) -> Array:
        """(3 P, 7 or 3 + P) orthonormal moves of the points that no track can tell from a move of the cameras, but for
        those that what is known of the points tells."""
        points = self._state.points
        count = len(points)
        moves = [np.cross(axis, points) for axis in np.eye(3)]
        if self._nodal:  # the distance of each point besides
            far = np.zeros((count, count, 3))
            far[np.arange(count), np.arange(count)] = points
            moves += list(far)
        else:
            moves += [np.tile(axis, (count, 1)) for axis in np.eye(3)] + [points]
        gauge = np.linalg.qr(np.stack([move.ravel() for move in moves], axis=1))[0]
        pull = self._solution.free.pull
        if pull is None:
            return gauge
        columns = (3 * self._held[:, None] + np.arange(3)).ravel()
        held = pull.normal(self._solution.state.points)[2][np.ix_(columns, columns)]
        values, axes = np.linalg.eigh(gauge.T @ held @ gauge)
        return gauge @ axes[:, values < TOLD * max(float(values.max()), 1e-30)]

    def _factor(self) -> Array | None:
        """Inverse of the system of points (and zooms that were found), gauge fixed; (n, n) float64."""
        if self._whole is None:
            return None
        points = 3 * len(self._state.points)
        lens = [self._lens.index(c) for c in self._solution.free.lens]
        first = len(self._lens)
        zooms = np.arange(first + points, len(self._whole.right)) if self._zoom is not None else np.zeros(0, int)
        rows = np.concatenate([lens, np.arange(first, first + points), zooms]).astype(int)
        matrix = self._whole.matrix[np.ix_(rows, rows)].copy()
        gauge = self._gauge()
        at = np.arange(len(lens), len(lens) + points)
        matrix[np.ix_(at, at)] += np.median(matrix[at, at]) * (gauge @ gauge.T)
        if self._zoom is not None:
            tail = np.arange(len(rows) - len(zooms), len(rows))
            matrix[np.ix_(tail, tail)] += self._zoom
        self._rows, self._at = rows, at
        try:
            inverse = np.linalg.inv(np.linalg.cholesky(matrix))
        except np.linalg.LinAlgError:
            return None
        covariance = inverse.T @ inverse * self._solution.sigma**2
        blocks = covariance[np.ix_(at, at)].reshape(len(at) // 3, 3, -1, 3)
        self.points[self._held] = np.einsum("pipj->pij", blocks)
        return inverse

    def flat(self) -> bool:
        """Whether the points lie on a plane as well as can be told, or nearly."""
        points, spread = self._state.points, self.points[self._held]
        if len(points) < 4 or self._root is None:
            return False
        values, axes = np.linalg.eigh(np.cov(points.T))
        normal = axes[:, 0]
        along = points @ normal
        thick = 1.4826 * float(np.median(np.abs(along - np.median(along))))
        blur = float(np.sqrt(np.median(np.einsum("i,pij,j->p", normal, spread, normal))))
        return thick < FLAT * blur or thick < 0.01 * float(np.sqrt(values[1]))

    def focal_sigma(self) -> float:
        """Of the logarithm of the focal length of the first camera, RMS over its frames where it changes; 0 where it
        was given, 1 where it cannot be told."""
        found = self._solution.free.lens
        if FOCAL not in found and self._zoom is None:
            return 0.0
        if self._root is None:
            return 1.0
        shared = self._root[:, found.index(FOCAL)] if FOCAL in found else np.zeros(len(self._root))
        if self._zoom is None:
            return float(np.linalg.norm(shared)) * self._solution.sigma
        own = np.flatnonzero(self._solution.views.camera[self._known] == 0)
        each = self._root[:, len(self._root) - len(self._known) + own] + shared[:, None]
        return float(np.sqrt((each**2).sum(axis=0).mean())) * self._solution.sigma

    def path(self) -> float:
        """Expected error of the path over its size: samples of the posterior, each moved onto the path as well as a
        similarity can (Umeyama, 1991)."""
        if self._nodal:
            return 0.0
        if self._root is None or self._whole is None:
            return 1.0
        whole: Reduced = self._whole
        normal = _normal_numbers(SAMPLES, len(self._root) + whole.right_out.size)
        centres = self._state.centres()
        size = float(np.sqrt(((centres - centres.mean(axis=0)) ** 2).sum(axis=1).mean()))
        errors = []
        for numbers in normal:
            kept = np.zeros(len(whole.right))
            kept[self._rows] = self._root.T @ numbers[: len(self._root)]
            rest = numbers[len(self._root) :].reshape(whole.right_out.shape)
            rest = rest - (whole.across @ kept).reshape(rest.shape)
            errors.append(self._moved_path(whole, rest * self._solution.sigma))
        return float(np.sqrt(np.mean(np.square(errors)))) / max(size, 1e-12)

    def _moved_path(self, whole: Reduced, rest: Array) -> float:
        """How far the path moves, but for a similarity, by a step whose poses are `rest` (m, 6) through the roots."""
        step = np.einsum("mji,mj->mi", whole.roots, rest)
        # centre = -R^T t, so a shift of t and a turn of R move it by -R^T (shift + t x turn)
        shift = step[:, 3:6] + np.cross(self._state.translation, step[:, :3])
        centres = self._state.centres()
        return _after_similarity(centres - np.einsum("fji,fj->fi", self._state.rotation, shift), centres)

    def fixes(
        self, rms: float, by_frame: Array, by_track: Array, path: float,
        progress: Callable[[str], None] = lambda words: None,
    ) -> tuple[Fix, ...]:
        """What the rest would be without each of the worst tracks and frames: one Gauss-Newton step from here.

        (Belsley, Kuh and Welsch, "Regression Diagnostics", 1980, deletion of a group of rows, with the matrix of all.)
        """
        if self._root is None or self._whole is None:
            return ()
        cost = np.square(residuals(self._state, self._part)).sum(axis=1)
        tried = [("track", int(row)) for row in _worst(by_track) if row in self._held]
        tried += [("frame", int(row)) for row in _worst(by_frame)]
        made = []
        for kind, row in tried:
            progress("")
            made.append(self._without(kind, row, rms, cost, path))
        return tuple(sorted((fix for fix in made if fix is not None), key=lambda fix: fix.rms_px))

    def _without(self, kind: str, row: int, rms: float, cost: Array, path: float) -> Fix | None:
        assert self._root is not None
        assert self._whole is not None
        whole, of_track = self._whole, kind == "track"
        at = int(np.searchsorted(self._held if of_track else self._known, row))
        gone = (self._part.track if of_track else self._part.frame) == at
        if not gone.any() or gone.all():
            return None
        free = Free(frame=(*self._poses, FRAME_FOCAL), lens=self._lens)
        normal = normal_equations(self._state, self._part.take(gone), 0.0, free)
        frames, points = normal.frames_right[:, list(self._poses)], normal.points_right
        if of_track:
            points = np.zeros_like(points)  # its own point goes with it
        else:
            frames = np.zeros_like(frames)
        lens = normal.lens_right[list(self._lens)]
        right = np.concatenate([lens, points.ravel(), normal.frames_right[:, FRAME_FOCAL]])[self._rows]
        out = np.einsum("mij,mj->mi", whole.roots, frames)
        kept = self._root @ (right - (whole.across[:, self._rows].T @ out.ravel()))
        less = cost[gone].sum() + float(kept @ kept) + float((out**2).sum())
        left = max(0.0, (cost.sum() - less) / cost.sum() * len(cost) / float((~gone).sum()))
        share = 0.0
        if not self._nodal and path > 0.0:
            whole_kept = np.zeros(len(whole.right))
            whole_kept[self._rows] = self._root.T @ kept
            rest = out - (whole.across @ whole_kept).reshape(out.shape)
            centres = self._state.centres()
            size = float(np.sqrt(((centres - centres.mean(axis=0)) ** 2).sum(axis=1).mean()))
            share = self._moved_path(whole, rest) / max(size * path, 1e-12)
        return Fix(kind, row, rms * float(np.sqrt(left)), share)

    def centres(self) -> Array:
        """(F, 3, 3) covariance of where the cameras stand, NaN where there is none."""
        found = np.full((len(self._solution.known), 3, 3), np.nan)
        if self._root is None or self._whole is None or self._nodal:
            return found
        whole: Reduced = self._whole
        count, width = whole.right_out.shape
        across = whole.across.reshape(count, width, -1)[:, :, self._rows] @ self._root.T
        inner = np.eye(width) + np.einsum("fik,fjk->fij", across, across)
        pose = np.einsum("fki,fkl,flj->fij", whole.roots, inner, whole.roots) * self._solution.sigma**2
        # of a turn and a shift of a pose: -R^T (shift + t x turn), and t x turn is a product with a skew matrix
        t = self._state.translation
        skew = np.cross(t[:, None, :], np.eye(3)).transpose(0, 2, 1)
        way = np.concatenate([skew, np.tile(np.eye(3), (count, 1, 1))], axis=2)
        way = -np.einsum("fji,fjk->fik", self._state.rotation, way)
        found[self._known] = np.einsum("fik,fkl,fjl->fij", way, pose, way)
        return found

    def tests(self) -> tuple[Test, ...]:
        """Score tests of the parameters of the lens that were held, and of a zoom at an even pace."""
        if self._root is None or self._whole is None:
            return ()
        whole, found = self._whole, self._solution.free
        zooms = len(self._lens) + 3 * len(self._state.points) + np.arange(len(self._known))
        tried = [(LENS_NAMES[c], self._lens.index(c)) for c in TESTED if c not in found.lens]
        made: list[Test] = []
        pace = np.linspace(-0.5, 0.5, len(zooms))
        for name, at in tried:
            if self._zoom is not None and at == self._lens.index(FOCAL):
                continue
            column = whole.matrix[self._rows, at]
            made.append(self._test(name, column, whole.matrix[at, at], whole.right[at], self._value(self._lens[at])))
        if self._zoom is None and len(zooms) > 2:
            column = whole.matrix[np.ix_(self._rows, zooms)] @ pace
            own = float(pace @ whole.matrix[np.ix_(zooms, zooms)] @ pace)
            made.append(self._test("zoom", column, own, float(pace @ whole.right[zooms]), 0.0))
        return tuple(made)

    def _value(self, column: int) -> float:
        return float(self._state.lens[column])

    def _test(self, name: str, column: Array, own: float, right: float, value: float) -> Test:
        assert self._root is not None
        assert self._whole is not None
        across = self._root @ column
        left = own - float(across @ across)
        slope = right - float(across @ (self._root @ self._whole.right[self._rows]))
        if left <= 1e-9 * own:
            return Test(name, 0.0, value)  # it cannot be told from the rest
        better = value + slope / left
        if name in ("focal length", "pixel aspect", "zoom"):
            better = float(np.exp(min(max(better, -30.0), 30.0)))
        return Test(name, slope**2 / left / self._solution.sigma**2 / self._slow, better)


def _worst(error: Array, most: int = 6) -> Rows:
    """Rows of the greatest errors."""
    known = np.flatnonzero(np.isfinite(error))
    return known[np.argsort(-error[known], kind="stable")[:most]].astype(np.int32)


def _normal_numbers(rows: int, columns: int) -> Array:
    """(rows, columns) float64 standard normal, the same at every call (Box and Muller, 1958)."""
    keys = np.arange(rows * columns, dtype=np.uint32)
    first = np.maximum(rand(keys, 11).astype(np.float64), 1e-9)
    second = rand(keys, 12).astype(np.float64)
    return np.asarray(np.sqrt(-2.0 * np.log(first)) * np.cos(2.0 * np.pi * second)).reshape(rows, columns)


def _after_similarity(moved: Array, path: Array) -> float:
    """RMS distance (F, 3) after the best similarity."""
    a, b = moved - moved.mean(axis=0), path - path.mean(axis=0)
    u, s, vt = np.linalg.svd(b.T @ a)
    turn = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    scale = float(np.trace(np.diag(s) @ turn)) / max(float((a**2).sum()), 1e-30)
    return float(np.sqrt(((scale * a @ (u @ turn @ vt).T - b) ** 2).sum(axis=1).mean()))
