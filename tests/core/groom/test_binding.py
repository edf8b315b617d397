"""Guides as sites of the skin, and a coat that follows guides being planted and deleted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.evaluator import Evaluator
from core.groom.binding import MOST_EDITS, CoatBinding, triangle_places
from core.groom.children import Children
from core.groom.guides import Guides
from core.mesh.mesh import Mesh
from core.mesh.roots import Roots
from core.mesh.skin import Skin, skin_at_rest
from core.mesh.surface import place_roots, root_positions
from core.record import freeze
from tests.core.mesh import skin_samples as skins


def quads(n: int = 12) -> Mesh:
    """A bumpy sheet of quads."""
    g = np.linspace(0.0, 1.0, n)
    x, y = np.meshgrid(g, g)
    points = np.stack([x, y, 0.1 * np.sin(6 * x) * np.cos(5 * y)], axis=2).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(n - 1), np.arange(n - 1))
    a = (j * n + i).ravel()
    corners = np.stack([a, a + 1, a + n + 1, a + n], axis=1).astype(np.int32)
    return Mesh(
        points=freeze(points.astype(np.float32)), counts=freeze(np.full(len(a), 4, np.int32)),
        corners=freeze(corners.ravel()), parts=freeze(np.zeros(len(a), np.int32)), part_names=("sheet",),
    )


def guides_at(mesh: Mesh, skin: Skin, triangle: NDArray, bary: NDArray, first_id: int = 0) -> Guides:
    roots = place_roots(mesh, skin.triangles, triangle, bary.astype(np.float32), skin.normals)
    at = root_positions(mesh, roots)
    points = at[:, None] + np.linspace(0, 0.2, 16, dtype=np.float32)[:, None] * roots.frames[:, 2][:, None]
    n = len(at)
    return Guides(
        ids=freeze(np.arange(first_id, first_id + n, dtype=np.int32)), roots=roots, points=freeze(points),
        hold=freeze(np.zeros((n, 16), np.float32)), selected=freeze(np.zeros(n, bool)),
        frozen=freeze(np.zeros(n, bool)), next_id=first_id + n,
    )


def kept(guides: Guides, rows: NDArray) -> Guides:
    return guides.replace(
        ids=guides.ids[rows], roots=guides.roots.take(rows), points=guides.points[rows], hold=guides.hold[rows],
        selected=guides.selected[rows], frozen=guides.frozen[rows],
    )


def joined(a: Guides, b: Guides) -> Guides:
    return Guides(
        ids=np.concatenate([a.ids, b.ids]), roots=a.roots.join(b.roots), points=np.concatenate([a.points, b.points]),
        hold=np.concatenate([a.hold, b.hold]), selected=np.concatenate([a.selected, b.selected]),
        frozen=np.concatenate([a.frozen, b.frozen]), next_id=max(a.next_id, b.next_id),
    )


def test_roots_are_found_on_the_triangulation() -> None:
    mesh = quads()
    skin = skin_at_rest(mesh, Evaluator())
    triangles, rng = skin.triangles, np.random.default_rng(0)
    t, b = skins.sample((mesh.points.astype(float), triangles.vertices), 400, rng)
    roots = place_roots(mesh, triangles, t, b.astype(np.float32))
    turned = roots.replace(  # the same corners named in another order
        corners=roots.corners[:, [2, 0, 1]], weights=roots.weights[:, [2, 0, 1]]
    )
    for one in (roots, turned):
        found, bary = triangle_places(mesh, triangles, one)
        assert np.array_equal(found, t)
        np.testing.assert_allclose(bary, b, atol=1e-6)


def test_a_root_on_the_other_diagonal_of_a_quad_is_found_too() -> None:
    mesh = quads()
    skin = skin_at_rest(mesh, Evaluator())
    rng = np.random.default_rng(1)
    n = 300
    which = np.array([[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]])[rng.integers(0, 4, n)].astype(np.int32)
    roots = Roots(
        faces=rng.integers(0, len(mesh.counts), n).astype(np.int32), corners=which,
        weights=rng.dirichlet(np.ones(3), n).astype(np.float32), uvs=np.zeros((n, 2), np.float32),
        frames=np.tile(np.eye(3, dtype=np.float32), (n, 1, 1)),
    )
    found, bary = triangle_places(mesh, skin.triangles, roots)
    assert np.array_equal(skin.triangles.faces[found], roots.faces)
    there = np.einsum("nk,nkc->nc", bary, mesh.points[skin.triangles.vertices[found]])
    assert np.abs(there - root_positions(mesh, roots)).max() < 0.02  # a quad of 0.09 with a bend
    assert np.abs((there - root_positions(mesh, roots))[:, :2]).max() < 5e-3


def coat() -> tuple[Mesh, Skin, Guides, CoatBinding, Children, NDArray, NDArray]:
    mesh = quads()
    skin = skin_at_rest(mesh, Evaluator())
    rng = np.random.default_rng(2)
    flat = mesh.points.astype(float), skin.triangles.vertices
    t, b = skins.sample(flat, 80, rng)
    guides = guides_at(mesh, skin, t, b)
    ct, cb = skins.sample(flat, 4000, rng)
    bound = CoatBinding(mesh, skin.triangles, guides, ct, cb.astype(np.float32))
    children = Children(ct, cb, bound.binding(), skin.triangles.vertices)
    return mesh, skin, guides, bound, children, ct, cb


def agrees(children: Children, bound: CoatBinding) -> None:
    now = bound.binding()
    assert np.array_equal(children.sites, now.sites[children.ids])
    assert np.array_equal(children.weights, now.weights[children.ids, :2])


def test_planting_and_deleting_touches_few_children() -> None:
    mesh, skin, guides, bound, children, ct, cb = coat()
    assert len(bound.update(guides, children)) == 0
    planted = joined(guides, guides_at(mesh, skin, ct[:3], cb[:3], guides.next_id))
    rows = bound.update(planted, children)
    assert 0 < len(rows) < 0.35 * len(children)
    agrees(children, bound)
    assert {80, 81, 82} <= set(children.sites[rows].ravel().tolist())
    deleted = kept(planted, np.delete(np.arange(83), [0, 40, 81]))
    rows = bound.update(deleted, children)
    assert 0 < len(rows) < 0.5 * len(children)
    agrees(children, bound)
    assert children.sites.max() == 79
    # each child still hangs on guides around it
    where = skins.place((mesh.points.astype(float), skin.triangles.vertices), ct, cb)[children.ids]
    nearest = np.linalg.norm(where[:, None] - deleted.points[None, :, 0], axis=2).min(axis=1)
    w = np.c_[children.weights, 1 - children.weights.sum(1)]
    apart = np.linalg.norm(deleted.points[children.sites, 0] - where[:, None], axis=2)
    assert ((w * apart).sum(axis=1) < nearest + 0.35).all()


def test_much_at_once_or_another_order_binds_anew() -> None:
    mesh, skin, guides, bound, children, ct, cb = coat()
    for other in (
        kept(guides, np.arange(80)[::-1]),
        joined(guides, guides_at(mesh, skin, ct[: MOST_EDITS + 1], cb[: MOST_EDITS + 1], guides.next_id)),
    ):
        rows = bound.update(other, children)
        assert len(rows) == len(children)
        agrees(children, bound)
        fresh = CoatBinding(mesh, skin.triangles, other, ct, cb.astype(np.float32)).binding()
        assert np.array_equal(children.sites, fresh.sites[children.ids])


def test_a_guide_set_elsewhere_is_noticed() -> None:
    mesh, skin, guides, bound, children, ct, cb = coat()
    elsewhere = guides_at(mesh, skin, ct[:1], cb[:1])
    roots = elsewhere.roots.join(guides.roots.take(np.arange(1, 80)))
    bound.update(guides.replace(roots=roots), children)
    agrees(children, bound)
    first = children.row_of[0]  # the child that stands where the guide stands now
    assert children.sites[first][children.weights[first].argmax()] == 0 or children.weights[first].sum() < 0.5
