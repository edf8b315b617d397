"""Feathers taken, drawn and set by hand, with pointers on an egg; what comes out is checked in space."""

import numpy as np
import pytest

from core.document import Document, MeshObject
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.bend import place_on, pulled
from core.feather.coat.coat import IDS
from core.feather.coat.drawn import coat_with_set, coat_without_set, set_ids
from core.feather.coat.pick import feather_under
from core.leaves import same_bits
from core.mesh.surface import root_positions
from core.workspace import Respect, Workspace
from tests.core.feather.coat.bodies import cells, egg
from tests.tools.scenes import line, pointers, sight
from tools import feather_edits as edits
from tools.ground import Pointer
from tools.session import Session

EYE = sight((-1.0, 0.0, 0.0), 2.5)  # from +x, where the egg lies across the picture, its nose to the left


@pytest.fixture(scope="module")
def evaluator():
    made = Evaluator()
    yield made
    made.close()


@pytest.fixture(scope="module")
def document(evaluator):
    return edits.add_feathers(
        Document(meshes=(MeshObject(id=4, name="egg", mesh=egg()),)), 4, 400, evaluator, keys=12)


@pytest.fixture
def session(document, evaluator):
    made = Session(document, Workspace(respect=Respect(symmetry=False)), evaluator=evaluator)
    made.set_craft("feather")
    return made


def lying(session):
    ground = session.hand.craft("feather").grounds(session, EYE, session.tool)[0]
    return ground, ground.lying()


def pixel_of(session, row, along=0.7):
    """A pixel over a feather's shaft, where no other feather lies over it."""
    ground, known = lying(session)
    vane = known.laid.layered.vanes[row].astype(np.float64)
    at = np.array([np.interp(along * (len(vane) - 1), np.arange(len(vane)), vane[:, 2, k]) for k in range(3)])
    return ground.in_view(at[None])[0]


def free_feather(session):
    """A feather and a pixel of it that a hand can hold: it is on top there and faces the eye."""
    ground, known = lying(session)
    for row in np.argsort(-known.laid.layered.vanes.mean(axis=(1, 2))[:, 0]):
        x, y = pixel_of(session, row)
        origin, way = ground.ray(Pointer(x, y))
        hit = feather_under(known.laid, origin, way)
        if hit is not None and hit.row == row:
            return int(row), hit, (x, y)
    raise AssertionError("no feather can be held")


def test_the_feather_under_a_ray_is_the_nearest_of_all_triangles(session):
    _, known = lying(session)
    rng = np.random.default_rng(4)
    vanes = known.laid.layered.vanes.astype(np.float64)
    triangles = np.stack([_other_cut(v) for v in vanes])  # (N, T, 3, 3), cut as they are shown
    found = 0
    for _ in range(40):
        origin = rng.normal(size=3)
        origin *= 3.0 / np.linalg.norm(origin)
        way = vanes[rng.integers(len(vanes)), rng.integers(8), rng.integers(5)] + rng.normal(0.0, 2e-3, 3) - origin
        way /= np.linalg.norm(way)
        distance = np.array([_nearest(t, origin, way) for t in triangles])
        hit = feather_under(known.laid, origin, way)
        if not np.isfinite(distance).any():
            assert hit is None
            continue
        found += 1
        assert hit is not None
        assert hit.distance == pytest.approx(distance.min(), abs=1e-9)
        assert distance[hit.row] == pytest.approx(distance.min(), abs=1e-9)
        assert hit.id == known.laid.ids[hit.row]
        assert 0.0 <= hit.along <= 1.0
        assert feather_under(known.laid, origin, way, hit.distance - 1e-6) is None
    assert found > 30


def _other_cut(vane):
    assert cells(vane).shape == (56, 3, 3)
    a, b, c, d = vane[:-1, :-1], vane[:-1, 1:], vane[1:, :-1], vane[1:, 1:]
    halves = np.stack([a, b, c], axis=2), np.stack([d, c, b], axis=2)
    return np.concatenate([half.reshape(-1, 3, 3) for half in halves])


def _nearest(triangles, origin, way):
    """By solving for where the line meets each plane."""
    best = np.inf
    for p, q, r in triangles:
        matrix = np.stack([q - p, r - p, -way], axis=1)
        if abs(np.linalg.det(matrix)) < 1e-16:
            continue
        s, t, distance = np.linalg.solve(matrix, origin - p)
        if s >= 0.0 and t >= 0.0 and s + t <= 1.0 and distance > 0.0:
            best = min(best, distance)
    return best


