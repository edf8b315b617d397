"""A grown groom as strands, the form files carry."""

from __future__ import annotations

import numpy as np

from core.groom.children import Children
from core.groom.groom import Groom
from core.groom.guides import Guides
from core.groom.strands import GroomStrands, Strands
from core.mesh.mesh import Mesh
from core.record import freeze


def groom_strands(groom: Groom, mesh: Mesh, children: Children) -> GroomStrands:
    """Guides and children of a groom in rank order, with ids, root UVs, diameters and guide triples."""
    return GroomStrands(
        name=groom.name, guides=guide_strands(groom.guides, groom), children=child_strands(groom, children)
    )


def guide_strands(guides: Guides, groom: Groom) -> Strands:
    """The guides themselves; their widths are those of the coat."""
    n, points = guides.points.shape[:2]
    return Strands(
        counts=freeze(np.full(n, points, np.int32)), points=freeze(guides.points.reshape(-1, 3).copy()),
        widths=freeze(_widths(groom, n, points)), ids=guides.ids, root_uvs=guides.roots.uvs,
    )


def child_strands(groom: Groom, children: Children) -> Strands:
    """The children shown at the coat's density."""
    baked = children.baked(groom.coat.density)
    n, points = baked.points.shape[:2]
    return Strands(
        counts=freeze(np.full(n, points, np.int32)), points=freeze(baked.points.reshape(-1, 3)),
        widths=freeze(_widths(groom, n, points)), ids=freeze(baked.ids), root_uvs=freeze(baked.root_uvs),
        colors=freeze(_colors(groom, n, points)), guide_ids=freeze(groom.guides.ids[baked.sites]),
        guide_weights=freeze(baked.weights),
    )


def _widths(groom: Groom, strands: int, points: int) -> np.ndarray:
    along = np.linspace(groom.coat.width_root, groom.coat.width_tip, points, dtype=np.float32)
    return np.tile(along, strands)


def _colors(groom: Groom, strands: int, points: int) -> np.ndarray:
    t = np.linspace(0.0, 1.0, points, dtype=np.float32)[:, None]
    root, tip = np.array(groom.coat.color_root, np.float32), np.array(groom.coat.color_tip, np.float32)
    return np.tile(root * (1 - t) + tip * t, (strands, 1)).astype(np.float32)
