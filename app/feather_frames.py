"""Frames of feathers on their way out: what one frame writes or shows, and what still crosses in it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import typer
from numpy.typing import NDArray

from app.report import Report
from core.document import Document, find_mesh, keys_of
from core.evaluator import Evaluator
from core.feather.attributes import column
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.export import crossing_wings, instances, left_crossing, shown_rows, wing_rows
from core.feather.coat.picture import coat_meshes
from core.feather.coat.plumage import Laid, Plumage
from core.feather.coat.worn import worn_preset, worn_values
from core.feather.look import FeatherLook, look_of
from core.feather.pieces import FeatherMesh
from core.formats.usd_feathers import FeatherFrame
from core.mesh.skin import Skin

Figures = dict[str, Any]
EXPORTED = ("age", "spacing", "tract")  # columns every program gets beside places and ids
LISTED = 100  # crossing pairs named in a report


def frame_range(words: str | None) -> tuple[int, int] | None:
    """The frames of "A-B" (or of "A" alone), None where none are named; wrong usage when it is neither."""
    if words is None:
        return None
    sign, rest = ("-", words[1:]) if words.startswith("-") else ("", words)
    first, dash, last = rest.partition("-")
    try:
        begin = int(sign + first)
        end = int(last) if dash else begin
    except ValueError:
        raise typer.BadParameter(f"frames are two numbers such as 1001-1024, not {words!r}") from None
    if end < begin:
        raise typer.BadParameter(f"the last frame {end} comes before the first, {begin}")
    return begin, end


def say_beyond_clips(document: Document, wanted: tuple[int, int], report: Report) -> None:
    """Say it where some of the frames that are asked for lie outside everything that plays in a document."""
    clips = [item.rig.clip for item in document.meshes if item.rig is not None and item.rig.clip is not None]
    if not clips:
        report.note("no clip moves the mesh; it is the same in every frame")
        return
    start, end = min(clip.start for clip in clips), max(clip.end for clip in clips)
    begin, last = wanted
    if last < start or begin > end:
        report.note(f"the clip plays frames {start:g}-{end:g}; the mesh stands still in all of {begin}-{last}")
    elif begin < start or last > end:
        report.note(f"the clip plays frames {start:g}-{end:g}; before and after it the mesh stands still")


def worse(one: Figures, other: Figures) -> Figures:
    """The figures of the worst frame: the greater of every number, the longer list."""
    if not one:
        return other
    size = {key: len(value) if isinstance(value, list) else value for key, value in one.items()}
    return {
        key: value if (len(value) if isinstance(value, list) else value) >= size[key] else one[key]
        for key, value in other.items()
    }


def coat_look(coat: FeatherCoat) -> FeatherLook:
    """The material of a coat: that of the feathers on its body."""
    return look_of(worn_values(coat, worn_preset(coat)))


def shaft_radii(coat: FeatherCoat) -> tuple[float, float]:
    """Radius at root and tip, in shaft lengths, of the shafts of the feathers on a coat's body."""
    values = worn_values(coat, worn_preset(coat))
    return float(values[column("shaftRadius")]), float(values[column("shaftRadiusTip")])


def export_frame(
    laid: Laid, frame: float, each: bool, evaluator: Evaluator, added: NDArray[np.float64] | None = None
) -> tuple[FeatherFrame, Figures]:
    """One frame as it is written, and what crosses in it; `added` (``added_at_rest``) where it is one of many."""
    rows = shown_rows(laid)
    attributes = {name: laid.fields[name][rows] for name in EXPORTED if name in laid.fields}
    figures: Figures
    if each:
        left = left_crossing(laid, evaluator.workers)
        vanes = laid.layered.vanes[rows]
        made = FeatherFrame(frame, laid.skin.points, None, laid.ids[rows], vanes, attributes)
        figures = {}
    else:
        found = instances(laid, evaluator.workers, added)
        left = found.left
        vanes = found.vanes
        made = FeatherFrame(frame, laid.skin.points, found, found.ids, None, attributes)
        figures = {
            "shapes": len(found.prototypes), "quantising_error": found.error,
            "crossings_16_bit": len(found.coarse.first),
        }
    wings = wing_rows(laid)
    if len(wings):
        made = made._replace(wing_ids=laid.ids[wings], wing_vanes=laid.layered.vanes[wings])
        with_skin, among = crossing_wings(laid, vanes, evaluator.workers)
        figures = {
            **figures, "wing_feathers": len(wings), "crossings_of_wings_with_skin_feathers": with_skin,
            "crossings_within_wings": among,
        }
    ids = laid.ids[rows]
    worst = [[int(ids[a]), int(ids[b])] for a, b in zip(left.first, left.second, strict=True)]
    return made, {
        "feathers": len(rows), "crossings": len(left.first), "skin_hits": len(left.skin), "pairs": left.pairs,
        **figures, "worst": worst[:LISTED],
    }


def feather_meshes(
    document: Document, skins: Mapping[int, Skin], frame: float, evaluator: Evaluator
) -> tuple[FeatherMesh, ...]:
    """Every coat of feathers that is not hidden, on its skin (by the id of the mesh), as it is drawn at a frame."""
    found: list[FeatherMesh] = []
    for coat in document.feathers:
        item = find_mesh(document, coat.mesh_id)
        if not coat.hidden and not item.hidden:
            laid = Plumage(evaluator).at_frame(
                coat, keys_of(document, coat), item.mesh, skins[item.id], frame, float(document.first_frame))
            found += coat_meshes(laid, coat)
    return tuple(found)
