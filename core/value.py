"""Values: numbers an artist may animate. A constant, a keyed curve or an expression, optionally times a map."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core import expression
from core.curve import Curve, curve_at
from core.errors import UserError
from core.record import Record, number


class Constant(Record, tag="constant"):
    """One number."""

    number: float

    def __post_init__(self) -> None:
        number(self, "number")


class Formula(Record, tag="expression"):
    """The source of an expression in the grammar of ``core.expression``."""

    source: str

    def __post_init__(self) -> None:
        expression.parse(self.source)


class Value(Record):
    """A number that may change over time and place.

    base : constant, keyed curve or expression.
    map : name of a field that multiplies it (a vertex map, an image), or None.
    """

    base: Constant | Curve | Formula
    map: str | None = None


def constant(amount: float, map: str | None = None) -> Value:
    """The value that is always `amount` (times a map)."""
    return Value(base=Constant(number=float(amount)), map=map)


def formula(source: str, map: str | None = None) -> Value:
    """The value an expression gives.

    Raises
    ------
    ExpressionError
        With the column of the fault.
    """
    return Value(base=Formula(source=source), map=map)


def evaluate(value: Value, frame: float = 0.0, fields: Mapping[str, ArrayLike] | None = None) -> NDArray[np.float64]:
    """The value at a frame, for the rows of `fields`.

    Parameters
    ----------
    frame : whole or fractional; an expression reads it as ``frame``.
    fields : columns an expression may name and the map is taken from; they broadcast.

    Returns
    -------
    float64, shape () when nothing it reads is an array, else the broadcast shape of what it reads; always finite,
    within 1e30.

    Raises
    ------
    UserError
        When the map or a name does not exist, or columns do not fit together.
    """
    known = {**(fields or {}), "frame": frame}
    base = value.base
    if isinstance(base, Constant):
        result = expression.hold(base.number)
    elif isinstance(base, Curve):
        result = expression.hold(curve_at(base, frame))
    else:
        result = expression.evaluate(base.source, known)
    if value.map is None:
        return result
    if value.map not in known:
        raise UserError(f"There is no map named {value.map!r}; paint or load it, or choose another map.")
    try:
        return expression.hold(result * expression.hold(known[value.map]))
    except ValueError:
        raise UserError(f"The map {value.map!r} does not have as many values as the field it multiplies.") from None


def names_used(value: Value) -> frozenset[str]:
    """Names it reads from the fields: the expression's and the map's, and ``frame`` where it is animated."""
    names = frozenset() if value.map is None else frozenset({value.map})
    if isinstance(value.base, Formula):
        return names | expression.names_used(value.base.source)
    if isinstance(value.base, Curve) and value.base.animated:
        return names | {"frame"}
    return names
