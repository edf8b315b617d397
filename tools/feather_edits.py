"""Edits of coats of feathers: pure functions of a document, each a named step when a session makes it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.document import Document, find_feathers, find_mesh, free_id, keys_of, with_feathers, with_groom
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.attributes import ATTRIBUTES, COLUMNS
from core.feather.coat.coat import AttributeValue, DialTurn, FeatherCoat, Placement
from core.feather.coat.drawn import (
    coat_with_set,
    coat_with_stroke,
    coat_with_tract,
    coat_without_set,
    coat_without_strokes,
)
from core.feather.coat.dress import KEYS, Dressed, dress_feathers
from core.feather.coat.plumage import Plumage
from core.feather.coat.proxy import demoted, keyed, promoted
from core.feather.coat.wing import WING_IDS
from core.feather.coat.worn import for_all, worn_preset
from core.feather.presets import preset_values
from core.groom.groom import Groom
from core.mesh.roots import Roots
from core.value import Constant, Value, constant


def add_feathers(
    document: Document, mesh_id: int, count: int, evaluator: Evaluator, preset: str = "goldfinch",
    placement: str = "rows", keys: int = KEYS, seed: int = 0,
) -> Document:
    """The document with a coat of exactly `count` feathers on a mesh, and a groom of its keys to comb; for a job.

    A rig with wings gets their feathers too (``wing_edits``).
    """
    item = find_mesh(document, mesh_id)
    return with_dressed(document, dress_feathers(
        item.mesh, evaluator, count, preset, placement, keys, seed, mesh_id=mesh_id, rig=item.rig))


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


def set_attributes(document: Document, coat_id: int, changes: Mapping[str, Value | float]) -> Document:
    """The document with attributes of all feathers of a coat set, by their names (``core.feather.attributes``).

    Raises
    ------
    UserError
        There is no attribute of a name, or a number lies outside its range.
    """
    coat = _free(document, coat_id)
    made = {item.name: item for item in coat.attributes}
    for name, given in changes.items():
        if name not in COLUMNS:
            raise UserError(f"A feather has no attribute {name!r}; docs/feather.md says how to list them.")
        known = ATTRIBUTES[COLUMNS[name]]
        value = given if isinstance(given, Value) else constant(given)
        item = AttributeValue(name=name, value=value)
        if for_all(item) and isinstance(value.base, Constant) and not known.low <= value.base.number <= known.high:
            raise UserError(f"{name} goes from {known.low:g} to {known.high:g}, not {value.base.number:g}.")
        made[name] = item
    return set_feathers(document, coat_id, attributes=tuple(made.values()))


def reset_attributes(document: Document, coat_id: int, names: Collection[str] | None = None) -> Document:
    """The document with attributes of a coat, all by default, again those of its bird."""
    coat = _free(document, coat_id)
    kept = () if names is None else tuple(item for item in coat.attributes if item.name not in names)
    return set_feathers(document, coat_id, attributes=kept)


def turn_dial(document: Document, coat_id: int, name: str, position: float) -> Document:
    """The document with a dial of a coat's feathers (``core.feather.dials``) turned to a position -1 .. 1."""
    coat = _free(document, coat_id)
    others = tuple(dial for dial in coat.dials if dial.name != name)
    try:
        turned = (DialTurn(name=name, position=position),) if position else ()
    except ValueError as error:
        raise UserError(f"This dial cannot be turned: {error}.") from error
    return set_feathers(document, coat_id, dials=(*others, *turned))


def wear_feather(document: Document, coat_id: int, values: ArrayLike, part: str = "body") -> Document:
    """The document with the feathers of a coat like one feather, `values` (K,) all its attributes, dials at 0.

    part : of the bird, where they become that feather; elsewhere its bird's feathers take on what differs.
    """
    coat = _free(document, coat_id)
    wanted, worn = np.asarray(values, np.float32), preset_values(worn_preset(coat, part))
    items = tuple(
        AttributeValue(name=known.name, value=constant(float(wanted[column])))
        for column, known in enumerate(ATTRIBUTES) if wanted[column] != worn[column]
    )  # fmt: skip
    return set_feathers(document, coat_id, attributes=items, dials=())


def add_placement(document: Document, coat_id: int, placement: Placement) -> Document:
    """The document with feathers set in one more way; those there are stay as they stand."""
    coat = _free(document, coat_id)
    return set_feathers(document, coat_id, placements=(*coat.placements, placement))


def set_placement(document: Document, coat_id: int, number: int, **changes: Any) -> Document:
    """The document with fields of one placement of a coat changed; feathers of the others stay what they are.

    Raises
    ------
    UserError
        There is no such placement, or a value is impossible.
    """
    coat = _free(document, coat_id)
    if not 0 <= number < len(coat.placements):
        raise UserError(f"{coat.name} has {len(coat.placements)} placements; there is no number {number}.")
    try:
        made = coat.placements[number].replace(**changes)
    except (ValueError, TypeError) as error:
        raise UserError(f"Feathers cannot be set so: {error}.") from error
    placements = (*coat.placements[:number], made, *coat.placements[number + 1:])
    return set_feathers(document, coat_id, placements=placements)


