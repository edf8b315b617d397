"""A feather as one material: what it looks like from afar, for renderers that know nothing of barbs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.feather.attributes import column
from core.feather.levels import flat_feather

Color = tuple[float, float, float]


class FeatherLook(NamedTuple):
    """color : linear RGB. roughness, gloss, anisotropy, transmission : 0 .. 1."""

    color: Color
    roughness: float = 0.55
    gloss: float = 0.35
    anisotropy: float = 0.0
    transmission: float = 0.0


def look_of(values: NDArray[np.float32]) -> FeatherLook:
    """The look of a feather, (K,) all its attributes: its colours by how much of the light each of them stops."""
    card = flat_feather(values).picture
    encoded, cover = card[..., :3].astype(np.float64) / 255.0, card[..., 3:].astype(np.float64)
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    red, green, blue = (linear * cover).sum(axis=(0, 1)) / max(float(cover.sum()), 1e-9)

    def both(name: str) -> float:
        first = column(name)
        return float(np.clip(values[first : first + 2].mean(), 0.0, 1.0))

    return FeatherLook(
        (float(red), float(green), float(blue)), both("vaneRoughness*"), both("vaneGloss*"), both("vaneAnisotropy*"),
        both("vaneTransmission*"),
    )
