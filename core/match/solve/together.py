"""A plate solved together with pictures of other cameras: photographs of the set, and witnesses that filmed it too.

What is seen in both is told by name. A witness need not run in step with the plate: the scene stands still.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.solve.floor import noise_floor
from core.match.solve.observed import observations_of
from core.match.solve.problem import FLOOR
from core.match.solve.state import Observations, Rows
from core.match.solve.views import Camera, Views, one_shot
from core.match.track import Track

MOST = 24  # pictures of one witness; more of them say little more


class Pictures(NamedTuple):
    """What another camera saw. tracks : named as those of the plate, their frames are numbers of its pictures.

    pictures : names of them, where they have any. sigma : (tracks,) pixels, how well each was picked; None where the
    tracks tell it themselves.
    """

    name: str
    camera: Camera
    tracks: tuple[Track, ...]
    pictures: Mapping[int, str] | None = None
    sigma: NDArray[np.float64] | None = None


class Together(NamedTuple):
    """What :func:`core.match.solve.solve.solve` is given: frames (F,) rise, those of other cameras after the plate's.

    names : of the tracks. said : what each frame is called.
    """

    observations: Observations
    frames: Rows
    names: list[str]
    views: Views
    said: list[str]


def together(tracks: Sequence[Track], size: tuple[int, int], others: Sequence[Pictures]) -> Together:
    """The plate's tracks with what other cameras saw.

    Raises
    ------
    UserError
        Two tracks have one name, or another camera sees hardly anything of what the plate does.
    """
    observations, frames = observations_of(tracks)
    names, said = [track.name for track in tracks], [f"frame {number}" for number in frames]
    views = one_shot(len(frames), Camera(size))
    if not others:
        return Together(observations, frames, names, views, said)
    noise = _noise(observations, len(frames))
    parts, alone, cameras = [observations], [views.alone], [views.camera]
    for number, other in enumerate(others, 1):
        rows = _rows_of(names, other)
        seen, own = _evenly(*observations_of(other.tracks))
        if other.sigma is None:
            root = seen.root * (noise / _noise(seen, len(own)))
        else:
            root = (noise / other.sigma[seen.track])[:, None] * [1.0, 0.0, 1.0]
        parts.append(Observations((seen.frame + len(said)).astype(np.int32), rows[seen.track], seen.xy, root))
        alone.append(np.ones(len(own), bool))
        cameras.append(np.full(len(own), number, np.int32))
        said += [f"{other.name} {(other.pictures or {}).get(int(k), str(k))}" for k in own]
    numbers = np.arange(1, len(said) - len(frames) + 1) + frames[-1]
    return Together(
        Observations(*(np.ascontiguousarray(np.concatenate(column)) for column in zip(*parts, strict=True))),
        np.concatenate([frames, numbers]).astype(np.int32), names,
        Views(np.concatenate(alone), np.concatenate(cameras), (Camera(size), *(other.camera for other in others))),
        said,
    )


def _noise(observations: Observations, frames: int) -> float:
    """Standard deviation of the whitened tracks."""
    return (noise_floor(observations, frames) or FLOOR) * float(np.median(observations.root[:, 0]))


def _rows_of(names: list[str], other: Pictures) -> Rows:
    """Rows of the tracks of another camera; `names` grows by those the plate does not have."""
    row = {name: k for k, name in enumerate(names)}
    twice = next((name for k, name in enumerate(names) if row[name] != k), None)
    if twice is not None:
        raise UserError(f"Two tracks of the plate are called {twice}; what other cameras saw is found by name.")
    if sum(track.name in row for track in other.tracks) < 3:
        raise UserError(
            f"{other.name} sees fewer than three of the plate's tracks; call what is seen in both by the same name.")
    for track in other.tracks:
        if track.name not in row:
            row[track.name] = len(names)
            names.append(track.name)
    return np.array([row[track.name] for track in other.tracks], np.int32)


def _evenly(seen: Observations, frames: Rows) -> tuple[Observations, Rows]:
    """At most `MOST` of the frames."""
    if len(frames) <= MOST:
        return seen, frames
    kept = np.unique(np.linspace(0, len(frames) - 1, MOST).round().astype(int))
    number = np.full(len(frames), -1, np.int32)
    number[kept] = np.arange(len(kept))
    part = seen.take(number[seen.frame] >= 0)
    return part._replace(frame=number[part.frame]), frames[kept]
