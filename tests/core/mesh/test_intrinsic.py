"""Binding to sites on a surface: truths from the plane, and the properties it is chosen for."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sparse
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import Delaunay

from core.mesh.intrinsic import HELPER, WORTH_A_PART, Binding, Rebound, SurfaceSites, bind
from core.mesh.scatter import scatter
from core.workers import Workers
from tests.core.mesh import skin_samples as skins


def matrix(bound: Binding, sites: int) -> sparse.csr_matrix:
    rows = np.repeat(np.arange(len(bound.sites)), 3)
    return sparse.csr_matrix(
        (bound.weights.ravel().astype(float), (rows, bound.sites.ravel())), shape=(len(bound.sites), sites)
    )


def sound(bound: Binding, sites: int) -> None:
    assert bound.sites.min(initial=0) >= 0
    assert bound.sites.max(initial=0) < sites
    assert bound.weights.min(initial=0) >= 0
    np.testing.assert_allclose(bound.weights.sum(axis=1), 1.0, atol=1e-6)
    assert np.array_equal(np.sort(bound.order), np.arange(len(bound.sites)))


@pytest.mark.parametrize(("seed", "jitter"), [(0, 0.0), (1, 0.4), (2, 0.4), (3, 0.0)])
def test_on_a_flat_sheet_it_is_delaunay_with_linear_weights(seed: int, jitter: float) -> None:
    rng = np.random.default_rng(seed)
    skin = skins.sheet(36, jitter, rng)
    st_, sb = skins.sample(skin, 250, rng)
    ct, cb = skins.sample(skin, 15_000, rng)
    net = SurfaceSites(*skin, st_, sb, ct, cb, seed)
    bound = net.binding()
    sound(bound, 250)
    assert bound.nearest == 0
    assert bound.helped < 0.05 * len(ct)  # a corner of the sheet is the tip of a sharp cone
    site, child = skins.place(skin, st_, sb)[:, :2], skins.place(skin, ct, cb)[:, :2]
    plane = Delaunay(site)
    simplex = plane.find_simplex(child)
    far = np.minimum(child, 1 - child).min(axis=1) > 0.3
    same = (np.sort(plane.simplices[simplex], axis=1) == np.sort(bound.sites, axis=1)).all(axis=1)
    assert far.sum() > 2000
    assert same[far].all()
    assert same[simplex >= 0].mean() > 0.93
    # linear reproduction, before the weights are stored in single precision
    corner_site = net._label[net._net.origin.reshape(-1, 3)[net._net.home[: len(ct)]]]
    weights = np.where(corner_site < 0, 0.0, net._net.bary[: len(ct)])
    again = np.einsum("nk,nkc->nc", weights, site[corner_site])
    error = np.abs(again - child[net._given]).max(axis=1)
    assert error[far[net._given]].max() < 1e-11
    stored = np.einsum("nk,nkc->nc", bound.weights.astype(float), site[bound.sites])
    assert np.abs(stored - child).max(axis=1)[simplex >= 0].max() < 0.06


def directions(skin: skins.Skin, triangle: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    corners = skin[0][skin[1][triangle]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    v = rng.normal(size=normal.shape)
    v *= np.sign((v * normal).sum(1, keepdims=True))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


@pytest.mark.parametrize("sites", [500, 4000])
def test_on_a_cat_neighbours_get_nearly_the_same_binding(sites: int) -> None:
    skin, rng = skins.cat(), np.random.default_rng(5)
    st_, sb = skins.sample(skin, sites, rng)
    heading = directions(skin, st_, rng)
    ct, cb = skins.sample(skin, 30_000, rng)
    edge = skins.mean_edge(skin)
    middle, worst = [], []
    for share in (0.1, 0.001):
        wt, wb, arrived = skins.walk(skin, ct, cb, share * edge, rng)
        both = np.concatenate([ct[arrived], wt[arrived]]), np.concatenate([cb[arrived], wb[arrived]])
        bound = bind(*skin, st_, sb, *both)
        sound(bound, sites)
        assert bound.helped == bound.nearest == 0
        n = int(arrived.sum())
        w = matrix(bound, sites)
        change = np.asarray(abs(w[:n] - w[n:]).sum(axis=1)).ravel()
        mixed = w @ heading
        length = np.linalg.norm(mixed, axis=1, keepdims=True)
        mixed /= length
        angle = np.degrees(2 * np.arcsin(np.minimum(1, np.linalg.norm(mixed[:n] - mixed[n:], axis=1) / 2)))
        # guides that cancel out have no direction to keep: near them any scheme turns fast
        clear = np.minimum(length[:n, 0], length[n:, 0]) > 0.1
        middle.append(np.percentile(angle, 99.9))
        worst.append((angle[clear].max(), change.max()))
    assert middle[1] < middle[0] / 30
    assert middle[1] < 1.0
    assert worst[1][0] < 3.0
    assert worst[1][1] < 0.05  # a jump would show as about 1


@pytest.mark.parametrize("edited", [False, True])
def test_what_is_left_is_a_closed_delaunay_triangulation_of_the_sites(edited: bool) -> None:
    skin, rng = skins.cat(), np.random.default_rng(11)
    st_, sb = skins.sample(skin, 200, rng)
    net = SurfaceSites(*skin, st_, sb, st_, sb)
    if edited:
        for i in range(20):
            net.add_site(int(st_[i]), [0.3, 0.3, 0.4])
            net.remove_site(i)
    n = net._net
    h = np.flatnonzero(n.origin >= 0)
    after, before = h - h % 3 + (h + 1) % 3, h - h % 3 + (h + 2) % 3
    assert (n.twin[n.twin[h]] == h).all()
    assert (n.origin[n.twin[h]] == n.origin[after]).all()
    assert np.array_equal(n.length[h], n.length[n.twin[h]])
    assert len(h) // 3 == 2 * 200 - 4
    assert set(net._label[n.origin[h]].tolist()) == set(range(200))
    c, a, b = n.length[h], n.length[after], n.length[before]
    angle = np.zeros(len(n.origin))
    angle[h] = np.arccos(np.clip((a * a + b * b - c * c) / (2 * a * b), -1, 1))
    assert (angle[h] + angle[n.twin[h]]).max() < np.pi + 1e-6


def test_sites_bind_to_themselves() -> None:
    skin, rng = skins.cat(), np.random.default_rng(2)
    for sites in (300, 3000):
        st_, sb = skins.sample(skin, sites, rng)
        sb[:20] = np.eye(3)[rng.integers(0, 3, 20)]  # on mesh vertices too
        bound = bind(*skin, st_, sb, st_, sb)
        own = (bound.weights * (bound.sites == np.arange(sites)[:, None])).sum(axis=1)
        assert own[20:].min() >= 0.9996
        twins = len(np.unique(skin[1][st_[:20], sb[:20].argmax(1)])) < 20
        assert twins or own.min() >= 0.9996


def capsule_pair() -> skins.Skin:
    mesh = trimesh.creation.capsule(1.0, 0.25, count=[24, 24])
    a = np.array(mesh.vertices), np.array(mesh.faces, np.int32)
    return skins.joined(a, (a[0] + [0.52, 0.0, 0.0], a[1]))


def test_nothing_leaks_between_legs() -> None:
    skin, rng = capsule_pair(), np.random.default_rng(0)
    half = len(skin[1]) // 2
    st_, sb = skins.sample(skin, 100, rng)
    ct, cb = skins.sample(skin, 20_000, rng)
    bound = bind(*skin, st_, sb, ct, cb)
    other = (st_[bound.sites] < half) != (ct < half)[:, None]
    assert bound.weights[other].sum() == 0.0
    assert bound.nearest == 0


@pytest.mark.parametrize("seed", range(1, 5))
@pytest.mark.parametrize("even", [True, False])
def test_nothing_leaks_through_a_folded_sheet(seed: int, even: bool) -> None:
    folded, triangles, flat = skins.folded_sheet(seed)
    skin, rng = (folded, triangles), np.random.default_rng(seed)
    sites = scatter(folded.astype(np.float32), triangles, 500, seed) if even else skins.sample(skin, 500, rng)
    children = skins.sample(skin, 20_000, rng)
    bound = bind(*skin, *sites, *children)
    here, there = skins.place((flat, triangles), *children), skins.place((flat, triangles), *sites)[bound.sites]
    # the other layer is .02 away in space, but more than six spacings along the surface; the border is no way over
    opposite = (np.sign(there[:, :, 0]) != np.sign(here[:, :1])) & (np.abs(here[:, :1]) > 0.6)
    assert (np.abs(here[:, 0]) > 0.6).sum() > 10_000
    assert bound.weights[opposite].sum() == 0.0
    assert bound.helped == 0


def test_nothing_leaks_on_a_camel() -> None:
    skin, rng = skins.data_mesh("libigl_A/camelhead.off"), np.random.default_rng(3)
    points, triangles = skin
    st_, sb = scatter(points.astype(np.float32), triangles, 500, 3)
    ct, cb = skins.sample(skin, 4_000, rng)
    bound = bind(*skin, st_, sb, ct, cb)
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    length = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    graph = sparse.csr_matrix((length, (ends[:, 0], ends[:, 1])), shape=(len(points),) * 2)
    near_site = triangles[st_, sb.argmax(1)]
    along = dijkstra(graph, directed=False, indices=near_site)[:, triangles[ct, cb.argmax(1)]]
    spacing = np.sqrt(trimesh.Trimesh(points, triangles, process=False).area / 500)
    for k in range(3):
        used = bound.weights[:, k] > 0.02
        reach = along[bound.sites[:, k], np.arange(len(ct))]
        # neighbours are at most two spacings apart; distances along edges of the mesh are up to twice too long
        assert (reach[used] < 5.0 * spacing).all()


def test_adding_and_taking_away_sites_agrees_with_binding_anew() -> None:
    skin, rng = skins.ball(4), np.random.default_rng(4)
    st_, sb = skins.sample(skin, 330, rng)
    ct, cb = skins.sample(skin, 8_000, rng)
    net = SurfaceSites(*skin, st_[:300], sb[:300], ct, cb)
    first = net.binding()
    sites, weights = first.sites.copy(), first.weights.copy()
    shares = []
    for i in range(300, 330):
        rebound = net.add_site(int(st_[i]), sb[i])
        shares.append(len(rebound.rows) / len(ct))
        sites[rebound.rows], weights[rebound.rows] = rebound.sites, rebound.weights
    now = net.binding()
    assert np.array_equal(now.sites, sites)  # nothing else changed
    assert np.array_equal(now.weights, weights)
    anew = bind(*skin, st_, sb, ct, cb)
    other_seed = bind(*skin, st_, sb, ct, cb, seed=9)
    apart = np.asarray(abs(matrix(now, 330) - matrix(anew, 330)).sum(axis=1)).ravel() / 2
    seeds = np.asarray(abs(matrix(other_seed, 330) - matrix(anew, 330)).sum(axis=1)).ravel() / 2
    assert apart.mean() < 0.01 + 2 * seeds.mean()
    assert np.mean(shares) < 0.03
    for i in range(30):
        row = int(rng.integers(0, net.sites)) if i % 2 else net.sites - 1
        rebound = net.remove_site(row)
        sites[sites > row] -= 1
        sites[rebound.rows], weights[rebound.rows] = rebound.sites, rebound.weights
    now = net.binding()
    sound(now, 300)
    assert np.array_equal(now.sites, sites)
    assert np.array_equal(now.weights, weights)
    assert now.helped == 0
    left = bind(*skin, net._site_triangle, net._site_bary, ct, cb)
    apart = np.asarray(abs(matrix(now, 300) - matrix(left, 300)).sum(axis=1)).ravel() / 2
    assert apart.mean() < 0.02


def test_an_added_site_takes_over_where_it_stands() -> None:
    skin, rng = skins.cat(), np.random.default_rng(6)
    st_, sb = skins.sample(skin, 1060, rng)
    net = SurfaceSites(*skin, st_[:1000], sb[:1000], st_, sb)
    for i in range(1000, 1060):
        net.add_site(int(st_[i]), sb[i])
    bound = net.binding()
    own = (bound.weights * (bound.sites == np.arange(1060)[:, None])).sum(axis=1)
    assert own[:1000].min() > 0.999
    assert own[1000:].min() > 0.999  # a tracked point on the spot tells where it is now
    blind = SurfaceSites(*skin, st_[:1000], sb[:1000], st_[:1000], sb[:1000])
    for i in range(1000, 1060):
        blind.add_site(int(st_[i]), sb[i])
    near = matrix(blind.binding(), 1060) - matrix(net.binding(), 1060)[:1000]
    assert abs(near).sum() < 0.02 * 1000  # without one, its place is a blend of the corners'


def test_growing_beyond_the_room_kept_for_new_sites() -> None:
    skin, rng = skins.ball(2), np.random.default_rng(7)
    st_, sb = skins.sample(skin, 720, rng)
    ct, cb = skins.sample(skin, 500, rng)
    net = SurfaceSites(*skin, st_[:10], sb[:10], ct, cb)
    for i in range(10, 720):
        net.add_site(int(st_[i]), sb[i])
    sound(net.binding(), 720)
    assert len(np.unique(net.binding().sites)) > 400


@pytest.mark.parametrize("sites", [1, 2, 3, 4, 5, 8, 20])
def test_few_sites_on_a_closed_skin(sites: int) -> None:
    skin, rng = skins.ball(3), np.random.default_rng(sites)
    st_, sb = skins.sample(skin, sites, rng)
    ct, cb = skins.sample(skin, 2_000, rng)
    net = SurfaceSites(*skin, st_, sb, ct, cb)
    bound = net.binding()
    sound(bound, sites)
    assert bound.nearest == 0
    assert (net._kind == HELPER).sum() <= (6 if sites < 4 else 1)
    if sites >= 2:
        net.remove_site(0)
        sound(net.binding(), sites - 1)


def test_a_piece_without_a_site_goes_to_the_nearest_until_it_gets_one() -> None:
    a = skins.ball(2)
    skin = skins.joined(a, (a[0] + [5.0, 0, 0], a[1]))
    half = len(a[1])
    rng = np.random.default_rng(8)
    st_, sb = skins.sample(a, 30, rng)
    ct, cb = skins.sample(skin, 1_000, rng)
    net = SurfaceSites(*skin, st_, sb, ct, cb)
    bound = net.binding()
    far = ct >= half
    assert bound.nearest == far.sum()
    place, site = skins.place(skin, ct, cb), skins.place(skin, st_, sb)
    nearest = np.linalg.norm(place[far][:, None] - site[None], axis=2).argmin(axis=1)
    assert np.array_equal(bound.sites[far, 0], nearest)
    rebound = net.add_site(half + 3, [0.2, 0.3, 0.5])
    assert set(np.flatnonzero(far)) <= set(rebound.rows.tolist())
    bound = net.binding()
    assert bound.nearest == 0
    assert (bound.sites[far] == 30).all()
    net.remove_site(30)
    assert net.binding().nearest == far.sum()


def test_the_same_input_gives_the_same_bits() -> None:
    skin, rng = skins.ball(3), np.random.default_rng(9)
    args = (*skin, *skins.sample(skin, 50, rng), *skins.sample(skin, 500, rng))
    a, b = bind(*args), bind(*args)
    assert np.array_equal(a.sites, b.sites)
    assert np.array_equal(a.weights, b.weights)


@pytest.mark.parametrize("threads", [2, 3])
def test_any_number_of_threads_gives_the_same_bits_and_goes_on_alike(threads: int) -> None:
    points, triangles = skins.ball()
    skin = skins.joined((points, triangles), (points * [1.0, 0.5, 0.8] + [4.0, 0.0, 0.0], triangles))
    rng = np.random.default_rng(3)
    sites, tracked = skins.sample(skin, 300, rng), skins.sample(skin, threads * WORTH_A_PART, rng)
    triangle, bary = (column[0] for column in skins.sample(skin, 1, rng))
    workers = Workers(threads)
    alone, shared = SurfaceSites(*skin, *sites, *tracked), SurfaceSites(*skin, *sites, *tracked, workers=workers)
    bound = alone.binding()
    its = np.sort(bound.sites[bound.order], axis=1)
    assert np.count_nonzero((its[1:] != its[:-1]).any(axis=1)) < 2 * 300  # a run for each triangle of sites
    for edit in (
        lambda net: net.binding()[:3],
        lambda net: rebound_in_order(net.add_site(triangle, bary)),
        lambda net: rebound_in_order(net.remove_site(17)),
    ):
        for one, other in zip(edit(alone), edit(shared), strict=True):
            np.testing.assert_array_equal(one, other)
    workers.close()


def rebound_in_order(rebound: Rebound) -> tuple[np.ndarray, ...]:
    order = np.argsort(rebound.rows)
    assert len(order) > 0
    return tuple(column[order] for column in rebound)


def test_no_site_is_refused() -> None:
    skin = skins.ball(1)
    with pytest.raises(ValueError, match="at least one site"):
        bind(*skin, np.zeros(0, np.int32), np.zeros((0, 3)), np.zeros(1, np.int32), np.full((1, 3), 1 / 3))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(4, 16), st.integers(1, 40), st.integers(1, 12))
def test_any_soup_is_bound(seed: int, vertices: int, faces: int, sites: int) -> None:
    """Random triangles: non-manifold, degenerate, intersecting, in scraps, with NaN."""
    rng = np.random.default_rng(seed)
    points = rng.random((vertices, 3)) * 10.0 ** rng.integers(-6, 6)
    points[rng.integers(vertices)] = points[rng.integers(vertices)]
    if seed % 7 == 0:
        points[0] = np.nan
    triangles = rng.integers(0, vertices, (faces, 3)).astype(np.int32)
    st_, sb = rng.integers(0, faces, sites).astype(np.int32), rng.dirichlet(np.ones(3), sites)
    ct, cb = rng.integers(0, faces, 50).astype(np.int32), rng.dirichlet(np.ones(3), 50)
    net = SurfaceSites(points, triangles, st_, sb, ct, cb)
    sound(net.binding(), sites)
    for i in range(3):
        net.add_site(int(st_[i % sites]), sb[(i + 1) % sites])
    for _ in range(3):
        net.remove_site(int(rng.integers(net.sites)))
    sound(net.binding(), sites)
