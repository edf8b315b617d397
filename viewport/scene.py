"""What is drawn: plain tuples of arrays, made anew for every picture at no cost.

Buffers on the graphics card are kept by the identity (``is``) of these arrays. Colours are linear, in Rec. 709
primaries. Points are in world space, metres.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from core.feather.pieces import FeatherMesh

Color = tuple[float, float, float]
MOST_BOUNDING, ALONG = 5_000, 5  # strands, and points of each, looked at to find how large the scene is
Floats = NDArray[np.float32]
Ramp = Literal["map", "heat", "signed"]
RAMPS: tuple[Ramp, ...] = get_args(Ramp)


class Surface(NamedTuple):
    """A triangulated mesh.

    points : (V, 3) float32. normals : (V, 3) float32, unit. triangles : (T, 3) int32.
    color : linear RGB of the skin; under a coat take :func:`skin_under`.
    values : (V,) float32 or None, a map to be shown as colours, 0 .. 1.
    ramp : the colours: "map" flat, so that they can be compared; "heat" the same ones in light, so that the form is
        seen; "signed" in light, 0.5 stands for nothing.
    ghost : drawn translucent, over what is behind it.
    edges : (E, 2) int32 or None, the lines of a wire picture: the edges of the polygons, without the diagonals that
        triangulation added. Without them all edges of the triangles are drawn.
    covered : under a coat, where little light of the sky arrives; None for wherever the scene has coats.
    """

    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    color: Color = (0.36, 0.35, 0.34)
    values: np.ndarray | None = None
    ramp: Ramp = "map"
    ghost: bool = False
    edges: np.ndarray | None = None
    covered: bool | None = None


class Look(NamedTuple):
    """How hair looks.

    root, tip : linear RGB at both ends; `blend` is where along the hair (0 .. 1) they meet half and half.
    value_variation, hue_variation : spread of brightness and of warmth between hairs, 0 none .. 1 strong.
    root_width, tip_width : diameters in metres.
    gloss : strength of both highlights. roughness : their longitudinal width in radians.
    depth : how quickly light is swallowed inside the coat, 1 usual; 0 gives no shadow of hair upon hair.
    """

    root: Color = (0.055, 0.030, 0.016)
    tip: Color = (0.43, 0.225, 0.105)
    blend: float = 0.42
    value_variation: float = 0.35
    hue_variation: float = 0.25
    root_width: float = 8e-5
    tip_width: float = 1e-5
    gloss: float = 1.0
    roughness: float = 0.16
    depth: float = 1.0


class Coat(NamedTuple):
    """Hairs with the same number of points P each.

    points : (N, 3, P) or (N, P, 3) float32, root first (with P = 3 the former is taken).
    ids : (N,) integers; the variation between hairs is keyed on them.
    normals : (N, 3) float32, unit, of the skin at the roots.
    tints : (N, 3) float32 or None, linear factors on the colour of each hair (a painted map).
    widths : (N,) float32 or None, factors on the width of each hair.
    order : (M,) int32 or None, the rows that are shown, any first part of them an even coat; None for all rows.
    """

    points: np.ndarray
    ids: np.ndarray
    normals: np.ndarray
    look: Look = Look()
    tints: np.ndarray | None = None
    widths: np.ndarray | None = None
    order: np.ndarray | None = None


class GuideLines(NamedTuple):
    """Guides as lines of constant width in pixels.

    points : (G, P, 3) or (G, 3, P) float32. states : (G,) uint8, indices into `colors`: plain, selected, frozen,
    sprayed, trouble. opacity : of plain guides, those nothing is said about. normals : (G, 3) float32 of the skin at
    the roots, or None when all guides are drawn from all sides.
    """

    points: np.ndarray
    states: np.ndarray
    colors: tuple[Color, ...] = (
        (0.74, 0.39, 0.10), (1.0, 0.86, 0.55), (0.25, 0.45, 0.75), (0.20, 0.60, 0.42), (0.85, 0.09, 0.07)
    )
    pixels: float = 1.5
    opacity: float = 0.85
    normals: np.ndarray | None = None


class Lights(NamedTuple):
    """Key, fill and rim light: directions towards the light, linear RGB strengths.

    Directions are in camera space (x right, y up, z towards the viewer) when `follow_camera`, else in world space.
    """

    key: Color = (-0.62, 0.80, 0.55)
    key_color: Color = (3.3, 3.1, 2.85)
    fill: Color = (0.85, 0.15, 0.6)
    fill_color: Color = (0.34, 0.38, 0.46)
    rim: Color = (0.55, 0.5, -0.85)
    rim_color: Color = (1.5, 1.55, 1.7)
    sky_color: Color = (0.42, 0.44, 0.48)
    ground_color: Color = (0.12, 0.105, 0.09)
    follow_camera: bool = True


class Scene(NamedTuple):
    """Everything in one picture. `background` is display RGB 0 .. 1 at the top and at the bottom.

    clear : nothing is behind; finished pictures then hold sRGB times what is covered, and that as their fourth number.

    feathers : of finished pictures. quick_feathers : the same with fewer triangles, of moving ones.
    """

    surfaces: tuple[Surface, ...] = ()
    coats: tuple[Coat, ...] = ()
    guides: tuple[GuideLines, ...] = ()
    lights: Lights = Lights()
    background: tuple[Color, Color] = ((0.2275, 0.2314, 0.2471), (0.1216, 0.1255, 0.1373))
    exposure: float = 1.0
    feathers: tuple[FeatherMesh, ...] = ()
    quick_feathers: tuple[FeatherMesh, ...] = ()
    clear: bool = False


def thinned(coat: Coat, most: int) -> Coat:
    """The coat with at most `most` hairs: a half, a third ... of those shown.

    They are made wider, between what keeps the look of one hair and what keeps the cover of all. Rows of
    grown coats are sorted by place, so that equal steps leave an even coat where no order is known.
    """
    shown = len(coat.points) if coat.order is None else len(coat.order)
    step = -(-shown // max(most, 1))
    if step <= 1:
        return coat
    rows = np.arange(0, shown, step) if coat.order is None else np.sort(coat.order[: shown // step])
    look, wider = coat.look, step**0.75
    return Coat(
        coat.points[rows], np.asarray(coat.ids)[rows], coat.normals[rows],
        look._replace(root_width=look.root_width * wider, tip_width=look.tip_width * wider),
        None if coat.tints is None else coat.tints[rows],
        None if coat.widths is None else coat.widths[rows],
    )


def mean_width(look: Look) -> float:
    """Mean diameter in metres along a hair: the taper goes with the square of the way from the root."""
    return look.root_width + (look.tip_width - look.root_width) / 3.0


def skin_under(look: Look) -> Color:
    """The colour of skin that never shines through a coat of that look."""
    r, g, b = (0.6 * c for c in look.root)
    return (r, g, b)


def root_normals(points: np.ndarray, surface: Surface) -> Floats:
    """Normals (N, 3) at the first points of the hairs (see :class:`Coat`), from the nearest vertex of the surface."""
    if len(points) == 0 or len(surface.points) == 0:
        return np.zeros((len(points), 3), np.float32)
    roots = points[:, :, 0] if points.shape[1] == 3 else points[:, 0, :]
    return np.ascontiguousarray(surface.normals[cKDTree(surface.points).query(roots)[1]], dtype=np.float32)


def point_arrays(scene: Scene) -> list[np.ndarray]:
    """Arrays (n, 3) of vertices, (N, 3, P) or (N, P, 3) of strands: everything that takes room."""
    meshes = [surface.points for surface in scene.surfaces]
    meshes += [mesh.points for mesh in scene.quick_feathers or scene.feathers]
    return meshes + [coat.points for coat in scene.coats] + [lines.points for lines in scene.guides]


def bounding_points(points: np.ndarray) -> np.ndarray:
    """(n, 3): the vertices of one of :func:`point_arrays`, or points along its strands (some of many)."""
    if points.ndim == 2:
        return points
    axis = 2 if points.shape[1] == 3 else 1
    points = points[:: 1 + len(points) // MOST_BOUNDING]
    along = np.unique(np.linspace(0, points.shape[axis] - 1, ALONG).astype(np.intp))
    return np.concatenate([points.take(at, axis=axis) for at in along])


def direction(vector: ArrayLike) -> NDArray[np.float64]:
    """The vector (3,) with length 1."""
    v = np.asarray(vector, np.float64)
    return v / max(float(np.linalg.norm(v)), 1e-12)
