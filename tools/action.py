"""What actions of every craft share: how they are told something."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

import msgspec

from core.errors import UserError
from core.field import field
from core.record import Record

P = TypeVar("P", bound=Record)


class NoParams(Record):
    """Of actions without settings."""


class AmountParams(Record):
    """Of actions that do more or less."""

    amount: Annotated[float, field(
        "Amount", "How much of it is done, from nothing at 0 to all at 1.", "", (0, 1), (0, 1))] = 1.0


def params_of(label: str, kind: type[P], params: dict[str, Any]) -> P:
    """The parameters of an action from plain values; UserError naming the one that is not as it should be."""
    try:
        return msgspec.convert(params, kind)
    except msgspec.ValidationError as error:
        raise UserError(f"The settings of {label} cannot be used: {error}.") from error
