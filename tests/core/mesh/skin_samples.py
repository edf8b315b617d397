"""Skins, random places on them, and pairs of places a given way apart along the surface."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

Skin = tuple[NDArray[np.float64], NDArray[np.int32]]


def data_mesh(name: str) -> Skin:
    """A mesh of the data set, or a visible skip."""
    folder = os.environ.get("FILOPLUME_DATA")
    if not folder:
        pytest.skip("FILOPLUME_DATA is not set")
    mesh = trimesh.load(Path(folder) / "meshes" / name, process=False, force="mesh")
    return np.array(mesh.vertices, float), np.array(mesh.faces, np.int32)


def cat() -> Skin:
    return data_mesh("odedstein_A/cat/cat-low-resolution.obj")


def ball(subdivisions: int = 3) -> Skin:
    mesh = trimesh.creation.icosphere(subdivisions)
    return np.array(mesh.vertices, float), np.array(mesh.faces, np.int32)


def sheet(n: int, jitter: float, rng: np.random.Generator) -> Skin:
    """The unit square in z = 0, n x n vertices, inner ones moved, diagonals at random."""
    g = np.linspace(0.0, 1.0, n)
    x, y = np.meshgrid(g, g)
    points = np.stack([x.ravel(), y.ravel(), np.zeros(n * n)], axis=1)
    inner = (points[:, :2] > 0).all(1) & (points[:, :2] < 1).all(1)
    points[inner, :2] += (rng.random((inner.sum(), 2)) - 0.5) * jitter / (n - 1)
    triangles = []
    for j in range(n - 1):
        for i in range(n - 1):
            a, b, c, d = j * n + i, j * n + i + 1, (j + 1) * n + i + 1, (j + 1) * n + i
            triangles += [[a, b, c], [a, c, d]] if rng.random() < 0.5 else [[a, b, d], [b, c, d]]
    return points, np.array(triangles, np.int32)


def folded_sheet(seed: int) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float64]]:
    """A sheet of 4 x 1 folded along the middle, its halves .02 apart: points, triangles, and points laid flat
    (the fold at x = 0)."""
    points, triangles = sheet(60, 0.3, np.random.default_rng(seed))
    s, y = (points[:, 0] - 0.5) * 4.0, points[:, 1]
    radius = 0.01
    turn = np.clip(s / radius, -np.pi / 2, np.pi / 2)
    straight = np.maximum(np.abs(s) - radius * np.pi / 2, 0.0)
    folded = np.stack([radius * np.cos(turn) - straight, y, radius * np.sin(turn)], axis=1)
    return folded, triangles, np.stack([s, y, np.zeros(len(s))], axis=1)


def joined(*skins: Skin) -> Skin:
    """Separate skins as one."""
    starts = np.cumsum([0, *(len(p) for p, _ in skins)])
    triangles = [t + start for (_, t), start in zip(skins, starts[:-1], strict=True)]
    return np.concatenate([p for p, _ in skins]), np.concatenate(triangles).astype(np.int32)


def sample(skin: Skin, n: int, rng: np.random.Generator) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """`n` places at random by area: triangle and barycentric weights."""
    points, triangles = skin
    corners = points[triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    total = np.cumsum(areas)
    triangle = np.searchsorted(total, rng.random(n) * total[-1]).clip(0, len(triangles) - 1)
    u, v = rng.random((2, n))
    s = np.sqrt(u)
    return triangle.astype(np.int32), np.stack([1 - s, s * (1 - v), s * v], axis=1)


def place(skin: Skin, triangle: NDArray, bary: NDArray) -> NDArray[np.float64]:
    return np.einsum("nk,nkc->nc", bary, skin[0][skin[1][triangle]])


def mean_edge(skin: Skin) -> float:
    corners = skin[0][skin[1]]
    return float(np.linalg.norm(corners - np.roll(corners, -1, 1), axis=2).mean())


def walk(
    skin: Skin, triangle: NDArray[np.int32], bary: NDArray, length: float, rng: np.random.Generator
) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.bool_]]:
    """Walk straight over the surface in random directions: where each place ends up, and whether it did."""
    points, triangles = skin
    n = len(triangle)
    key = np.sort(np.stack([triangles, np.roll(triangles, -1, 1)], 2).reshape(-1, 2), axis=1)
    code = key[:, 0].astype(np.int64) * len(points) + key[:, 1]
    order = np.argsort(code, kind="stable")
    same = np.flatnonzero(code[order][1:] == code[order][:-1])
    mate = np.full(len(code), -1)
    mate[order[same]], mate[order[same + 1]] = order[same + 1], order[same]
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    side = corners[triangle, 1] - corners[triangle, 0]
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    angle = rng.random(n) * 2 * np.pi
    step = length * (np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * np.cross(normal[triangle], side))
    at, weights, done = triangle.copy(), bary.copy(), np.zeros(n, bool)
    todo = np.arange(n)
    for _ in range(40):
        t = at[todo]
        u, v = corners[t, 1] - corners[t, 0], corners[t, 2] - corners[t, 0]
        uu, uv, vv = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
        du, dv = (step[todo] * u).sum(1), (step[todo] * v).sum(1)
        det = uu * vv - uv * uv
        g1, g2 = (vv * du - uv * dv) / det, (uu * dv - uv * du) / det
        g = np.stack([-g1 - g2, g1, g2], axis=1)
        w = weights[todo]
        with np.errstate(divide="ignore", invalid="ignore"):
            hit = np.where(g < 0, np.maximum(w, 0.0) / -g, np.inf)
        k = hit.argmin(1)
        share = hit[np.arange(len(k)), k]
        ends = share >= 1
        weights[todo[ends]] = w[ends] + g[ends]
        done[todo[ends]] = True
        rows, k, share = todo[~ends], k[~ends], share[~ends][:, None]
        edge = (k + 1) % 3
        old = at[rows]
        other = mate[3 * old + edge]
        inside = other >= 0
        rows, edge, old, other, share = rows[inside], edge[inside], old[inside], other[inside], share[inside]
        w = w[~ends][inside] + share * g[~ends][inside]
        rest = step[rows] * (1 - share)
        new, e = other // 3, other % 3
        i = np.arange(len(rows))
        va = triangles[old, edge]
        turned = triangles[new, e] != va
        b = np.zeros((len(rows), 3))
        b[i, np.where(turned, (e + 1) % 3, e)] = w[i, edge]
        b[i, np.where(turned, e, (e + 1) % 3)] = w[i, (edge + 1) % 3]
        axis = points[triangles[old, (edge + 1) % 3]] - points[va]
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        cos = (normal[old] * normal[new]).sum(1)[:, None]
        sin = (np.cross(normal[old], normal[new]) * axis).sum(1)[:, None]
        step[rows] = rest * cos + np.cross(axis, rest) * sin + axis * (axis * rest).sum(1)[:, None] * (1 - cos)
        at[rows], weights[rows] = new, b
        todo = rows
        if not len(todo):
            break
    return at, weights, done
