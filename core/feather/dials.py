"""A dozen dials above the attributes: each turns many of them at once, and every one of them stays within reach."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.feather.attributes import COLUMNS, SIDES, limits


class Effect(NamedTuple):
    """What a dial does to one attribute (``*`` for both sides): `amount` added, or multiplied by, at 1."""

    name: str
    how: Literal["add", "times"]
    amount: float


class Dial(NamedTuple):
    """A dial from -1 to 1; at 0 it changes nothing, below 0 it does the opposite of what it says."""

    name: str
    description: str
    effects: tuple[Effect, ...]


def _dial(name: str, description: str, *effects: tuple[str, Literal["add", "times"], float]) -> Dial:
    return Dial(name, description, tuple(Effect(*effect) for effect in effects))


DIALS = (
    _dial(
        "fluff", "More, longer and looser down, and barbs that let go of each other",
        ("downHairDensityVane*", "times", 3.0), ("downHairLengthVane*", "times", 1.5),
        ("downHairEndVane*", "add", 0.25), ("downHairLiftVane*", "add", 0.3), ("barbCoverBase*", "times", 0.6),
    ),
    _dial(
        "age", "Faded, brittle and worn, as before the moult",
        ("wearEdge*", "add", 0.35), ("wearTip*", "add", 0.3), ("frayTip*", "add", 0.4), ("vaneGloss*", "times", 0.5),
        ("colorUnderStrength", "add", 0.2), ("barbMissing*", "add", 0.03), ("iridescence*", "times", 0.6),
    ),
    _dial(
        "wear", "Splits, gaps and bites at the edge",
        ("splitCount*", "add", 4.0), ("gapCount*", "add", 2.0), ("frayEdge*", "add", 0.5), ("wearEdge*", "add", 0.4),
        ("splitWidth*", "add", 0.02),
    ),
    _dial(
        "stiffness", "A stiff, flat feather with a thick shaft and a closed vane",
        ("shaftRadius", "times", 1.5), ("shaftRadiusTip", "times", 1.5), ("shaftBendMiddle", "times", 0.3),
        ("shaftBendTip", "times", 0.3), ("barbAngleNoise*", "times", 0.3), ("barbCoverEdge*", "times", 1.25),
    ),
    _dial(
        "width", "Wider vanes",
        ("vaneWidth*", "times", 1.6), ("downHairLengthVane*", "times", 1.2),
    ),
    _dial(
        "point", "A pointed tip",
        ("vaneTipFullness*", "times", 0.55), ("vaneWidest*", "add", -0.12),
    ),
    _dial(
        "asymmetry", "The left vane narrow, the right one wide, as in a wing's outer feathers",
        ("vaneAsymmetry", "add", 0.5), ("barbAngleMiddleLeft", "add", -0.2), ("shaftSweepTip", "add", -0.15),
    ),
    _dial(
        "curl", "The tip and the edges curl away from the skin",
        ("shaftBendTip", "add", -1.2), ("shaftBendMiddle", "add", -0.4), ("vaneCurl*", "add", 0.6),
    ),
    _dial(
        "cup", "The vanes close over the shaft like a hand",
        ("vaneCup*", "add", 0.8), ("vaneCupTip*", "add", 0.6), ("vaneAngle*", "add", 0.15),
    ),
    _dial(
        "wetness", "Barbs drawn into dark, shining bundles",
        ("barbClump*", "add", 0.9), ("barbCover*", "times", 0.55), ("barbCoverEdge*", "times", 0.5),
        ("vaneGloss*", "times", 2.2), ("downHairDensityVane*", "times", 0.6), ("colorMiddle+", "times", 0.6),
        ("colorTip+", "times", 0.6), ("vaneRoughness*", "times", 0.6),
    ),
    _dial(
        "pattern", "Bars, spots, streak and fringe more strongly drawn",
        ("barStrength*", "times", 1.8), ("spotStrength*", "times", 1.8), ("edgeStrength*", "times", 1.8),
        ("streakStrength", "times", 1.8), ("mottleStrength", "times", 1.8), ("tipBandStrength", "times", 1.8),
    ),
    _dial(
        "brightness", "Lighter colours",
        ("colorBase+", "times", 1.7), ("colorMiddle+", "times", 1.7), ("colorTip+", "times", 1.7),
        ("colorDown+", "times", 1.3),
    ),
    _dial(
        "gloss", "A shining vane, with more of the colours of thin films",
        ("vaneGloss*", "times", 2.5), ("vaneRoughness*", "times", 0.7), ("iridescence*", "times", 1.8),
        ("shaftGloss", "times", 1.6),
    ),
)  # fmt: skip
DIAL_NAMES = tuple(dial.name for dial in DIALS)


def turned(values: NDArray[np.float32], **positions: float) -> NDArray[np.float32]:
    """Attributes (..., K) with dials turned to positions -1 .. 1; the result stays within the ranges.

    Raises
    ------
    ValueError
        When there is no dial of a name, or a position lies outside -1 .. 1.
    """
    out = np.array(values, np.float64)
    known = {dial.name: dial for dial in DIALS}
    for name, position in positions.items():
        if name not in known or not -1.0 <= position <= 1.0:
            raise ValueError(f"dials are {', '.join(DIAL_NAMES)}, from -1 to 1; not {name} at {position}")
        for effect in known[name].effects:
            for column in columns_of(effect.name):
                if effect.how == "add":
                    out[..., column] += effect.amount * position
                else:
                    out[..., column] *= effect.amount**position
    low, high = limits()
    return np.clip(out, low, high).astype(np.float32)


def columns_of(name: str) -> list[int]:
    """Columns of an attribute: of both sides where it ends in ``*``, of the three bands of a colour with ``+``."""
    ends = {"*": SIDES, "+": ("Red", "Green", "Blue")}.get(name[-1])
    return [COLUMNS[name]] if ends is None else [COLUMNS[name[:-1] + end] for end in ends]
