"""Levels of detail of one feather: card, vane, barbs, barbules; the outline of each keeps to that of the finer one.

    barbules   the ramus of every barb with its barbules; down with its fringe
    barbs      every barb a ribbon as wide as its barbules close the vane
    vane       lofts through those barbs that the outline cannot do without, cut where the vane is split; barbs that
               stand alone stay ribbons, the fringe of down becomes a web
    card       a bent sheet with a picture of the barbs on it (``card``), and coarse webs of the down that stands off

The vane keeps a barb wherever leaving it out would move the outline by more than OUTLINE of the feather's length.
"""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from core.feather.attributes import column
from core.feather.barbs import ANGLE_NOISE, BarbCurves, Barbs, condense, expand
from core.feather.card import FlatPicture, card_of, flat_picture
from core.feather.coloring import down_mesh, shaft_mesh, vane_mesh
from core.feather.down import HAIR_LENGTH, Down, down_hairs
from core.feather.nurbs import Nurbs, evaluate, through
from core.feather.pieces import FeatherMesh, Floats, grid_triangles, joined, ribbons, tangents, unit
from core.feather.shaft import quill
from core.feather.simplify import kept_of_line
from core.feather.surface import LENGTH
from core.random import rand

Level = Literal["card", "vane", "barbs", "barbules"]
LEVELS: tuple[Level, ...] = get_args(Level)
OUTLINE = 0.0025  # of the feather's length
SPLIT = 0.006  # of the length: barbs whose ends stray so differently are not of one surface
BARE = 0.012  # of the length: what may lie open between two barbs of one surface
ROWS = 40  # of a vane, at least, so that its pattern is seen
POINTS, HAIR_POINTS = 10, 12
CARD_HAIR_POINTS, CARD_HAIR_LEAST = 18.0, 7  # of a hair of a card as long as the shaft, and of any
LOOSE = 4  # barbs of one surface that may lie anywhere off a sheet
CARD_QUILL = 12, 7  # of a quill, along and around
WEB_REACH, WEB_AHEAD, WEB_OPEN = 0.8, 0.4, 0.35  # of the length of a fringe's blades; how far two webs stand apart
WEB_THIN = 0.35  # of what hairs hide behind them
WEB_ENDS = 0.75, 0.6  # of the width of a web at its ends, from which blades lean away
RADIUS, BARB_TAPER = column("barbRadius*"), column("barbTaper*")
COVER, COVER_EDGE, COVER_BASE = column("barbCover*"), column("barbCoverEdge*"), column("barbCoverBase*")
HAIR_RADIUS, HAIR_TAPER = column("downHairRadiusVane*"), column("downHairTaperVane*")
FRINGE, FRINGE_LENGTH = column("downHairFringeVane*"), column("downHairFringeLengthVane*")
BARBULES, BARBULE_RADIUS = column("barbuleCount*"), column("barbuleRadius*")
DISTAL, PROXIMAL = column("barbuleLengthDistal*"), column("barbuleLengthProximal*")
ANGLE_DISTAL, ANGLE_PROXIMAL = column("barbuleAngleDistal*"), column("barbuleAngleProximal*")
BARBULE_CURL, BARBULE_NOISE = column("barbuleCurl*"), column("barbuleNoise*")


def feather_mesh(values: NDArray[Any], seed: int = 0, level: Level = "barbs") -> FeatherMesh:
    """One feather as triangles: values (K,) all attributes; `seed`, its id, says how it differs from its like."""
    a = np.ascontiguousarray(values, np.float32)
    barbs = condense(a[None], np.array([seed]))
    curves = expand(a, barbs, 0, POINTS)
    if level == "card":
        pieces, alone = _pieces(a, barbs, curves)
        loose = [np.arange(rows[0], rows[-1] + 1) for rows in pieces if len(rows) <= LOOSE]
        alone = np.concatenate([alone, *loose])
        of_vane = np.setdiff1d(np.arange(len(curves.points)), alone)
        ribbons_of = _barb_ribbons(a, seed, barbs, curves, False, of_vane) if len(of_vane) else []
        standing = _down(a, seed, level)
        standing += _barb_ribbons(a, seed, barbs, curves, False, alone) if len(alone) else []
        quill = quill_mesh(a, *CARD_QUILL)
        return card_of(a, joined([*ribbons_of, quill]), quill, joined(standing) if standing else None)
    parts = _down(a, seed, level)
    if len(curves.points) and level == "vane":
        parts += _lofts(a, seed, barbs, curves)
    elif len(curves.points):
        parts += _barb_ribbons(a, seed, barbs, curves, level == "barbules")
    return joined([*parts, quill_mesh(a)])  # in this order a card paints one over the other


