"""The shaft: a tapering quill as a NURBS surface, round at the calamus, flattened and grooved below the vanes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.feather.attributes import column
from core.feather.nurbs import Nurbs, clamped_knots
from core.feather.surface import END, LENGTH, NODES, ROW, on_shaft, shaft_table, smoothstep

RADIUS, RADIUS_TIP, SHAFT_TAPER = column("shaftRadius"), column("shaftRadiusTip"), column("shaftTaper")
CALAMUS, CALAMUS_RADIUS = column("shaftCalamusLength"), column("shaftCalamusRadius")
CALAMUS_TAPER = column("shaftCalamusTaper")
FLATNESS, FLATNESS_TIP = column("shaftFlatness"), column("shaftFlatnessTip")
GROOVE, GROOVE_WIDTH, GROOVE_START = column("shaftGrooveDepth"), column("shaftGrooveWidth"), column("shaftGrooveStart")
INSET, RISE = column("shaftTipInset"), column("shaftRise")
SECTIONS = 26  # control points along the quill; the first and the last section close it
# a circle as a rational quadratic of nine control points, from its lowest point round and back
CORNERS = np.array([[0, -1], [1, -1], [1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1]], np.float64)
WEIGHTS = np.array([1.0, np.sqrt(0.5), 1.0, np.sqrt(0.5), 1.0, np.sqrt(0.5), 1.0, np.sqrt(0.5), 1.0])
CIRCLE_KNOTS = np.array([0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1], np.float64)


@njit(cache=True)
def shaft_end(a):  # type: ignore[no-untyped-def]
    """Where the shaft ends, in shaft lengths: a little before the tip of the longer vane, never beyond 1."""
    return min(max(a[END], a[END + 1]), 1.0) * (1.0 - 0.8 * a[INSET])


@njit(cache=True)
def shaft_radius(a, place):  # type: ignore[no-untyped-def]
    """Half the width of the shaft at a place along it, in shaft lengths."""
    calamus = max(a[CALAMUS], 1e-3)
    beyond = min(max((place - calamus) / max(shaft_end(a) - calamus, 1e-3), 0.0), 1.0)
    rachis = a[RADIUS] + (a[RADIUS_TIP] - a[RADIUS]) * (1.0 - (1.0 - beyond) ** (1.0 / a[SHAFT_TAPER]))
    below = 1.0 - smoothstep(place / calamus)  # 1 at the skin
    swell = 1.0 + (a[CALAMUS_RADIUS] - 1.0) * (1.0 - smoothstep((place - 0.7 * calamus) / (0.6 * calamus)))
    return rachis * swell * (1.0 - a[CALAMUS_TAPER] * below * below)


@njit(
    types.void(
        ROW, types.Array(types.float64, 2, "C", readonly=True), types.float64[::1], types.float64[:, :, ::1]
    ), cache=True, nogil=True,
)
def _sections(a, corners, places, out):  # type: ignore[no-untyped-def]
    table = np.empty((NODES, 12))
    shaft_table(a, table)
    scale, end = np.float64(a[LENGTH]), shaft_end(a)
    for i in range(len(places)):
        place = places[i] * end
        radius = shaft_radius(a, place)
        if i == 0 or i == len(places) - 1:
            radius *= 0.02
        deep = a[FLATNESS] + (a[FLATNESS_TIP] - a[FLATNESS]) * places[i]
        groove = a[GROOVE] * smoothstep((places[i] - a[GROOVE_START]) / 0.1)
        rise = a[RISE] * radius * smoothstep((place - 0.5 * a[CALAMUS]) / max(a[CALAMUS], 1e-3))
        for j in range(len(corners)):
            x, z = corners[j, 0], corners[j, 1]
            if z < 0.0 and x == 0.0:
                z += 2.0 * groove
            elif z < 0.0:
                x *= 1.0 - 0.6 * groove * (1.0 - min(a[GROOVE_WIDTH], 1.0))
            p0, p1, p2 = on_shaft(table, place, radius * x, radius * deep * z + rise)
            out[i, j, 0], out[i, j, 1], out[i, j, 2] = scale * p0, scale * p1, scale * p2


def quill(values: NDArray[Any]) -> Nurbs:
    """The quill of one feather, metres, in its own frame: cubic along (first axis), a rational circle around."""
    inner = (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, SECTIONS - 2))) * 0.5
    places = np.concatenate([[0.0], inner, [1.0]])
    points = np.empty((SECTIONS, len(CORNERS), 3))
    _sections(np.ascontiguousarray(values, np.float32), CORNERS, places, points)
    weights = np.tile(WEIGHTS, (SECTIONS, 1))
    return Nurbs(points, weights, (4, 3), (clamped_knots(SECTIONS, 4), CIRCLE_KNOTS))
