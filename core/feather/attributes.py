"""The attributes of a feather, declared once as data.

Imageworks found over 200 descriptive attributes for the feathers of Stuart Little 2 (SIGGRAPH 2001 course, Feather
Primitive): each has a default, and certain combinations make a contour feather, a remex, down. The rows below give the
editor, the tooltips, the presets, the expressions and the columns of a table of feathers.

A name that ends in ``*`` stands for two attributes, ``...Left`` and ``...Right``, in two neighbouring columns. Lengths
but ``shaftLength`` are shares of the shaft's length, positions go from 0 (calamus) to 1 (tip), colours are linear RGB.
The groups "shaft" and "vane" come first: they alone shape the coarse vane (``vane_grids``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.feather.attributes_of_color import COLOR_ROWS
from core.feather.attributes_of_form import FORM_ROWS, SHAPE_ROWS, Row

SIDES = ("Left", "Right")


class Attribute(NamedTuple):
    """One attribute: what it is called, what it does, in which unit and between which numbers it lies."""

    name: str
    group: str
    default: float
    unit: str
    low: float
    high: float
    description: str


def _expanded(rows: tuple[Row, ...]) -> tuple[Attribute, ...]:
    found = []
    for group, name, default, unit, low, high, description in rows:
        if name.endswith("*"):
            for side in SIDES:
                said = f"{description} ({side.lower()} side)."
                found.append(Attribute(name[:-1] + side, group, default, unit, low, high, said))
        else:
            found.append(Attribute(name, group, default, unit, low, high, description + "."))
    return tuple(found)


ATTRIBUTES = _expanded(SHAPE_ROWS + FORM_ROWS + COLOR_ROWS)
NAMES = tuple(attribute.name for attribute in ATTRIBUTES)
COLUMNS = {name: column for column, name in enumerate(NAMES)}
SHAPE_NAMES = tuple(attribute.name for attribute in _expanded(SHAPE_ROWS))  # the first columns of every table
GROUPS = tuple(dict.fromkeys(attribute.group for attribute in ATTRIBUTES))


def defaults() -> NDArray[np.float32]:
    """The default of every attribute, (K,) float32, by column."""
    return np.array([attribute.default for attribute in ATTRIBUTES], np.float32)


def limits() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The least and the most of every attribute, (K,) float32 each."""
    return (
        np.array([attribute.low for attribute in ATTRIBUTES], np.float32),
        np.array([attribute.high for attribute in ATTRIBUTES], np.float32),
    )


def column(name: str) -> int:
    """The column of an attribute, by its name.

    Raises
    ------
    KeyError
        When there is none of that name; ``name*`` gives the left one, the right one follows it.
    """
    return COLUMNS[name[:-1] + "Left" if name.endswith("*") else name]
