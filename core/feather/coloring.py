"""Attributes as colours and light of the vertices of a feather."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.feather.attributes import column
from core.feather.pattern import vane_colors
from core.feather.pieces import FeatherMesh, Floats, Optics
from core.random import rand

GLOSS, ROUGHNESS, ANISOTROPY = column("vaneGloss*"), column("vaneRoughness*"), column("vaneAnisotropy*")
TRANSMISSION, OPACITY, IRIDESCENCE = column("vaneTransmission*"), column("vaneOpacity*"), column("iridescence*")
THICKNESS, FILM_START, FILM_NOISE = (
    column("iridescenceThickness"), column("iridescenceStart"), column("iridescenceNoise")
)
UNDER, UNDER_STRENGTH = column("colorUnderRed"), column("colorUnderStrength")
DOWN_COLOR, DOWN_OPACITY, DOWN_TRANSMISSION = (
    column("colorDownRed"), column("downOpacity"), column("downTransmission")
)
SHAFT_ROOT, SHAFT_TIP, SHAFT_BLEND = column("shaftColorRootRed"), column("shaftColorTipRed"), column("shaftColorBlend")
SHAFT_LIGHT = [column("shaftGloss"), column("shaftRoughness"), column("shaftTransmission")]


def optics(values: Floats) -> Optics:
    """What is one for the whole feather."""
    red, green, blue = (float(v) for v in values[UNDER : UNDER + 3])
    under = (red, green, blue, float(values[UNDER_STRENGTH]))
    return Optics(under, float(values[column("iridescenceIndex")]), float(values[column("iridescenceSpread")]))


def vane_mesh(
    values: Floats, seed: int, points: Floats, normals: Floats, fibres: Floats, triangles: NDArray[np.int32],
    sides: NDArray[np.intp], places: Floats, flat: Floats, tones: Floats, barbs: NDArray[np.int32],
) -> FeatherMesh:
    """Vertices of vanes with their colours: sides (V,), places (V, 2), tones (V,) brightness, barbs (V,) numbers."""
    light = np.stack(
        [values[GLOSS + sides], values[ROUGHNESS + sides], values[ANISOTROPY + sides], values[TRANSMISSION + sides]],
        axis=1,
    )
    begun = np.clip((places[:, 0] - values[FILM_START]) / 0.12, 0.0, 1.0)
    noise = 1.0 + values[FILM_NOISE] * (2.0 * rand(barbs, seed + 70).astype(np.float32) - 1.0)
    film = np.stack([values[IRIDESCENCE + sides] * begun, values[THICKNESS] * noise], axis=1)
    colors = np.clip(vane_colors(values, sides, places, seed) * tones[:, None], 0.0, 1.0)
    return FeatherMesh(
        points, normals, fibres, colors.astype(np.float32), light.astype(np.float32), film.astype(np.float32),
        values[OPACITY + sides].astype(np.float32), flat, triangles, optics(values),
    )


def down_mesh(
    values: Floats, points: Floats, normals: Floats, fibres: Floats, triangles: NDArray[np.int32], flat: Floats,
    tones: Floats, thin: float = 1.0,
) -> FeatherMesh:
    """Vertices of down; `thin` is a factor on how much of what is behind them hairs hide."""
    count = len(points)
    light = np.tile(np.array([0.12, 0.6, 0.8, values[DOWN_TRANSMISSION]], np.float32), (count, 1))
    colors = np.clip(values[DOWN_COLOR : DOWN_COLOR + 3] * tones[:, None], 0.0, 1.0)
    return FeatherMesh(
        points, normals, fibres, colors.astype(np.float32), light, np.zeros((count, 2), np.float32),
        np.full(count, values[DOWN_OPACITY] * thin, np.float32), flat, triangles, optics(values),
    )


def shaft_mesh(
    values: Floats, points: Floats, normals: Floats, fibres: Floats, triangles: NDArray[np.int32], flat: Floats
) -> FeatherMesh:
    """Vertices of the shaft."""
    count = len(points)
    f = np.clip((flat[:, 1] - values[SHAFT_BLEND]) / 0.4 + 0.5, 0.0, 1.0)[:, None]
    colors = values[SHAFT_ROOT : SHAFT_ROOT + 3] * (1.0 - f) + values[SHAFT_TIP : SHAFT_TIP + 3] * f
    gloss, roughness, transmission = values[SHAFT_LIGHT]
    light = np.tile(np.array([gloss, roughness, 0.25, transmission], np.float32), (count, 1))
    return FeatherMesh(
        points, normals, fibres, colors.astype(np.float32), light, np.zeros((count, 2), np.float32),
        np.ones(count, np.float32), flat, triangles, optics(values),
    )
