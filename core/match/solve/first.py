"""The first cameras: pairs of keyframes, what each could mean, and the rest of the keyframes one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import cv2
import numpy as np

from core.match.solve.bundle import POSE, Free, adjust
from core.match.solve.nodal import turn_between
from core.match.solve.state import FRAME_FOCAL, Array, Flags, Observations, State, bearings, residuals

LEAST_COMMON = 6  # tracks of a pair
ENOUGH_PARALLAX = 0.12  # radians; more makes a pair no better
PAIRS = 6
SHARED, MOST_KEYS = 9, 60  # tracks that three keyframes in a row should share; keyframes, to share them
TESTED = 5  # other keyframes a hypothesis is tried on
FEWEST_POINTS = 5  # seen by a camera that is found from them
BUNDLES = (2, 4, 8, 16, 24, 36, 54, 81, 120, 180, 270)  # numbers of keyframes at which all is adjusted


class Pair(NamedTuple):
    """Two keyframes: rows of frames, and how good a beginning they are."""

    first: int
    second: int
    score: float


def rays(observations: Observations, lens: Array, frames: int, tracks: int) -> Array:
    """(F, P, 2) coordinates over depth, NaN where a track is not seen."""
    table = np.full((frames, tracks, 2), np.nan)
    table[observations.frame, observations.track] = bearings(lens, 0.0, observations.xy)[:, :2]
    return table


def keyframes(observations: Observations, frames: int, tracks: int, most: int = 20, least: int = 8) -> list[int]:
    """Frames at equal steps of the cumulative median motion of the tracks, so many that three in a row share enough of
    them: where tracks are short each camera is found from what the two before it tell."""
    table = np.full((frames, tracks, 2), np.nan)
    table[observations.frame, observations.track] = observations.xy
    step = np.zeros(frames)
    for k in range(1, frames):
        motion = np.linalg.norm(table[k] - table[k - 1], axis=1)
        motion = motion[np.isfinite(motion)]
        step[k] = max(1e-3, float(np.median(motion))) if len(motion) else 1e-3
    path = np.cumsum(step)
    seen = np.isfinite(table[:, :, 0])
    count = min(frames, max(least, min(most, frames // 5)))
    while True:
        at = np.searchsorted(path, np.linspace(path[0], path[-1], count))
        keys = sorted({int(k) for k in np.clip(at, 0, frames - 1)})
        of_three = seen[keys[:-2]] & seen[keys[1:-1]] & seen[keys[2:]]
        if count >= min(frames, MOST_KEYS) or (of_three.sum(axis=1) >= SHARED).all():
            return keys
        count = min(frames, MOST_KEYS, count + count // 2 + 1)


def best_pairs(
    table: Array, noise: float, progress: Callable[[str], None] = lambda words: None,
) -> list[Pair]:
    """Pairs of keyframes by the parallax that no turn explains, the number of tracks and how they are spread."""
    frames = len(table)
    width = np.nanmax(np.abs(table)) if np.isfinite(table).any() else 1.0
    found = []
    for i in range(frames):
        progress("")
        for j in range(i + 1, frames):
            both = np.isfinite(table[i, :, 0]) & np.isfinite(table[j, :, 0])
            count = int(both.sum())
            if count < LEAST_COMMON:
                continue
            a, b = (_unit(table[k, both]) for k in (i, j))
            parallax = np.median(np.linalg.norm(a @ turn_between(a, b, noise).T - b, axis=1))
            spread = float(np.sqrt(np.linalg.det(np.cov(table[i, both].T) + 1e-12 * np.eye(2)))) / width**2
            score = min(float(parallax), ENOUGH_PARALLAX) * np.sqrt(count) * min(1.0, 4.0 * spread) ** 2
            found.append(Pair(i, j, float(score)))
    return sorted(found, key=lambda pair: -pair.score)[:PAIRS]


def _unit(flat: Array) -> Array:
    unit = np.concatenate([flat, np.ones((len(flat), 1))], axis=1)
    return np.asarray(unit / np.linalg.norm(unit, axis=1, keepdims=True))


def _relative(a: Array, b: Array, noise: float) -> Iterator[tuple[Array, Array]]:
    """Rotations and unit translations (second from first) that could explain points (N, 2) over depth."""
    cv2.setRNGSeed(1)
    essential, _ = cv2.findEssentialMat(a, b, np.eye(3), cv2.RANSAC, 0.999, 3.0 * noise)
    if essential is not None:
        for part in essential.reshape(-1, 3, 3):
            one, two, shift = (np.asarray(found, np.float64) for found in cv2.decomposeEssentialMat(part))
            t: Array = shift.ravel()
            for turn in (one, two):
                yield np.asarray(turn, np.float64), t
                yield np.asarray(turn, np.float64), -t
    plane, _ = cv2.findHomography(a, b, cv2.RANSAC, 3.0 * noise)
    if plane is not None and abs(np.linalg.det(plane)) > 1e-9:
        _, turns, shifts, _ = cv2.decomposeHomographyMat(plane, np.eye(3))
        for rotation, move in zip(turns, shifts, strict=True):
            length = float(np.linalg.norm(move))
            if length > 1e-6:
                yield np.asarray(rotation, np.float64), np.asarray(move, np.float64).ravel() / length


def triangulated(rotation: Array, translation: Array, table: Array) -> tuple[Array, Array]:
    """Points (P, 3) nearest to the rays of the frames that see them, and how well each is held, (P,).

    The second is the mean square of the sine between the rays and the best direction: about the parallax squared; -1
    where the point lies behind a camera or fewer than two frames see it.
    """
    centre = -np.einsum("fji,fj->fi", rotation, translation)
    seen = np.isfinite(table[:, :, 0])
    flat = np.where(seen[:, :, None], table, 0.0)
    ray = np.concatenate([flat, np.ones((*flat.shape[:2], 1))], axis=2)
    ray /= np.linalg.norm(ray, axis=2, keepdims=True)
    ray = np.einsum("fji,fpj->fpi", rotation, ray)
    across = (np.eye(3) - ray[:, :, :, None] * ray[:, :, None, :]) * seen[:, :, None, None]
    matrix = across.sum(axis=0)
    right = np.einsum("fpij,fj->pi", across, centre)
    count = np.maximum(seen.sum(axis=0), 1)
    least = np.linalg.eigvalsh(matrix)[:, 0] / count
    ok = (seen.sum(axis=0) >= 2) & (least > 1e-14)
    points = np.zeros((table.shape[1], 3))
    points[ok] = np.linalg.solve(matrix[ok], right[ok][:, :, None])[:, :, 0]
    depth = np.einsum("fj,pj->fp", rotation[:, 2], points) + translation[:, 2:]
    ahead = ((depth > 1e-6) | ~seen).all(axis=0)
    return points, np.where(ok & ahead, least, -1.0)


class Cameras(NamedTuple):
    """Keyframes found so far. known : (F,) bool. held : (P,) bool, points that exist."""

    state: State
    known: Flags
    held: Flags


def pose_from_points(points: Array, flat: Array, noise: float) -> tuple[Array, Array] | None:
    """Rotation and translation of a camera that sees points (N, 3) at places over depth (N, 2)."""
    if len(points) < FEWEST_POINTS:
        return None
    cv2.setRNGSeed(1)
    try:
        good, turn, shift, _ = cv2.solvePnPRansac(
            np.ascontiguousarray(points), np.ascontiguousarray(flat), np.eye(3), None, iterationsCount=200,
            reprojectionError=float(6.0 * noise), confidence=0.999, flags=cv2.SOLVEPNP_AP3P,
        )
    except cv2.error:
        return None
    if not good or not np.isfinite(turn).all():
        return None
    return np.asarray(cv2.Rodrigues(turn)[0], np.float64), np.asarray(shift, np.float64).ravel()


class Grower:
    """Finds all keyframes from a pair.

    table : (F, P, 2) places over depth of the keyframes. noise : their standard deviation.
    progress : as :func:`solve` has it.
    """

    def __init__(
        self, observations: Observations, lens: Array, table: Array, noise: float, scale: float,
        progress: Callable[[str], None] = lambda words: None,
    ) -> None:
        self._observations, self._lens, self._table = observations, lens, table
        self._noise, self._scale, self._progress = noise, scale, progress

    def hypotheses(self, pairs: list[Pair]) -> list[tuple[float, Cameras]]:
        """What the pairs could mean, the likeliest first: by how well other keyframes are explained by it."""
        found = []
        for pair in pairs:
            self._progress("")
            both = np.isfinite(self._table[[pair.first, pair.second], :, 0]).all(axis=0)
            a, b = (np.ascontiguousarray(self._table[k, both]) for k in (pair.first, pair.second))
            for rotation, shift in _relative(a, b, self._noise):
                self._progress("")
                cameras = self._pair(pair, rotation, shift)
                if cameras.held.sum() >= max(FEWEST_POINTS, 0.6 * both.sum()):
                    found.append((self._doubt(cameras), cameras))
            if found and min(f[0] for f in found) < 0.35:
                break
        return sorted(found, key=lambda one: one[0])

    def _pair(self, pair: Pair, rotation: Array, shift: Array) -> Cameras:
        frames, tracks = self._table.shape[:2]
        turns, shifts = np.tile(np.eye(3), (frames, 1, 1)), np.zeros((frames, 3))
        turns[pair.second], shifts[pair.second] = rotation, shift
        known = np.zeros(frames, bool)
        known[[pair.first, pair.second]] = True
        state = State(turns, shifts, np.zeros((tracks, 3)), np.zeros(frames), self._lens.copy())
        return self._with_points(Cameras(state, known, np.zeros(tracks, bool)))

    def _with_points(self, cameras: Cameras) -> Cameras:
        """Points of tracks that have none yet and are seen under enough parallax."""
        state, known = cameras.state, cameras.known
        points, least = triangulated(state.rotation[known], state.translation[known], self._table[known])
        new = ~cameras.held & (least > (2.0 * self._noise) ** 2)
        merged = np.where(new[:, None], points, state.points)
        return Cameras(state._replace(points=merged), known, cameras.held | new)

    def _doubt(self, cameras: Cameras) -> float:
        """Mean of log(1 + (e / 4 s)^2) over keyframes that are found from the points; the least is the likeliest."""
        seen = np.isfinite(self._table[:, :, 0]) & cameras.held
        others = np.flatnonzero(~cameras.known & (seen.sum(axis=1) >= FEWEST_POINTS + 1))
        if not len(others):
            others = np.flatnonzero(cameras.known)
        picked = others[np.linspace(0, len(others) - 1, min(TESTED, len(others))).astype(int)]
        doubts = []
        for k in np.unique(picked):
            self._progress("")
            flat, points = self._table[k, seen[k]], cameras.state.points[seen[k]]
            pose = (
                (cameras.state.rotation[k], cameras.state.translation[k])
                if cameras.known[k] else pose_from_points(points, flat, self._noise)
            )
            if pose is None:
                doubts.append(4.0)
                continue
            there = points @ pose[0].T + pose[1]
            error = np.linalg.norm(there[:, :2] / np.maximum(there[:, 2:], 1e-9) - flat, axis=1)
            error = np.where(there[:, 2] > 0, error, 1.0)
            doubts.append(float(np.log1p((error / (4.0 * self._noise)) ** 2).mean()))
        return float(np.mean(doubts))

    def grow(self, cameras: Cameras, lens_columns: tuple[int, ...] = ()) -> Cameras:
        """All keyframes that can be found, adjusted together as they become more."""
        frames = len(self._table)
        cameras = self.adjusted(cameras, lens_columns)
        failed = np.zeros(frames, bool)
        while True:
            seen = np.isfinite(self._table[:, :, 0]) & cameras.held
            counts = np.where(cameras.known | failed, -1, seen.sum(axis=1))
            k = int(counts.argmax())
            if counts[k] < FEWEST_POINTS:
                break
            self._progress("")
            pose = pose_from_points(cameras.state.points[seen[k]], self._table[k, seen[k]], self._noise)
            if pose is None:
                failed[k] = True
                continue
            state, known = cameras.state, cameras.known.copy()
            rotation, translation = state.rotation.copy(), state.translation.copy()
            rotation[k], translation[k], known[k] = *pose, True
            state = state._replace(rotation=rotation, translation=translation)
            cameras = self._with_points(Cameras(state, known, cameras.held))
            if int(known.sum()) in BUNDLES:
                cameras = self._with_points(self.adjusted(cameras, lens_columns))
                failed[:] = False
        return self.adjusted(cameras, lens_columns)

    def adjusted(self, cameras: Cameras, lens_columns: tuple[int, ...] = (), zoom: Array | None = None) -> Cameras:
        """All that is known, moved to the robust best."""
        rows = cameras.known[self._observations.frame] & cameras.held[self._observations.track]
        frames = np.flatnonzero(cameras.known)
        number = np.zeros(len(cameras.known), np.int32)
        number[frames] = np.arange(len(frames))
        part = self._observations.take(rows)
        part = part._replace(frame=number[part.frame])
        state = cameras.state
        small = State(state.rotation[frames], state.translation[frames], state.points, state.focal[frames], state.lens)
        error = residuals(small, part)
        spread = float(np.median(np.linalg.norm(error, axis=1))) / 1.177 if len(error) else 1.0
        free = Free(frame=(*POSE, FRAME_FOCAL) if zoom is not None else POSE, lens=lens_columns, zoom=zoom)
        done = adjust(
            small, part, free, scale=2.5 * max(self._scale, min(spread, 20.0 * self._scale)), iterations=15,
            tolerance=1e-4, progress=self._progress,
        ).state
        rotation, translation, focal = state.rotation.copy(), state.translation.copy(), state.focal.copy()
        rotation[frames], translation[frames], focal[frames] = done.rotation, done.translation, done.focal
        return Cameras(State(rotation, translation, done.points, focal, done.lens), cameras.known, cameras.held)
