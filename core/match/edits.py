"""Edits of tracks: pure functions from records to records."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.track import HAND, PlaneTrack, Track
from core.record import freeze

COLUMNS = ("frames", "points", "covariance", "own", "score")


def split_track(track: Track, frame: int, new_id: int, new_name: str) -> tuple[Track, Track]:
    """The part before `frame`, and that from it on under a new id. Each keeps its keys, or its first point as one."""
    before = track.frames < frame
    if before.all() or not before.any():
        raise UserError(f"Track {track.name} has nothing on one side of frame {frame}; split it between its points.")
    return _part(track, before), _part(track, ~before).replace(id=new_id, name=new_name)


def join_tracks(first: Track, second: Track) -> Track:
    """One track of two of the same point; where both see it, they are averaged by how sure they are."""
    if first.plate_id != second.plate_id:
        raise UserError(f"{first.name} and {second.name} are tracks of different plates and cannot be joined.")
    made = average_tracks((first, second))
    keys = {key[0]: key for key in (*second.keys, *first.keys)}
    return made.replace(id=first.id, name=first.name, keys=freeze(np.array([keys[f] for f in sorted(keys)])))


def average_tracks(tracks: tuple[Track, ...]) -> Track:
    """The track of the mean point: on every frame the mean of those that see it, weighted by their covariances."""
    if not tracks or not any(len(track.frames) for track in tracks):
        raise UserError("Choose tracks that have points to average them.")
    frames = np.unique(np.concatenate([track.frames for track in tracks]))
    weight, right = np.zeros((len(frames), 2, 2)), np.zeros((len(frames), 2))
    own, score, count = np.zeros((len(frames), 3)), np.ones(len(frames)), np.zeros(len(frames))
    for track in tracks:
        at = np.searchsorted(frames, track.frames)
        inverse = np.linalg.inv(_full(track.covariance))
        weight[at] += inverse
        right[at] += np.einsum("nij,nj->ni", inverse, track.points)
        own[at] += track.own
        score[at] = np.minimum(score[at], track.score)
        count[at] += 1
    covariance = np.asarray(np.linalg.inv(weight), np.float64)
    points = np.einsum("nij,nj->ni", covariance, right)
    return tracks[0].replace(
        frames=freeze(frames.astype(np.int32)), points=freeze(points), covariance=freeze(_packed(covariance)),
        own=freeze(own / count[:, None] ** 2), score=freeze(score), keys=freeze(_as_key(frames, points)),
    )  # fmt: skip


def smooth_track(track: Track, length: int = 5) -> Track:
    """Quadratics through `length` neighbouring frames (Savitzky & Golay 1964), within unbroken runs; keys stay."""
    from scipy.signal import savgol_filter

    if length % 2 == 0 or length < 3:
        raise UserError("Smoothing needs an odd number of frames, 3 or more.")
    points = track.points.copy()
    for run in np.split(np.arange(len(track.frames)), np.flatnonzero(np.diff(track.frames) > 1) + 1):
        if len(run) >= length:
            points[run] = savgol_filter(track.points[run], length, 2, axis=0)
    at = np.searchsorted(track.frames, track.keys[:, 0])
    points[at] = track.keys[:, 1:]
    return track.replace(points=freeze(points))


def key_track(track: Track, frame: int, point: tuple[float, float]) -> Track:
    """The point is set by a hand on that frame and becomes a key; tracking anew meets it."""
    keys = np.concatenate((track.keys[track.keys[:, 0] != frame], [[frame, *point]]))
    rest = track.frames != frame
    sure = np.array([[HAND, 0.0, HAND]])
    columns = {
        "frames": np.append(track.frames[rest], np.int32(frame)),
        "points": np.concatenate((track.points[rest], [point])),
        "covariance": np.concatenate((track.covariance[rest], sure)), "own": np.concatenate((track.own[rest], sure)),
        "score": np.append(track.score[rest], 1.0),
    }  # fmt: skip
    order = np.argsort(columns["frames"])
    changed = {name: freeze(np.ascontiguousarray(value[order])) for name, value in columns.items()}
    return track.replace(keys=freeze(keys[np.argsort(keys[:, 0])]), **changed)


def offset_track(track: Track, frame: int, point: tuple[float, float], new_id: int, new_name: str) -> Track:
    """A track of another point that moves with this one: the distance at `frame` stays."""
    at = np.flatnonzero(track.frames == frame)
    if not len(at):
        raise UserError(f"Track {track.name} is not seen on frame {frame}; choose a frame where it is.")
    by = np.asarray(point) - track.points[at[0]]
    keys = track.keys + np.array([0.0, *by])
    return track.replace(id=new_id, name=new_name, points=freeze(track.points + by), keys=freeze(keys))


def merge_tracked(before: Track, made: Track, frames: range) -> Track:
    """What was tracked anew on `frames`, and beside them what the track held before."""
    rest = ~np.isin(before.frames, np.arange(frames[0], frames[-1] + 1)) if len(frames) else before.frames >= 0
    inside = np.isin(made.frames, np.arange(frames[0], frames[-1] + 1)) if len(frames) else made.frames < 0
    order = np.argsort(np.concatenate((before.frames[rest], made.frames[inside])), kind="stable")
    changed = {
        name: freeze(np.concatenate((getattr(before, name)[rest], getattr(made, name)[inside]))[order])
        for name in COLUMNS
    }
    return made.replace(**changed)


def rekey_track(track: Track, frame: int) -> Track:
    """The point where it was seen on that frame becomes a key: a new template is cut there when it is tracked anew."""
    at = np.flatnonzero(track.frames == frame)
    if not len(at):
        raise UserError(f"Track {track.name} is not seen on frame {frame}; choose a frame where it is.")
    x, y = track.points[at[0]]
    return key_track(track, frame, (float(x), float(y)))


def reproject_track(track: Track, plane: PlaneTrack) -> Track:
    """The track filled where it was not seen and its plane was: carried by the plane from the nearest frame of both.

    What is carried is as unsure as where it starts and, twice, as the plane; its score is that of the plane.
    """
    rows = np.flatnonzero(np.isin(track.frames, plane.frames))
    if track.plate_id != plane.plate_id or not len(rows):
        raise UserError(f"Track {track.name} and plane {plane.name} share no frame; choose two that are seen together.")
    missing = plane.frames[~np.isin(plane.frames, track.frames)]
    if not len(missing):
        return track
    shared = track.frames[rows]
    start = rows[np.abs(shared[None] - missing[:, None]).argmin(axis=1)]
    to, off = np.searchsorted(plane.frames, missing), np.searchsorted(plane.frames, track.frames[start])
    matrix = plane.homographies[to] @ np.linalg.inv(plane.homographies[off])
    there = np.einsum("nij,nj->ni", matrix, np.column_stack((track.points[start], np.ones(len(start)))))
    variance = np.stack((plane.error[to] ** 2 + plane.error[off] ** 2,) * 3, axis=1) * [1.0, 0.0, 1.0]
    added = {
        "frames": missing, "points": there[:, :2] / there[:, 2:], "covariance": track.covariance[start] + variance,
        "own": variance + HAND * np.array([1.0, 0.0, 1.0]), "score": plane.score[to],
    }  # fmt: skip
    order = np.argsort(np.concatenate((track.frames, missing)), kind="stable")
    changed = {name: freeze(np.concatenate((getattr(track, name), value))[order]) for name, value in added.items()}
    return track.replace(**changed)


def _part(track: Track, rows: NDArray[np.bool_]) -> Track:
    changed = {name: freeze(getattr(track, name)[rows].copy()) for name in COLUMNS}
    keys = track.keys[np.isin(track.keys[:, 0], changed["frames"])]
    if not len(keys):
        keys = _as_key(changed["frames"], changed["points"])
    return track.replace(keys=freeze(keys), **changed)


def _as_key(frames: NDArray[np.int32], points: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([[frames[0], *points[0]]], np.float64)


def _full(packed: NDArray[np.float64]) -> NDArray[np.float64]:
    return packed[:, [0, 1, 1, 2]].reshape(-1, 2, 2)


def _packed(full: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.ascontiguousarray(full.reshape(-1, 4)[:, [0, 1, 3]])
