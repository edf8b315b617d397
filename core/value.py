"""Values: numbers an artist may animate. A constant, a keyed curve or an expression, optionally times a map."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from core import expression
from core.curve import Curve, curve_at
from core.errors import UserError
from core.expression.parser import unknown_name
from core.field import Field
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


def formula(source: str, map: str | None = None, label: str = "") -> Value:
    """The value an expression gives.

    Parameters
    ----------
    label : of the field it is meant for, to be named when it is faulty.

    Raises
    ------
    ExpressionError, ValueFault
        With the column of the fault; the latter when there is a label to name.
    """
    try:
        return Value(base=Formula(source=source), map=map)
    except expression.ExpressionError as error:
        if label:
            raise ValueFault(label, error) from None
        raise


class ValueFault(UserError, ValueError):
    """What is wrong with the value of a field: one sentence that names the field.

    It is a ValueError as well, so that decoding a document adds the path of the offending field.
    """

    def __init__(self, label: str, reason: object) -> None:
        super().__init__(f"{label}: {reason}")


def value_field(
    label: str, tooltip: str, unit: str = "", soft: tuple[float, float] | None = None,
    hard: tuple[float, float] | None = None, step: float | None = None,
) -> msgspec.Meta:
    """The annotation of a field that is a :class:`Value`, see :func:`core.field.field`.

    `hard` is what a lone constant must lie in (:func:`check_constant`) and what every other value is held in after it
    is evaluated (:func:`evaluate_within`).
    """
    known = Field(label, tooltip, unit, soft, hard, step)
    return msgspec.Meta(title=label, description=tooltip, extra={"field": known})


def check_constant(record: Record, name: str, least: float, most: float) -> None:
    """Check the field `name` of `record`: a Value, and within `least` .. `most` when it is a constant alone.

    Raises
    ------
    ValueError
        The message names the field and the limits.
    """
    value = getattr(record, name)
    label = f"{type(record).__name__}.{name}"
    if not isinstance(value, Value):
        raise ValueError(f"{label} must be a Value (core.value.constant makes one of a number), not {value!r}")
    if isinstance(value.base, Constant) and value.map is None and not least <= value.base.number <= most:
        raise ValueError(f"{label} must be a finite number from {least:g} to {most:g}, not {value.base.number!r}")


def check_names(value: Value, names: Collection[str], maps: Collection[str], label: str) -> None:
    """Check that all a value reads exists: `names` and `maps` in its expression, `maps` to multiply it.

    Raises
    ------
    ValueFault
        One sentence with the label of the field and the column.
    """
    if isinstance(value.base, Formula):
        known = {*names, *maps}
        for step in expression.parse(value.base.source).code:
            if step.kind == "name" and step.text not in known:
                raise ValueFault(label, unknown_name(step.text, known, value.base.source, step.column))
    if value.map is not None and value.map not in maps:
        raise ValueFault(label, _no_map(value.map))


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
        raise UserError(_no_map(value.map))
    try:
        return expression.hold(result * expression.hold(known[value.map]))
    except ValueError:
        raise UserError(f"The map {value.map!r} does not have as many values as the field it multiplies.") from None


def _no_map(name: str) -> str:
    return f"There is no map named {name!r}; paint or load it, or choose another map."


def evaluate_within(
    value: Value, known: Field, frame: float = 0.0, fields: Mapping[str, ArrayLike] | None = None
) -> float | NDArray[np.float32]:
    """The value of a described field at a frame, held within its hard range.

    Returns
    -------
    One number when nothing it reads is an array, else float32 of the shape of what it reads.

    Raises
    ------
    ValueFault
        As :func:`evaluate`, with the label of the field.
    """
    try:
        result = evaluate(value, frame, fields)
    except UserError as error:
        raise ValueFault(known.label, error) from None
    if known.hard is not None:
        result = np.clip(result, *known.hard)
    return float(result) if result.ndim == 0 else np.asarray(result, np.float32)


def names_used(value: Value) -> frozenset[str]:
    """Names it reads from the fields: the expression's and the map's, and ``frame`` where it is animated."""
    names = frozenset() if value.map is None else frozenset({value.map})
    if isinstance(value.base, Formula):
        return names | expression.names_used(value.base.source)
    if isinstance(value.base, Curve) and value.base.animated:
        return names | {"frame"}
    return names
