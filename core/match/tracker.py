"""Tracking through a plate: sweeps forward and back, keys joined in between, frames told as they are made."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.match.features import find_features
from core.match.join import Piece, join_pieces
from core.match.runs import Ranges, Runs, Seen, Shape
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
    offset: tuple[float, float] = (0.0, 0.0)
    shape: Shape = None


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
        made = [
            join_pieces(track, self._pieces[track.id]) if _keyed_on(track, self._frames) else track
            for track in self._given
        ]
        return tuple(track for track in made if len(track.frames) > 1 or track.id not in self._features)

    def _sweep(self, direction: int) -> Iterator[Step]:
        starts = self._starts(direction)
        finding = self._auto if direction > 0 else 0
        groups: dict[tuple[object, ...], _Group] = {}  # tracks of the same settings
        shape: tuple[int, ...] | None = None  # of the frames; one of another size shows another picture
        for n, frame in enumerate(self._frames[::direction]):
            alive = any(group.runs.alive.any() for group in groups.values())
            if not (alive or frame in starts or finding):
                if not starts:
                    return
                continue
            image = self._read(frame)
            shape = shape if shape is not None or image is None else image.shape
            if image is None or image.shape != shape:
                for group in groups.values():
                    group.runs.miss()
                continue
            hold = self._hold(frame)
            seen = [group.step(frame, image, hold) for group in groups.values()]
            self.observations += sum(len(one.rows) for _, one in seen)
            begin = starts.pop(frame, [])
            last = frame == self._frames[-1] and n > 0
            living = [group.runs.warp[group.runs.alive, :2] for group in groups.values()]
            taken = np.concatenate([np.zeros((0, 2)), *living])
            if finding and not last and (n % REFILL == 0 or len(taken) < SCARCE * finding):
                begin += self._found(image, frame, taken, hold)
            for settings, some in self._by_settings(begin).values():
                key = msgspec.structs.astuple(settings)
                if key not in groups:
                    groups[key] = _Group(Runs(settings, image.shape[2], self._ranges), direction)
                for piece in groups[key].begin(frame, image, some, hold):
                    self._pieces[piece.track_id].append(piece)
            done = n + 1 + (0 if direction > 0 else len(self._frames))
            yield _told(frame, done, 2 * len(self._frames), seen)

    def _by_settings(self, starts: list[Start]) -> dict[tuple[object, ...], tuple[TrackSettings, list[Start]]]:
        own = {track.id: track.settings or self.settings for track in self._given}
        out: dict[tuple[object, ...], tuple[TrackSettings, list[Start]]] = {}
        for start in starts:
            settings = own[start.track_id]
            out.setdefault(msgspec.structs.astuple(settings), (settings, []))[1].append(start)
        return out

    def _starts(self, direction: int) -> dict[int, list[Start]]:
        """The keys to follow, by frame: to the next key of their track, or to the end of the plate."""
        starts: dict[int, list[Start]] = {}
        for track in self._given:
            if not _keyed_on(track, self._frames):
                continue
            keys = [key for key in track.keys[::direction] if int(key[0]) in self._frames]
            ends = [int(key[0]) for key in keys[1:]] + [self._frames[::direction][-1]]
            for (frame, x, y), end in zip(keys, ends, strict=True):
                if end != int(frame):
                    shape = None if track.shape is None else (track.shape, track.shape_smooth)
                    start = Start(track.id, (x, y), end, track.offset, shape)
                    starts.setdefault(int(frame), []).append(start)
        return starts

    def _found(self, image: Image, frame: int, taken: NDArray[np.float64], hold: Mask | None) -> list[Start]:
        """New features in place of tracks that ended, away from those at `taken` (N, 2)."""
        points = find_features(image, self._auto - len(taken), self.settings.pattern, taken, hold)
        starts = []
        for x, y in points:
            track_id = max(self._pieces, default=0) + 1
            self._features.add(track_id)
            self._given.append(keyed_track(track_id, f"auto{track_id:04d}", np.array([[frame, x, y]])))
            self._pieces[track_id] = []
            starts.append(Start(track_id, (x, y), self._frames[-1]))
        return starts


class _Group:
    """Runs of the same settings in one sweep, and the pieces of tracks that they make."""

    def __init__(self, runs: Runs, direction: int) -> None:
        self.runs, self._direction = runs, direction
        self._pieces: list[Piece] = []  # of every row

    def step(self, frame: int, image: Image, hold: Mask | None) -> tuple[list[int], Seen]:
        """The next frame: ids of the tracks that were seen, and what was."""
        seen = self.runs.step(image, hold)
        for row, *numbers in zip(*seen, strict=True):
            self._pieces[row].add(frame, *numbers)
        self.runs.alive[self.runs.stop == frame] = False
        return [self._pieces[row].track_id for row in seen.rows], seen

    def begin(self, frame: int, image: Image, starts: list[Start], hold: Mask | None) -> list[Piece]:
        rows = self.runs.begin(
            image,
            np.array([start.point for start in starts]),
            np.array([start.stop for start in starts], np.int64),
            hold,
            np.array([start.offset for start in starts]),
            [start.shape for start in starts],
        )
        made = [
            Piece(start.track_id, frame, self._direction, self.runs.shared[row].copy())
            for start, row in zip(starts, rows, strict=True)
        ]
        self._pieces += made
        return made


def _told(frame: int, done: int, total: int, seen: list[tuple[list[int], Seen]]) -> Step:
    ids = np.array([track_id for some, _ in seen for track_id in some], np.int64)
    if not seen:
        return Step(frame, done, total, ids, np.zeros((0, 2)), np.zeros((0, 3)), np.zeros(0))
    points, covariance, score = (
        np.concatenate([getattr(one, name) for _, one in seen]) for name in ("points", "covariance", "score")
    )
    return Step(frame, done, total, ids, points, covariance, score)


def _keyed_on(track: Track, frames: range) -> bool:
    """Whether a track has a key to be followed from; without one it stays as it is."""
    return any(int(frame) in frames for frame in track.keys[:, 0])


def _nothing_held(frame: int) -> Mask | None:
    return None
