"""From a document and its grown coats to what is drawn."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from core.document import Document, visible_grooms
from core.feather.pieces import FeatherMesh
from core.groom.children import Children, Traits
from core.groom.groom import Coat as CoatRecord
from core.groom.strands import GroomStrands, Strands
from core.mesh.skin import Skin
from viewport.scene import Coat, Color, GuideLines, Look, Scene, Surface, mean_width

SKIN = (0.36, 0.35, 0.34)
DRAWN_POINTS = 16
UNDER = 0.5  # of the colour of feathers: that of the skin they leave bare


def scene_of(document: Document, skins: Mapping[int, Skin], children: Mapping[int, Children]) -> Scene:
    """The scene of every visible mesh (in the pose of its skin) and every visible coat in `children` (by groom id)."""
    grooms = [groom for groom in visible_grooms(document) if groom.id in children]
    coats = {g.mesh_id: look_of(g.coat, children[g.id].traits) for g in grooms}
    surfaces = tuple(
        Surface(
            skins[item.id].points, skins[item.id].normals, skins[item.id].triangles.vertices,
            skin_of(coats[item.id]) if item.id in coats else SKIN,
        )
        for item in document.meshes
        if not item.hidden
    )
    hair = tuple(
        coat_of(g.coat, children[g.id])
        for g in grooms
        if len(children[g.id])
    )
    return Scene(surfaces, hair)


def skin_of(look: Look) -> Color:
    """The colour of skin under a coat: near that of the roots, a little of the tips for where hair is short."""
    r, g, b = (0.7 * (0.75 * root + 0.25 * tip) for root, tip in zip(look.root, look.tip, strict=True))
    return (r, g, b)


def coat_of(coat: CoatRecord, children: Children) -> Coat:
    """The hairs shown at the density they were grown at; the very arrays of `children` when that is all of them."""
    traits = children.traits
    look = look_of(coat, traits)
    widths = widths_of(look, traits)
    whole = Coat(children.points, children.ids, children.roots()[1], look, widths=widths)
    rows = children.shown(traits.density)
    if len(rows) == len(children):
        return whole
    rows = np.sort(rows)  # by place, as `thinned` wants them
    return whole._replace(
        points=whole.points[rows], ids=whole.ids[rows], normals=whole.normals[rows],
        widths=None if widths is None else widths[rows],
    )


def look_of(coat: CoatRecord, traits: Traits) -> Look:
    """How the hairs of a coat look; widths that differ are here the average of them all."""
    root, tip = (float(np.mean(width)) if np.size(width) else 0.0 for width in (traits.width_root, traits.width_tip))
    return Look(root=coat.color_root, tip=coat.color_tip, root_width=root, tip_width=tip)


def widths_of(look: Look, traits: Traits) -> np.ndarray | None:
    """Factors (N,) float32 on the widths of the look where those of the hairs differ; None where they do not."""
    if not isinstance(traits.width_root, np.ndarray) and not isinstance(traits.width_tip, np.ndarray):
        return None
    mean = mean_width(look)
    each = traits.width_root + (np.asarray(traits.width_tip) - traits.width_root) / 3.0
    return np.asarray(each / mean if mean > 0.0 else np.zeros_like(each), np.float32)


def scene_of_strands(groom: GroomStrands) -> Scene:
    """The scene of a groom file without its animal: hairs where it has some, else guides as hairs."""
    if groom.children is not None and len(groom.children):
        return Scene(coats=(_coat(groom.children),))
    if groom.guides is not None and len(groom.guides):
        points = resampled(groom.guides)
        return Scene(guides=(GuideLines(points, np.zeros(len(points), np.uint8)),))
    return Scene()


def _coat(strands: Strands) -> Coat:
    points = resampled(strands)
    size = float(np.linalg.norm(np.ptp(strands.points, axis=0)))
    width = float(np.median(strands.widths)) if strands.widths is not None else 0.0005 * size
    ids = strands.ids if strands.ids is not None else np.arange(len(strands), dtype=np.int32)
    normal = points[:, 1] - points[:, 0]
    normal = (normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)).astype(np.float32)
    look = Look(root_width=max(width, 1e-4 * size), tip_width=0.2 * max(width, 1e-4 * size))
    return Coat(points, ids, normal, look)


def resampled(strands: Strands) -> np.ndarray:
    """(S, DRAWN_POINTS, 3) float32: points at even steps of the parameter of each strand, for drawing."""
    starts = np.cumsum(strands.counts) - strands.counts
    at = np.linspace(0.0, 1.0, DRAWN_POINTS)[None, :] * (strands.counts[:, None] - 1)
    low = np.minimum(at.astype(np.int64), strands.counts[:, None] - 2)
    share = (at - low)[..., None]
    first = strands.points[starts[:, None] + low]
    return np.ascontiguousarray(first * (1 - share) + strands.points[starts[:, None] + low + 1] * share, np.float32)


def under_feathers(meshes: Iterable[FeatherMesh]) -> Color:
    """What skin between feathers is painted in: as dark as what lies under them."""
    means = [mesh.colors.mean(axis=0) for mesh in meshes if len(mesh.colors)]
    red, green, blue = (UNDER * float(v) for v in np.mean(means, axis=0)) if means else (0.1, 0.1, 0.1)
    return red, green, blue
