"""Every value of a document that an artist has keyed, by an address a script can write down; and how to change them."""

from __future__ import annotations

import types
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Annotated, Any, NamedTuple, Union, get_args, get_origin, get_type_hints

from core.curve import Curve
from core.document import Document
from core.errors import UserError
from core.field import Field, fields_of
from core.record import Record
from core.value import Constant, Value


class Keyed(NamedTuple):
    """A keyed value.

    address : "grooms/1/coat/length": fields of the document, and ids (or places) in its lists.
    owner : the name of the thing it belongs to. known : what a person reads of it.
    """

    address: str
    owner: str
    known: Field
    curve: Curve


def keyed_values(document: Document) -> tuple[Keyed, ...]:
    """All keyed values, in the order of the document."""
    return tuple(_keyed(document, "", ""))


def set_bases(document: Document, bases: Mapping[str, Curve | Constant]) -> Document:
    """The document with other curves (or plain numbers) in the values of some addresses; their maps stay.

    Raises
    ------
    UserError
        There is no value at an address, or the document refuses it.
    """
    for address, base in bases.items():
        try:
            document = _with_base(document, address.split("/"), base)
        except LookupError:
            raise UserError(f"There is no value {address!r} in this document that could be keyed.") from None
        except (ValueError, TypeError) as error:
            raise UserError(f"This cannot be set: {error}.") from error
    return document


def _keyed(record: Record, address: str, owner: str) -> Iterator[Keyed]:
    owner = getattr(record, "name", owner)
    for name, known in _holders(type(record)).items():
        held = getattr(record, name)
        if isinstance(held, Value):
            if known is not None and isinstance(held.base, Curve):
                yield Keyed(f"{address}{name}", owner, known, held.base)
        elif isinstance(held, Record):
            yield from _keyed(held, f"{address}{name}/", owner)
        elif isinstance(held, tuple):
            for place, item in enumerate(held):
                yield from _keyed(item, f"{address}{name}/{getattr(item, 'id', place)}/", owner)


def _with_base(record: Any, steps: list[str], base: Curve | Constant) -> Any:
    """A record, list or value with the base at the end of `steps` replaced."""
    if isinstance(record, Value) and not steps:
        return record.replace(base=base)
    if not steps:
        raise LookupError
    step, *rest = steps
    if isinstance(record, tuple):
        names = [str(getattr(item, "id", i)) for i, item in enumerate(record)]
        if step not in names:
            raise LookupError(step)
        place = names.index(step)
        changed = _with_base(record[place], rest, base)
        return (*record[:place], changed, *record[place + 1:])
    if not isinstance(record, Record) or step not in record.__struct_fields__:
        raise LookupError(step)
    return record.replace(**{step: _with_base(getattr(record, step), rest, base)})


@cache
def _holders(record: type) -> dict[str, Field | None]:
    """Fields of a type of record in which values may be, with what a person reads of those that are values.

    Types tell: documents hold lists of many thousand records, and only those that can hold values are gone through.
    """
    known = fields_of(record)
    return {name: known.get(name) for name, hint in get_type_hints(record, include_extras=True).items()
            if _may_hold(hint, frozenset({record}))}


def _may_hold(hint: Any, above: frozenset[type]) -> bool:
    """Whether a value may be in what an annotation describes. `above` : records it is within, against going round."""
    if get_origin(hint) is Annotated:
        return _may_hold(get_args(hint)[0], above)
    if get_origin(hint) in (Union, types.UnionType):
        return any(_may_hold(one, above) for one in get_args(hint))
    if get_origin(hint) is tuple:
        parts = get_args(hint)
        return len(parts) == 2 and parts[1] is Ellipsis and _may_hold(parts[0], above)
    if not (isinstance(hint, type) and issubclass(hint, Record)) or hint in above:
        return False
    if hint is Value:
        return True
    inside = get_type_hints(hint, include_extras=True).values()
    return any(_may_hold(one, above | {hint}) for one in inside)
