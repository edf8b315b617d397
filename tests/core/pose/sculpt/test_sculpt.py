"""Brushes against what geometry says they must do."""

import numpy as np
import pytest

from core.falloff import falloff
from core.mesh.edges import edge_vertices
from core.pose.sculpt.brushes import draw, flatten, grab, inflate, pinch, relax, restore, smooth
from core.pose.sculpt.mask import blur_mask, invert_mask, no_mask, paint_mask
from core.pose.sculpt.ring import mean_normal, ring_at, ring_normals, whole_surface
from core.pose.sculpt.surface import sculpt_surface
from tests.core.pose.sculpt.sculpt_samples import grid, joined, sphere


@pytest.fixture(scope="module")
def ball():
    mesh = sphere()
    return mesh, sculpt_surface(mesh)


def changed(a, b):
    return np.flatnonzero((a != b).any(axis=1))


def brushes(surface, points, ring):
    """Every brush once, by name."""
    return {
        "grab": grab(surface, points, ring, (0.1, 0.0, 0.0)),
        "draw": draw(surface, points, ring, 0.1),
        "inflate": inflate(surface, points, ring, 0.1),
        "pinch": pinch(surface, points, ring, 0.5),
        "flatten": flatten(surface, points, ring, 0.5),
        "smooth": smooth(surface, points, ring, 1.0),
        "relax": relax(surface, points, ring, 1.0),
        "restore": restore(surface, points, ring, points + np.float32(1.0), 0.5),
    }


def noisy(mesh, amount=0.004, seed=1):
    return (mesh.points + np.random.default_rng(seed).normal(0.0, amount, mesh.points.shape)).astype(np.float32)


def test_the_ring_is_all_within_the_radius_with_the_weights_of_the_falloff(ball):
    mesh, surface = ball
    ring = ring_at(surface, mesh.points, (0.0, 1.0, 0.0), 0.4, "linear")
    distances = np.linalg.norm(mesh.points.astype(np.float64) - (0.0, 1.0, 0.0), axis=1)
    assert np.array_equal(ring.sites, np.flatnonzero(distances < 0.4))
    assert np.allclose(ring.weights, falloff(distances[ring.sites] / 0.4, "linear"), atol=1e-6)


def test_a_ring_of_nothing_touches_nothing(ball):
    mesh, surface = ball
    for centre, radius in (((9.0, 0.0, 0.0), 0.5), ((0.0, 0.0, 1.0), 0.0), ((np.nan, 0.0, 0.0), 1.0)):
        ring = ring_at(surface, mesh.points, centre, radius)
        assert not len(ring.sites)
        for points in brushes(surface, mesh.points, ring).values():
            assert np.array_equal(points, mesh.points)


def test_only_the_connected_side_of_a_fold_is_touched():
    sheet = grid()
    both = joined(sheet, sheet.replace(points=sheet.points + np.float32([0, 0, 0.05])))
    surface = sculpt_surface(both)
    ring = ring_at(surface, both.points, (0.0, 0.0, 0.0), 0.3)
    assert ring.sites.max() < len(sheet.points)
    apart = ring_at(surface, both.points, (0.0, 0.0, 0.0), 0.3, connected=False)
    assert apart.sites.max() >= len(sheet.points)


def test_every_brush_keeps_the_bits_outside_its_ring_and_under_the_mask(ball):
    mesh, surface = ball
    points = noisy(mesh)
    mask = np.zeros(len(points), np.float32)
    mask[::3] = 1.0
    before = points.copy()
    ring = ring_at(surface, points, (1.0, 0.0, 0.0), 0.5, mask=mask)
    free = ring.sites[ring.weights > 0.0]
    for name, after in brushes(surface, points, ring).items():
        moved = changed(points, after)
        assert len(moved) > 10, name
        assert np.isin(moved, free).all(), name
        assert after.dtype == np.float32, name
        assert np.isfinite(after).all(), name
    assert np.array_equal(points, before)  # nothing is written into what was given


