"""Children against a plain evaluation with rotation matrices, and what a coat promises."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from core.groom.children import Children, Shape, evaluate, moved_guides, update_roots
from core.mesh.intrinsic import Rebound, SurfaceSites
from core.mesh.normals import vertex_normals
from core.workers import Workers
from tests.core.mesh import skin_samples as skins

GUIDES = 150


class Fur(NamedTuple):
    children: Children
    sites: SurfaceSites
    points: NDArray[np.float32]  # of guides
    normals: NDArray[np.float32]
    skin: NDArray[np.float32]
    triangles: NDArray[np.int32]


def fur(count: int = 16, children: int = 3000, lift: float = 15.0) -> Fur:
    """Straight guides at a lift in random directions on a bumpy ball; the first children stand where guides stand."""
    rng = np.random.default_rng(count)
    points, triangles = skins.ball(3)
    points *= 1.0 + 0.1 * np.sin(5.0 * points[:, :1])
    st, sb = skins.sample((points, triangles), GUIDES, rng)
    ct, cb = skins.sample((points, triangles), children, rng)
    ct, cb = np.concatenate([st, ct]), np.concatenate([sb, cb]).astype(np.float32)
    skin = points.astype(np.float32)
    vertex = vertex_normals(skin, triangles)
    normals = np.einsum("nk,nkc->nc", sb, vertex[triangles[st]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    along = np.cross(normals, rng.normal(size=normals.shape))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    heading = np.sin(np.radians(lift)) * normals + np.cos(np.radians(lift)) * along
    curves = skins.place((points, triangles), st, sb)[:, None] + np.linspace(0, 0.5, count)[:, None] * heading[:, None]
    sites = SurfaceSites(points, triangles, st, sb, ct, cb)
    grown = Children(ct, cb, sites.binding(), triangles, count=count)
    update_roots(grown, skin, vertex)
    return Fur(grown, sites, curves.astype(np.float32), normals.astype(np.float32), skin, triangles)


def plainly(f: Fur) -> NDArray[np.float64]:
    """The same with scipy's rotations, double precision, (N, P, 3)."""
    c = f.children
    root, normal = c.roots()
    out = np.repeat(root[:, None].astype(float), c.count, axis=1)
    weights = np.concatenate([c.weights, 1 - c.weights.sum(1, keepdims=True)], axis=1).astype(float)
    for k in range(3):
        a = f.normals[c.sites[:, k]].astype(float)
        axis = np.cross(a, normal)
        size = np.linalg.norm(axis, axis=1, keepdims=True)
        angle = np.arctan2(size, (a * normal).sum(1, keepdims=True))
        turn = Rotation.from_rotvec(axis / np.maximum(size, 1e-12) * angle).as_matrix()
        local = (f.points - f.points[:, :1])[c.sites[:, k]].astype(float)
        out += (weights[:, k] * c.length)[:, None, None] * np.einsum("nij,npj->npi", turn, local)
    return out


@pytest.mark.parametrize("count", [16, 5])
def test_it_is_the_mean_of_guides_turned_with_the_skin(count: int) -> None:
    f = fur(count)
    f.children.length = np.linspace(0.5, 1.2, len(f.children)).astype(np.float32)[f.children.ids]
    assert evaluate(f.children, f.points, f.normals) is None
    np.testing.assert_allclose(f.children.points.transpose(0, 2, 1), plainly(f), atol=3e-6)


def test_a_child_where_a_guide_stands_is_that_guide() -> None:
    f = fur()
    evaluate(f.children, f.points, f.normals)
    baked = f.children.baked()
    assert np.array_equal(baked.ids, np.arange(len(f.children)))
    assert np.abs(baked.points[:GUIDES] - f.points).max() < 0.5 * 4e-4
    assert np.linalg.norm(baked.points[:GUIDES, 0] - f.points[:, 0], axis=1).max() < 1e-6


def test_no_child_dips_where_guides_do_not() -> None:
    f = fur(lift=5.0)
    evaluate(f.children, f.points, f.normals)
    root, normal = f.children.roots()
    height = np.einsum("ncp,nc->np", f.children.points - root[:, :, None], normal)
    assert height[:, 1:].min() > 0.9 * 0.5 / 15 * np.sin(np.radians(5.0))
    lying = f.points - f.points[:, :1]
    mixed = np.einsum(
        "nk,nkpc->npc", np.c_[f.children.weights, 1 - f.children.weights.sum(1)], lying[f.children.sites]
    )
    assert (np.einsum("npc,nc->np", mixed, normal)[:, 1:].min(axis=1) < 0).mean() > 0.01  # plain blending dips


