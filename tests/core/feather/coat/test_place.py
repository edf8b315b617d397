"""Where feathers stand: exact, even, stable."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.coat import IDS, FeatherCoat, Placement, Tract
from core.feather.coat.place import distance_to_tract, place_feathers
from core.feather.coat.rows import along_rows
from core.groom.groom import Map
from core.mesh.skin import skin_at_rest
from core.workers import Workers
from tests.core.feather.coat.bodies import egg
from tests.documents import grid_mesh


@pytest.fixture(scope="module")
def evaluator():
    made = Evaluator()
    yield made
    made.close()


@pytest.fixture(scope="module")
def body():
    return egg()


def coat(*placements, **fields):
    return FeatherCoat(id=1, name="coat", mesh_id=1, placements=placements, **fields)


def positions(places, mesh, evaluator):
    skin = skin_at_rest(mesh, evaluator)
    corners = skin.points[skin.triangles.vertices[places.triangle]]
    return np.einsum("nk,nkc->nc", places.barycentric, corners.astype(np.float64))


@pytest.mark.parametrize("kind", ["even", "repulsion", "random", "rows", "grid", "uv"])
@pytest.mark.parametrize("count", [0, 1, 157])
def test_every_kind_sets_exactly_the_count_on_the_skin(kind, count, body, evaluator):
    places = place_feathers(coat(Placement(kind=kind, count=count)), body, (), evaluator)
    assert len(places.ids) == len(places.triangle) == count
    assert len(np.unique(places.ids)) == count
    assert places.barycentric.min(initial=0.0) > -1e-5
    np.testing.assert_allclose(places.barycentric.sum(axis=1), 1.0, atol=1e-5)


def test_ids_of_mixed_placements_never_meet_and_stay_when_another_is_added(body, evaluator):
    one = Placement(kind="even", count=30)
    alone = place_feathers(coat(one), body, (), evaluator)
    both = place_feathers(coat(one, Placement(kind="rows", count=20)), body, (), evaluator)
    assert both.ids.tolist() == [*range(30), *range(IDS, IDS + 20)]
    np.testing.assert_array_equal(both.triangle[:30], alone.triangle)
    np.testing.assert_array_equal(both.barycentric[:30], alone.barycentric)


@pytest.mark.parametrize("kind", ["even", "repulsion", "rows"])
def test_places_do_not_depend_on_the_number_of_threads(kind, body):
    found = []
    for threads in (1, 3):
        evaluator = Evaluator(workers=Workers(threads))
        found.append(place_feathers(coat(Placement(kind=kind, count=3000)), body, (), evaluator))
        evaluator.close()
    for a, b in zip(*found, strict=True):
        np.testing.assert_array_equal(a, b)


def test_repulsion_is_even_and_nobody_stands_near_another(body, evaluator):
    places = place_feathers(coat(Placement(kind="repulsion", count=2000)), body, (), evaluator)
    nearest = cKDTree(positions(places, body, evaluator)).query(positions(places, body, evaluator), 2)[0][:, 1]
    assert nearest.std() / nearest.mean() <= 0.06
    assert nearest.min() > 0.5 * nearest.mean()


def test_a_density_map_and_a_tract_keep_feathers_where_they_are_wanted(body, evaluator):
    front = Map(name="front", values=(body.points[:, 2] > 0.0).astype(np.float32))
    spine = Tract(name="spine", line=np.array([[0.0, 0.3, -0.4], [0.0, 0.3, 0.4]], np.float32), width=0.3)
    for kind in ("even", "random", "rows"):
        places = place_feathers(coat(Placement(kind=kind, count=80, density_map="front")), body, (front,), evaluator)
        assert len(places.ids) == 80
        assert positions(places, body, evaluator)[:, 2].min() > -0.1
        banded = coat(Placement(kind=kind, count=60, tract="spine"), tracts=(spine,))
        places = place_feathers(banded, body, (), evaluator)
        assert len(places.ids) == 60
        assert distance_to_tract(positions(places, body, evaluator), spine).max() <= 0.15 + 1e-6


def test_what_cannot_be_followed_is_said(body, evaluator):
    with pytest.raises(UserError, match="no map named 'bald'"):
        place_feathers(coat(Placement(kind="even", count=5, density_map="bald")), body, (), evaluator)
    bare = body.replace(uvs=None)
    with pytest.raises(UserError, match="UV"):
        place_feathers(coat(Placement(kind="uv", count=5)), bare, (), evaluator)


def test_rows_are_straight_and_every_second_one_is_moved_by_half_a_spacing():
    mesh = grid_mesh(8)
    quads = mesh.corners.reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
    values = mesh.points[:, 2].astype(np.float64)
    laid = along_rows(mesh.points, triangles, values, 100)
    at = np.einsum("nk,nkc->nc", laid.barycentric, mesh.points[triangles[laid.triangle]].astype(np.float64))
    assert 100 <= len(at) <= 110  # whole rows
    rows = np.unique(np.round(at[:, 2], 5))
    gaps = np.diff(rows)
    np.testing.assert_allclose(gaps, gaps[0], rtol=1e-3)
    spacing = gaps[0] / 0.866
    begins = []
    for row in rows:
        x = np.sort(at[np.abs(at[:, 2] - row) < 1e-4, 0])
        np.testing.assert_allclose(np.diff(x), spacing, rtol=1e-3)
        begins.append(x[0] % spacing)
    apart = np.abs(np.diff(begins))
    np.testing.assert_allclose(np.minimum(apart, spacing - apart), 0.5 * spacing, rtol=1e-2)
