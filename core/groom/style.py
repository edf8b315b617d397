"""Styles: how a first coat is laid on an animal, before any hand touches it.

A style is data (``resources/presets/*.json``). Lengths are fractions of the bounding-box diagonal unless a
length in metres is given, so the same style fits a mouse and an elephant.
"""

from __future__ import annotations

from importlib import resources

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.falloff import smoothstep
from core.groom.flow import Flow, smooth_over_surface
from core.groom.guides import Guides
from core.mesh.bvh import Bvh, cast_rays, closest_points
from core.mesh.roots import Roots
from core.random import rand
from core.record import Record, freeze
from core.workers import Workers


class Style(Record):
    """Numbers of one style. Angles in degrees, lengths as fractions of the bounding-box diagonal.

    lift_root, lift_tip : angle of the hair to the skin at its root and at its tip.
    lift_power : how soon it lies down (larger: stands longer).
    wander : largest turn of a guide out of the flow, keyed on its id.
    thin_length : length where the body is thin (ears, toes), as a factor; `thin` the thickness that counts as thin.
    face_length : length at the nose, as a factor; full length is reached `face` along the body.
    mane_end : how far from the nose a mane reaches (0: no mane); off the mane, and under the body, hair has
        `body_length`, as a factor.
    """

    name: str
    description: str
    length: float
    length_variation: float = 0.2
    lift_root: float = 40.0
    lift_tip: float = 10.0
    lift_power: float = 1.0
    wander: float = 12.0
    thin: float = 0.06
    thin_length: float = 0.45
    face: float = 0.12
    face_length: float = 0.4
    mane_end: float = 0.0
    body_length: float = 1.0
    width_root: float = 0.0011
    width_tip: float = 0.0002
    color_root: tuple[float, float, float] = (0.045, 0.022, 0.010)
    color_tip: tuple[float, float, float] = (0.42, 0.22, 0.09)
    clump: float = 0.4
    frizz: float = 0.05


def style_names() -> list[str]:
    """Names of the styles that come with the program."""
    folder = resources.files("resources") / "presets"
    return sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".json"))


def load_style(name: str) -> Style:
    """The style of that name, or one sentence naming those there are."""
    entry = resources.files("resources") / "presets" / f"{name}.json"
    if name not in style_names():
        raise UserError(f"there is no preset called {name}; there are {', '.join(style_names())}")
    return msgspec.json.decode(entry.read_bytes(), type=Style)


def length_factors(
    points: NDArray[np.float32], triangles: NDArray[np.int32], normals: NDArray[np.float32], flow: Flow,
    bvh: Bvh, style: Style, workers: Workers | None = None,
) -> NDArray[np.float32]:
    """(V,) float32 factors 0..1 on the length: shorter on the face and where the body is thin."""
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    depth, _, _ = cast_rays(bvh, points - normals * np.float32(1e-4 * diagonal), -normals, 0.5 * diagonal, workers)
    reached = np.isfinite(depth) & (depth >= 0)
    depths = smooth_over_surface(np.where(reached, depth, 0.5 * diagonal), triangles, 16)
    thickness = smoothstep(0.2 * style.thin * diagonal, style.thin * diagonal, depths)
    factor = style.thin_length + (1.0 - style.thin_length) * thickness
    if flow.nose >= 0:
        away = np.where(np.isfinite(flow.distance), flow.distance, diagonal)
        face = smoothstep(0.0, max(style.face, 1e-6) * diagonal, smooth_over_surface(away, triangles, 4))
        factor = factor * (style.face_length + (1.0 - style.face_length) * face)
        if style.mane_end > 0.0:
            end = style.mane_end * diagonal
            mane = (1.0 - smoothstep(0.7 * end, end, away)) * smoothstep(-0.3, 0.5, normals[:, 1])
            factor = factor * (style.body_length + (1.0 - style.body_length) * smooth_over_surface(mane, triangles, 8))
    return freeze(factor.astype(np.float32))


def lay_guides(
    roots: Roots, positions: NDArray[np.float32], root_flow: NDArray[np.float32], lengths: NDArray[np.float32],
    bvh: Bvh, points: NDArray[np.float32], triangles: NDArray[np.int32], normals: NDArray[np.float32],
    directions: NDArray[np.float32], style: Style, first_id: int = 0, seed: int = 0, count: int = 16,
    workers: Workers | None = None,
) -> Guides:
    """Guides that leave the skin at the style's lift and then follow the flow over the body.

    Each guide is traced: at every point the nearest skin gives the normal and the flow there, so long hair
    hugs the animal instead of cutting corners.

    Parameters
    ----------
    roots, positions : N roots and where they stand, (N, 3). root_flow : (N, 3) unit tangents there.
    lengths : (N,) metres. points, triangles, normals, directions : the skin and its per-vertex flow.
    """
    n = len(lengths)
    ids = np.arange(first_id, first_id + n, dtype=np.int32)
    normal = roots.frames[:, 2].astype(np.float64)
    turn = np.radians(style.wander) * (2.0 * rand(ids, seed + 11) - 1.0)
    tilt = 1.0 + 0.25 * (2.0 * rand(ids, seed + 12) - 1.0)
    out = np.empty((n, count, 3), np.float32)
    out[:, 0] = positions
    step = (lengths / (count - 1)).astype(np.float64)[:, None]
    at = positions.astype(np.float64)
    tangent = root_flow.astype(np.float64)
    for k in range(count - 1):
        s = k / (count - 1)
        lift = np.radians(style.lift_tip + (style.lift_root - style.lift_tip) * (1.0 - s) ** style.lift_power) * tilt
        side = np.cross(normal, tangent)
        along = tangent * np.cos(turn)[:, None] + side * np.sin(turn)[:, None]
        at = at + step * (along * np.cos(lift)[:, None] + normal * np.sin(lift)[:, None])
        out[:, k + 1] = at
        if k == count - 2:
            break
        triangle, weights, _ = closest_points(bvh, at.astype(np.float32), np.inf, workers)
        here = triangles[triangle]
        normal_here = np.einsum("nk,nkc->nc", weights, normals[here]).astype(np.float64)
        flow_here = np.einsum("nk,nkc->nc", weights, directions[here]).astype(np.float64)
        normal = _unit(0.5 * normal + 0.5 * _unit(normal_here))
        tangent = 0.6 * tangent + 0.4 * flow_here
        tangent = _unit(tangent - normal * np.sum(tangent * normal, axis=1, keepdims=True))
    return Guides(
        ids=freeze(ids), roots=roots, points=freeze(out), hold=freeze(np.zeros((n, count), np.float32)),
        selected=freeze(np.zeros(n, np.bool_)), frozen=freeze(np.zeros(n, np.bool_)), next_id=first_id + n,
    )


def _unit(vectors: np.ndarray) -> NDArray[np.float64]:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12))