def test_a_turned_and_moved_skin_carries_the_coat_along() -> None:
    f = fur()
    evaluate(f.children, f.points, f.normals)
    before = f.children.points.copy()
    turn, shift = Rotation.from_euler("xyz", [0.4, 1.0, -0.7]).as_matrix(), np.array([0.3, -2.0, 1.0])

    def moved(x: NDArray) -> NDArray[np.float32]:
        return (x @ turn.T + shift).astype(np.float32)

    skin = moved(f.skin)
    update_roots(f.children, skin, vertex_normals(skin, f.triangles))
    evaluate(f.children, moved(f.points), (f.normals @ turn.T).astype(np.float32))
    np.testing.assert_allclose(f.children.points.transpose(0, 2, 1), moved(before.transpose(0, 2, 1)), atol=5e-6)


@pytest.mark.parametrize("shape", [Shape(), Shape(0.4, 0.3, 7)])
def test_only_children_of_moved_guides_are_touched_and_rightly(shape: Shape) -> None:
    f, workers = fur(), Workers(2)
    evaluate(f.children, f.points, f.normals, workers, shape=shape)
    before = f.children.points.copy()
    later = f.points.copy()
    later[10:18, 5:] += np.float32(1e-3)
    moved = moved_guides(f.points, later, workers.ranges)
    assert np.flatnonzero(moved).tolist() == list(range(10, 18))
    rows = evaluate(f.children, later, f.normals, workers, moved=moved, shape=shape)
    assert rows is not None
    assert np.array_equal(rows, np.flatnonzero(moved[f.children.sites].any(axis=1)))
    part = f.children.points.copy()
    evaluate(f.children, later, f.normals, workers, shape=shape)
    assert np.array_equal(part, f.children.points)
    rest = np.setdiff1d(np.arange(len(f.children)), rows)
    assert np.array_equal(part[rest], before[rest])
    assert len(rest) > 2000
    workers.close()


def test_moved_guides_sees_a_single_bit() -> None:
    f = fur()
    other = f.points.copy()
    other[3, 2, 1] = np.nextafter(other[3, 2, 1], np.float32(9))
    other[4, 0, 0] = np.float32(-0.0) if other[4, 0, 0] == 0 else -other[4, 0, 0]
    assert np.flatnonzero(moved_guides(f.points, other)).tolist() == [3, 4]
    assert not moved_guides(f.points, f.points.copy()).any()


def test_zero_shape_changes_nothing_and_roots_never_move() -> None:
    f = fur()
    evaluate(f.children, f.points, f.normals)
    plain = f.children.points.copy()
    evaluate(f.children, f.points, f.normals, shape=Shape(0.0, 0.0, 5))
    assert np.array_equal(plain, f.children.points)
    for shape in (Shape(0.7, 0.0, 1), Shape(0.0, 0.7, 1)):
        evaluate(f.children, f.points, f.normals, shape=shape)
        assert np.array_equal(plain[:, :, 0], f.children.points[:, :, 0])
        assert np.abs(f.children.points[:, :, 15] - plain[:, :, 15]).max() > 0.01


def test_a_column_of_one_number_is_that_number_and_a_row_heeds_its_own() -> None:
    f = fur()
    count = len(f.children)
    evaluate(f.children, f.points, f.normals, shape=Shape(0.0, 0.3, 7))
    calm = f.children.points.copy()
    evaluate(f.children, f.points, f.normals, shape=Shape(0.6, 0.3, 7))
    clumped = f.children.points.copy()
    alike = Shape(np.full(count, 0.6, np.float32), np.full(count, 0.3, np.float32), 7)
    evaluate(f.children, f.points, f.normals, shape=alike)
    assert np.array_equal(f.children.points, clumped)
    every_third = f.children.ids % 3 == 0
    evaluate(f.children, f.points, f.normals, shape=alike._replace(clump=np.where(every_third, 0.6, 0.0)))
    assert np.array_equal(f.children.points[every_third], clumped[every_third])
    assert np.array_equal(f.children.points[~every_third], calm[~every_third])
    assert not np.array_equal(clumped[~every_third], calm[~every_third])
    with pytest.raises(ValueError, match="one number for all"):
        evaluate(f.children, f.points, f.normals, shape=Shape(np.zeros(3, np.float32)))


def test_a_density_for_every_row_keeps_a_child_by_its_own() -> None:
    f = fur()
    evaluate(f.children, f.points, f.normals)
    whole, count = f.children.baked(), len(f.children)
    even = f.children.ids % 2 == 0
    baked = f.children.baked(np.where(even, 0.5, 0.125).astype(np.float32))
    wanted = [i for i in range(count) if i < (0.5 if i % 2 == 0 else 0.125) * count]
    assert baked.ids.tolist() == wanted
    for column, full in zip(baked, whole, strict=True):
        assert np.array_equal(column, full[wanted])


