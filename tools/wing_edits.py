"""Edits of wings and tails of coats of feathers: pure functions of a document, each a named step in a session."""

from __future__ import annotations

from typing import Any

from core.document import Document, find_feathers, find_mesh, with_feathers
from core.errors import UserError
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.wing import Wing, WingOffset, WingRow
from core.feather.coat.wing_dress import dress_wings
from core.record import Record


def add_wings(document: Document, coat_id: int) -> Document:
    """The document with the feathers of wings and tail on a coat, in place of those it had, measured by the bones.

    Raises
    ------
    UserError
        The feathers are locked, or no joints of the mesh are called as those of a wing.
    """
    coat = _free(document, coat_id)
    item = find_mesh(document, coat.mesh_id)
    if item.rig is None:
        raise UserError(f"{item.name} has no rig; wings stand on joints called humerus, forearm and hand.")
    return with_feathers(document, coat.replace(wings=dress_wings(item.mesh, item.rig)))


def remove_wings(document: Document, coat_id: int) -> Document:
    """The document with a coat that has no feathers of wings and tail; those of the skin stay."""
    return with_feathers(document, _free(document, coat_id).replace(wings=()))


def find_wing(coat: FeatherCoat, wing_id: int) -> Wing:
    """The wing of that id; UserError when there is none."""
    for wing in coat.wings:
        if wing.id == wing_id:
            return wing
    raise UserError(f"{coat.name} has no wing {wing_id}; choose one of {[wing.id for wing in coat.wings]}.")


def find_row(wing: Wing, row_id: int) -> WingRow:
    """The row of that id; UserError when there is none."""
    for row in wing.rows:
        if row.id == row_id:
            return row
    raise UserError(f"The {wing.name} has no row {row_id}; choose one of {[row.id for row in wing.rows]}.")


def set_wing(document: Document, coat_id: int, wing_id: int, **changes: Any) -> Document:
    """The document with fields of a wing changed, as its fan; UserError where they cannot be."""
    coat = _free(document, coat_id)
    changed = _replaced(find_wing(coat, wing_id), changes)
    wings = tuple(changed if wing.id == wing_id else wing for wing in coat.wings)
    return with_feathers(document, coat.replace(wings=wings))


def set_row(document: Document, coat_id: int, wing_id: int, row_id: int, **changes: Any) -> Document:
    """The document with fields of a row of a wing changed; feathers that stay keep their ids."""
    wing = find_wing(_free(document, coat_id), wing_id)
    changed = _replaced(find_row(wing, row_id), changes)
    rows = tuple(changed if row.id == row_id else row for row in wing.rows)
    return set_wing(document, coat_id, wing_id, rows=rows)


def set_wing_feather(
    document: Document, coat_id: int, wing_id: int, row_id: int, number: int, **changes: Any
) -> Document:
    """The document with what a hand adds to one feather of a row, 1 the innermost: spread, lift, bend, twist."""
    row = find_row(find_wing(_free(document, coat_id), wing_id), row_id)
    if not 1 <= number <= row.count:
        raise UserError(f"The {row.name} have {row.count} feathers; there is no number {number}.")
    changed = _replaced(offset_of(row, number), changes)
    others = tuple(offset for offset in row.offsets if offset.number != number)
    return set_row(document, coat_id, wing_id, row_id, offsets=(*others, changed))


def reset_wing_feather(document: Document, coat_id: int, wing_id: int, row_id: int, number: int) -> Document:
    """The document with one feather of a row again as its row has it."""
    row = find_row(find_wing(_free(document, coat_id), wing_id), row_id)
    kept = tuple(offset for offset in row.offsets if offset.number != number)
    return set_row(document, coat_id, wing_id, row_id, offsets=kept)


def offset_of(row: WingRow, number: int) -> WingOffset:
    """What a hand adds to a feather of a row; nothing where it was never touched."""
    return next((offset for offset in row.offsets if offset.number == number), WingOffset(number=number))


def _replaced(record: Record, changes: dict[str, Any]) -> Any:
    unknown = set(changes) - set(record.__struct_fields__)
    if unknown:
        raise UserError(f"A {type(record).__name__} has no {', '.join(sorted(unknown))}; choose one of its fields.")
    try:
        return record.replace(**changes)
    except (ValueError, TypeError) as error:
        raise UserError(f"This cannot be set: {error}.") from error


def _free(document: Document, coat_id: int) -> FeatherCoat:
    coat = find_feathers(document, coat_id)
    if coat.locked:
        raise UserError(f"{coat.name} is locked; unlock it to edit its wings.")
    return coat
