"""What is drawn on a coat of feathers and set in it by hand: coats in, coats out."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.feather.coat.coat import IDS, FeatherCoat, Placement, Stroke, Tract
from core.mesh.roots import Roots
from core.record import freeze


def free_tract_name(coat: FeatherCoat, part: str) -> str:
    """A name for one more tract of a part of the bird: "back", "back 2" ..."""
    taken, number = {tract.name for tract in coat.tracts}, 1
    while (name := part if number == 1 else f"{part} {number}") in taken:
        number += 1
    return name


def coat_with_tract(coat: FeatherCoat, name: str, line: ArrayLike, width: float) -> FeatherCoat:
    """The coat with one more tract: `line` (P, 3) on the skin at rest, `width` in metres."""
    tract = Tract(name=name, line=freeze(np.array(line, np.float32)), width=width)
    return coat.replace(tracts=(*coat.tracts, tract))


def coat_with_stroke(coat: FeatherCoat, points: ArrayLike) -> FeatherCoat:
    """The coat following its strokes, with one more: `points` (P, 3) on the skin at rest, root to tip."""
    stroke = Stroke(points=freeze(np.array(points, np.float32)))
    return coat.replace(strokes=(*coat.strokes, stroke), direction="strokes")


def coat_without_strokes(coat: FeatherCoat, rows: Collection[int]) -> FeatherCoat:
    """The coat without some of its strokes; without any left it follows its keys again, or else the body's flow."""
    if not rows:
        return coat
    kept = tuple(stroke for row, stroke in enumerate(coat.strokes) if row not in rows)
    other = "keys" if coat.keys_id is not None else "flow"
    back = not kept and coat.direction == "strokes"
    return coat.replace(strokes=kept, direction=other if back else coat.direction)


def coat_with_set(coat: FeatherCoat, roots: Roots) -> FeatherCoat:
    """The coat with feathers set by hand at `roots`, in its first placement by hand; ids are never given twice."""
    number = next((k for k, p in enumerate(coat.placements) if p.hand is not None), None)
    count = len(roots.faces)
    if number is None:
        return coat.replace(placements=(*coat.placements, Placement(kind="hand", count=count, hand=roots)))
    old = coat.placements[number]
    assert old.hand is not None
    first = max(old.count, len(old.hand.faces))
    own = np.arange(len(old.hand.faces), dtype=np.int32) if old.hand_ids is None else old.hand_ids
    made = old.replace(
        hand=old.hand.join(roots), count=first + count,
        hand_ids=freeze(np.concatenate([own, np.arange(first, first + count, dtype=np.int32)])),
    )
    return _with_placement(coat, number, made)


def coat_without_set(coat: FeatherCoat, ids: ArrayLike) -> FeatherCoat:
    """The coat without the feathers of these ids that were set by hand; the others keep their ids."""
    gone = np.asarray(ids, np.int64)
    for number, old in enumerate(coat.placements):
        if old.hand is None:
            continue
        own = np.arange(len(old.hand.faces), dtype=np.int32) if old.hand_ids is None else old.hand_ids
        kept = np.flatnonzero(~np.isin(number * IDS + own.astype(np.int64), gone))
        if len(kept) < len(own):
            coat = _with_placement(coat, number, old.replace(
                hand=old.hand.take(kept), hand_ids=freeze(own[kept]), count=max(old.count, len(own))))
    return coat


def set_ids(coat: FeatherCoat) -> NDArray[np.int64]:
    """Ids (N,) of the feathers that were set by hand."""
    found = [np.zeros(0, np.int64)]
    for number, placement in enumerate(coat.placements):
        if placement.hand is not None:
            own = placement.hand_ids
            found.append(number * IDS + (np.arange(len(placement.hand.faces)) if own is None else own).astype(np.int64))
    return np.concatenate(found)


def _with_placement(coat: FeatherCoat, number: int, placement: Placement) -> FeatherCoat:
    return coat.replace(placements=(*coat.placements[:number], placement, *coat.placements[number + 1:]))