def test_clumped_tips_go_to_the_tip_of_the_strongest_guide_the_nearer_it_stands() -> None:
    f = fur()
    evaluate(f.children, f.points, f.normals)
    plain = f.children.points.copy()
    evaluate(f.children, f.points, f.normals, shape=Shape(clump=1.0))
    weights = np.c_[f.children.weights, 1 - f.children.weights.sum(1)]
    strongest = f.children.sites[np.arange(len(weights)), weights.argmax(axis=1)]
    away = f.points[strongest, 15] - plain[:, :, 15]
    gone = f.children.points[:, :, 15] - plain[:, :, 15]
    share = (gone * away).sum(axis=1) / np.maximum((away * away).sum(axis=1), 1e-12)
    np.testing.assert_allclose(gone, share[:, None] * away, atol=1e-5)
    apart = np.linalg.norm(f.points[strongest, 0] - plain[:, :, 0], axis=1)
    moves = np.linalg.norm(away, axis=1) > 1e-3
    assert share[moves].min() >= 0
    assert share[moves].max() <= 1 + 1e-4
    reach = apart / np.linalg.norm(plain[:, :, 15] - plain[:, :, 0], axis=1)
    by_reach = share[moves][np.argsort(reach[moves])]
    assert (np.diff(by_reach) < 1e-4).all()
    assert by_reach[0] > 0.9


def test_frizz_follows_the_id_not_the_row() -> None:
    f = fur()
    g = fur()
    order = np.random.default_rng(1).permutation(len(g.children))
    for name in ("ids", "triangle", "bary", "sites", "weights", "length"):
        setattr(g.children, name, np.ascontiguousarray(getattr(g.children, name)[order]))
    for one in (f, g):
        evaluate(one.children, one.points, one.normals, shape=Shape(0.0, 1.0, 3))
    assert np.array_equal(f.children.baked().points, g.children.baked().points)


def test_any_density_is_a_prefix() -> None:
    f = fur()
    evaluate(f.children, f.points, f.normals)
    full, tenth = f.children.baked(), f.children.baked(0.1)
    assert len(tenth.ids) == np.ceil(0.1 * len(f.children))
    assert np.array_equal(tenth.points, full.points[: len(tenth.ids)])
    assert len(f.children.baked(0.0).ids) == 0
    np.testing.assert_allclose(full.weights.sum(axis=1), 1.0, atol=1e-6)


def test_an_unbaked_child_costs_at_most_48_bytes() -> None:
    f = fur()
    columns = [v for v in vars(f.children).values() if isinstance(v, np.ndarray) and len(v) == len(f.children)]
    assert sum(v.nbytes for v in columns) / len(f.children) <= 48
    assert f.children.bytes_unbaked == sum(v.nbytes for v in columns)


def test_a_guide_more_or_less_is_followed() -> None:
    f = fur()
    added = f.sites.add_site(7, [0.2, 0.3, 0.5])
    rows = f.children.rebind(added)
    points, normals = np.concatenate([f.points, f.points[:1]]), np.concatenate([f.normals, f.normals[:1]])
    evaluate(f.children, points, normals)
    some = f.children.points.copy()
    fresh = f.sites.binding()
    assert np.array_equal(f.children.sites, fresh.sites[f.children.ids])
    assert np.array_equal(f.children.weights, fresh.weights[f.children.ids, :2])
    points[GUIDES, 1:] += 1.0
    assert set(np.flatnonzero((some != _evaluated(f.children, points, normals)).any((1, 2)))) <= set(rows.tolist())
    gone = f.sites.remove_site(3)
    f.children.guide_removed(3)
    f.children.rebind(gone)
    fresh = f.sites.binding()
    assert np.array_equal(f.children.sites, fresh.sites[f.children.ids])


def _evaluated(children: Children, points: NDArray[np.float32], normals: NDArray[np.float32]) -> NDArray[np.float32]:
    evaluate(children, points, normals)
    return children.points


def test_wrong_guides_are_refused() -> None:
    f = fur()
    with pytest.raises(ValueError, match="16 points"):
        evaluate(f.children, f.points[:, :8], f.normals)
    with pytest.raises(ValueError, match="not there"):
        evaluate(f.children, f.points[:20], f.normals[:20])
    empty = Rebound(np.zeros(0, np.int32), np.zeros((0, 3), np.int32), np.zeros((0, 3), np.float32))
    assert len(f.children.rebind(empty)) == 0