def flat_feather(values: NDArray[Any], seed: int = 0) -> FlatPicture:
    """A picture of one feather lying flat, with its down."""
    return flat_picture(feather_mesh(values, seed, "barbs"))


def vane_patches(values: NDArray[Any], seed: int = 0) -> list[Nurbs]:
    """The vanes of one feather as NURBS, metres: one for each stretch of a side between two splits."""
    a = np.ascontiguousarray(values, np.float32)
    barbs = condense(a[None], np.array([seed]))
    curves = expand(a, barbs, 0, POINTS)
    return [through(curves.points[rows]) for rows in _pieces(a, barbs, curves)[0]]


def quill_mesh(a: Floats, along: int = 40, around: int = 13) -> FeatherMesh:
    """The shaft of one feather as triangles."""
    patch = quill(a)
    grid = evaluate(patch, 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, along)), np.linspace(0.0, 1.0, around))
    middle = 0.5 * (grid[:, 0] + grid[:, around // 2])
    fibres = np.repeat(tangents(middle[None])[0][:, None], around, axis=1)
    normals = unit(grid - grid[:, :-1].mean(axis=1)[:, None])
    across = grid[..., 0] / a[LENGTH]
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(middle, axis=0), axis=1))]) / a[LENGTH]
    flat = np.stack([across - across[:, :1], np.repeat(way[:, None], around, axis=1)], axis=-1)
    parts = [np.ascontiguousarray(v.reshape(-1, v.shape[-1]), np.float32) for v in (grid, normals, fibres, flat)]
    return shaft_mesh(a, parts[0], parts[1], parts[2], grid_triangles(along, around), parts[3])


