"""While a part is combed the finished picture stays everywhere else, and where hair moved it is as without one."""

from __future__ import annotations

import numpy as np
import pytest

import viewport.moving
from core.camera import project
from core.workspace import ViewOptions
from tests.viewport.scenes import FLAT, camera, hairs, quad
from viewport.moving import changed_guides
from viewport.near_side import sparse_coat
from viewport.neighbours import Neighbours
from viewport.scene import GuideLines, Scene
from viewport.view import View3D

W, H = 240, 180
BARE = ViewOptions(grid=False, axes=False, hud=False)
LOOK = FLAT._replace(root_width=0.012, tip_width=0.004, value_variation=0.3)


@pytest.fixture
def stroke(ctx):
    """stroke(scene, change, finished) -> the picture before and after `change(scene) -> scene, points, rows`."""
    view = View3D(ctx, shadow_side=256)
    target = ctx.framebuffer([ctx.texture((W, H), 4)])

    def shown():
        view.present(target, (W, H))
        return np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(H, W, 3)[::-1].astype(int)

    def call(scene, change, finished=True, count=5000):
        view.begin(scene, camera(), (W, H), BARE)
        view.draw_interactive(count)
        if finished:
            list(view.refine())
        before = shown()
        for _ in range(3):
            scene, points, rows = change(scene)
            view.begin(scene, camera(), (W, H), BARE)
            view.rows_changed(points, rows)
            view.draw_interactive(count)
        return before, shown()

    call.view, call.shown = view, shown
    yield call
    view.release()
    target.release()


def field(count=3000):
    rng = np.random.default_rng(5)
    roots = np.column_stack([rng.uniform(-0.9, 0.9, (count, 2)), np.zeros(count)])
    order = rng.permutation(count).astype(np.int32)
    return hairs(roots, roots + np.array([0.0, 0.12, 0.06]), look=LOOK)._replace(order=order)


def brushed(coat, centre=(0.3, 0.2), radius=0.2, push=0.03):
    roots = coat.points[:, :2, 0]
    return np.flatnonzero(np.hypot(*(roots - np.asarray(centre)).T) < radius), np.float32(push)


def test_only_the_brushed_part_changes_and_what_is_left_is_the_finished_picture(stroke):
    coat = field()
    rows, push = brushed(coat)
    u = np.linspace(0.0, 1.0, 8, dtype=np.float32)

    def comb(scene):
        coat.points[rows, 0] += push * u
        return scene, coat.points, rows

    before, after = stroke(Scene((quad(),), (coat,)), comb)
    changed = np.abs(after - before).max(axis=2) > 0
    pixels = project(camera(), coat.points[rows].transpose(0, 2, 1).astype(float), W, H).xy.reshape(-1, 2)
    y, x = np.nonzero(changed)
    low, high = pixels.min(axis=0) - 10, pixels.max(axis=0) + 10
    assert changed.sum() > 300
    assert x.min() >= low[0]
    assert x.max() <= high[0]
    assert y.min() >= low[1]
    assert y.max() <= high[1]


