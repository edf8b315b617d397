"""Picks in photographs, without a window: what strokes make, and that cameras and model follow a pick in the hand."""

import numpy as np
import pytest

from core.document import Document
from core.errors import UserError
from core.image.plate import Plate
from core.image.plate_view import plate_camera, view_points
from core.match.photomodel.build import built
from core.match.photomodel.rows import seen_by
from core.match.photomodel.solve import solved
from core.workspace import Workspace
from tests.core.match.photomodel.scenes import HOUSE, PHOTOS, SIZE, edge_errors, house, places
from tools import photomodel_edits as edits
from tools.ground import Pointer, Sight
from tools.match_edits import add_plate
from tools.registry import Registry
from tools.session import Session

VIEW = (1500, 1000)
CAMERA = plate_camera(1500.0, -1000.0, 2000.0)  # half a pixel of the view for one of the photograph
SIGHT = Sight(CAMERA, *VIEW)
REGISTRY = Registry(())
PLATE = Plate(id=1, name="house", path="house.#.jpg", first=1, last=3, width=SIZE[0], height=SIZE[1])


def begun(model=None):
    document = add_plate(Document(), PLATE)
    if model is not None:
        photos = tuple(one.replace(plate_id=1, frame=one.id) for one in model.photos)
        document = document.replace(photomodels=(model.replace(photos=photos),))
    return Session(document, Workspace(craft="match", tool="pick_point", frame=1.0), tools=REGISTRY)


def drag(session, tool, xy, frame, **params):
    """Drag through places of a photograph."""
    session.choose(tool, **params)
    session.set_workspace(frame=float(frame))
    pixels = view_points(CAMERA, 1.0, xy, *VIEW)
    session.hand.stroke(SIGHT, tuple(Pointer(float(x), float(y), time=0.1 * n) for n, (x, y) in enumerate(pixels)))
    return session.document.photomodels[-1]


def test_a_house_is_picked_in_three_photographs_solved_and_built():
    session = begun()
    session.edit("Take photographs", edits.take_photographs)
    assert [(p.plate_id, p.frame) for p in session.document.photomodels[0].photos] == [(1, 1), (1, 2), (1, 3)]
    for place in HOUSE:
        session.edit("Select points", edits.select_points, ())
        for frame, photo in enumerate(PHOTOS, 1):
            model = drag(session, "pick_point", seen_by(photo, place[None])[0], frame)
    assert [point.picks.photo.tolist() for point in model.points] == [[1, 2, 3]] * len(HOUSE)
    assert session.history.undo_name == "Pick point"
    session.edit("Solve", edits.put_model, solved(model).model)
    assert np.abs(edge_errors(session.document.photomodels[0])).max() < 1e-4
    session.edit("Select points", edits.select_points, (1, 2, 4, 5))
    session.edit("Build box", edits.add_part, "box")
    assert len(built(session.document.photomodels[0]).counts) == 6
    session.edit("Select points", edits.select_points, (1, 2))
    session.edit("Distance", edits.add_known, "distance", (4.0,))
    there = places(session.document.photomodels[0])
    assert np.linalg.norm(there[1] - there[0]) == pytest.approx(4.0, rel=1e-3)
    session.edit("Origin", edits.set_world, "distance", 8.0)


def test_a_pick_in_the_hand_moves_cameras_and_model_and_undo_brings_them_back():
    session = begun(solved(house(0, noise=0.0)).model)
    before = session.document.photomodels[0]
    start = before.points[3].picks.xy[1]
    by = np.array([20.0, -10.0])
    after = drag(session, "pick_point", [start, start + 0.4 * by, start + by], 2)
    np.testing.assert_allclose(after.points[3].picks.xy[1], start + by, atol=1e-9)
    assert session.history.undo_name == "Move pick"
    assert after.selection == (4,)
    assert not np.allclose(after.photos[1].translation, before.photos[1].translation, atol=1e-6)
    assert not np.allclose(places(after)[3], places(before)[3], atol=1e-4)
    session.undo()
    assert session.document.photomodels[0] is before


