"""Reach: hair around the guides and nowhere else, by stable ids, the very coat there was where guides are near."""

import numpy as np
import pytest

from core.evaluator import Evaluator
from core.groom.groom import Coat, Groom
from core.groom.grow import grow
from core.groom.guides import Guides
from core.groom.live_coat import LiveCoat, bind_coat
from core.groom.reach import FULL
from core.groom.rows import take_rows
from core.value import constant
from tests.core.groom.small_grooms import ball, fur

EVALUATOR = Evaluator()
MESH = ball().skin.mesh


def groom_of(guides: Guides, **coat: object) -> Groom:
    return Groom(id=1, name="fur", mesh_id=1, guides=guides, coat=Coat(count=4000, points=12).replace(**coat))


def some(rows: list[int]) -> Guides:
    guides = fur(60)
    return take_rows(guides, np.isin(np.arange(len(guides)), rows))


def grown(groom: Groom) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ids shown, and roots and great circles to the nearest guide of all hairs by id."""
    children = grow(groom, MESH, EVALUATOR)
    roots = np.empty((len(children), 3))
    roots[children.ids] = children.roots()[0]
    unit = roots / np.linalg.norm(roots, axis=1, keepdims=True)
    sites = groom.guides.points[:, 0].astype(np.float64)
    sites /= np.linalg.norm(sites, axis=1, keepdims=True)
    shown = children.ids[children.shown(children.traits.density)]
    return shown, roots, np.arccos(np.clip(unit @ sites.T, -1.0, 1.0)).min(axis=1)


@pytest.mark.parametrize("rows", [[3], [3, 30], [1, 2, 3, 40, 41]])
def test_hair_grows_up_to_the_reach_over_the_skin(rows):
    shown, _, away = grown(groom_of(some(rows), reach=0.5))
    present = np.isin(np.arange(4000), shown)
    assert not present[away > 1.05 * 0.5].any()
    assert present[away < 0.95 * FULL * 0.5].all()
    rim = (away > FULL * 0.5) & (away < 0.5)
    assert 0.2 < present[rim].mean() < 0.8  # thins out between


def test_a_fully_planted_animal_is_unchanged_to_the_bit():
    near, far = (grow(groom_of(fur(60), reach=r), MESH, EVALUATOR) for r in (3.0, 0.0))
    assert near.traits == far.traits  # one number for the density, as without
    assert np.array_equal(near.points, far.points)


def test_ids_are_stable_and_a_thinner_coat_is_part_of_a_thicker_one():
    whole = set(grown(groom_of(some([3]), reach=0.5))[0])
    half = set(grown(groom_of(some([3]), reach=0.5, density=constant(0.5)))[0])
    small = set(grown(groom_of(some([3]), reach=0.3))[0])
    more = set(grown(groom_of(some([3, 30]), reach=0.5))[0])
    assert half < whole
    assert small < whole
    assert whole < more


def test_hair_that_is_edited_comes_to_the_hair_that_is_grown():
    start, planted = groom_of(some([3, 30]), reach=0.5), groom_of(some([3, 30, 50]), reach=0.5)
    live = LiveCoat(start, MESH, EVALUATOR, 1001.0)
    for groom in (planted, planted.replace(coat=planted.coat.replace(reach=0.25)), start,
                  start.replace(coat=start.coat.replace(reach=0.0)), planted):
        live.follow(groom, 1001.0)
        if live.needs_binding():
            live.take_binding(bind_coat(groom, MESH, EVALUATOR), groom.guides)
            live.follow(groom, 1001.0)
        shown, _, _ = grown(groom)
        assert np.array_equal(np.sort(live.children.ids[live.order]), np.sort(shown))