def _pieces(a: Floats, barbs: Barbs, curves: BarbCurves) -> tuple[list[NDArray[np.intp]], NDArray[np.intp]]:
    """Rows of barbs that each make one surface, thinned as far as the outline allows; and rows that stand alone."""
    found, alone = [], []
    stray = barbs.stray.astype(np.float64) / 16384.0
    for side in (0, 1):
        rows = np.flatnonzero(curves.sides == side)
        apart = SPLIT + 2.1 * float(a[ANGLE_NOISE + side])
        step = np.linalg.norm(np.diff(curves.points[rows].astype(np.float64), axis=0), axis=2)
        widest = 2.0 * np.median(step, axis=0) if len(step) else 0.0
        bare = step - np.minimum(_closed(a, curves)[rows[:-1]], 1.0) * np.minimum(step, widest)
        breaks = np.flatnonzero((np.abs(np.diff(stray[rows])) > apart) | (bare.max(axis=1) > BARE * a[LENGTH])) + 1
        for piece in np.split(rows, breaks):
            if len(piece) == 1:
                alone.append(piece)
            elif len(piece):
                ends = curves.points[piece][:, (POINTS // 2, POINTS - 1)].reshape(len(piece), 6) / a[LENGTH]
                kept = kept_of_line(np.ascontiguousarray(ends, np.float64), OUTLINE)
                kept[::max(1, len(rows) // ROWS)] = True
                found.append(piece[kept])
    return found, np.concatenate([*alone, np.zeros(0, np.intp)])


def _closed(a: Floats, curves: BarbCurves) -> NDArray[Any]:
    """How far barbules close the way to the next barb, (B, P), 1 for all of it."""
    sides, s = curves.sides, curves.places[..., 1]
    closed = a[COVER + sides][:, None] * (1.0 - s) + a[COVER_EDGE + sides][:, None] * s
    base = np.clip(curves.places[..., 0] / 0.25, 0.0, 1.0)
    return np.asarray(closed * (a[COVER_BASE + sides][:, None] * (1.0 - base) + base))


def _tones(barbs: Barbs) -> Floats:
    return np.asarray(1.0 + ((barbs.tone & 0xFE).astype(np.float32) - 128.0) / 128.0, np.float32)


def _lofts(a: Floats, seed: int, barbs: Barbs, curves: BarbCurves) -> list[FeatherMesh]:
    pieces, alone = _pieces(a, barbs, curves)
    found, tones = _barb_ribbons(a, seed, barbs, curves, False, alone) if len(alone) else [], _tones(barbs)
    for rows in pieces:
        grid, side = curves.points[rows], int(curves.sides[rows[0]])
        along = tangents(grid)
        normals = unit(np.cross(along, np.gradient(grid, axis=0))) * (1.0 if side else -1.0)
        triangles = grid_triangles(len(rows), POINTS)
        if side == 0:
            triangles = np.ascontiguousarray(triangles[:, ::-1])
        found.append(vane_mesh(
            a, seed, _rows(grid), _rows(normals), _rows(along), triangles, np.repeat(curves.sides[rows], POINTS),
            _rows(curves.places[rows]), _rows(curves.flat[rows]), np.repeat(tones[rows], POINTS),
            np.repeat(rows, POINTS).astype(np.int32),
        ))
    return found


def _rows(values: NDArray[Any]) -> Floats:
    return np.ascontiguousarray(values.reshape(-1, values.shape[-1]), np.float32)


def _spread(curves: BarbCurves) -> tuple[NDArray[Any], NDArray[Any]]:
    """Unit directions towards the next barb (B, P, 3), square to it, and distances (B, P, 2) to both."""
    points, along = curves.points.astype(np.float64), tangents(curves.points.astype(np.float64))
    across, gap = np.zeros_like(points), np.zeros((*points.shape[:2], 2))
    for side in (0, 1):
        rows = np.flatnonzero(curves.sides == side)
        if len(rows) < 2:
            across[rows] = [0.0, 1.0, 0.0]
            gap[rows] = 1e-5
            continue
        p, t = points[rows], along[rows]
        step = np.diff(p, axis=0)
        before, after = np.concatenate([step[:1], step]), np.concatenate([step, step[-1:]])
        square = [d - t * np.sum(d * t, axis=-1, keepdims=True) for d in (before, after)]
        sizes = [np.linalg.norm(d, axis=-1) for d in square]
        across[rows] = unit(unit(square[0]) + unit(square[1]) + 1e-9)
        widest = 2.0 * np.median(sizes[0], axis=0)
        gap[rows] = np.stack([np.minimum(size, widest) for size in sizes], axis=-1)
    across -= along * np.sum(across * along, axis=-1, keepdims=True)
    return unit(across), gap


def _barb_ribbons(
    a: Floats, seed: int, barbs: Barbs, curves: BarbCurves, with_barbules: bool, rows: NDArray[np.intp] | None = None
) -> list[FeatherMesh]:
    """Barbs as ribbons, with barbules or as wide as these close the vane; all of them, or those of `rows` (n,)."""
    across, gap = _spread(curves)
    sides = curves.sides
    s = curves.places[..., 1]
    ramus = a[LENGTH] * a[RADIUS + sides][:, None] * (1.0 - a[BARB_TAPER + sides][:, None] * s)
    # near its end a barb runs out to a point
    pointed = np.sqrt(np.clip((1.0 - np.linspace(0.0, 1.0, POINTS) ** 6), 0.03, 1.0))
    half = np.repeat(ramus[..., None], 2, axis=-1)
    if not with_barbules:
        half = np.maximum(half, 0.56 * _closed(a, curves)[..., None] * gap)
    half = half * pointed[:, None]
    right = sides == 1
    half = np.where(right[:, None, None], half, half[..., ::-1])
    oriented = across * np.where(right, 1.0, -1.0)[:, None, None]
    drawn = np.arange(len(curves.points)) if rows is None else rows
    points, normals, fibres, triangles = ribbons(
        curves.points[drawn], oriented[drawn], half[drawn, :, 0], 0.22, half[drawn, :, 1])
    each = 2 * POINTS
    flat = _offset_flat(curves.flat[drawn], half[drawn] / a[LENGTH])
    found = [vane_mesh(
        a, seed, points, normals, fibres, triangles, np.repeat(sides[drawn], each),
        _rows(np.repeat(curves.places[drawn], 2, axis=1)), flat, np.repeat(_tones(barbs)[drawn], each),
        np.repeat(drawn.astype(np.int32), each),
    )]
    if with_barbules:
        found += _barbules(a, seed, barbs, curves, oriented, gap.min(axis=-1))
    return found


def _offset_flat(curves: NDArray[Any], half: NDArray[Any]) -> Floats:
    """Places in the flat feather of both edges of ribbons about `curves` (B, P, 2), (B * P * 2, 2)."""
    along = np.gradient(curves, axis=1)
    along = along / np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-12)
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1)[:, :, None] * half[..., None]
    return _rows(curves[:, :, None] + across * np.array([-1.0, 1.0])[:, None])


def _barbules(
    a: Floats, seed: int, barbs: Barbs, curves: BarbCurves, oriented: NDArray[Any], gap: NDArray[Any]
) -> list[FeatherMesh]:
    """Barbules of both sides of every barb as blades of three points that hook down at their ends."""
    found, along = [], tangents(curves.points)
    tones = _tones(barbs)
    for side in (0, 1):
        rows = np.flatnonzero(curves.sides == side)
        number = round(float(a[BARBULES + side]))
        if not len(rows) or not number:
            continue
        at = (np.arange(number) + 0.5) / number * (POINTS - 1)
        low = np.minimum(at.astype(int), POINTS - 2)
        f = (at - low)[:, None]

        def mixed(values: NDArray[Any], rows: NDArray[Any] = rows, low: Any = low, f: Any = f) -> NDArray[Any]:
            wide = values[rows] if values.ndim == 3 else values[rows][..., None]
            return np.asarray(wide[:, low] * (1.0 - f) + wide[:, low + 1] * f)

        root, tangent, out, room = (mixed(v) for v in (curves.points, along, oriented, gap))
        up = unit(np.cross(tangent, out))
        place, flat = mixed(curves.places), mixed(curves.flat)
        for distal in (True, False):
            first, angle = (DISTAL, ANGLE_DISTAL) if distal else (PROXIMAL, ANGLE_PROXIMAL)
            keys = np.arange(root.shape[0] * number).reshape(root.shape[0], number, 1) + (1 << 20) * (2 * side + distal)
            noise = 1.0 + a[BARBULE_NOISE + side] * (2.0 * rand(keys, seed + 71) - 1.0)
            length = room * a[first + side] * noise
            # towards the tip of the feather lies +out on the right side, -out on the left one
            sign = (1.0 if distal else -1.0) * (1.0 if side else -1.0)
            way = unit(tangent * np.cos(a[angle + side]) + out * sign * np.sin(a[angle + side]))
            ends = [root, root + 0.6 * length * way, root + length * (way - a[BARBULE_CURL + side] * up)]
            blades = np.stack(ends, axis=2).reshape(-1, 3, 3)
            spacing = np.linalg.norm(curves.points[rows, -1] - curves.points[rows, 0], axis=-1) / number
            half = a[BARBULE_RADIUS + side] * np.repeat(spacing, number)[:, None] * np.array([1.0, 0.8, 0.15]) * 2.0
            square = unit(np.cross(np.repeat(up.reshape(-1, 1, 3), 3, axis=1), tangents(blades)))
            points, normals, fibres, triangles = ribbons(np.asarray(blades, np.float32), square, half, 0.1)
            fibres = np.repeat(_rows(tangent), 6, axis=0)  # highlights follow the barb, as on the vane
            found.append(vane_mesh(
                a, seed, points, normals, fibres, triangles, np.full(len(points), side),
                np.repeat(_rows(place), 6, axis=0), np.repeat(_rows(flat), 6, axis=0),
                np.repeat(np.repeat(tones[rows], number), 6), np.repeat(np.repeat(rows, number), 6).astype(np.int32),
            ))
    return found


def _down(a: Floats, seed: int, level: Level) -> list[FeatherMesh]:
    number = HAIR_POINTS
    if level == "card":
        longest = max(float(a[HAIR_LENGTH + side]) for side in (0, 1))
        number = int(np.clip(np.ceil(CARD_HAIR_POINTS * longest), CARD_HAIR_LEAST, HAIR_POINTS))
    hairs = down_hairs(a, seed, number)
    if not len(hairs.points):
        return []
    sides, count = hairs.sides, len(hairs.points)
    s = np.linspace(0.0, 1.0, number)
    half = a[LENGTH] * a[HAIR_RADIUS + sides][:, None] * (1.0 - a[HAIR_TAPER + sides][:, None] * s)
    tones = (0.82 + 0.36 * rand(np.arange(count), seed + 72)).astype(np.float32)
    across = _beside(hairs, seed)
    points, normals, fibres, triangles = ribbons(hairs.points, across, half, 0.5)
    flat = _flat_beside(a, points, hairs.points, hairs.flat)
    found = [down_mesh(a, points, normals, fibres, triangles, flat, np.repeat(tones, 2 * number))]
    if level in ("barbs", "barbules"):
        return found + _fringe(a, seed, hairs, across, tones)
    webs = [_web(a, hairs, across, half, tones, sheet) for sheet in (-1.0, 1.0)]
    return webs if level == "card" else webs + found


def _web(
    a: Floats, hairs: Down, across: NDArray[Any], half: NDArray[Any], tones: Floats, sheet: float
) -> FeatherMesh:
    """The fringe of hairs as one of two thin webs that cross along each of them, from where its blades lean to."""
    number = hairs.points.shape[1]
    s = np.linspace(0.0, 1.0, number)
    reach = a[LENGTH] * a[FRINGE_LENGTH + hairs.sides][:, None] * (1.0 - 0.5 * s)
    along = tangents(hairs.points)
    leaning = unit(across + sheet * WEB_OPEN * np.cross(along, across))
    curves = np.asarray(hairs.points + along * (WEB_AHEAD * reach)[..., None], np.float32)
    curves[:, 0] = hairs.points[:, 0]
    wide = half + WEB_REACH * reach * np.array([WEB_ENDS[0], *[1.0] * (number - 2), WEB_ENDS[1]])
    points, normals, fibres, triangles = ribbons(curves, leaning, wide, 0.5)
    flat = _flat_beside(a, points, hairs.points, hairs.flat)
    return down_mesh(a, points, normals, fibres, triangles, flat, np.repeat(tones, 2 * number), WEB_THIN)


def _flat_beside(a: Floats, points: Floats, curves: NDArray[Any], flat: NDArray[Any]) -> Floats:
    """Places in the flat feather (V, 2) of points (V, 3) close to `curves` (..., 3), whose own are `flat` (..., 2)."""
    count = len(points) // max(curves.size // 3, 1)
    off = points - np.repeat(_rows(curves), count, axis=0)
    return np.asarray(np.repeat(_rows(flat), count, axis=0) + off[:, :2] / a[LENGTH], np.float32)


def _beside(hairs: Down, seed: int) -> NDArray[Any]:
    """Unit directions square to hairs, each turned its own way out of the plane of the feather."""
    along = tangents(hairs.points)
    turn = (2.0 * rand(np.arange(len(along)), seed + 73) - 1.0)[:, None, None] * 0.9
    flat = unit(np.cross(np.broadcast_to(np.array([0.0, 0.0, 1.0]), along.shape), along) + 1e-9)
    up = np.cross(along, flat)
    return unit(flat * np.cos(turn) + up * np.sin(turn))


def _fringe(
    a: Floats, seed: int, hairs: Down, across: NDArray[Any], tones: Floats
) -> list[FeatherMesh]:
    """The fine barbules of down hairs, each a blade that ends in a point."""
    found = []
    for side in (0, 1):
        rows = np.flatnonzero(hairs.sides == side)
        number = round(float(a[FRINGE + side]))
        if not len(rows) or not number:
            continue
        at = (np.arange(2 * number) + 0.5) / (2 * number) * (HAIR_POINTS - 1)
        low = np.minimum(at.astype(int), HAIR_POINTS - 2)
        f = (at - low)[:, None]
        along = tangents(hairs.points)
        root, tangent, beside = (v[rows][:, low] * (1.0 - f) + v[rows][:, low + 1] * f for v in (
            hairs.points, along, across))
        flat = hairs.flat[rows][:, low] * (1.0 - f) + hairs.flat[rows][:, low + 1] * f
        keys = np.arange(len(rows) * 2 * number).reshape(len(rows), -1, 1) + (1 << 22) * side
        sign = np.where(np.arange(2 * number) % 2 == 0, 1.0, -1.0)[:, None]
        length = a[LENGTH] * a[FRINGE_LENGTH + side] * (0.7 + 0.6 * rand(keys, seed + 74)) * (1.0 - 0.5 * at / at[-1])[
            :, None]
        up = np.cross(tangent, beside)
        way = unit(0.7 * tangent + sign * beside + 0.5 * up * (2.0 * rand(keys, seed + 75) - 1.0))
        blades = np.stack([root, root + length * way], axis=2).reshape(-1, 2, 3)
        half = np.full((len(blades), 2), 0.35 * a[LENGTH] * a[HAIR_RADIUS + side]) * [1.0, 0.25]
        square = unit(np.cross(np.repeat(up.reshape(-1, 1, 3), 2, axis=1), tangents(blades)))
        points, normals, fibres, triangles = ribbons(np.asarray(blades, np.float32), square, half, 0.3)
        found.append(down_mesh(
            a, points, normals, fibres, triangles, _flat_beside(a, points, root, flat),
            np.repeat(tones[rows], 8 * number), 0.8,
        ))
    return found
