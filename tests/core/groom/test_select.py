from __future__ import annotations

import numpy as np
import trimesh

from core.evaluator import Evaluator
from core.groom.commands import skin_context
from core.groom.plant import plant_scatter
from core.groom.rows import no_guides
from core.groom.select import (
    select,
    select_all,
    select_ids,
    select_in_lasso,
    select_inverse,
    select_islands,
    select_less,
    select_more,
    select_none,
    select_with_ring,
)
from tests.core.groom.small_grooms import fur, mesh_of, view


def flags(*rows):
    out = np.zeros(60, bool)
    out[list(rows)] = True
    return out


def test_modes():
    g = fur().replace(selected=flags(1, 2))
    assert np.array_equal(select(g, flags(2, 3)).selected, flags(2, 3))
    assert np.array_equal(select(g, flags(2, 3), "add").selected, flags(1, 2, 3))
    assert np.array_equal(select(g, flags(2, 3), "remove").selected, flags(1))
    assert np.array_equal(select(g, flags(2, 3), "toggle").selected, flags(1, 3))
    assert select(g, flags(1, 2)) is g
    assert select_all(g).selected.all()
    assert not select_none(g).selected.any()
    assert np.array_equal(select_inverse(g).selected, ~flags(1, 2))
    assert np.array_equal(select_ids(g, [g.ids[7], 10**6]).selected, flags(7))


def test_frozen_guides_keep_their_mark():
    g = fur().replace(frozen=flags(0, 1), selected=flags(5))
    for call in (select_all, select_inverse, select_more, select_less, select_none):
        assert not call(g).selected[:2].any()


def test_a_ring_and_a_lasso_pick_what_they_touch():
    g, v = fur(), view()
    pixels, _ = v.pixels(g.points)
    at = pixels[10, -1]
    assert np.array_equal(
        select_with_ring(g, v, [at], 40, "replace").selected,
        (np.linalg.norm(pixels - at, axis=-1) < 40).any(axis=1))
    assert np.array_equal(
        select_with_ring(g, v, [at], 40, "replace", roots_only=True).selected,
        np.linalg.norm(pixels[:, 0] - at, axis=-1) < 40)
    box = [[100, 100], [250, 100], [250, 220], [100, 220]]
    inside = ((pixels > [100, 100]) & (pixels < [250, 220])).all(-1)
    assert np.array_equal(select_in_lasso(g, v, box).selected, inside.any(axis=1))
    front = g.points[:, 0, 2] > 0
    assert np.array_equal(
        select_in_lasso(g, v, box, mask=front, roots_only=True).selected, inside[:, 0] & front)


def test_growing_and_shrinking_by_neighbours():
    g = select_ids(fur(), [fur().ids[4]])
    near = np.argsort(np.linalg.norm(g.points[:, 0] - g.points[4, 0], axis=1))[:7]
    more = select_more(g)
    assert np.array_equal(more.selected, flags(*near))
    assert more.selected.sum() == 7
    less = select_less(more)
    assert less.selected.sum() < 7
    assert not (less.selected & ~more.selected).any()
    assert select_less(select_all(g)).selected.all()
    assert not select_more(select_none(g)).selected.any()


def test_islands_are_the_connected_pieces_of_the_mesh():
    one, two = trimesh.creation.icosphere(1), trimesh.creation.box()
    points = np.concatenate([one.vertices, two.vertices + 5])
    mesh = mesh_of(points, np.concatenate([one.faces, two.faces + len(one.vertices)]))
    context = skin_context(mesh, Evaluator(), collide=False)
    g = plant_scatter(no_guides(4), context.skin, 30, seed=2)
    on_box = g.points[:, 0, 0] > 3
    assert 0 < on_box.sum() < 30
    picked = select(g, np.arange(30) == np.flatnonzero(on_box)[0])
    assert np.array_equal(select_islands(picked, mesh).selected, on_box)
    assert select_islands(g, mesh) is g
