"""What a solve says of itself: how sure it is, what it could not have known, and what to mend next.

Uncertainty comes from the factors of the last normal equations. A parameter that was held fixed is tested by the
derivative of the cost along it (Rao's score test): residuals alone stay small when a wrong focal length bends the path.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from core.errors import UserError
from core.match.solve.bundle import Free, Reduced, normal_equations, reduced
from core.match.solve.nodal import BY_CHANCE, parallax
from core.match.solve.slides import correlation
from core.match.solve.solve import Solution
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
MOST = 300  # points the certainty is told from
GAIN = 30.0  # of the squares over the variance: a fixed parameter is wrong
NOISE, TOO_NOISY = 1.3, 3.0  # residuals over the noise of the tracks: said; refused
FOCAL_SIGMA = 0.03
PATH, NO_PATH = 0.03, 0.3  # uncertainty of the path over its size
OUT, TOO_MANY_OUT = 0.4, 0.49  # share of the tracks that do not fit
APART, MOVES = 1.5, 2.0  # of the typical error; of the doubt of the path: worth a look
FLAT = 4.0  # standard deviations of the points: a plane as well as can be told


TRANSLATION = "translation"


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


class Report(NamedTuple):
    """rms_px, median_px, mean_px, p95_px, most_px : lengths of reprojection errors in pixels.

    by_frame (F,), by_track (P,) : RMS in pixels, NaN where nothing was used.
    focal_px : (F,). focal_sigma_px : of the shared focal length, 0 where it was given.
    path_sigma : uncertainty of the path over its size; 0 of a camera that only turns.
    point_sigma : (P, 3, 3) covariance of points in world, NaN where there is none; centre_sigma : (F, 3, 3) of where
        cameras stand. Both as seen from the points as a whole: what moves, turns or scales all of them is no error.
    kind : "free", "planar" or "nodal". tests : of what was held fixed. warnings, advice : for the artist.
    fixes : what leaving out the worst tracks and frames would do, the most helpful first.
    """

    rms_px: float
    median_px: float
    mean_px: float
    p95_px: float
    most_px: float
    by_frame: Array
    by_track: Array
    focal_px: Array
    focal_sigma_px: float
    path_sigma: float
    point_sigma: Array
    centre_sigma: Array
    kind: str
    tests: tuple[Test, ...]
    warnings: tuple[str, ...]
    advice: tuple[str, ...]
    fixes: tuple[Fix, ...]


def report(solution: Solution, names: list[str]) -> Report:
    """Judge a solve; `names` of its tracks.

    Raises
    ------
    UserError
        The solve cannot be trusted; the message says why.
    """
    state, part = solution.state, solution.observations.take(solution.used)
    whitened = residuals(state, part)
    length = np.linalg.norm(whitened, axis=1) / np.sqrt(part.root[:, 0] * part.root[:, 2])  # pixels again
    length = length * solution.pixel[part.frame]
    by_frame = _rms(part.frame, length, len(solution.frames))
    by_track = _rms(part.track, length, len(solution.held))
    focal = np.exp(state.lens[FOCAL] + state.focal) * solution.pixel
    seen = np.bincount(solution.observations.track, minlength=len(solution.held)) >= 2
    out = 1.0 - float(solution.held[seen].mean()) if seen.any() else 1.0
    noisy = solution.sigma / solution.noise
    if noisy > TOO_NOISY:
        raise UserError(
            f"No camera explains these tracks: they miss it by {noisy:.1f} times their own noise. Look for a second "
            "motion among them, for rolling shutter, or for strong lens distortion."
        )
    if out > TOO_MANY_OUT:
        raise UserError(
            f"{round(100 * out)} % of the tracks do not fit the camera of the others: there may be two motions. Take "
            "out the tracks of what moves by itself."
        )
    certain = _Certainty(solution)
    kind = solution.kind
    if kind == "free" and certain.flat():
        kind = "planar"
    path = certain.path()
    if path > NO_PATH:
        raise UserError(
            "The path cannot be told from these tracks: the camera moves too little against the distance of the "
            "points. Solve it as one that only turns (--nodal), or add tracks that are near."
        )
    tests = certain.tests()
    if kind == "nodal":
        gain = parallax(state, part, solution.sigma)
        tests = (*tests, Test(TRANSLATION, gain if gain > BY_CHANCE else 0.0, 0.0))
    sigma_f = certain.focal_sigma() * float(np.exp(state.lens[FOCAL]))
    warnings = [*solution.said, *_warnings(solution, noisy, out, path, sigma_f, tests)]
    rms = float(np.sqrt((length**2).mean()))
    fixes = certain.fixes(rms, by_frame, by_track, path)
    return Report(
        rms, float(np.median(length)), float(length.mean()),
        float(np.quantile(length, 0.95)), float(length.max()), by_frame, by_track, focal, sigma_f, path,
        certain.points, certain.centres(), kind, tests, tuple(warnings),
        _advice(solution, names, rms, by_frame, by_track, fixes), fixes,
    )


def _rms(rows: Rows, length: Array, count: int) -> Array:
    seen = np.bincount(rows, minlength=count)
    total = np.bincount(rows, weights=length**2, minlength=count)
    return np.asarray(np.where(seen > 0, np.sqrt(total / np.maximum(seen, 1)), np.nan))


def _most_seen(solution: Solution) -> Rows:
    """Rows of the points that certainty is told from: with more than `MOST` of them the rest are left out, which makes
    it look a little worse than it is."""
    held = np.flatnonzero(solution.held).astype(np.int32)
    if len(held) <= MOST:
        return held
    seen = np.bincount(solution.observations.track[solution.used], minlength=len(solution.held))[held]
    return np.sort(held[np.argsort(-seen, kind="stable")[:MOST]])


class _Certainty:
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
        self._whole = reduced(normal, part, free, 1e-9, frames_out=True)
        zoom = solution.free.zoom
        self._zoom = None if zoom is None else zoom[np.ix_(self._known, self._known)]
        self.points = np.full((len(solution.held), 3, 3), np.nan)
        self._root = self._factor()

    def _gauge(self) -> Array:
        """(3 P, 7 or 3 + P) orthonormal moves of the points that no track can tell from a move of the cameras."""
        points = self._state.points
        count = len(points)
        moves = [np.cross(axis, points) for axis in np.eye(3)]
        if self._nodal:  # the distance of each point besides
            far = np.zeros((count, count, 3))
            far[np.arange(count), np.arange(count)] = points
            moves += list(far)
        else:
            moves += [np.tile(axis, (count, 1)) for axis in np.eye(3)] + [points]
        return np.linalg.qr(np.stack([move.ravel() for move in moves], axis=1))[0]

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
        """Of the logarithm of the shared focal length; 0 where it was given, 1 where it cannot be told."""
        if FOCAL not in self._solution.free.lens:
            return 0.0
        if self._root is None:
            return 1.0
        row = self._solution.free.lens.index(FOCAL)
        return float(np.linalg.norm(self._root[:, row])) * self._solution.sigma

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

    def fixes(self, rms: float, by_frame: Array, by_track: Array, path: float) -> tuple[Fix, ...]:
        """What the rest would be without each of the worst tracks and frames: one Gauss-Newton step from here.

        (Belsley, Kuh and Welsch, "Regression Diagnostics", 1980, deletion of a group of rows, with the matrix of all.)
        """
        if self._root is None or self._whole is None:
            return ()
        cost = np.square(residuals(self._state, self._part)).sum(axis=1)
        tried = [("track", int(row)) for row in _worst(by_track) if row in self._held]
        tried += [("frame", int(row)) for row in _worst(by_frame)]
        made = [self._without(kind, row, rms, cost, path) for kind, row in tried]
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


def _warnings(
    solution: Solution, noisy: float, out: float, path: float, sigma_f: float, tests: tuple[Test, ...]
) -> list[str]:
    said = []
    focal = float(np.exp(solution.state.lens[FOCAL]))
    if noisy > NOISE:
        said.append(
            f"The tracks miss the camera by {noisy:.2f} times their own noise: something is not in the model.")
    if out > OUT:
        said.append(f"{round(100 * out)} % of the tracks do not fit and were left out; do they move by themselves?")
    if path > PATH:
        said.append(f"The path is known to {100 * path:.1f} % of its size only; tracks that are nearer would help.")
    if sigma_f > FOCAL_SIGMA * focal:
        said.append(f"The focal length is known to {100 * sigma_f / focal:.1f} % only; give it if you know it.")
    if any(test.name == TRANSLATION and test.gain for test in tests):
        said.append(
            "The camera moves a little, as the parallax of the tracks shows: solved as one that only turns, its "
            "rotations are off by that. Add tracks that are near, so that the path can be told.")
        tests = ()  # what the lens seems to do is what that movement does
    strong = [test for test in tests if test.gain > GAIN]
    for test in sorted(strong, key=lambda one: -one.gain)[:2]:
        value = {
            "focal length": f"{test.better:.1f} px would fit better than {focal:.1f}; check it, or let it be found",
            "zoom": "the focal length seems to change over the shot; solve it with a zoom",
            "distortion k1": f"the lens seems to bend lines, k1 about {test.better:+.4f}; solve with a lens",
            "pixel aspect": f"pixels seem {test.better:.4f} times as high as wide; check the pixel aspect",
        }.get(test.name, f"about {test.better:.1f} px would fit better; check whether the plate was cropped")
        said.append(f"{test.name[0].upper()}{test.name[1:]}: {value}.")
    missing = int((~solution.known).sum())
    if missing:
        said.append(f"{missing} frames have no camera: too few tracks are seen there.")
    return said


def _advice(
    solution: Solution, names: list[str], rms: float, by_frame: Array, by_track: Array, fixes: tuple[Fix, ...]
) -> tuple[str, ...]:
    """What to mend next, worst first."""
    said = []
    seen = np.bincount(solution.observations.track, minlength=len(names))
    lost = [names[k] for k in np.flatnonzero(~solution.held & (seen >= 2))]
    if lost:
        more = " ..." if len(lost) > 8 else ""
        said.append(f"Look at the tracks that do not fit: {', '.join(lost[:8])}{more}.")
    for fix in helpful(fixes, by_frame, by_track):
        name = f"track {names[fix.row]}" if fix.kind == "track" else f"frame {solution.frames[fix.row]}"
        own = (by_track if fix.kind == "track" else by_frame)[fix.row]
        moves = f" and the path moves by {fix.share:.1f} times its doubt" if fix.share > 1.0 else ""
        said.append(
            f"Mend or leave out {name}, which misses by {own:.2f} px: the rest falls from {rms:.3f} to "
            f"{fix.rms_px:.3f} px{moves}."
        )
    counts = np.bincount(solution.observations.frame[solution.used], minlength=len(solution.frames))
    thin = np.flatnonzero(counts < 8)
    if len(thin):
        said.append(
            f"Add tracks on frames {solution.frames[thin[0]]} to {solution.frames[thin[-1]]}: some have fewer than 8.")
    return tuple(said)


def helpful(fixes: tuple[Fix, ...], by_frame: Array, by_track: Array) -> list[Fix]:
    """At most five of the fixes that are worth a look: what misses by half more than its like, or moves the path."""
    typical = {"track": float(np.nanmedian(by_track)), "frame": float(np.nanmedian(by_frame))}
    error = {"track": by_track, "frame": by_frame}
    return [fix for fix in fixes if error[fix.kind][fix.row] > APART * typical[fix.kind] or fix.share > MOVES][:5]