def test_a_point_has_its_place_with_the_second_pick_and_is_foretold_in_the_third():
    model = solved(house(0, noise=0.0)).model
    session = begun(model.replace(points=model.points[:11]))
    true = model.points[11].picks.xy
    drag(session, "pick_point", true[:1], 1)
    assert session.document.photomodels[0].points[-1].place is None
    model = drag(session, "pick_point", true[2:3], 3)
    assert model.points[-1].picks.photo.tolist() == [1, 3]
    there, _ = seen_by(model.photos[1], np.array([model.points[-1].place]))
    np.testing.assert_allclose(there[0], true[1], atol=0.05)
    assert edits.walk(session.document, 1, 3, 1).frame == 2


def test_edges_and_circles_are_picked_where_nothing_ends():
    session = begun(solved(house(0, noise=0.0)).model)
    with pytest.raises(UserError, match="two ends"):
        drag(session, "pick_edge", [[1500.0, 900.0]], 2)
    session.edit("Select points", edits.select_points, (9, 10))
    ends = HOUSE[[8, 9]]
    for frame, photo in enumerate(PHOTOS, 1):
        model = drag(session, "pick_edge", seen_by(photo, ends.mean(axis=0)[None])[0], frame)
    (line,) = model.lines
    assert (line.points, line.picks.photo.tolist()) == ((9, 10), [1, 2, 3])
    for frame, photo in enumerate(PHOTOS[:2], 1):
        for a in (0.3, 1.7, 3.0, 4.5):
            place = np.array([2 + 0.7 * np.cos(a), 2.2 + 0.7 * np.sin(a), 0.0])
            model = drag(session, "pick_circle", seen_by(photo, place[None])[0], frame)
    (circle,) = model.circles
    edge = np.linalg.norm(places(model)[1] - places(model)[0])
    assert circle.radius / edge == pytest.approx(0.7 / 4.0, rel=1e-3)


def test_deleting_a_point_takes_what_stands_on_it():
    session = begun(solved(house(0)).model)
    session.edit("Select points", edits.select_points, (1, 2, 6, 5))
    session.edit("Known", edits.add_known, "plane")
    session.edit("Build", edits.add_part, "polygon")
    session.edit("Build", edits.add_part, "extrude", (0.5,))
    assert [part.kind for part in session.document.photomodels[0].parts] == ["polygon", "extrude"]
    session.edit("Select points", edits.select_points, (6,))
    session.edit("Delete points", edits.delete_points)
    model = session.document.photomodels[0]
    assert (len(model.points), model.known, model.parts) == (len(HOUSE) - 1, (), ())
    with pytest.raises(UserError, match="Select 2 points for distance"):
        edits.add_known(session.document, "distance", (1.0,))


def test_edges_drawn_along_axes_give_one_photograph_its_camera_which_follows_their_ends():
    session = begun()
    one = PHOTOS[0]
    for pair, axis in (((0, 1), "x"), ((4, 5), "x"), ((0, 3), "z"), ((4, 7), "z")):
        model = drag(session, "line_up_axis", seen_by(one, HOUSE[list(pair)])[0], 1, axis=axis, height=2.0)
        assert session.history.undo_name == "Line-up"
    (photo,) = model.photos
    assert photo.focal_px == pytest.approx(one.focal_px, rel=1e-3)
    np.testing.assert_allclose(photo.rotation, one.rotation, atol=1e-3)
    np.testing.assert_allclose(photo.translation, one.translation, rtol=0.02)
    with pytest.raises(UserError, match="Nothing is built"):
        built(model)
    end = model.points[1].picks.xy[0]
    after = drag(session, "pick_point", [end, end + np.array([0.0, 40.0])], 1)
    assert not np.allclose(after.photos[0].rotation, photo.rotation, atol=1e-3)
    session.undo()
    session.undo()
    assert session.document.photomodels[0].photos[0].rotation is None
