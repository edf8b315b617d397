from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.groom.length import lengths
from core.groom.plant import places_along, plant, plant_scatter
from core.groom.rows import no_guides
from core.mesh.surface import root_positions
from core.record import freeze
from core.transform import minimal_rotation
from tests.core.groom.small_grooms import ball, fur, mixed, radial_depth

SKIN = ball().skin


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.integers(1, 9), st.integers(0, 5))
def test_planted_guides_stand_on_the_skin_and_touch_nobody(seed, count, inherit):
    rng = np.random.default_rng(seed)
    before = mixed(seed)
    triangle = rng.integers(0, len(SKIN.triangles.vertices), count).astype(np.int32)
    weights = rng.dirichlet(np.ones(3), count).astype(np.float32)
    after = plant(before, SKIN, triangle, weights, inherit=inherit, field=ball().field)
    n = len(before)
    for name in ("ids", "points", "hold", "selected", "frozen"):
        assert np.array_equal(getattr(after, name)[:n], getattr(before, name))
    assert after.ids[n:].tolist() == list(range(before.next_id, before.next_id + count))
    assert after.next_id == before.next_id + count
    assert not after.selected[n:].any()
    assert not after.frozen[n:].any()
    assert not after.hold[n:].any()
    corners = SKIN.mesh.points.astype(np.float64)[SKIN.triangles.vertices[triangle]]
    assert np.allclose(after.points[n:, 0], np.einsum("nk,nka->na", weights, corners), atol=1e-6)
    assert np.array_equal(after.points[n:, 0], root_positions(SKIN.mesh, after.roots)[n:])
    assert radial_depth(ball(), after.points[n:, 1:]).max() < 0.02 * ball().field.cell


def test_without_neighbours_they_stand_straight_or_lean():
    triangle, weights = np.arange(20, dtype=np.int32), np.full((20, 3), 1 / 3, np.float32)
    g = plant(no_guides(9), SKIN, triangle, weights, length=0.3)
    d = (g.points[:, 1:].astype(np.float64) - g.points[:, :1]) / (0.3 * np.arange(1, 9) / 8)[:, None]
    assert np.allclose(d, g.roots.frames[:, None, 2], atol=1e-5)
    lean = plant(no_guides(9), SKIN, triangle, weights, length=np.full(20, 0.2), direction=[0, -1, 0], lean=0.7)
    tips = (lean.points[:, -1].astype(np.float64) - lean.points[:, 0]) / 0.2
    assert np.allclose(np.arccos((tips * lean.roots.frames[:, 2]).sum(1)), 0.7, atol=1e-4)
    n = lean.roots.frames[:, 2].astype(np.float64)
    assert (np.abs(np.linalg.det(np.stack([tips, n, np.broadcast_to([0, -1.0, 0], n.shape)], 1))) < 1e-5).all()
    assert (tips[:, 1] < n[:, 1]).all()
    assert lengths(plant(no_guides(), SKIN, triangle, weights).points) == pytest.approx(SKIN.diagonal / 20, rel=1e-4)


def test_the_shape_of_the_neighbours_is_inherited():
    g = fur(120)
    # all hair is one spiral in the frame that the smallest rotation from +z carries to each normal
    n = g.roots.frames[:, 2].astype(np.float64)
    s = np.linspace(0, 1, 12)
    shape = np.stack([0.1 * np.sin(4 * s), 0.1 * (1 - np.cos(4 * s)), 0.3 * s], axis=1)
    front = n[:, 2] > 0.3
    turned = np.einsum("nab,pb->npa", minimal_rotation(np.array([0, 0, 1.0]), n), shape)
    g = g.replace(points=freeze((g.points[:, :1] + turned).astype(np.float32)))
    on_front = np.flatnonzero(SKIN.mesh.points[SKIN.triangles.vertices].mean(axis=1)[:, 2] > 0.8).astype(np.int32)
    after = plant(g, SKIN, on_front, np.full((len(on_front), 3), 1 / 3, np.float32))
    new_n = after.roots.frames[len(g):, 2].astype(np.float64)
    wanted = np.einsum("nab,pb->npa", minimal_rotation(np.array([0, 0, 1.0]), new_n), shape)
    got = after.points[len(g):].astype(np.float64) - after.points[len(g):, :1]
    assert np.abs(got - wanted).max() < 0.02
    assert np.allclose(lengths(after.points[len(g):]), lengths(g.points)[front].mean(), rtol=1e-3)


def test_a_guide_planted_on_a_guide_is_its_copy():
    g = mixed(7)
    bent = g.points.copy()
    bent[:, 6:] += np.random.default_rng(0).normal(0, 0.05, (len(g), 1, 3)).astype(np.float32)
    g = g.replace(points=freeze(bent))
    triangle = np.array([17], np.int32)
    g = plant(g, SKIN, triangle, np.array([[0.2, 0.3, 0.5]]), length=0.2)
    twice = plant(g, SKIN, triangle, np.array([[0.2, 0.3, 0.5]]))
    assert np.allclose(twice.points[-1], twice.points[-2], atol=1e-4)


def test_neighbours_on_the_other_side_of_thin_skin_do_not_count():
    g = fur()
    # the only near guide has the opposite normal: its row is moved to the place of planting
    triangle = np.array([3], np.int32)
    weights = np.full((1, 3), 1 / 3, np.float32)
    spot = plant(no_guides(12), SKIN, triangle, weights, length=0.4).points[0]
    opposite = int(np.argmin(g.roots.frames[:, 2] @ spot[0]))
    x = g.points.copy()
    x[opposite] = spot[0] + (x[opposite] - x[opposite, 0]) * 5
    new = plant(g.replace(points=freeze(x)), SKIN, triangle, weights).points[-1]
    assert np.linalg.norm(new - spot, axis=1).max() < 0.2


def test_along_a_line_in_even_steps():
    angle = np.linspace(0, 1.2, 300)
    line = np.stack([np.sin(angle), np.zeros(300), np.cos(angle)], axis=1)
    triangle, weights = places_along(SKIN, line, 0.1)
    assert len(triangle) == 12
    g = plant(no_guides(5), SKIN, triangle, weights, length=0.2)
    steps = np.linalg.norm(np.diff(g.points[:, 0].astype(np.float64), axis=0), axis=1)
    assert np.abs(steps - 0.1).max() < 0.01
    assert np.abs(g.points[:, 0, 1]).max() < 0.01


def test_a_scatter_is_exact_even_and_keeps_to_its_region():
    top = (SKIN.mesh.points[:, 1] > 0.3).astype(np.float32)
    g = plant_scatter(no_guides(6), SKIN, 200, region=top, seed=4, length=0.1)
    assert len(g) == 200
    assert g.points[:, 0, 1].min() > 0.0
    dense = plant_scatter(no_guides(6), SKIN, per_square_metre=30.0, seed=4, length=0.1)
    assert len(dense) == pytest.approx(30 * 4 * np.pi, rel=0.03)
    assert np.array_equal(plant_scatter(no_guides(6), SKIN, 50, seed=4, length=0.1).points,
                          plant_scatter(no_guides(6), SKIN, 50, seed=4, length=0.1).points)
