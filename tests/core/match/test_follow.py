"""Which frames following a track looks at, and that only what was asked for is made anew."""

import numpy as np
import pytest

from core.errors import UserError
from core.match.follow import WAYS, stretch_of, with_found
from core.match.track import keyed_track

THERE = range(1, 101)
TRACK = keyed_track(3, "t", np.array([[20.0, 5.0, 6.0], [60.0, 7.0, 8.0]]))


@pytest.mark.parametrize(("frame", "way", "frames", "made", "keys"), [
    (30, "forward", range(20, 101), range(31, 101), [20, 60]), (60, "forward", range(60, 101), range(61, 101), [60]),
    (30, "backward", range(1, 61), range(1, 30), [20, 60]), (20, "backward", range(1, 21), range(1, 20), [20]),
    (25, "next", range(20, 27), range(26, 27), [20]), (58, "previous", range(57, 61), range(57, 58), [60]),
    (30, "between", range(20, 61), range(20, 61), [20, 60]), (20, "between", range(20, 61), range(20, 61), [20, 60]),
    (60, "between", range(20, 61), range(20, 61), [20, 60]), (1, "both", THERE, THERE, [20, 60]),
])
def test_a_way_is_a_stretch_of_frames_between_keys(frame, way, frames, made, keys):
    found = stretch_of(TRACK, frame, way, THERE)
    assert (found.frames, found.made) == (frames, made)
    assert found.task.keys[:, 0].tolist() == keys


@pytest.mark.parametrize(("frame", "way"), [
    (10, "forward"), (70, "backward"), (100, "forward"), (1, "backward"), (10, "between"), (61, "between")])
def test_a_way_without_a_beginning_says_what_to_do(frame, way):
    with pytest.raises(UserError, match=r"first|back|on"):
        stretch_of(TRACK, frame, way, THERE)


def test_a_track_without_keys_on_the_plate_is_refused_in_every_way():
    for way in WAYS:
        with pytest.raises(UserError):
            stretch_of(TRACK, 205, way, range(200, 211))


def test_frames_that_were_not_asked_for_stay():
    points = np.arange(20.0).reshape(10, 2)
    old = keyed_track(3, "t", np.column_stack((np.arange(1.0, 11.0), points)))
    new = keyed_track(3, "t", np.column_stack((np.arange(4.0, 9.0), points[:5] + 100.0)))
    joined = with_found(old, new, range(5, 8))
    assert joined.frames.tolist() == list(range(1, 11))
    assert (joined.points[[0, 1, 2, 3, 7, 8, 9]] == points[[0, 1, 2, 3, 7, 8, 9]]).all()
    assert (joined.points[4:7] == points[1:4] + 100.0).all()
    assert joined.keys is old.keys
    lost = with_found(old, new, range(5, 11))
    assert lost.frames.tolist() == [1, 2, 3, 4, 5, 6, 7, 8], "what was not found again is gone"
