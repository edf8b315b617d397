"""A coat that follows its groom comes to the very hairs that growing it from nothing gives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.evaluator import Evaluator
from core.groom.collision import Collision, collision
from core.groom.commands import COMMANDS, SkinContext
from core.groom.groom import Coat, Groom, Map
from core.groom.grow import grow
from core.groom.live_coat import MOST_AT_ONCE, LiveCoat, bind_coat
from core.groom.plant import plant, plant_scatter
from core.groom.rows import no_guides, take_rows
from core.mesh.normals import mesh_normals
from core.mesh.skin import Posed, skin_at_rest, skin_posed
from core.record import freeze
from core.value import constant, formula
from tests.core.groom.small_grooms import ball, fur

HAIRS = 900
COAT = Coat(
    count=HAIRS, points=12, clump=constant(0.4), frizz=constant(0.2), length_variation=constant(0.3),
)
EVALUATOR = Evaluator()  # what it remembers of the balls serves every test


def groom_of(bump: float = 0.0, guides: int = 40, **coat: object) -> Groom:
    height = ball(bump).skin.mesh.points[:, 1]
    maps = (Map("short", values=freeze((0.5 + 0.4 * height).astype(np.float32))),)
    return Groom(id=1, name="fur", mesh_id=1, guides=fur(guides, 0.4, bump), coat=COAT.replace(**coat), maps=maps)


def mesh_of(bump: float = 0.0):
    return ball(bump).skin.mesh


def turned(mesh, seed: int) -> Posed:
    """The ball stretched, bent and turned."""
    points = mesh.points * [1.3, 0.8, 1.0] + 0.15 * np.sin(2.0 * mesh.points[:, [1, 2, 0]] + seed)
    points = freeze((points @ Rotation.random(random_state=seed).as_matrix().T + [0.2, 0.1, -0.3]).astype(np.float32))
    return Posed(points, mesh_normals(mesh, points))


def rest(live: LiveCoat, groom: Groom, frame: float, posed: Posed | None, hard: Collision, slices: int = 170) -> None:
    """All that is owed, as a resting hand lets it be done."""
    if live.needs_binding():
        live.take_binding(bind_coat(groom, live.mesh, EVALUATOR), groom.guides)
    live.follow(groom, frame, posed, 0)
    assert not live.needs_binding()
    while live.owing(hard):
        rows = live.catch_up(slices, hard)
        assert 0 < len(rows) <= slices
    assert not live.unsettled


def same_as_grown(live: LiveCoat, groom: Groom, frame: float, posed: Posed | None = None) -> None:
    skin = None if posed is None else skin_posed(live.mesh, posed.points, EVALUATOR)
    fresh = grow(groom, live.mesh, EVALUATOR, skin, frame)
    rows = fresh.shown(fresh.traits.density)
    np.testing.assert_array_equal(live.children.ids[live.order], fresh.ids[rows])
    np.testing.assert_array_equal(live.children.points[live.order], fresh.points[rows])
    for mine, its in zip(live.children.traits[1:], fresh.traits[1:], strict=True):  # density and widths
        a, b = np.broadcast_to(mine, len(fresh)), np.broadcast_to(its, len(fresh))
        np.testing.assert_array_equal(a[live.order], b[rows])
    normals = fresh.roots()[1]
    np.testing.assert_array_equal(live.normals[live.order], normals[rows])


class Follower(RuleBasedStateMachine):
    """Any commands, numbers and frames in any order, followed in bits and pieces."""

    @initialize(bump=st.sampled_from([0.0, 0.12]))
    def start(self, bump):
        self.context: SkinContext = ball(bump)
        self.mesh = mesh_of(bump)
        self.groom, self.frame = groom_of(bump), 1001.0
        self.live = LiveCoat(self.groom, self.mesh, EVALUATOR, self.frame, rows_shown=200)
        self.hard = collision(self.mesh, self.mesh.points, EVALUATOR)

    @rule(name=st.sampled_from(sorted(COMMANDS)), seed=st.integers(0, 2**31 - 1), shown=st.sampled_from([0, 100, 900]))
    def edit(self, name, seed, shown):
        guides = COMMANDS[name].run(self.groom.guides, self.context, seed)
        if len(guides):
            self.follow(self.groom.replace(guides=guides), shown)

    @rule(
        field=st.sampled_from(["clump", "frizz", "length", "length_variation", "density", "width_root", "width_tip"]),
        value=st.sampled_from(
            [constant(0.0), constant(0.5), constant(1.0), constant(0.7, "short"), formula("0.3 + 0.5 * (id % 2)"),
             formula("0.1 + 0.05 * (frame - 1000)"), formula("0.2 + short")]),
    )
    def number(self, field, value):
        self.follow(self.groom.replace(coat=self.groom.coat.replace(**{field: value})), 100)

    @rule(painted=st.integers(0, 5))
    def paint(self, painted):
        values = self.groom.maps[0].values.copy()
        values[painted * 50 : (painted + 1) * 50] *= np.float32(0.5)
        coat = self.groom.coat.replace(length_map="short")
        self.follow(self.groom.replace(maps=(Map("short", values=freeze(values)),), coat=coat), 100)

    @rule(change=st.sampled_from([{"seed": 3}, {"count": 700}, {"points": 9}, {"density_map": "short"}]))
    def grow_others(self, change):
        self.follow(self.groom.replace(coat=self.groom.coat.replace(**change)), 100)

    @rule(frame=st.integers(1001, 1010))
    def go(self, frame):
        self.frame = float(frame)
        self.follow(self.groom, 300)

    @rule(most=st.integers(1, 400))
    def some_slices(self, most):
        self.live.catch_up(most)
        self.live.catch_up(most, self.hard)

    @rule()
    def compare(self):
        rest(self.live, self.groom, self.frame, None, self.hard)
        same_as_grown(self.live, self.groom, self.frame)

    def follow(self, groom, shown):
        self.groom = groom
        rows = self.live.follow(groom, self.frame, None, shown)
        assert np.all(np.diff(rows) > 0)
        points = self.live.children.points
        assert np.isfinite(points[self.live.order[:shown]]).all()
        if self.live.needs_growth(groom, self.mesh):  # the old coat stood in
            self.live = LiveCoat(groom, self.mesh, EVALUATOR, self.frame, rows_shown=50)
            assert not self.live.needs_growth(groom, self.mesh)

    def teardown(self):
        if hasattr(self, "live"):
            self.compare()


Follower.TestCase.settings = settings(
    max_examples=25, stateful_step_count=12, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
TestFollower = Follower.TestCase


@pytest.mark.parametrize("bump", [0.0, 0.12])
def test_a_posed_coat_follows_too(bump):
    mesh, groom = mesh_of(bump), groom_of(bump)
    live = LiveCoat(groom, mesh, EVALUATOR, 1.0)
    for seed, name in enumerate(("comb", "plant", "smooth", "delete")):
        posed = turned(mesh, seed)
        live.follow(groom, 1.0, posed, 100)
        groom = groom.replace(guides=COMMANDS[name].run(groom.guides, ball(bump), seed))
        live.follow(groom, 1.0, posed, 100)
        rest(live, groom, 1.0, posed, collision(mesh, posed.points, EVALUATOR))
        same_as_grown(live, groom, 1.0, posed)
    live.follow(groom, 1.0, None, 100)
    rest(live, groom, 1.0, None, collision(mesh, mesh.points, EVALUATOR))
    same_as_grown(live, groom, 1.0)


def settled(groom: Groom) -> tuple[LiveCoat, Collision]:
    mesh = mesh_of()
    live, hard = LiveCoat(groom, mesh, EVALUATOR, 1.0), collision(mesh, mesh.points, EVALUATOR)
    rest(live, groom, 1.0, None, hard)
    return live, hard


def nudged(groom: Groom, rows: list[int]) -> Groom:
    points = groom.guides.points.copy()
    points[rows, 1:] += np.float32(0.01)
    return groom.replace(guides=groom.guides.replace(points=freeze(points)))


def test_combing_touches_only_the_hairs_of_the_guides_that_moved():
    groom = groom_of(frizz=constant(0.0))
    live, hard = settled(groom)
    before = live.children.points.copy()
    rows = live.follow(nudged(groom, [3, 7]), 1.0)
    hang = np.isin(live.children.sites, [3, 7]).any(axis=1)
    np.testing.assert_array_equal(rows, np.flatnonzero(hang))
    assert 0 < len(rows) < 0.4 * HAIRS
    changed = (live.children.points != before).any(axis=(1, 2))
    assert not changed[~hang].any()
    assert changed[rows].mean() > 0.9
    assert live.owing(hard) == len(rows)  # settled later, and only they


def test_only_the_hairs_on_the_screen_are_evaluated_at_once_the_rest_when_shown_or_in_slices():
    groom = groom_of()
    live, hard = settled(groom)
    later = nudged(groom, [3, 7])
    hang = np.isin(live.children.sites, [3, 7]).any(axis=1)
    rows = live.follow(later, 1.0, None, 200)
    np.testing.assert_array_equal(rows, np.flatnonzero(hang & (live.children.ids < 200)))
    assert len(live.follow(later, 1.0, None, 200)) == 0
    more = live.follow(later, 1.0, None, 500)
    assert len(more)
    assert not np.isin(more, rows).any()
    assert live.owing() == hang.sum() - len(rows) - len(more)
    assert live.owing(hard) == hang.sum()


def test_a_selection_or_a_colour_costs_nothing():
    groom = groom_of()
    live, hard = settled(groom)
    picked = groom.replace(guides=groom.guides.replace(selected=freeze(np.ones(len(groom.guides), np.bool_))))
    assert len(live.follow(picked, 1.0)) == 0
    red = picked.replace(coat=picked.coat.replace(color_tip=(1.0, 0.0, 0.0), width_tip=constant(1e-3)))
    assert len(live.follow(red, 1.0)) == 0
    assert live.children.traits.width_tip == 1e-3
    assert live.owing(hard) == 0


def test_density_shows_fewer_and_what_comes_back_is_right():
    groom = groom_of()
    live, hard = settled(groom)
    thin = groom.replace(coat=groom.coat.replace(density=constant(0.25)))
    assert len(live.follow(thin, 1.0)) == 0
    np.testing.assert_array_equal(live.children.ids[live.order], np.arange(HAIRS // 4))
    combed = nudged(thin, list(range(40)))
    rows = live.follow(combed, 1.0)
    assert len(rows) == HAIRS // 4  # what is not shown waits
    assert live.owing(hard) == HAIRS // 4
    thick = combed.replace(coat=combed.coat.replace(density=constant(1.0)))
    assert len(live.follow(thick, 1.0)) == HAIRS - HAIRS // 4
    rest(live, thick, 1.0, None, hard)
    same_as_grown(live, thick, 1.0)


def test_a_painted_length_touches_the_painted_hairs_only():
    groom = groom_of(length_map="short")
    live, _ = settled(groom)
    values = groom.maps[0].values.copy()
    values[:40] *= np.float32(0.5)
    rows = live.follow(groom.replace(maps=(Map("short", values=freeze(values)),)), 1.0)
    corners = live.children.triangles[live.children.triangle]
    painted = (corners < 40).any(axis=1)
    assert len(rows)
    assert set(rows) <= set(np.flatnonzero(painted))


def test_many_guides_at_once_wait_for_a_binding():
    groom = groom_of()
    live, hard = settled(groom)
    before = live.children.points.copy()
    guides = plant_scatter(groom.guides, ball().skin, MOST_AT_ONCE + 1, seed=5, length=0.3)
    planted = groom.replace(guides=guides)
    assert len(live.follow(planted, 1.0)) == 0
    assert live.needs_binding(stroking=True)
    np.testing.assert_array_equal(live.children.points, before)  # the coat stays as it is until then
    # combed on meanwhile
    bound = bind_coat(planted, live.mesh, EVALUATOR)
    later = nudged(planted, [0, len(guides) - 1])
    live.follow(later, 1.0)
    live.take_binding(bound, planted.guides)
    rest(live, later, 1.0, None, hard)
    same_as_grown(live, later, 1.0)
    few = later.replace(guides=take_rows(later.guides, np.arange(5)))  # and deleted, which is other rows of guides
    live.follow(few, 1.0)
    assert live.needs_binding(stroking=True)
    rest(live, few, 1.0, None, hard)
    same_as_grown(live, few, 1.0)


def test_the_first_guide_on_a_piece_of_skin_and_the_last_wait_for_a_binding():
    one = mesh_of()
    n = len(one.points)
    two = one.replace(
        points=freeze(np.concatenate([one.points, one.points + np.float32([3.0, 0.0, 0.0])])),
        corners=freeze(np.concatenate([one.corners, one.corners + n])), counts=freeze(np.tile(one.counts, 2)),
        parts=freeze(np.zeros(2 * len(one.parts), np.int32)),
    )
    groom = groom_of().replace(maps=())  # its guides stand on the first ball
    live = LiveCoat(groom, two, EVALUATOR, 1.0)
    hard = collision(two, two.points, EVALUATOR)
    skin = skin_at_rest(two, EVALUATOR)
    there = np.array([len(one.counts) + 7], np.int32)
    guides = plant(groom.guides, skin, there, np.full((1, 3), 1 / 3, np.float32), length=0.3)
    planted = groom.replace(guides=guides)
    assert len(live.follow(planted, 1.0)) == 0
    assert live.needs_binding(stroking=True)
    rest(live, planted, 1.0, None, hard)
    same_as_grown(live, planted, 1.0)
    live.follow(groom, 1.0)
    assert live.needs_binding(stroking=True)
    rest(live, groom, 1.0, None, hard)
    same_as_grown(live, groom, 1.0)


def test_a_planted_guide_is_followed_at_once_and_bound_properly_at_rest():
    groom = groom_of()
    live, _ = settled(groom)
    planted = groom.replace(guides=plant_scatter(groom.guides, ball().skin, 1, seed=5, length=0.3))
    rows = live.follow(planted, 1.0)
    assert 0 < len(rows) < 0.3 * HAIRS
    assert (live.children.sites[rows] == len(groom.guides)).any()
    assert not live.needs_binding(stroking=True)
    assert live.needs_binding()


def test_a_value_that_cannot_be_evaluated_is_told_and_changes_nothing():
    groom = groom_of()
    live, hard = settled(groom)
    before = live.children.points.copy()
    assert mesh_of().uvs is None
    bad = groom.replace(coat=groom.coat.replace(clump=formula("u")))
    assert len(live.follow(bad, 1.0)) == 0
    assert "UVs" in str(live.trouble)
    np.testing.assert_array_equal(live.children.points, before)
    live.follow(groom, 1.0)
    assert live.trouble is None
    assert live.owing(hard) == 0


def test_without_guides_no_hair_is_grown():
    with pytest.raises(UserError, match="plant some"):
        LiveCoat(groom_of().replace(guides=no_guides(12)), mesh_of(), EVALUATOR, 1.0)


def test_a_skin_in_another_pose_settles_nothing():
    groom = groom_of()
    live, hard = settled(groom)
    posed = turned(live.mesh, 1)
    live.follow(groom, 1.0, posed)
    assert live.owing(hard) == 0
    assert live.unsettled
    assert live.owing(collision(live.mesh, posed.points, EVALUATOR)) == HAIRS