def test_normals_of_a_sphere(ball):
    mesh, surface = ball
    every = whole_surface(surface)
    normals = ring_normals(surface, mesh.points, every.sites)
    assert (np.sum(normals * mesh.points, axis=1) > 0.999).all()


def test_grab_moves_by_the_weight_of_each_site(ball):
    mesh, surface = ball
    ring = ring_at(surface, mesh.points, (0.0, 0.0, 1.0), 0.6, "smooth")
    after = grab(surface, mesh.points, ring, (0.2, -0.1, 0.3))
    wanted = mesh.points[ring.sites] + ring.weights[:, None] * (0.2, -0.1, 0.3)
    assert np.allclose(after[ring.sites], wanted, atol=1e-6)


def test_inflate_makes_a_larger_sphere_and_draw_goes_one_way(ball):
    mesh, surface = ball
    after = inflate(surface, mesh.points, whole_surface(surface), 0.25)
    assert np.allclose(np.linalg.norm(after, axis=1), 1.25, atol=1e-3)
    ring = ring_at(surface, mesh.points, (0.0, 1.0, 0.0), 0.7)
    step = draw(surface, mesh.points, ring, 0.1).astype(np.float64) - mesh.points
    assert np.allclose(mean_normal(surface, mesh.points, ring), (0, 1, 0), atol=1e-3)
    assert np.allclose(step[ring.sites], 0.1 * ring.weights[:, None] * (0.0, 1.0, 0.0), atol=2e-4)


def test_smooth_takes_out_noise_and_leaves_a_flat_sheet():
    flat = grid()
    surface = sculpt_surface(flat)
    every = whole_surface(surface)
    inner = ~surface.border
    assert np.allclose(smooth(surface, flat.points, every, 1.0)[inner], flat.points[inner], atol=1e-6)
    rough = noisy(flat, 0.01)
    after = smooth(surface, rough, every, 1.0, 4)
    assert np.abs(after[inner, 2]).mean() < 0.35 * np.abs(rough[inner, 2]).mean()


def test_smooth_draws_a_border_only_along_itself():
    flat = grid()
    surface = sculpt_surface(flat)
    after = smooth(surface, flat.points, whole_surface(surface), 1.0, 5)
    side = np.flatnonzero(flat.points[:, 0] == flat.points[:, 0].max())
    straight = side[7:-7]  # the corners are cut, and five rounds carry that five sites in
    assert np.allclose(after[straight, 0], flat.points[straight, 0], atol=1e-6)


def test_pinch_goes_inward_without_leaving_the_plane_and_flatten_reaches_it():
    sheet = grid(31, z=lambda x, y: 0.05 * np.cos(9.0 * x))
    surface = sculpt_surface(sheet)
    flat = grid(31)
    plain = sculpt_surface(flat)
    ring = ring_at(plain, flat.points, (0.0, 0.0, 0.0), 0.3)
    after = pinch(plain, flat.points, ring, 0.5)
    assert (np.linalg.norm(after, axis=1)[ring.sites] <= np.linalg.norm(flat.points, axis=1)[ring.sites]).all()
    assert np.abs(after[:, 2]).max() == 0.0
    ring = ring_at(surface, sheet.points, (0.0, 0.0, 0.05), 0.35, "constant")
    pressed = flatten(surface, sheet.points, ring, 1.0)[ring.sites].astype(np.float64)
    assert np.linalg.svd(pressed - pressed.mean(axis=0))[1][2] < 1e-5
    assert np.ptp(sheet.points[ring.sites][:, 2]) > 0.03  # it was not flat before