def remove_placement(document: Document, coat_id: int, number: int) -> Document:
    """The document without the feathers of one placement.

    An empty one keeps its place before others, for ids of feathers come from it; at the end it goes.
    """
    emptied = set_placement(
        document, coat_id, number, kind="rows", count=0, hand=None, hand_ids=None, density_map=None, tract=None)
    placements = find_feathers(emptied, coat_id).placements
    while placements and not placements[-1].count and placements[-1].hand is None:
        placements = placements[:-1]
    return set_feathers(emptied, coat_id, placements=placements)


def remove_tract(document: Document, coat_id: int, name: str) -> Document:
    """The document without a tract; placements that kept to it are no longer held."""
    coat = _free(document, coat_id)
    freed = tuple(p.replace(tract=None) if p.tract == name else p for p in coat.placements)
    kept = tuple(tract for tract in coat.tracts if tract.name != name)
    return set_feathers(document, coat_id, placements=freed, tracts=kept)


def tract_of_keys(document: Document, coat_id: int, keys: Collection[int], name: str) -> Document:
    """The document with a band of skin from key to key, by ids of the guides, as wide as they stand apart at most."""
    coat = _free(document, coat_id)
    roots = _roots(document, coat, keys)
    if len(roots) < 2:
        raise UserError("Select two or more keys along the middle of the tract.")
    middle = roots - roots.mean(axis=0)
    line = roots[np.argsort(middle @ np.linalg.svd(middle, full_matrices=False)[2][0], kind="stable")]
    width = float(np.linalg.norm(np.diff(line, axis=0), axis=1).max())
    others = tuple(tract for tract in coat.tracts if tract.name != name)
    return add_tract(set_feathers(document, coat_id, tracts=others), coat_id, name, line, width)


def strokes_of_keys(document: Document, coat_id: int, keys: Collection[int]) -> Document:
    """The document with a stroke along each of the keys, by ids of the guides, and the coat following its strokes."""
    coat = _free(document, coat_id)
    rows = _rows(document, coat, keys)
    if not len(rows):
        raise UserError("Select the keys whose direction the feathers are to follow.")
    guides = _keys(document, coat).guides
    for row in rows:
        document = add_stroke(document, coat_id, guides.points[row])
    return document


def add_tract(document: Document, coat_id: int, name: str, line: ArrayLike, width: float) -> Document:
    """The document with a tract drawn on a coat: `line` (P, 3) on the skin at rest, `width` in metres."""
    coat = _free(document, coat_id)
    try:
        return with_feathers(document, coat_with_tract(coat, name, line, width))
    except (ValueError, TypeError) as error:
        raise UserError(f"This tract cannot be drawn: {error}.") from error


def add_stroke(document: Document, coat_id: int, points: ArrayLike) -> Document:
    """The document with a stroke (P, 3) that says which way feathers lie, and the coat following its strokes."""
    coat = _free(document, coat_id)
    try:
        return with_feathers(document, coat_with_stroke(coat, points))
    except (ValueError, TypeError) as error:
        raise UserError(f"Feathers cannot follow this: {error}.") from error


def remove_strokes(document: Document, coat_id: int) -> Document:
    """The document with the feathers of a coat following their keys again, or else the flow of the body."""
    coat = _free(document, coat_id)
    return with_feathers(document, coat_without_strokes(coat, range(len(coat.strokes))))


def set_by_hand(document: Document, coat_id: int, roots: Roots) -> Document:
    """The document with feathers of a coat set at these places by hand."""
    return with_feathers(document, coat_with_set(_free(document, coat_id), roots))


def take_away(document: Document, coat_id: int, ids: ArrayLike) -> Document:
    """The document without the feathers of these ids that were set by hand; the others keep their ids."""
    return with_feathers(document, coat_without_set(_free(document, coat_id), ids))


def promote_feather(document: Document, coat_id: int, feather: int, plumage: Plumage, frame: float) -> Document:
    """The document with a feather taken over by hand as it lies, its first key at `frame`.

    plumage : what shows the coat; nothing is laid anew when it has.
    """
    coat = _free(document, coat_id)
    if feather >= WING_IDS:
        raise UserError("This feather is of a wing: choose its row and number under Wings in the feather panel.")
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


def demote_all(document: Document, coat_id: int) -> Document:
    """The document with all feathers of a coat that were animated by hand given back to its keys."""
    coat = _free(document, coat_id)
    if not coat.proxies:
        raise UserError("No feather of this coat was taken over by hand.")
    return with_feathers(document, coat.replace(proxies=()))


def _keys(document: Document, coat: FeatherCoat) -> Groom:
    groom = keys_of(document, coat)
    if groom is None:
        raise UserError(f"{coat.name} has no keys; plant guides on its mesh and make them its keys.")
    return groom


def _rows(document: Document, coat: FeatherCoat, keys: Collection[int]) -> NDArray[np.intp]:
    return np.flatnonzero(np.isin(_keys(document, coat).guides.ids, list(keys)))


def _roots(document: Document, coat: FeatherCoat, keys: Collection[int]) -> NDArray[np.float64]:
    return np.asarray(_keys(document, coat).guides.points[_rows(document, coat, keys)][:, 0], np.float64)


def _free(document: Document, coat_id: int) -> FeatherCoat:
    coat = find_feathers(document, coat_id)
    if coat.locked:
        raise UserError(f"{coat.name} is locked; unlock it to edit its feathers.")
    return coat
