"""What a panel, a tooltip, a hotkey and a preset need to know of one field of a record."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import msgspec

UNITS = ("", "px", "m", "rad", "s", "frames")  # as stored; a panel shows degrees and the document's unit of length


class Field(NamedTuple):
    """One field as a person meets it.

    label : what stands before it.
    tooltip : what it does, when to change it, in which unit; at least eight words.
    unit : one of :data:`UNITS`; "" for a plain number.
    soft : range of the bar that is dragged. hard : range that may be typed; None where there is none.
    step : what Ctrl snaps to; None for a tenth of the soft range.
    choices : the words to choose from, of a string field.
    """

    label: str
    tooltip: str
    unit: str = ""
    soft: tuple[float, float] | None = None
    hard: tuple[float, float] | None = None
    step: float | None = None
    choices: tuple[str, ...] = ()


def field(
    label: str, tooltip: str, unit: str = "", soft: tuple[float, float] | None = None,
    hard: tuple[float, float] | None = None, step: float | None = None, choices: tuple[str, ...] = (),
) -> msgspec.Meta:
    """The annotation of a field: ``size: Annotated[float, field("Size", "...", "px", (4, 400), (1, 4000))] = 70.0``.

    Decoding refuses numbers outside `hard`.
    """
    if unit not in UNITS:
        raise ValueError(f"the unit of a field is one of {UNITS}, not {unit!r}")
    low, high = (None, None) if hard is None else hard
    known = Field(label, tooltip, unit, soft, hard, step, choices)
    return msgspec.Meta(title=label, description=tooltip, ge=low, le=high, extra={"field": known})


def fields_of(record: type) -> dict[str, Field]:
    """The described fields of a record type by name, in the order they are written down."""
    found: dict[str, Field] = {}
    for name, hint in get_type_hints(record, include_extras=True).items():
        described = _described(hint)
        if described is not None:
            found[name] = described
    return found


def _described(hint: Any) -> Field | None:
    if get_origin(hint) is Annotated:
        for note in get_args(hint)[1:]:
            if isinstance(note, msgspec.Meta) and note.extra is not None and "field" in note.extra:
                known: Field = note.extra["field"]
                return known
    return None
