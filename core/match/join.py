"""One track out of pieces: each key followed forward and back; between two keys both, blended by how sure they are."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from core.match.track import HAND, Track
from core.record import freeze


class Piece:
    """What following one key in one direction gave, frame by frame.

    shared : covariance (3,) of the template's place at the key.
    """

    def __init__(self, track_id: int, key: int, direction: int, shared: NDArray[np.float64]) -> None:
        self.track_id, self.key, self.direction, self.shared = track_id, key, direction, shared
        self.frames: list[int] = []
        self._rows: list[NDArray[np.float64]] = []

    def add(
        self,
        frame: int,
        point: NDArray[np.float64],
        covariance: NDArray[np.float64],
        own: NDArray[np.float64],
        score: float,
    ) -> None:
        self.frames.append(frame)
        self._rows.append(np.concatenate((point, covariance, own, [score])))

    def rows(self) -> dict[int, NDArray[np.float64]]:
        """x, y, covariance (3), own (3), score by frame."""
        return dict(zip(self.frames, self._rows, strict=True))


def join_pieces(track: Track, pieces: list[Piece]) -> Track:
    """The track with what its pieces found; its keys stay exactly where they are."""
    made: dict[int, NDArray[np.float64]] = {}
    keys = {int(frame): point for frame, *point in track.keys}
    by_key = {(piece.key, piece.direction): piece for piece in pieces}
    order = sorted(keys)
    for piece in pieces:
        ends = [key for key in order if (key - piece.key) * piece.direction > 0]
        if not ends:
            made.update(piece.rows())
    for first, last in pairwise(order):
        made.update(between(first, last, keys, by_key.get((first, 1)), by_key.get((last, -1))))
    for frame, point in keys.items():
        # what a template is off by stands on the frame it was cut from
        cut = [piece.shared for piece in pieces if piece.key == frame]
        own = np.mean(cut, axis=0) if cut else np.zeros(3)
        made[frame] = np.array([*point, HAND, 0.0, HAND, own[0] + HAND, own[1], own[2] + HAND, 1.0])
    frames = np.array(sorted(made), np.int32)
    rows = np.array([made[int(frame)] for frame in frames]).reshape(-1, 9)
    return track.replace(
        frames=freeze(frames),
        points=freeze(rows[:, :2].copy()),
        covariance=freeze(rows[:, 2:5].copy()),
        own=freeze(rows[:, 5:8].copy()),
        score=freeze(rows[:, 8].copy()),
    )


def between(
    first: int, last: int, keys: dict[int, list[float]], forward: Piece | None, backward: Piece | None
) -> dict[int, NDArray[np.float64]]:
    """Frames from one key to the next. Where one misses the other's key, it is trusted less the further it went.

    One that was lost on the way is no better than the other: what that misses by is held against both.
    """
    ahead = forward.rows() if forward is not None else {}
    back = backward.rows() if backward is not None else {}
    missed = [_drift(ahead.get(last), keys[last]), _drift(back.get(first), keys[first])]
    most = max((gap for gap in missed if gap is not None), default=0.0)
    drift = [most if gap is None else gap for gap in missed]
    made = {}
    for frame in range(first + 1, last):
        way = (frame - first) / (last - first)
        a, b = ahead.get(frame), back.get(frame)
        sides = [
            _weakened(row, gap * part**2)
            for row, gap, part in ((a, drift[0], way), (b, drift[1], 1.0 - way))
            if row is not None
        ]
        if len(sides) == 2:
            made[frame] = _blend(*sides)
        elif sides:
            made[frame] = sides[0]
    return made


def _drift(arrived: NDArray[np.float64] | None, key: list[float]) -> float | None:
    """Variance in px^2 that a piece missed the other key by beyond what it foretold; None when it never came there."""
    if arrived is None:
        return None
    return max(0.0, float(((arrived[:2] - key) ** 2).sum()) / 2.0 - (arrived[2] + arrived[4]) / 2.0)


def _weakened(row: NDArray[np.float64], variance: float) -> NDArray[np.float64]:
    out = row.copy()
    out[[2, 4]] += variance
    return out


def _blend(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Both sides weighted by the inverse of their covariances. They share the frame's own noise: it stays whole."""
    ca, cb = (row[[2, 3, 3, 4]].reshape(2, 2) for row in (a, b))
    wa = cb @ np.linalg.inv(ca + cb)
    wb = np.eye(2) - wa
    mean_own = 0.5 * (a[5:8] + b[5:8])
    own = mean_own[[0, 1, 1, 2]].reshape(2, 2)
    rest_a, rest_b = ca - a[[5, 6, 6, 7]].reshape(2, 2), cb - b[[5, 6, 6, 7]].reshape(2, 2)
    full = own + wa @ rest_a @ wa.T + wb @ rest_b @ wb.T
    point = wa @ a[:2] + wb @ b[:2]
    return np.array([*point, full[0, 0], full[0, 1], full[1, 1], *mean_own, min(a[8], b[8])])