def test_where_hair_was_there_is_skin_and_where_it_went_there_is_hair(stroke):
    still, moved = ([-0.5, -0.2, 0.05], [-0.5, 0.2, 0.05]), ([0.3, -0.2, 0.05], [0.3, 0.2, 0.05])
    coat = hairs(*map(list, zip(still, moved, strict=True)), look=FLAT._replace(root_width=0.05, tip_width=0.05))
    rows = np.array([1])

    def comb(scene):
        coat.points[1, 0] += np.float32(0.1)
        return scene, coat.points, rows

    scene = Scene((quad()._replace(covered=False),), (coat,))
    before, after = stroke(scene, comb)
    columns = [round(project(camera(), np.array([x, 0.0, 0.05]), W, H).xy[0]) for x in (-0.5, 0.3, 0.6, 0.0)]
    old = np.s_[H // 2 - 8 : H // 2 + 8]
    hair, was, now, skin = (after[old, column].mean(axis=0) for column in columns)
    assert np.array_equal(after[old, columns[0] - 3 : columns[0] + 4], before[old, columns[0] - 3 : columns[0] + 4])
    assert np.abs(was - skin).max() < 12
    assert np.abs(now - skin).max() > 25
    assert np.abs(hair - skin).max() > 25


def test_without_a_finished_picture_all_of_it_moves(stroke):
    coat = field()
    rows, push = brushed(coat)

    def comb(scene):
        coat.points[rows, 0] += push
        return scene, coat.points, rows

    stroke(Scene((quad(),), (coat,)), comb, finished=False)
    assert stroke.view.moving.patch.number is None


def test_guides_in_new_arrays_are_followed_and_others_stay(stroke):
    coat = field(200)
    straight = hairs([[-0.5, -0.3, 0.1], [0.4, -0.3, 0.1]], [[-0.5, 0.3, 0.1], [0.4, 0.3, 0.1]]).points
    lines = GuideLines(np.ascontiguousarray(straight.transpose(0, 2, 1)), np.zeros(2, np.uint8), pixels=4.0)

    def comb(scene):
        guides = scene.guides[0]
        points = guides.points.copy()
        points[1, :, 0] += 0.1
        return scene._replace(guides=(guides._replace(points=points),)), coat.points, np.array([0])

    before, after = stroke(Scene((quad(),), (coat,), (lines,)), comb)
    assert stroke.view.moving.patch.number is not None
    columns = [round(project(camera(), np.array([x, 0.0, 0.1]), W, H).xy[0]) for x in (-0.5, 0.4, 0.7)]
    row = H // 2
    assert np.array_equal(after[row, columns[0] - 3 : columns[0] + 4], before[row, columns[0] - 3 : columns[0] + 4])
    orange = after[row, columns[2]]
    assert orange[0] > orange[2] + 40
    assert np.abs(after[row, columns[1]] - before[row, columns[1]]).max() > 40


def test_hairs_worked_out_alone_are_as_all_of_them_worked_out(stroke):
    """A second and third picture of a stroke work out what has moved alone; any stale hair would show."""
    pictures = []
    for alone in (True, False):
        coat = field()
        rows, push = brushed(coat)

        def comb(scene, coat=coat, rows=rows, push=push, alone=alone):
            coat.points[rows, 0] += push
            if not alone:
                stroke.view.moving.forget_touched()
            return scene, coat.points, rows

        pictures.append(stroke(Scene((quad(),), (coat,)), comb)[1])
    assert np.array_equal(*pictures)


def test_changed_guides_are_found_by_points_and_by_state():
    points = np.random.default_rng(1).normal(size=(6, 8, 3)).astype(np.float32)
    states = np.zeros(6, np.uint8)
    lines = GuideLines(points, states)
    assert not changed_guides(lines, lines).any()
    other = points.copy()
    other[2, 7, 1] += 1.0
    chosen = states.copy()
    chosen[4] = 1
    assert np.flatnonzero(changed_guides(lines, GuideLines(other, chosen))).tolist() == [2, 4]


def test_a_new_camera_or_coat_gives_the_patch_up(stroke):
    coat = field()
    rows, push = brushed(coat)

    def replaced(scene):
        fresh = scene.coats[0]._replace(points=scene.coats[0].points + push)
        return scene._replace(coats=(fresh,)), fresh.points, rows

    before, after = stroke(Scene((quad(),), (coat,)), replaced)
    assert (np.abs(after - before).max(axis=2) > 0).mean() > 0.2, "all of it was drawn anew"


def test_hairs_that_are_not_yet_evaluated_leave_with_those_that_are(stroke):
    """A sparse part of the coat is combed, as a live coat does it: nothing of the old coat stays between its hairs."""
    coat = field(12_000)
    rows, push = brushed(coat, radius=0.3, push=0.06)
    first = coat.order[:800]
    evaluated = np.intersect1d(rows, first)
    u = np.linspace(0.0, 1.0, 8, dtype=np.float32)

    def comb(scene):
        coat.points[evaluated, 0] += push * u
        return scene, coat.points, evaluated

    before, after = stroke(Scene((quad(),), (coat,)), comb, count=800)
    y, x = np.mgrid[:H, :W]
    at = project(camera(), np.array([[0.3, 0.2, 0.0], [0.5, 0.2, 0.0], [0.9, 0.2, 0.0]]), W, H).xy
    away = np.hypot(x - at[0, 0], y - at[0, 1])
    same_as_before = np.abs(after - before).max(axis=2) <= 1
    assert same_as_before[away < at[1, 0] - at[0, 0]].mean() < 0.12
    assert same_as_before[away > at[2, 0] - at[0, 0]].all()


def test_many_hairs_leave_in_several_pictures_that_come_by_themselves(stroke, monkeypatch):
    """The first touch of a stroke takes thousands of hairs out of the finished picture: not all in one frame."""
    pictures = []
    for at_once in (100_000, 60):
        monkeypatch.setattr(viewport.moving, "OPENED_AT_ONCE", at_once)
        coat = field(6000)
        rows, push = brushed(coat, radius=0.3, push=0.06)
        evaluated = np.intersect1d(rows, coat.order[:400])

        def comb(scene, coat=coat, evaluated=evaluated, push=push):
            coat.points[evaluated, 0] += push * np.linspace(0.0, 1.0, 8, dtype=np.float32)
            return scene, coat.points, evaluated

        _, after = stroke(Scene((quad(),), (coat,)), comb, count=400)
        more = 0
        while stroke.view.opening:
            stroke.view.draw_interactive(400)
            after, more = stroke.shown(), more + 1
        pictures.append(after)
        assert (more > 3) == (at_once == 60)
    assert np.abs(pictures[0] - pictures[1]).max() <= 1


def test_neighbours_are_those_a_sparse_hair_stands_for():
    coat = field(4000)
    drawn = sparse_coat(coat, camera(), 100, (W, H))
    neighbours = Neighbours(coat, drawn, camera())
    roots = coat.points[:, :, 0].astype(float)
    one = drawn.order[:1]
    spacing = np.sort(np.linalg.norm(roots[drawn.order] - roots[one], axis=1))[3]
    away = np.linalg.norm(roots - roots[one], axis=1)
    found = neighbours.around(one)
    assert np.array_equal(np.sort(found), np.flatnonzero(away <= 1.3 * spacing))
    everything = neighbours.around(drawn.order)
    assert len(np.unique(everything)) > 0.9 * 4000
    assert len(Neighbours(coat, sparse_coat(coat, camera(), 4000, (W, H)), camera()).around(one)) == 0, "all are drawn"
    assert len(neighbours.around(np.zeros(0, np.int32))) == 0