@pytest.mark.parametrize("way", ["bend", "turn", "lengthen"])
def test_a_pulled_shaft_points_where_the_hand_is(way):
    rng = np.random.default_rng(1)
    for _ in range(30):
        shaft = np.concatenate([[[0.0, 0.0, 0.0]], np.cumsum(rng.normal((0.0, 1.0, 0.2), 0.15, (7, 3)), axis=0)])
        along = float(rng.uniform(0.3, 1.0))
        target = place_on(shaft, along) + rng.normal(0.0, 1.5, 3)
        made = pulled(shaft, along, target, way)
        np.testing.assert_array_equal(made[0], shaft[0])
        held = place_on(made, along)
        assert held @ target / np.linalg.norm(held) / np.linalg.norm(target) == pytest.approx(1.0, abs=1e-6)
        before, after = (np.linalg.norm(np.diff(line, axis=0), axis=1) for line in (shaft, made))
        if way == "lengthen":
            np.testing.assert_allclose(held, target, atol=1e-9)
            np.testing.assert_allclose(after / before, (after / before)[0])
        else:
            np.testing.assert_allclose(after, before, rtol=1e-9)


def test_a_click_takes_a_feather_over_and_changes_nothing_else(session):
    _, hit, (x, y) = free_feather(session)
    _, before = lying(session)
    session.choose("shaft")
    session.hand.stroke(EYE, (Pointer(x, y),))
    coat = session.document.feathers[0]
    assert [proxy.id for proxy in coat.proxies] == [hit.id]
    assert session.history.names[-1] == "Take over feather"
    _, after = lying(session)
    np.testing.assert_array_equal(after.laid.layered.vanes, before.laid.layered.vanes)
    session.hand.stroke(EYE, (Pointer(x, y, ctrl=True),))
    assert session.document.feathers[0].proxies == ()
    assert session.history.names[-1] == "Give feather back"


def test_a_drag_brings_the_place_that_is_held_under_the_hand_and_keys_it(session):
    row, hit, (x, y) = free_feather(session)
    ground, before = lying(session)
    session.choose("shaft")
    session.set_workspace(frame=1004.0)
    to = np.array([x + 22.0, y - 16.0])
    session.hand.stroke(EYE, line((x, y), to, 6))
    proxy = session.document.feathers[0].proxies[0]
    assert (proxy.id, proxy.frames.tolist()) == (hit.id, [1004.0])
    _, after = lying(session)
    root = before.laid.feathers.roots[row].astype(np.float64)
    shaft = proxy.shafts[0].astype(np.float64) @ after.frames[row].astype(np.float64) + root
    start = proxy.rest.astype(np.float64) @ after.frames[row].astype(np.float64) + root
    moved = ground.in_view(np.stack([start[0], place_on(start, hit.along), place_on(shaft, hit.along)]))
    wanted, got = moved[1] + [22.0, -16.0] - moved[0], moved[2] - moved[0]
    assert np.degrees(np.arccos(wanted @ got / np.linalg.norm(wanted) / np.linalg.norm(got))) < 6.0
    others = np.delete(np.arange(len(after.laid.ids)), row)
    same = (after.laid.layered.vanes[others] == before.laid.layered.vanes[others]).all(axis=(1, 2, 3))
    assert (after.laid.layered.vanes[row] != before.laid.layered.vanes[row]).any()
    assert same.mean() > 0.9  # only who was in its way has gone
    session.undo()
    assert session.document.feathers[0].proxies == ()


def test_a_roll_turns_about_the_shaft_and_both_sides_follow_the_hand(session):
    _, hit, (x, y) = free_feather(session)
    session.choose("shaft", how="roll")
    session.set_workspace(respect=Respect(symmetry=True))
    session.hand.stroke(EYE, line((x, y), (x + 20.0, y + 25.0), 4))
    proxies = session.document.feathers[0].proxies
    assert hit.id in [proxy.id for proxy in proxies]
    assert len(proxies) == 2
    for proxy in proxies:
        np.testing.assert_array_equal(proxy.shafts[0], proxy.rest)
        assert proxy.rolls[0] != 0.0


def test_a_press_beside_all_feathers_says_so(session):
    session.choose("shaft")
    with pytest.raises(UserError, match="no feather here"):
        session.hand.stroke(EYE, (Pointer(2.0, 2.0),))
    _, _, (x, y) = free_feather(session)
    with pytest.raises(UserError, match="not taken over"):
        session.hand.stroke(EYE, (Pointer(x, y, ctrl=True),))


def test_a_tract_lies_where_it_was_drawn_on_both_sides(session):
    session.choose("tract", part="back", width=0.1, count=25)
    session.set_workspace(respect=Respect(symmetry=True))
    session.hand.stroke(EYE, line((160.0, 190.0), (240.0, 190.0), 9))
    coat = session.document.feathers[0]
    assert [tract.name for tract in coat.tracts] == ["back", "back 2"]
    assert [tract.part for tract in coat.tracts] == ["back", "back"]
    here, there = (tract.line for tract in coat.tracts)
    assert (here[:, 0] > 0.1).all()
    np.testing.assert_allclose(there * [-1.0, 1.0, 1.0], here, atol=2e-3)
    ground, known = lying(session)
    np.testing.assert_allclose(ground.in_view(here)[[0, -1]], [[160.0, 190.0], [240.0, 190.0]], atol=0.5)
    ids = known.laid.ids
    assert [int(((ids >= k * IDS) & (ids < (k + 1) * IDS)).sum()) for k in (1, 2)] == [25, 25]
    added = known.laid.bed.positions[(ids >= IDS) & (ids < 2 * IDS)].astype(np.float64)
    away = np.linalg.norm(added[:, None] - here[None], axis=2).min(axis=1)
    assert away.max() <= 0.1  # half of the width, and half a piece of the line


