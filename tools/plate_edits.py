"""Edits of plates: what is told of one, which is in view, where its files lie. Pure functions, as those of tracks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from core.document import FRAMES, Document
from core.errors import UserError
from core.image.plate import Plate
from tools.match_edits import show_plate, shown_plate


def plate_of(document: Document, plate_id: int) -> Plate:
    """The plate of that id; UserError when there is none."""
    found = next((plate for plate in document.plates if plate.id == plate_id), None)
    if found is None:
        raise UserError(f"There is no plate {plate_id}; choose one from the list of plates.")
    return found


def set_plate(document: Document, plate_id: int, **changes: Any) -> Document:
    """The document with fields of a plate changed: name, offset, crop, pixel aspect, film back, colour space, mix, ...

    Raises
    ------
    UserError
        A value is out of its range, the plate is locked, or it is cropped anew under tracks, planes or masks.
    """
    old = plate_of(document, plate_id)
    if old.locked and set(changes) != {"locked"}:
        raise UserError(f"{old.name} is locked; unlock it first.")
    if changes.get("crop", old.crop) != old.crop:
        marked = [m.name for kind in ("tracks", "planes", "masks") for m in getattr(document, kind)
                  if m.plate_id == plate_id]
        if marked:
            raise UserError(f"{old.name} is tracked already ({marked[0]}); crop it before, or delete what is on it.")
    try:
        new = old.replace(**changes)
    except (ValueError, TypeError) as error:
        raise UserError(f"This cannot be set: {error}.") from error
    changed = _with(document, new)
    shown = shown_plate(changed)
    moved = new.offset != old.offset and shown is not None and shown.id == plate_id
    return _in_step(changed, new) if moved else changed


def show_next_plate(document: Document) -> Document:
    """The document with the plate in view that follows the one that is, the first after the last."""
    if len(document.plates) < 2:
        raise UserError("There is no other plate; open one from the File menu.")
    shown = shown_plate(document)
    at = -1 if shown is None else next(i for i, plate in enumerate(document.plates) if plate is shown)
    return show_plate_in_step(document, document.plates[(at + 1) % len(document.plates)].id)


def show_plate_in_step(document: Document, plate_id: int) -> Document:
    """The document with that plate in view and the frames of the timeline those of the plate."""
    return _in_step(show_plate(document, plate_id), plate_of(document, plate_id))


def relink_plate(document: Document, plate_id: int, found: Plate) -> Document:
    """The document with a plate at another place, where `found` was read; all that is marked on it stays.

    Raises
    ------
    UserError
        The frames there are of another size, or lack the numbers of those that were.
    """
    old = plate_of(document, plate_id)
    if (found.width, found.height) != (old.width, old.height):
        raise UserError(f"{found.name} has frames of {found.width} x {found.height} pixels, {old.name} of "
                        f"{old.width} x {old.height}; choose the same plate at its new place.")
    if found.last < old.first or found.first > old.last:
        raise UserError(f"{found.name} has frames {found.first} to {found.last}, {old.name} {old.first} to "
                        f"{old.last}; choose the same plate at its new place.")
    return _with(document, old.replace(
        path=Path(found.path).as_posix(), digest=found.digest, first=found.first, last=found.last,
        missing=found.missing, movie=found.movie))


def delete_plate(document: Document, plate_id: int) -> Document:
    """The document without a plate and what is marked on it; its files stay. Another comes into view."""
    gone = plate_of(document, plate_id)
    if gone.locked:
        raise UserError(f"{gone.name} is locked; unlock it first.")
    model = next((m.name for m in document.photomodels if any(p.plate_id == plate_id for p in m.photos)), None)
    if model is not None:
        raise UserError(f"{gone.name} is a photograph of {model}; delete that first.")
    rest = tuple(plate for plate in document.plates if plate.id != plate_id)
    changed: Document = document.replace(
        plates=rest, **{kind: tuple(m for m in getattr(document, kind) if m.plate_id != plate_id)
                        for kind in ("tracks", "planes", "masks", "solves")})
    left = {track.id for track in changed.tracks}
    changed = changed.replace(track_selection=tuple(i for i in changed.track_selection if i in left))
    return show_plate_in_step(changed, rest[0].id) if rest and shown_plate(changed) is None else changed


def _with(document: Document, plate: Plate) -> Document:
    changed: Document = document.replace(
        plates=tuple(plate if have.id == plate.id else have for have in document.plates))
    return changed


def _in_step(document: Document, plate: Plate) -> Document:
    """The document whose timeline is that of a plate."""
    first, last = (min(max(n + plate.offset, FRAMES[0]), FRAMES[1]) for n in (plate.first, plate.last))
    changed: Document = document.replace(first_frame=first, last_frame=last)
    return changed
