from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.groom.collide import lowest_distances, push_out
from core.mesh.distance_field import DistanceField, build_distance_field
from core.record import freeze
from tests.bench.comb_targets import guides_of
from tests.core.groom.small_grooms import ball, mixed, radial_depth, segment_lengths, stays

UP = np.array([[[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]])


def plane(cell=0.1):
    z = np.arange(-1, 3, cell)
    return DistanceField(
        np.array([-3.0, -3.0, -1.0]), cell, 9.0,
        freeze(np.broadcast_to(z, (int(6 / cell), int(6 / cell), len(z))).astype(np.float32).copy()))


def strand(points):
    return guides_of(np.asarray(points, np.float64)[None], UP)


def test_depth_below_a_plane_in_closed_form():
    g = strand([[0, 0, 0], [0.1, 0, 0.2], [0.5, 0, -0.3], [0.6, 0, 0.1]])
    assert lowest_distances(g.points, plane())[0] == pytest.approx(-0.3, abs=1e-6)


def test_a_strand_pushed_into_a_plane_lies_on_it():
    s = np.linspace(0, 1, 11)
    g = strand(np.stack([0.6 * s, 0 * s, -0.8 * s], axis=1))
    out = push_out(g, plane(), clearance=0.01)
    x = out.points[0].astype(np.float64)
    assert np.allclose(x[2:, 2], 0.01 + 0.25 * 0.1, atol=3e-3)  # clearance, and a quarter of a cell for the grid
    assert x[1, 2] > 0.01
    assert np.allclose(x[1:, 1], 0)
    assert np.allclose(segment_lengths(out), 0.1, atol=1e-6)
    assert x[-1, 0] > 0.99  # it kept its way along the plane


def test_straight_down_finds_some_way():
    s = np.linspace(0, 1, 6)
    out = push_out(strand(np.stack([0 * s, 0 * s, -s], axis=1)), plane())
    assert lowest_distances(out.points, plane())[0] > 0
    assert np.allclose(segment_lengths(out), 0.2, atol=1e-6)


def test_a_segment_over_a_ridge_is_lifted_though_its_ends_are_out():
    # a box 0.2 wide and 0.3 high stands on the floor between the points of the strand
    x, y, z = np.meshgrid(*[np.arange(-2, 2, 0.05)] * 3, indexing="ij")
    q = np.stack([np.abs(x - 0.5) - 0.1, np.abs(y) - 5.0, np.abs(z) - 0.3], -1)
    box = np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0)
    field = DistanceField(np.full(3, -2.0), 0.05, 9.0, freeze(np.minimum(box, z).astype(np.float32)))
    g = strand([[0, 0, 0], [0.3, 0, 0.15], [0.75, 0, 0.15], [1.2, 0, 0.15]])
    assert lowest_distances(g.points, field)[0] < -0.05
    out = push_out(g, field)
    x = out.points[0].astype(np.float64)
    t = np.linspace(0, 1, 200)[:, None]
    dense = np.concatenate([a * (1 - t) + b * t for a, b in pairwise(x)])
    inside = (np.abs(dense[:, 0] - 0.5) < 0.1) & (dense[:, 2] < 0.3)
    assert (np.minimum(0.1 - np.abs(dense[inside, 0] - 0.5), 0.3 - dense[inside, 2]) < 0.012).all()


def test_hair_that_stands_clear_is_not_touched():
    g = strand(np.stack([np.zeros(6), np.zeros(6), np.linspace(0, 1, 6)], axis=1))
    assert np.array_equal(push_out(g, plane()).points, g.points)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 2**31))
def test_tangled_hair_comes_out_of_a_ball(seed):
    rng = np.random.default_rng(seed)
    before = mixed(seed)
    n, p = before.hold.shape
    d = rng.normal(size=(n, p - 1, 3)) * 0.5 + rng.normal(size=(n, 1, 3))
    d *= 0.05 / np.linalg.norm(d, axis=-1, keepdims=True)
    x = np.concatenate([np.zeros((n, 1, 3)), np.cumsum(d, axis=1)], axis=1) + before.points[:, :1]
    before = before.replace(points=np.concatenate([before.points[:, :1], x[:, 1:]], axis=1).astype(np.float32))
    after = push_out(before, ball().field)
    stays(before, after)
    assert np.abs(segment_lengths(after) / segment_lengths(before) - 1).max() < 1e-5
    free = ~before.frozen & (before.hold[:, 1:].max(axis=1) < 1)
    if before.selected.any():
        free &= before.selected
    x = after.points[free].astype(np.float64)
    samples = np.concatenate([x[:, 1:] * t + x[:, :-1] * (1 - t) for t in (0.25, 0.5, 0.75, 1.0)], axis=1)
    assert radial_depth(ball(), samples).max(initial=-1) < 0.02 * ball().field.cell


def test_roots_on_a_coarse_grid_do_not_stand_hair_on_end():
    # a grid far too coarse for the hair reads the root as deep inside; hair along the skin must stay along it
    context = ball()
    coarse = build_distance_field(context.skin.mesh.points, context.skin.triangles.vertices, cell=0.3)
    root = np.array([0.0, 0.0, 1.0])
    s = np.linspace(0, 0.05, 8)
    g = strand(root + np.stack([s, 0 * s, 0.1 * s], axis=1))
    after = push_out(g, coarse).points[0].astype(np.float64)
    d = after[-1] - after[0]
    assert d[2] / np.linalg.norm(d) < 0.5
