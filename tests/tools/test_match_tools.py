"""Strokes on a plate, without a window: what each tool makes, that a replay makes the same, and what is refused."""

import numpy as np
import pytest

from core.document import Document
from core.errors import UserError
from core.image.plate import Plate
from core.image.plate_view import plate_camera, view_points
from core.leaves import same_bits
from core.match.outline import filled, outline_at
from core.match.track import keyed_track
from core.workspace import Workspace
from tools import match_edits as edits
from tools.ground import Pointer, Sight
from tools.pen import PenSettings
from tools.registry import Registry
from tools.session import Session

SIZE = (800, 600)
PLATE = Plate(id=1, name="shot", path="shot.####.png", first=11, last=30, width=320, height=240, offset=990)
CAMERA = plate_camera(150.0, -110.0, 120.0)  # 5 pixels of the view for one of the plate
SIGHT = Sight(CAMERA, *SIZE)
REGISTRY = Registry(())


def begun(*tracks, **params):
    document = edits.put_tracks(edits.add_plate(Document(), PLATE), tracks)
    return Session(document, Workspace(craft="match", tool="track_point", frame=1005.0, params=params), tools=REGISTRY)


def drag(session, tool, places, **params):
    """Drag through places of the plate."""
    session.choose(tool, **params)
    pixels = view_points(CAMERA, 1.0, places, *SIZE)
    session.hand.stroke(SIGHT, tuple(Pointer(float(x), float(y), time=0.1 * n) for n, (x, y) in enumerate(pixels)))
    return session.document


def two():
    keys = np.array([[15.0, 140.0, 100.0], [16.0, 142.0, 101.0]])
    return keyed_track(1, "a", keys, 1), keyed_track(2, "b", keys + np.array([0.0, 20.0, 5.0]), 1)


def test_a_plate_brings_its_frames_and_takes_the_place_of_the_one_before():
    document = edits.add_plate(edits.add_plate(Document(), PLATE), PLATE.replace(name="other", offset=0))
    assert [(p.id, p.hidden) for p in document.plates] == [(1, True), (2, False)]
    assert (document.first_frame, document.last_frame) == (11, 30)
    back = edits.show_plate(document, 1)
    assert edits.shown_plate(back).name == "shot"
    with pytest.raises(UserError, match="no plate 7"):
        edits.show_plate(document, 7)


def test_a_click_places_a_track_where_it_was_made():
    session = begun()
    document = drag(session, "track_point", [[131.25, 97.5]], pattern=31)
    (track,) = document.tracks
    assert track.frames.tolist() == [15]
    assert np.allclose(track.points, [[131.25, 97.5]])
    assert (track.settings.pattern, track.plate_id, document.track_selection) == (31, 1, (track.id,))
    assert session.history.undo_name == "Track point"
    session.undo()
    assert session.document.tracks == ()


def test_a_drag_moves_a_track_and_a_click_only_selects_it():
    session = begun(*two())
    document = drag(session, "track_point", [[160.4, 105.0]])
    assert document.track_selection == (2,)
    assert session.history.undo_name == "Select track"
    assert document.tracks[0].points is two()[0].points or same_bits(document.tracks[0], two()[0])
    document = drag(session, "track_point", [[140.0, 100.0], [145.0, 103.0]])
    assert np.allclose(edits.place_at(document.tracks[0], 15), [145.0, 103.0])
    assert np.allclose(edits.place_at(document.tracks[0], 16), [142.0, 101.0])
    assert session.history.undo_name == "Move track"
    document = drag(session, "track_point", [[160.0, 105.0]], adds=True)
    assert document.track_selection == (1, 2)
    document = drag(session, "track_point", [[160.0, 105.0]], adds=True)
    assert document.track_selection == (1,)


def test_a_slow_drag_and_a_nudge_go_a_tenth_as_far():
    session = begun(*two())
    document = drag(session, "track_point", [[140.0, 100.0], [145.0, 103.0]], speed=0.1)
    assert np.allclose(edits.place_at(document.tracks[0], 15), [140.5, 100.3])
    document = drag(session, "nudge", [[20.0, 20.0], [30.0, 10.0]])
    assert np.allclose(edits.place_at(document.tracks[0], 15), [141.5, 99.3])
    assert np.allclose(edits.place_at(document.tracks[1], 15), [160.0, 105.0])


def test_a_box_is_a_pattern_about_its_middle():
    document = drag(begun(), "track_box", [[100.0, 80.0], [130.0, 100.0]])
    (track,) = document.tracks
    assert np.allclose(track.points, [[115.0, 90.0]])
    assert track.settings.pattern == 31


def test_a_mask_holds_off_what_was_drawn_around_and_its_points_move():
    turn = np.linspace(0.0, 2.0 * np.pi, 60)
    circle = np.stack((150.0 + 30.0 * np.cos(turn), 110.0 + 30.0 * np.sin(turn)), axis=1)
    session = begun()
    document = drag(session, "roto", circle)
    (mask,) = document.masks
    y, x = np.mgrid[0:240, 0:320]
    inside = np.hypot(x - 150.0, y - 110.0) < 30.0
    held = filled(outline_at(mask, 15), mask.smooth, 240, 320)
    assert (held ^ inside).sum() < 0.05 * inside.sum()
    session.set_workspace(frame=1010.0)
    corner = mask.points[0, 0]
    document = drag(session, "roto", [corner, corner + np.array([8.0, 2.0])])
    (moved,) = document.masks
    assert moved.frames.tolist() == [15, 20]
    assert np.allclose(outline_at(moved, 20)[0], corner + np.array([8.0, 2.0]))
    assert np.allclose(outline_at(moved, 15), mask.points[0])


