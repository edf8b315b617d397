"""Frames of feathers on their way out: what one frame writes or shows, and what still crosses in it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import typer
from numpy.typing import NDArray

from app.deliver import posed_document
from app.report import Report
from core.document import Document, find_mesh, keys_of
from core.evaluator import Evaluator
from core.feather.attributes import column
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.condensed import coat_condensed
from core.feather.coat.curves import coat_curves, kinds_of, shaft_looks
from core.feather.coat.export import crossing_wings, instances, left_crossing, shown_rows, wing_rows
from core.feather.coat.picture import coat_meshes
from core.feather.coat.plumage import Laid, Plumage
from core.feather.coat.worn import parts_of, worn_preset, worn_values
from core.feather.look import FeatherLook, look_of
from core.feather.pieces import FeatherMesh
from core.formats.atomic import atomic_write
from core.formats.curve_file import maker
from core.formats.usd_feathers import FeatherFrame, FeatherWriter
from core.mesh.skin import Skin

Figures = dict[str, Any]
Form = Literal["instances", "meshes", "shafts", "barbs", "condensed", "nurbs"]
CURVES: tuple[Form, ...] = ("shafts", "barbs", "condensed")
EXPORTED = ("age", "spacing", "tract", "length")  # columns every program gets beside places and ids
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


def form_of(each: bool, nurbs: bool, curves: str | None) -> Form:
    """What ``--meshes``, ``--nurbs`` and ``--curves KIND`` ask for; wrong usage when there is no such kind, or two."""
    if each + nurbs + (curves is not None) > 1:
        raise typer.BadParameter("choose one of --meshes, --nurbs and --curves")
    if curves is None:
        return "meshes" if each else "nurbs" if nurbs else "instances"
    found = next((form for form in CURVES if form == curves), None)
    if found is None:
        raise typer.BadParameter(f"curves are {', '.join(CURVES)}, not {curves!r}", param_hint="--curves")
    return found


def coat_looks(coat: FeatherCoat) -> dict[str, FeatherLook]:
    """The materials of a coat, one for each preset its parts wear, in the order of ``kinds_of``."""
    worn = {worn_preset(coat, part) for part in parts_of(coat)}
    return {name: look_of(worn_values(coat, name)) for name in sorted(worn)}


def export_frame(
    laid: Laid, coat: FeatherCoat, frame: float, form: Form, evaluator: Evaluator,
    added: NDArray[np.float64] | None = None, barbs: int | None = None,
) -> tuple[FeatherFrame, Figures]:
    """One frame as it is written, and what crosses in it.

    form : what the feathers become. added : ``added_at_rest``, where it is one of many. barbs : a side at most.
    """
    rows, wings = shown_rows(laid), wing_rows(laid)
    names, kinds = kinds_of(laid, coat)
    known = {name: np.asarray(laid.fields[name]) for name in EXPORTED if name in laid.fields}
    known["wear"] = np.array([_wear(worn_values(coat, name)) for name in names])[kinds]
    attributes = {name: values.astype(np.float32) for name, values in known.items()}
    of_skin = {name: values[rows] for name, values in attributes.items()}
    figures: Figures
    if form == "instances":
        found = instances(laid, evaluator.workers, added)
        left, vanes = found.left, found.vanes
        made = FeatherFrame(frame, laid.skin.points, found, found.ids, None, of_skin, kinds=kinds[rows])
        figures = {
            "shapes": len(found.prototypes), "quantising_error": found.error,
            "crossings_16_bit": len(found.coarse.first),
        }
    else:
        left, vanes = left_crossing(laid, evaluator.workers), laid.layered.vanes[rows]
        made = FeatherFrame(frame, laid.skin.points, None, laid.ids[rows], vanes, of_skin, kinds=kinds[rows])
        figures = {}
    if form == "nurbs":
        radii = [shaft_looks(worn_values(coat, name), vanes.shape[1])[0] for name in names]
        made = made._replace(radii=np.stack(radii))
    elif form == "condensed":
        made = made._replace(curves=lambda: coat_condensed(laid, coat, barbs), attributes=attributes)
    elif form in ("shafts", "barbs"):
        made = made._replace(curves=lambda: coat_curves(laid, coat, form == "barbs", barbs), attributes=attributes)
    if len(wings):
        made = made._replace(
            wing_ids=laid.ids[wings], wing_vanes=laid.layered.vanes[wings], wing_kinds=kinds[wings],
            wing_attributes={name: values[wings] for name, values in attributes.items()})
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


def write_coat(
    path: Path, document: Document, coat: FeatherCoat, form: Form, evaluator: Evaluator, frame: float | None = None,
    barbs: int | None = None,
) -> Figures:
    """Write a coat of a document to OpenUSD as it lies at a frame (None: at rest); what is told of it."""
    item, start = find_mesh(document, coat.mesh_id), float(document.first_frame)
    plumage, keys = Plumage(evaluator), keys_of(document, coat)
    if frame is None:
        laid = plumage.at_rest(coat, keys, item.mesh, start)
    else:
        skin = posed_document(document, frame, evaluator)[item.id]
        laid = plumage.at_frame(coat, keys, item.mesh, skin, frame, start)
    written, figures = export_frame(laid, coat, start if frame is None else frame, form, evaluator, barbs=barbs)
    with atomic_write(path) as beside:
        writer = FeatherWriter(beside, coat.name, item.mesh, maker(), coat_looks(coat), False)
        writer.write(written)
        writer.close()
    return figures


def _wear(values: NDArray[np.float32]) -> float:
    """How worn feathers of a type are, 0 .. 1."""
    edge, tip = column("wearEdge*"), column("wearTip*")
    return float(np.mean([values[edge : edge + 2], values[tip : tip + 2]]))


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
