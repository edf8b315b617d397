"""Edits of coats of feathers: pure functions of a document, each a named step when a session makes it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from core.document import Document, find_feathers, find_mesh, free_id, keys_of, with_feathers, with_groom
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.coat import FeatherCoat, Placement, Stroke, Tract
from core.feather.coat.dress import KEYS, Dressed, dress_feathers
from core.feather.coat.plumage import Plumage
from core.feather.coat.proxy import demoted, keyed, promoted
from core.record import freeze


def add_feathers(
    document: Document, mesh_id: int, count: int, evaluator: Evaluator, preset: str = "goldfinch",
    placement: str = "rows", keys: int = KEYS, seed: int = 0,
) -> Document:
    """The document with a coat of exactly `count` feathers on a mesh, and a groom of its keys to comb; for a job."""
    item = find_mesh(document, mesh_id)
    return with_dressed(
        document, dress_feathers(item.mesh, evaluator, count, preset, placement, keys, seed, mesh_id=mesh_id))


def with_dressed(document: Document, dressed: Dressed) -> Document:
    """The document with a first coat of feathers and the groom of its keys, which :func:`dress_feathers` made."""
    groom = dressed.keys.replace(id=free_id(document.grooms))
    coat = dressed.coat.replace(id=free_id(document.feathers), keys_id=groom.id)
    return with_feathers(with_groom(document, groom), coat)


def remove_feathers(document: Document, coat_id: int) -> Document:
    """The document without a coat of feathers; the groom of its keys stays."""
    find_feathers(document, coat_id)
    return document.replace(feathers=tuple(coat for coat in document.feathers if coat.id != coat_id))


def set_feathers(document: Document, coat_id: int, **changes: Any) -> Document:
    """The document with fields of a coat of feathers changed.

    Raises
    ------
    UserError
        The feathers are locked, a field does not exist, or a value is out of its range.
    """
    coat = _free(document, coat_id)
    unknown = set(changes) - set(FeatherCoat.__struct_fields__)
    if unknown:
        raise UserError(f"Feathers have no {', '.join(sorted(unknown))}; choose a field of the coat.")
    try:
        return with_feathers(document, coat.replace(**changes))
    except (ValueError, TypeError) as error:
        raise UserError(f"This cannot be set: {error}.") from error


def add_placement(document: Document, coat_id: int, placement: Placement) -> Document:
    """The document with feathers set in one more way; those there are stay as they stand."""
    coat = _free(document, coat_id)
    return set_feathers(document, coat_id, placements=(*coat.placements, placement))


def add_tract(document: Document, coat_id: int, name: str, line: ArrayLike, width: float) -> Document:
    """The document with a tract drawn on a coat: `line` (P, 3) on the skin at rest, `width` in metres."""
    coat = _free(document, coat_id)
    tract = Tract(name=name, line=freeze(np.array(line, np.float32)), width=width)
    return set_feathers(document, coat_id, tracts=(*coat.tracts, tract))


def add_stroke(document: Document, coat_id: int, points: ArrayLike) -> Document:
    """The document with a stroke (P, 3) that says which way feathers lie, and the coat following its strokes."""
    coat = _free(document, coat_id)
    stroke = Stroke(points=freeze(np.array(points, np.float32)))
    return set_feathers(document, coat_id, strokes=(*coat.strokes, stroke), direction="strokes")


def promote_feather(document: Document, coat_id: int, feather: int, plumage: Plumage, frame: float) -> Document:
    """The document with a feather taken over by hand as it lies, its first key at `frame`.

    plumage : what shows the coat; nothing is laid anew when it has.
    """
    coat = _free(document, coat_id)
    mesh, keys = find_mesh(document, coat.mesh_id).mesh, keys_of(document, coat)
    laid = plumage.at_rest(coat, keys, mesh, float(document.first_frame))
    rows = np.flatnonzero(laid.ids == feather)
    if not len(rows):
        raise UserError(f"There is no feather {feather} in {coat.name}.")
    row = int(rows[0])
    frames = plumage.root_frames(coat, keys, mesh)
    return with_feathers(document, promoted(
        coat, feather, laid.layered.vanes[row], laid.feathers.roots[row], frames[row], frame))


def key_feather(
    document: Document, coat_id: int, feather: int, frame: float, shaft: ArrayLike, roll: float = 0.0
) -> Document:
    """The document with a key of a feather animated by hand: `shaft` (P, 3) in the frame of its root, metres."""
    coat = _free(document, coat_id)
    return with_feathers(document, keyed(coat, feather, frame, np.array(shaft, np.float32), roll))


def demote_feather(document: Document, coat_id: int, feather: int) -> Document:
    """The document with a feather given back to the keys of its coat."""
    return with_feathers(document, demoted(_free(document, coat_id), feather))


def _free(document: Document, coat_id: int) -> FeatherCoat:
    coat = find_feathers(document, coat_id)
    if coat.locked:
        raise UserError(f"{coat.name} is locked; unlock it to edit its feathers.")
    return coat
