"""``filoplume pose``: sculpts at poses into a rig that meets them everywhere; a rig at a pose; a rig for others."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from app.report import Report, peak_megabytes
from core.document import Document, MeshObject, with_mesh
from core.errors import UserError
from core.formats import pose_export
from core.formats.mesh_file import write_mesh
from core.formats.pose_json import read_moment, read_poses
from core.formats.project import read_project, write_project
from core.formats.rig_file import document_of, read_rig
from core.pose.edit_layers import sculpt_errors
from core.pose.layers import Extracted, LayerReport, build
from core.pose.pose_space import Correctives, PoseLayer
from core.pose.refusal import Refusal
from core.pose.rig import Rig
from core.pose.solve import solve
from core.pose.synthesis import evaluate, evaluate_at, prepare
from core.record import freeze

PROJECT = (".filo", ".filo1")
KNOWN = (".filo", *pose_export.SUFFIXES)


def command(
    rig: Annotated[Path, typer.Argument(help="A rig (USD, glTF, a project), or a project that has poses.", show_default=False)],
    poses: Annotated[Path | None, typer.Option(help="POSES.json: kernel, poses, their sculpts.")] = None,
    output: Annotated[list[Path] | None, typer.Option("--output", "-o", help="Where it goes; the suffix says how: .filo; .usda .usdc (UsdSkel with shapes), .glb, .py (Blender), .mel (Maya), .json (runtime). May be given again.", show_default=False)] = None,
    at: Annotated[Path | None, typer.Option(help="POSE.json: controls, or a clip and a frame.")] = None,
    obj: Annotated[Path | None, typer.Option(help="Write the surface at that pose, vertices in the order of the rig's file.")] = None,
    baked: Annotated[Path | None, typer.Option(help="Write the points on every frame of the clip as a USD cache: .usdc or .usda.")] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of RIG where it does not say: m, cm, mm, in, ft.")] = None,
    up: Annotated[str | None, typer.Option(help="Up axis of RIG where it does not say: y or z.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Build pose spaces from sculpts, look at any pose, and write the rig for other programs."""
    outputs = output or []
    _check_use(poses, outputs, at, obj, baked)
    report = Report(as_json)
    found: dict[str, Any] = {}
    with report.working(total=4 + len(outputs)):
        with report.stage("load", f"reading {rig.name}"):
            document, item = _read(rig, unit, up, report)
        if poses is not None:
            with report.stage("solve", "extracting and solving the poses"):
                rig_made, extracted = _built(poses, item, report)
            item = item.replace(rig=rig_made, correctives=extracted.correctives)
            found = _figures(item, extracted)
            document = with_mesh(document, item)
        for path in outputs:
            with report.stage(f"export_{path.suffix.lstrip('.')}", f"writing {path.name}"):
                if path.suffix.lower() in PROJECT:
                    write_project(path, document)
                else:
                    for note in pose_export.write(path, item, document.fps):
                        report.note(note)
        if at is not None and obj is not None:
            with report.stage("evaluate", "posing"):
                _write_posed(at, obj, item)
        if baked is not None:
            with report.stage("export_points", f"writing {baked.name}"):
                pose_export.write_points(baked, item)
    written = [str(path) for path in [*outputs, *(p for p in (obj, baked) if p is not None)]]
    result = {
        **found, "vertices": len(item.mesh.points), "outputs": written, "seconds": report.seconds,
        "peak_mb": peak_megabytes(),
    }
    report.done(result, [*_words(found), *written])


def _check_use(poses: Path | None, outputs: list[Path], at: Path | None, obj: Path | None, baked: Path | None) -> None:
    if (at is None) != (obj is None):
        raise typer.BadParameter("a pose and a file for its surface go together: --at POSE.json --obj RESULT.obj")
    if poses is not None and not outputs and obj is None and baked is None:
        raise typer.BadParameter("say where the result goes: -o OUT.filo", param_hint="--output")
    if poses is None and not outputs and obj is None and baked is None:
        raise typer.BadParameter("say what to do: --poses POSES.json -o OUT.filo, or --at POSE.json --obj RESULT.obj")
    for path in outputs:
        if path.suffix.lower() not in KNOWN:
            raise UserError(f"{path.name}: a posed rig is written as {', '.join(KNOWN)}; choose one of these suffixes")
    if obj is not None and obj.suffix.lower() != ".obj":
        raise UserError(f"{obj.name}: the surface at a pose is written as .obj")
    if baked is not None and baked.suffix.lower() not in (".usdc", ".usda"):
        raise UserError(f"{baked.name}: baked points are written as .usdc or .usda")
    for path in [*outputs, *(p for p in (obj, baked) if p is not None)]:
        if not path.resolve().parent.is_dir():
            raise UserError(f"the folder {path.resolve().parent} does not exist; make it first")
        if path.is_dir():
            raise UserError(f"{path} is a folder; name a file")


