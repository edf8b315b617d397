"""Painting a map: what lies under the ring, on both sides, at rest and bent, and what it does to the coat."""

import numpy as np
import pytest

from core.camera import project
from core.document import find_groom
from core.errors import UserError
from core.formats.project import read_project
from core.groom.groom import Map
from core.groom.live_coat import places_of
from core.posed import skin_at
from core.record import freeze
from core.workspace import Respect
from tests.tools.scenes import BENT, EVALUATOR, SIZE, document, line, pointers, session, sight
from tools.document_edits import set_map
from tools.map_edits import paintable_copy
from tools.session import Session

HARD = {"strength": 1.0, "falloff": "constant", "size": 30.0, "pressure_strength": False}
FRONT = 0.2  # of the height of the ball towards the eye: nearer to the rim a ring on the skin is no ring on the screen


def density(s):
    groom = find_groom(s.document, s.groom.id)
    return None if groom.map("density") is None else groom.map("density").values


def front(s, frame=None):
    """Pixels (V, 2) of the vertices in a pose, and which of them face the eye."""
    skin = skin_at(s.document.meshes[0], frame, EVALUATOR)
    return project(sight().camera, skin.points, SIZE, SIZE).xy, skin.points[:, 2] > FRONT


@pytest.mark.parametrize("frame", [None, BENT])
def test_the_first_stroke_makes_a_density_map_that_is_bare_where_the_ring_was(frame):
    s = session()
    s.set_workspace(frame=frame or 1001.0)
    assert s.groom.coat.density_map is None
    s.choose("paint_map", **HARD)
    s.hand.stroke(sight(), pointers([(200, 190)]))
    values = density(s)
    assert find_groom(s.document, s.groom.id).coat.density_map == "density"
    at, facing = front(s, frame)
    away = np.hypot(*(at - (200, 190)).T)
    assert (values[facing & (away < 24)] == 0.0).all()
    assert (values[away > 34] == 1.0).all()
    assert (values[~facing] == 1.0).all(), "not through the ball"
    assert (values == 0.0).sum() > 3
    s.undo()
    assert density(s) is None
    assert s.groom.coat.density_map is None


def test_pressure_keys_and_softening_do_what_the_hint_says():
    s = session()
    s.choose("paint_map", **(HARD | {"pressure_strength": True, "value": 0.25}))
    s.hand.stroke(sight(), pointers([(200, 200)], pressure=0.5))
    light = density(s).min()
    assert 0.25 < light < 1.0
    s.hand.stroke(sight(), pointers([(200, 200)], pressure=1.0))
    assert density(s).min() == pytest.approx(0.25)
    edge = np.ptp(density(s))
    s.hand.stroke(sight(), line((170, 200), (230, 200), shift=True))
    assert np.ptp(density(s)) < edge
    s.hand.stroke(sight(), pointers([(200, 200)], ctrl=True))
    assert 0.25 < density(s)[np.argmin(np.hypot(*(front(s)[0] - 200).T) - front(s)[1])] <= 0.75


def test_far_side_too_paints_all_that_the_ring_covers():
    s = session()
    s.choose("paint_map", through=True, **HARD)
    s.hand.stroke(sight(), pointers([(200, 190)]))
    away = np.hypot(*(front(s)[0] - (200, 190)).T)
    np.testing.assert_array_equal(density(s) == 0.0, away < 30.0)


def test_symmetry_paints_both_sides_alike():
    s = session()
    s.set_workspace(respect=Respect(symmetry=True))
    s.choose("paint_map", **HARD)
    s.hand.stroke(sight(), line((240, 180), (260, 220)))
    values, points = density(s), s.document.meshes[0].mesh.points
    left, right = (values == 0.0) & (points[:, 0] < 0.0), (values == 0.0) & (points[:, 0] > 0.0)
    assert left.sum() == right.sum() > 2
    np.testing.assert_allclose(
        np.sort(np.abs(points[left]), axis=0), np.sort(np.abs(points[right]), axis=0), atol=1e-6)


def test_hair_leaves_where_it_was_painted_away_and_the_map_is_saved(tmp_path):
    s = session()
    s.choose("paint_map", **HARD)
    s.hand.stroke(sight(), line((170, 200), (230, 200)))
    values, item = density(s), s.document.meshes[0]
    places = places_of(find_groom(s.document, s.groom.id), item.mesh, EVALUATOR)
    corners = skin_at(item, None, EVALUATOR).triangles.vertices[places[0]]
    assert (values[corners].max(axis=1) > 0.0).all(), "no hair where the map is 0"
    s.save(tmp_path / "painted.filo")
    kept = read_project(tmp_path / "painted.filo")[0]
    np.testing.assert_array_equal(find_groom(kept, s.groom.id).map("density").values, values)


def test_an_image_is_copied_before_it_is_painted_and_what_is_missing_is_said():
    plain = document()
    mesh = plain.meshes[0].mesh
    unwrapped = mesh.replace(uvs=freeze(np.full((len(mesh.corners), 2), 0.5, np.float32)))
    s = Session(document(mesh=unwrapped), evaluator=EVALUATOR)
    s.edit("Load", set_map, s.groom.id, Map(name="grey", image=freeze(np.full((4, 4), 0.5, np.float32))))
    s.choose("paint_map", map="grey")
    with pytest.raises(UserError, match="image"):
        s.hand.stroke(sight(), pointers([(200, 200)]))
    assert not s.stroking
    s.edit("Copy", paintable_copy, s.groom.id, "grey", "grey painted")
    s.choose("paint_map", map="grey painted", **HARD)
    s.hand.stroke(sight(), pointers([(200, 200)]))
    values = find_groom(s.document, s.groom.id).map("grey painted").values
    assert values.min() == 0.0
    assert values.max() == 0.5
    s.choose("paint_map", map="gone")
    with pytest.raises(UserError, match="no map named"):
        s.hand.stroke(sight(), pointers([(200, 200)]))


def test_a_stroke_beside_the_skin_makes_no_step():
    s = session()
    before = s.document
    s.choose("paint_map")
    s.hand.stroke(sight(), pointers([(3, 3)]))
    assert s.document is before