def test_feathers_lie_along_a_stroke_until_it_is_taken_away(session):
    session.choose("flow")
    session.hand.stroke(EYE, line((170.0, 215.0), (230.0, 185.0), 9))
    coat = session.document.feathers[0]
    assert coat.direction == "strokes"
    _, known = lying(session)
    stroke = coat.strokes[0].points.astype(np.float64)
    near = np.linalg.norm(known.laid.bed.positions - stroke.mean(axis=0), axis=1) < 0.12
    wanted = stroke[-1] - stroke[0]
    along = known.frames[near][:, 1].astype(np.float64) @ (wanted / np.linalg.norm(wanted))
    assert near.sum() > 4
    assert along.min() > 0.9
    session.hand.stroke(EYE, pointers([(200.0, 190.0), (200.0, 215.0)], ctrl=True))
    assert session.document.feathers[0].strokes == ()
    assert session.document.feathers[0].direction == "keys"


def test_feathers_stand_where_they_were_set_and_keep_their_ids(session):
    session.choose("set_feather", spacing=0.05)
    session.hand.stroke(EYE, (Pointer(200.0, 200.0),))
    session.hand.stroke(EYE, line((170.0, 220.0), (230.0, 220.0), 9))
    coat = session.document.feathers[0]
    roots = root_positions(session.document.meshes[0].mesh, coat.placements[1].hand)
    ground, known = lying(session)
    seen = ground.in_view(roots)
    np.testing.assert_allclose(seen[0], [200.0, 200.0], atol=0.5)
    np.testing.assert_allclose(seen[1:, 1], 220.0, atol=0.5)
    steps = np.linalg.norm(np.diff(roots[1:], axis=0), axis=1)
    np.testing.assert_allclose(steps, 0.05, atol=0.012)
    count = len(roots)
    assert set(set_ids(coat)) <= set(known.laid.ids)
    session.hand.stroke(EYE, (Pointer(200.0, 200.0, ctrl=True),))
    less = session.document.feathers[0]
    np.testing.assert_array_equal(set_ids(less), IDS + np.arange(1, count))
    session.hand.stroke(EYE, (Pointer(200.0, 180.0),))
    np.testing.assert_array_equal(set_ids(session.document.feathers[0]), IDS + np.arange(1, count + 1))
    _, again = lying(session)
    assert set(set_ids(session.document.feathers[0])) <= set(again.laid.ids)


def test_an_id_is_never_given_twice(document):
    coat = document.feathers[0]
    roots = document.grooms[0].guides.roots
    coat = coat_with_set(coat, roots.take(np.arange(3)))
    coat = coat_without_set(coat, [IDS + 2])
    coat = coat_with_set(coat, roots.take(np.arange(3, 5)))
    np.testing.assert_array_equal(set_ids(coat), IDS + np.array([0, 1, 3, 4]))
    assert coat_without_set(coat, [7]) is coat


def test_coats_that_cannot_be_worked_on_say_why(document, evaluator):
    bare = Session(Document(meshes=document.meshes), evaluator=evaluator)
    bare.set_craft("feather")
    with pytest.raises(UserError, match="no feathers yet"):
        bare.hand.stroke(EYE, (Pointer(200.0, 200.0),))
    for change, words in (({"locked": True}, "locked"), ({"hidden": True}, "hidden")):
        s = Session(
            document.replace(feathers=(document.feathers[0].replace(**change),)), evaluator=evaluator)
        s.set_craft("feather")
        with pytest.raises(UserError, match=words):
            s.hand.stroke(EYE, (Pointer(200.0, 200.0),))


def test_any_strokes_are_undone_and_redone_to_the_bit(session):
    rng = np.random.default_rng(8)
    states = [session.document]
    for _ in range(40):
        session.choose(str(rng.choice(["shaft", "flow", "tract", "set_feather"])))
        if session.tool.name == "shaft":
            session.choose("shaft", how=str(rng.choice(["bend", "turn", "lengthen", "roll"])))
        session.set_workspace(respect=Respect(symmetry=bool(rng.integers(2))), frame=float(rng.integers(1001, 1010)))
        way = 200.0 + np.cumsum(rng.normal(0.0, 20.0, (5, 2)), axis=0)
        try:
            session.hand.hover(EYE, Pointer(*way[0]))
            session.hand.stroke(EYE, pointers(way, ctrl=bool(rng.random() < 0.3)))
        except UserError:
            assert session.document is states[-1]
        if session.document is not states[-1]:
            states.append(session.document)
    assert len(states) > 12
    for state in reversed(states):
        assert same_bits(session.document, state)
        session.undo()
    for state in states:
        assert same_bits(session.document, state)
        session.redo()
