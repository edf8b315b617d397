"""A grown groom as strands, the form files carry."""

from __future__ import annotations

import numpy as np

from core.groom.children import Children, Number, Traits
from core.groom.groom import Groom
from core.groom.guides import Guides
from core.groom.strands import GroomStrands, Strands
from core.mesh.mesh import Mesh
from core.record import freeze


def groom_strands(groom: Groom, mesh: Mesh, children: Children) -> GroomStrands:
    """Guides and children of a groom in rank order, with ids, root UVs, diameters and guide triples."""
    return GroomStrands(
        name=groom.name, guides=guide_strands(groom.guides, children.traits), children=child_strands(groom, children)
    )


def guide_strands(guides: Guides, traits: Traits) -> Strands:
    """The guides themselves, as wide as the hairs of the coat are on the average."""
    n, points = guides.points.shape[:2]
    widths = _widths(_mean(traits.width_root), _mean(traits.width_tip), n, points)
    return Strands(
        counts=freeze(np.full(n, points, np.int32)), points=freeze(guides.points.reshape(-1, 3).copy()),
        widths=freeze(widths), ids=guides.ids, root_uvs=guides.roots.uvs,
    )


def child_strands(groom: Groom, children: Children) -> Strands:
    """The children shown at the density they were grown at, as wide as they were then."""
    traits = children.traits
    baked = children.baked(traits.density)
    rows = children.row_of[baked.ids]
    n, points = baked.points.shape[:2]
    widths = _widths(_of_rows(traits.width_root, rows), _of_rows(traits.width_tip, rows), n, points)
    return Strands(
        counts=freeze(np.full(n, points, np.int32)), points=freeze(baked.points.reshape(-1, 3)),
        widths=freeze(widths), ids=freeze(baked.ids), root_uvs=freeze(baked.root_uvs),
        colors=freeze(_colors(groom, n, points)), guide_ids=freeze(groom.guides.ids[baked.sites]),
        guide_weights=freeze(baked.weights),
    )


def _mean(number: Number) -> float:
    return float(np.mean(number)) if np.size(number) else 0.0


def _of_rows(number: Number, rows: np.ndarray) -> Number:
    return number[rows] if isinstance(number, np.ndarray) else number


def _widths(root: Number, tip: Number, strands: int, points: int) -> np.ndarray:
    """Diameters (strands * points,) float32 that go evenly from root to tip."""
    if isinstance(root, np.ndarray) or isinstance(tip, np.ndarray):
        return np.linspace(
            np.broadcast_to(root, strands), np.broadcast_to(tip, strands), points, axis=1, dtype=np.float32
        ).ravel()
    return np.tile(np.linspace(root, tip, points, dtype=np.float32), strands)


def _colors(groom: Groom, strands: int, points: int) -> np.ndarray:
    t = np.linspace(0.0, 1.0, points, dtype=np.float32)[:, None]
    root, tip = np.array(groom.coat.color_root, np.float32), np.array(groom.coat.color_tip, np.float32)
    return np.tile(root * (1 - t) + tip * t, (strands, 1)).astype(np.float32)
