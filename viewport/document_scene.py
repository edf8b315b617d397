"""From a document and its grown coats to what is drawn."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from core.document import Document, visible_grooms
from core.feather.pieces import FeatherMesh
from core.groom.groom import Coat as CoatRecord
from core.groom.strands import GroomStrands, Strands
from core.mesh.mesh import Mesh
from core.mesh.skin import Skin
from core.record import freeze
from viewport.scene import Coat, Color, GuideLines, Look, Scene, Surface, mean_width

if TYPE_CHECKING:  # their kernels load with the first coat, a window starts without them
    from core.groom.children import Children, Traits

SKIN = (0.36, 0.35, 0.34)
# what bare parts of a feathered animal are painted in, by words in their names: linear RGB
PARTS: dict[str, Color] = {
    "eye": (0.006, 0.005, 0.005), "beak": (0.56, 0.27, 0.13), "bill": (0.56, 0.27, 0.13), "feet": (0.30, 0.17, 0.12),
    "foot": (0.30, 0.17, 0.12), "claw": (0.03, 0.025, 0.02), "toe": (0.30, 0.17, 0.12),
}
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


def feathered(
    scene: Scene, document: Document, skins: Mapping[int, Skin], feathers: tuple[FeatherMesh, ...]
) -> Scene:
    """The scene of a document (``scene_of``) with feathers on its meshes, whose bare parts are painted."""
    under, surfaces = under_feathers(feathers), []
    for item, surface in zip((i for i in document.meshes if not i.hidden), scene.surfaces, strict=True):
        faces = skins[item.id].triangles.faces
        for color, part in painted_parts(item.mesh, faces, surface.triangles):
            surfaces.append(surface._replace(color=under if color is None else color, triangles=part))
    return scene._replace(feathers=feathers, surfaces=tuple(surfaces))


def painted_parts(
    mesh: Mesh, faces: NDArray[np.int32], triangles: NDArray[np.int32]
) -> tuple[tuple[Color | None, NDArray[np.int32]], ...]:
    """The triangles (T, 3) of a feathered mesh by what they are painted in: first None, what feathers stand on.

    faces : (T,) int32, of the mesh, that the triangles are parts of.
    """
    colors = [next((PARTS[word] for word in PARTS if word in name.lower()), None) for name in mesh.part_names]
    number = np.array([-1 if color is None else colors.index(color) for color in colors], np.int64)
    of = number[mesh.parts[faces]] if colors else np.full(len(faces), -1)
    if (of < 0).all():
        return ((None, triangles),)
    return tuple((None if k < 0 else colors[k], freeze(triangles[of == k])) for k in np.unique(of))


def under_feathers(meshes: Iterable[FeatherMesh]) -> Color:
    """What skin between feathers is painted in: as dark as what lies under them."""
    known = [mesh for mesh in meshes if len(mesh.colors)]
    means, share = [mesh.colors.mean(axis=0) for mesh in known], [len(mesh.colors) for mesh in known]
    red, green, blue = (UNDER * float(v) for v in np.average(means, 0, share)) if known else (0.1, 0.1, 0.1)
    return red, green, blue