def _read(path: Path, unit: str | None, up: str | None, report: Report) -> tuple[Document, MeshObject]:
    if path.suffix.lower() in PROJECT:
        document = read_project(path).document
    else:
        document = document_of(read_rig(path, unit=unit, up=up, say=report.note))
    item = next((item for item in document.meshes if item.rig is not None), None)
    if item is None:
        raise UserError(f"{path.name} has no rig; give a file with a skeleton or blend shapes.")
    return document, item


def _built(path: Path, item: MeshObject, report: Report) -> tuple[Rig, Extracted]:
    file = read_poses(path, item.rig, item.mesh)  # type: ignore[arg-type]
    for note in file.notes:
        report.note(note)
    try:
        return file.rig, build(item.mesh.points, file.rig, file.sculpts, file.dofs, **file.options)
    except Refusal as error:
        if report.as_json:  # the names of the poses, for scripts
            sentence = str(error)
            print(json.dumps({"error": sentence, "refusals": [{"reason": error.reason, "poses": list(error.poses)}]}))
            print(f"filoplume: {sentence}", file=sys.stderr)
            raise typer.Exit(1) from None
        raise


def _figures(item: MeshObject, extracted: Extracted) -> dict[str, Any]:
    assert item.rig is not None
    correctives = extracted.correctives
    errors = sculpt_errors(item.mesh.points, item.rig, correctives)
    size = float(np.linalg.norm(np.ptp(item.mesh.points, axis=0)))
    reports = {report.layer: report for report in extracted.reports}
    return {
        "poses": [
            {"name": sample.name, "layer": layer.name, "controls": list(layer.space.controls),
             "vertices": int(layer.moved[k].sum()),
             "error": float(np.max(errors[sample.name], initial=0.0)) / max(size, 1e-30)}
            for layer in correctives.layers for k, sample in enumerate(layer.space.samples)
        ],
        "layers": [_layer_figures(layer, reports[layer.name]) for layer in correctives.layers],
        "conditions": {layer.name: _condition(layer) for layer in correctives.layers},
        "refusals": [],
    }


def _layer_figures(layer: PoseLayer, report: LayerReport) -> dict[str, Any]:
    return {
        "name": layer.name, "kernel": layer.space.kernel, "controls": list(layer.space.controls),
        "poses": [sample.name for sample in layer.space.samples],
        "anchors": [pose.name for pose in layer.space.anchors], "vertices": len(layer.vertices),
        "skin_condition": float(report.condition.max(initial=0.0)) if np.isfinite(report.condition).all() else None,
        "after_skinning": int(report.flagged.sum()),
    }


def _condition(layer: PoseLayer) -> float:
    """Condition of the system of all poses of the layer; 1 is best."""
    return 1.0 / solve(layer.space).reciprocal_condition


def _write_posed(at: Path, obj: Path, item: MeshObject) -> None:
    assert item.rig is not None
    moment = read_moment(at, item.rig)
    correctives: Correctives | None = item.correctives
    if moment.frame is None:
        points = evaluate(item.mesh.points, item.rig, correctives, moment.pose)
    else:
        points = evaluate_at(item.mesh.points, moment.rig, prepare(correctives, item.rig), moment.frame)
    mesh, there = item.mesh, item.rig.file_vertices
    if there is not None:
        first = np.zeros(len(points), np.int32)
        first[there[::-1]] = np.arange(len(there), dtype=np.int32)[::-1]
        mesh, points = mesh.replace(points=freeze(points[there]), corners=freeze(first[mesh.corners])), points[there]
    write_mesh(obj, mesh.replace(points=freeze(points)))


def _words(found: dict[str, Any]) -> list[str]:
    if not found:
        return []
    lines = [f"{len(found['poses'])} poses in {len(found['layers'])} layers"]
    for layer in found["layers"]:
        late = f", {layer['after_skinning']} corrected after skinning" if layer["after_skinning"] else ""
        lines.append(
            f"{layer['name']:<20} {layer['kernel']}, {layer['vertices']:,} vertices{late}, condition "
            f"{found['conditions'][layer['name']]:.3g}: {', '.join(layer['poses'])}"
        )
    return lines
