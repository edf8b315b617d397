"""What following a track in one direction works on, and how what was found joins what there was."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from core.errors import UserError
from core.match.track import Track
from core.record import freeze

Way = Literal["forward", "backward", "next", "previous", "between", "both"]
WAYS: tuple[Way, ...] = ("forward", "backward", "next", "previous", "between", "both")
COLUMNS = ("frames", "points", "covariance", "own", "score")
NOT_FOLLOWED = "track {} was not followed: its pattern shows too little beside noise, or one edge only; take a corner"


class Stretch(NamedTuple):
    """frames : that are looked at. made : those among them whose points are made anew. task : the track with the keys
    that are followed, and nothing else."""

    frames: range
    made: range
    task: Track


def stretch_of(track: Track, frame: int, way: Way, there: range) -> Stretch:
    """What following a track from a frame means. Patterns are always those of keys, so nothing drifts by chaining.

    Parameters
    ----------
    frame : as files count. there : the frames of the plate.
    way : forward from the key at or before the frame, backward from that at or after it, one frame on or back,
        between the keys about the frame, or both ways from every key.

    Raises
    ------
    UserError
        There is no key to begin at, or no frame to go to.
    """
    given = track.keys[(track.keys[:, 0] >= there[0]) & (track.keys[:, 0] <= there[-1])]
    keys = given[:, 0].astype(np.int64)
    before, after = keys[keys <= frame], keys[keys >= frame]
    last, first = there[-1], there[0]
    if way == "both":
        frames = made = there
    elif way in ("forward", "next"):
        if not len(before):
            raise UserError(f"Track {track.name} has no key at or before frame {frame}; set its place here first.")
        if frame >= last:
            raise UserError(f"Frame {frame} is the last of the plate; go back to track forward.")
        end = last if way == "forward" else frame + 1
        frames, made = range(int(before[-1]), end + 1), range(frame + 1, end + 1)
    elif way in ("backward", "previous"):
        if not len(after):
            raise UserError(f"Track {track.name} has no key at or after frame {frame}; set its place here first.")
        if frame <= first:
            raise UserError(f"Frame {frame} is the first of the plate; go on to track backward.")
        end = first if way == "backward" else frame - 1
        frames, made = range(end, int(after[0]) + 1), range(end, frame)
    else:
        behind = keys[keys < frame] if len(keys[keys > frame]) == 0 else before
        beyond = keys[keys > (behind[-1] if len(behind) else frame)]
        if not len(behind) or not len(beyond):
            raise UserError(f"Track {track.name} has no two keys about frame {frame}; set its place on another frame.")
        frames = range(int(behind[-1]), int(beyond[0]) + 1)
        made = frames
    inside = given[(keys >= frames[0]) & (keys <= frames[-1])]
    if not len(inside):
        raise UserError(f"Track {track.name} has no key on the frames of the plate; set its place here first.")
    return Stretch(frames, made, track.replace(keys=freeze(inside.copy())))


def with_found(track: Track, found: Track, made: range) -> Track:
    """The track with what was found on the frames `made`, its own points on all others."""
    old = (track.frames < made[0]) | (track.frames > made[-1])
    new = (found.frames >= made[0]) & (found.frames <= made[-1])
    columns = {
        name: np.concatenate((getattr(track, name)[old], getattr(found, name)[new])) for name in COLUMNS
    }
    order = np.argsort(columns["frames"], kind="stable")
    return track.replace(**{name: freeze(np.ascontiguousarray(value[order])) for name, value in columns.items()})