def test_relax_brings_edges_back_to_their_neutral_lengths_and_keeps_the_form(ball):
    mesh, surface = ball
    rng = np.random.default_rng(3)
    slid = mesh.points + rng.normal(0.0, 0.012, mesh.points.shape)
    slid = (slid / np.linalg.norm(slid, axis=1, keepdims=True)).astype(np.float32)  # along the sphere only
    a, b = edge_vertices(mesh).T

    def strain(points):
        lengths = np.linalg.norm(points[a] - points[b], axis=1)
        neutral = np.linalg.norm(mesh.points[a] - mesh.points[b], axis=1)
        return np.sqrt(np.mean((lengths / neutral - 1.0) ** 2))

    after = relax(surface, slid, whole_surface(surface), 1.0, 30)
    assert strain(after) < 0.35 * strain(slid)
    assert np.abs(np.linalg.norm(after, axis=1) - 1.0).max() < 4e-3


def test_restore_arrives_exactly(ball):
    mesh, surface = ball
    points = noisy(mesh)
    assert np.array_equal(restore(surface, points, whole_surface(surface), mesh.points, 1.0), mesh.points)
    with pytest.raises(ValueError, match="as many points"):
        restore(surface, points, whole_surface(surface), mesh.points[:-1], 1.0)


def test_a_seam_never_opens():
    whole = grid(21, z=lambda x, y: 0.1 * np.sin(5.0 * x) * np.cos(4.0 * y))
    quads = whole.corners.reshape(-1, 4)
    left = whole.points[quads].mean(axis=1)[:, 0] < 0.0
    order = np.concatenate([np.flatnonzero(left), np.flatnonzero(~left)])
    corners = quads.copy()
    on_seam = np.flatnonzero(whole.points[:, 0] == 0.0)
    copies = {int(v): len(whole.points) + i for i, v in enumerate(on_seam)}
    for row in np.flatnonzero(~left):
        corners[row] = [copies.get(int(v), int(v)) for v in corners[row]]
    doubled = np.concatenate([whole.points, whole.points[on_seam]])
    cut = whole.replace(points=doubled, corners=corners[order].reshape(-1))
    surface, joint = sculpt_surface(cut), sculpt_surface(whole)
    points = noisy(whole)
    split = np.concatenate([points, points[on_seam]])
    ring = ring_at(surface, split, (0.0, 0.0, 0.0), 0.4)
    same = ring_at(joint, points, (0.0, 0.0, 0.0), 0.4)
    for name, after in brushes(surface, split, ring).items():
        assert np.array_equal(after[len(points):], after[on_seam]), name
        welded = brushes(joint, points, same)[name]
        assert np.allclose(after[: len(points)], welded, atol=1e-6), name  # as if it had never been cut
    mask = paint_mask(surface, no_mask(surface), ring)
    assert np.array_equal(mask[len(points):], mask[on_seam])


def test_lips_that_touch_stay_two():
    sheet = grid()
    both = joined(sheet, sheet)  # the same places twice: the rims are seams, the inner sites are not
    surface = sculpt_surface(both)
    middle = len(sheet.points) // 2
    assert surface.site[len(sheet.points) + middle] == len(sheet.points) + middle


def test_masks(ball):
    mesh, surface = ball
    ring = ring_at(surface, mesh.points, (0.0, 1.0, 0.0), 0.5)
    mask = paint_mask(surface, no_mask(surface), ring)
    assert np.allclose(mask[ring.sites], ring.weights, atol=1e-6)
    assert np.array_equal(np.flatnonzero(mask), ring.sites[ring.weights > 0.0])
    assert np.allclose(invert_mask(invert_mask(mask)), mask, atol=1e-7)
    assert np.allclose(invert_mask(mask) + mask, 1.0)
    hard = (mask > 0.2).astype(np.float32)
    soft = blur_mask(surface, hard, whole_surface(surface), iterations=3)
    assert soft.min() >= 0.0
    assert soft.max() <= 1.0
    assert len(np.unique(soft)) > 2
    a, b = edge_vertices(mesh).T
    assert np.abs(soft[a] - soft[b]).max() < 0.6 * np.abs(hard[a] - hard[b]).max()
    wiped = paint_mask(surface, mask, whole_surface(surface), 0.0)
    assert not wiped.any()
