"""Tracking through a plate: sweeps forward and back, keys joined in between, frames told as they are made."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.match.features import find_features
from core.match.join import Piece, join_pieces
from core.match.runs import Ranges, Runs
from core.match.track import Track, TrackSettings, keyed_track
from core.workers import serial_ranges

Image = NDArray[np.float32]
Mask = NDArray[np.bool_]
REFILL = 8  # frames between looks for new features
SCARCE = 0.8  # of the features that are wanted: when fewer are left, new ones are looked for at once


class Step(NamedTuple):
    """One frame of one sweep. tracks : ids; the other arrays have a row for each, see ``Track``."""

    frame: int
    done: int
    total: int
    tracks: NDArray[np.int64]
    points: NDArray[np.float64]
    covariance: NDArray[np.float64]
    score: NDArray[np.float64]


class Start(NamedTuple):
    """A key that is to be followed from its frame to the frame `stop`."""

    track_id: int
    point: tuple[float, float]
    stop: int


class Tracking:
    """Tracks points through a plate: iterate :meth:`steps` (leave off to cancel), then take :meth:`tracks`.

    read : gives the frame that tracking looks at (H, W, C) float32, or None for a missing or broken one.
    frames : to be looked at. tracks : with their keys; what they hold beside keys is made anew.
    auto : how many features the finder keeps alive. hold : gives what tracks must not look at, (H, W) True, or None.
    """

    def __init__(
        self,
        read: Callable[[int], Image | None],
        frames: range,
        tracks: tuple[Track, ...] = (),
        settings: TrackSettings | None = None,
        *,
        auto: int = 0,
        ranges: Ranges = serial_ranges,
        hold: Callable[[int], Mask | None] | None = None,
    ) -> None:
        self.settings = settings if settings is not None else TrackSettings()
        self.observations = 0
        self._read, self._frames, self._auto, self._ranges = read, frames, auto, ranges
        self._hold = hold if hold is not None else _nothing_held
        self._given = list(tracks)
        self._pieces: dict[int, list[Piece]] = {track.id: [] for track in tracks}
        self._features: set[int] = set()

    def steps(self) -> Iterator[Step]:
        """Frames as they are made, forward then backward."""
        for direction in (1, -1):
            yield from self._sweep(direction)

    def tracks(self) -> tuple[Track, ...]:
        """What has been tracked so far. Features that were never seen again are no tracks."""
        made = [join_pieces(track, self._pieces[track.id]) for track in self._given]
        return tuple(track for track in made if len(track.frames) > 1 or track.id not in self._features)

    def _sweep(self, direction: int) -> Iterator[Step]:
        starts = self._starts(direction)
        finding = self._auto if direction > 0 else 0
        runs: Runs | None = None
        owners: list[Piece] = []
        for n, frame in enumerate(self._frames[::direction]):
            alive = runs is not None and bool(runs.alive.any())
            if not (alive or frame in starts or finding):
                if not starts:
                    return
                continue
            image, seen = self._read(frame), None
            if image is None:
                if runs is not None:
                    runs.miss()
                continue
            runs = Runs(self.settings, image.shape[2], self._ranges) if runs is None else runs
            hold = self._hold(frame)
            seen = runs.step(image, hold)
            self.observations += len(seen.rows)
            for row, *numbers in zip(*seen, strict=True):
                owners[row].add(frame, *numbers)
            runs.alive[runs.stop == frame] = False
            begin = starts.pop(frame, [])
            last = frame == self._frames[-1] and n > 0
            if finding and not last and (n % REFILL == 0 or runs.alive.sum() < SCARCE * finding):
                begin += self._found(image, frame, runs, hold)
            if begin:
                stops = np.array([start.stop for start in begin], np.int64)
                rows = runs.begin(image, np.array([start.point for start in begin]), stops, hold)
                for start, row in zip(begin, rows, strict=True):
                    owners.append(Piece(start.track_id, frame, direction, runs.shared[row].copy()))
                    self._pieces[start.track_id].append(owners[-1])
            ids = np.array([owners[row].track_id for row in seen.rows], np.int64)
            done = n + 1 + (0 if direction > 0 else len(self._frames))
            yield Step(frame, done, 2 * len(self._frames), ids, seen.points, seen.covariance, seen.score)

    def _starts(self, direction: int) -> dict[int, list[Start]]:
        """The keys to follow, by frame: to the next key of their track, or to the end of the plate."""
        starts: dict[int, list[Start]] = {}
        for track in self._given:
            keys = [key for key in track.keys[::direction] if int(key[0]) in self._frames]
            ends = [int(key[0]) for key in keys[1:]] + [self._frames[::direction][-1]]
            for (frame, x, y), end in zip(keys, ends, strict=True):
                if end != int(frame):
                    starts.setdefault(int(frame), []).append(Start(track.id, (x, y), end))
        return starts

    def _found(self, image: Image, frame: int, runs: Runs, hold: Mask | None) -> list[Start]:
        """New features in place of tracks that ended."""
        taken = runs.warp[runs.alive, :2]
        points = find_features(image, self._auto - len(taken), self.settings.pattern, taken, hold)
        starts = []
        for x, y in points:
            track_id = max(self._pieces, default=0) + 1
            self._features.add(track_id)
            self._given.append(keyed_track(track_id, f"auto{track_id:04d}", np.array([[frame, x, y]])))
            self._pieces[track_id] = []
            starts.append(Start(track_id, (x, y), self._frames[-1]))
        return starts


def _nothing_held(frame: int) -> Mask | None:
    return None
