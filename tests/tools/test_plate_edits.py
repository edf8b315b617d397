"""Edits of a plate: what is refused, and what stays as it was."""

import numpy as np
import pytest

from core.document import Document
from core.errors import UserError
from core.image.plate import Plate
from core.match.track import keyed_track
from tools.match_edits import add_plate, add_tracks
from tools.plate_edits import set_plate

FILM = Plate(id=1, name="shot", path="shot.####.png", first=1, last=9, width=200, height=100)


def test_a_plate_is_cropped_before_it_is_tracked_and_not_under_its_tracks():
    empty = add_plate(Document(), FILM)
    plate_id = empty.plates[0].id
    cropped = set_plate(empty, plate_id, crop=(10, 0, 4, 2))
    assert cropped.plates[0].crop == (10, 0, 4, 2)
    tracked = add_tracks(cropped, (keyed_track(1, "nose", np.array([[1, 50.0, 40.0]])),), plate_id)
    with pytest.raises(UserError, match=r"nose.*crop it before"):
        set_plate(tracked, plate_id, crop=(0, 0, 0, 0))
    same = set_plate(tracked, plate_id, crop=(10, 0, 4, 2), pixel_aspect=2.0)
    assert same.plates[0].pixel_aspect == 2.0
    assert same.tracks is tracked.tracks


@pytest.mark.parametrize("crop", [(200, 0, 0, 0), (100, 0, 100, 0), (-1, 0, 0, 0), (0, 50, 0, 50)])
def test_a_crop_that_leaves_nothing_is_refused(crop):
    document = add_plate(Document(), FILM)
    with pytest.raises(UserError, match="crop"):
        set_plate(document, document.plates[0].id, crop=crop)