def test_the_ruler_changes_nothing_and_says_how_far():
    session = begun(*two())
    before = session.document
    session.hand.pen = PenSettings(spikes=False, smoothing=0.0)
    session.choose("ruler")
    ends = view_points(CAMERA, 1.0, [[100.0, 100.0], [103.0, 104.0]], *SIZE)
    session.hand.press(SIGHT, Pointer(*map(float, ends[0])))
    session.hand.move((Pointer(*map(float, ends[1])),))
    words = " ".join(o.words for o in session.hand.hover(SIGHT, Pointer(*map(float, ends[1]))) if hasattr(o, "words"))
    session.hand.release()
    assert "5.00 px" in words
    assert session.document is before


def test_what_stands_in_the_way_is_said():
    locked = two()[0].replace(locked=True)
    with pytest.raises(UserError, match="locked"):
        drag(begun(locked), "track_point", [[140.0, 100.0], [150.0, 100.0]])
    with pytest.raises(UserError, match="inside"):
        drag(begun(), "track_point", [[-40.0, 100.0]])
    with pytest.raises(UserError, match="no plate"):
        drag(Session(Document(), tools=REGISTRY), "track_point", [[10.0, 10.0]])
    for tool in ("track_box", "roto", "nudge"):
        with pytest.raises(UserError):
            drag(begun(), tool, [[100.0, 100.0], [101.0, 100.0]])


def test_strokes_are_replayed_to_the_same_bits():
    session, records = begun(*two()), []
    session.hand.recorded = records.append
    drag(session, "track_point", [[140.0, 100.0], [145.3, 103.1]])
    drag(session, "track_box", [[100.0, 80.0], [130.0, 100.0]])
    again = begun(*two())
    again.set_workspace(frame=1002.0)
    for record in records:
        again.hand.replay(record)
    assert same_bits(again.document.tracks, session.document.tracks)


def test_edits_of_selected_tracks():
    document = edits.put_tracks(edits.add_plate(Document(), PLATE), two())
    assert [t.name for t in edits.split(document, (1,), 16).tracks] == ["a", "b", "ab"]
    joined = edits.join(document, (1, 2))
    assert [t.id for t in joined.tracks] == [1]
    assert np.allclose(joined.tracks[0].points, two()[0].points + np.array([10.0, 2.5]))
    mean = edits.average(document, (1, 2))
    assert len(mean.tracks) == 3
    assert mean.track_selection == (3,)
    keyed = edits.remove_keys(document, (1,), 15)
    assert keyed.tracks[0].keys[:, 0].tolist() == [16]
    assert keyed.tracks[0].frames.tolist() == [15, 16]
    assert edits.key(keyed, (1,), 15).tracks[0].keys[:, 0].tolist() == [15, 16]
    assert edits.clear(document, (2,), 15, after=True).tracks[1].frames.tolist() == [15]
    assert edits.clear(document, (2,), 16, after=False).tracks[1].frames.tolist() == [16]
    assert np.allclose(edits.nudge(document, (1,), 16, 0.1, -0.2).tracks[0].points[1], [142.1, 100.8])
    hidden = edits.set_tracks(document, (1,), hidden=True, locked=True)
    assert (hidden.tracks[0].hidden, hidden.tracks[0].locked, hidden.tracks[1].locked) == (True, True, False)
    with pytest.raises(UserError, match="locked"):
        edits.delete_tracks(hidden, (1, 2))
    assert edits.delete_tracks(document, (1,)).tracks == document.tracks[1:]
    with pytest.raises(UserError, match="only key"):
        edits.remove_keys(keyed, (1,), 16)
    with pytest.raises(UserError, match="Select two"):
        edits.join(document, (1,))
    with pytest.raises(UserError, match="No track"):
        edits.smooth(document, ())


def test_the_pattern_of_a_track_is_shaped_moved_aside_and_drawn():
    session = begun(*two())
    with pytest.raises(UserError, match="No track is selected"):
        drag(session, "track_pattern", [[140.0, 100.0], [150.0, 100.0]])
    session.edit("Select", edits.select_tracks, (1,))
    corner = np.array([140.0, 100.0]) + 10.5 * np.array([1.0, -1.0])
    (track, _) = drag(session, "track_pattern", [corner, corner + np.array([6.0, -4.0])]).tracks
    assert np.allclose(track.shape, [[-10.5, -10.5], [16.5, -14.5], [10.5, 10.5], [-10.5, 10.5]])
    assert track.settings.pattern >= 33
    (track, _) = drag(session, "track_pattern", [[140.0, 100.0], [152.0, 103.0]]).tracks
    assert track.offset == pytest.approx((12.0, 3.0))
    assert np.allclose(track.points[0], [140.0, 100.0]), "the point itself stays"
    angles = np.linspace(0.0, 2.0 * np.pi, 40)
    ring = np.array([205.0, 60.0]) + 12.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    (track, _) = drag(session, "track_pattern", ring).tracks
    assert track.shape_smooth
    assert track.offset == pytest.approx((65.0, -40.0), abs=1.0)
    assert np.hypot(*track.shape.T) == pytest.approx(np.full(len(track.shape), 12.0), abs=1.5)
    assert session.history.names[-3:] == ("Track pattern",) * 3
    session.set_workspace(frame=1007.0)
    with pytest.raises(UserError, match="no key here"):
        drag(session, "track_pattern", [[140.0, 100.0], [150.0, 100.0]])
