"""Numbers as a person writes them: mathematics with units, digits that mean something. No Qt here.

Stored are metres, radians, seconds, frames and pixels; shown are the document's unit of length and degrees.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from core import expression
from core.expression import ExpressionError
from core.field import Field
from core.units import METRES_PER_UNIT

_LENGTHS = {**METRES_PER_UNIT, "um": 1e-6, "µm": 1e-6, "km": 1000.0}
_ANGLES = {"deg": math.pi / 180.0, "°": math.pi / 180.0, "rad": 1.0, "turn": math.tau}
_TIMES = {"s": 1.0, "ms": 1e-3, "min": 60.0}
UNITS_OF = {"m": _LENGTHS, "rad": _ANGLES, "s": _TIMES, "px": {"px": 1.0}, "frames": {"f": 1.0, "frames": 1.0}, "": {}}
_SMALLER = {"m": ("m", "cm", "mm", "µm"), "cm": ("cm", "mm", "µm"), "mm": ("mm", "µm"), "ft": ("ft", "in")}
_KINDS = {"m": "a length", "rad": "an angle", "s": "a time", "px": "pixels", "frames": "frames"}
_LONGEST = 6  # decimals

_QUANTITY = re.compile(
    r"(?<![A-Za-z0-9_.])((?>(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?))[ \t]*([A-Za-zµ°]+)(?![A-Za-z0-9_(])"
)
_GROUPED = re.compile(r"[+-]?[0-9]{1,3}(,[0-9]{3})+(\.[0-9]*)?[ \t]*[A-Za-zµ°]*")
_WORDS = frozenset({"if", "else", "and", "or", "not"})


class Scale(NamedTuple):
    """How a field is shown: the word of its unit, how much of the stored unit it is, and decimals."""

    unit: str
    factor: float
    decimals: int


def scale_of(known: Field, length_unit: str = "m", whole: bool = False) -> Scale:
    """How to show a field of a document whose panels show `length_unit`.

    A length whose bar would end below a tenth of that unit is shown in the next smaller one of the same system, so
    that the width of a hair is not 0.00008 m. `whole` : of whole numbers, which have no decimals.
    """
    top = 1.0 if known.soft is None else max(abs(known.soft[0]), abs(known.soft[1]))
    span = 1.0 if known.soft is None else known.soft[1] - known.soft[0]
    unit, factor = known.unit, 1.0
    if known.unit == "m":
        ladder = _SMALLER.get(length_unit, (length_unit,))
        unit = next((word for word in ladder if top >= 0.1 * _LENGTHS[word]), ladder[-1])
        if known.soft is None:
            unit = length_unit
        factor = _LENGTHS[unit]
    elif known.unit == "rad":
        unit, factor = "°", _ANGLES["°"]
    elif known.unit == "frames":
        unit = "f"
    decimals = 0 if whole else min(max(math.ceil(-math.log10(max(span / factor / 100.0, 1e-12)) - 1e-9), 0), _LONGEST)
    return Scale(unit, factor, decimals)


def shown(value: float, scale: Scale, unit: bool = True) -> str:
    """A stored number as words of a bar: as many digits as can be told apart on it, more for what is smaller."""
    number = value / scale.factor
    text = f"{number:,.{scale.decimals}f}"
    if number != 0.0 and (abs(number) >= 1e9 or abs(float(text.replace(",", "")) - number) > 0.02 * abs(number)):
        text = f"{number:.3g}"
    if text.startswith("-") and not any(digit in text for digit in "123456789"):
        text = text[1:]
    if not unit or not scale.unit:
        return text
    return f"{text}{'' if scale.unit == '°' else ' '}{scale.unit}"


def editable(value: float, scale: Scale) -> str:
    """The number alone, with every digit that matters, as what is typed begins with."""
    return f"{value / scale.factor:.9g}"


def read(text: str, known: Field, scale: Scale) -> float:
    """The stored number that a person means: arithmetic of our own grammar in the unit shown, any number with its own.

    ``2*3+1``, ``1.5cm``, ``12 in + 1 mm``, ``30 deg``, ``100,000``.

    Raises
    ------
    ExpressionError
        With the column of the fault in what was typed.
    """
    if _GROUPED.fullmatch(text.strip()):
        text = text.replace(",", "")
    source, columns = _without_units(text, known, scale)
    try:
        result = float(expression.evaluate(expression.parse(source, ()), {}))
    except ExpressionError as error:
        column = columns[min(error.column - 1, len(columns) - 1)]
        raise ExpressionError(error.message, text, column) from None
    return result * scale.factor


def held(value: float, known: Field, whole: bool = False) -> float:
    """A number within the hard range of its field, a whole one where it must be."""
    if known.hard is not None:
        value = min(max(value, known.hard[0]), known.hard[1])
    return round(value) if whole else value


def _without_units(text: str, known: Field, scale: Scale) -> tuple[str, list[int]]:
    """The same arithmetic with every quantity in the unit shown, and for each of its characters the column in `text`
    (one more for its end)."""
    parts: list[str] = []
    columns: list[int] = []
    at = 0
    for match in _QUANTITY.finditer(text):
        word = match[2]
        if word in _WORDS:
            continue
        factor = UNITS_OF[known.unit].get(word)
        if factor is None:
            raise ExpressionError(_wrong_unit(word, known), text, match.start(2) + 1)
        replaced = f"({match[1]}*{factor / scale.factor!r})"
        parts += [text[at:match.start()], replaced]
        columns += [*range(at + 1, match.start() + 1), *[match.start() + 1] * len(replaced)]
        at = match.end()
    parts.append(text[at:])
    columns += range(at + 1, len(text) + 2)
    return "".join(parts), columns


def _wrong_unit(word: str, known: Field) -> str:
    words = [each for each in UNITS_OF[known.unit] if each not in ("um", "km", "f")]
    if not words:
        return f"{word!r} has no place here: this is a plain number."
    return f"{word!r} is no unit of {_KINDS[known.unit]}; write {', '.join(words)}, or nothing."
