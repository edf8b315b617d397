"""``filoplume feather PRESET -o OUT``: one feather as a picture or as OpenUSD."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from app.report import Report
from core.camera import frame_points
from core.errors import UserError
from core.feather.attributes import ATTRIBUTES, COLUMNS, SIDES
from core.feather.compare import blend, compare
from core.feather.dials import DIAL_NAMES, turned
from core.feather.levels import LEVELS, Level, feather_mesh
from core.feather.look import look_of
from core.feather.presets import preset_names, preset_values
from core.feather.trace import traced
from core.formats.atomic import atomic_write
from core.formats.curve_file import maker
from core.formats.feather_look import write_mtlx
from core.formats.picture import read_colors
from core.formats.usd_feather import NURBS, SUFFIXES, write_feather

LIGHT = ((0.66, 0.66, 0.66), (0.52, 0.52, 0.52))  # display RGB behind a feather, top and bottom
TOWARDS = (0.35, 0.15, -1.0)  # from the camera: a little from the left and from above


def command(
    preset: Annotated[str, typer.Argument(help="A feather, or `list`; see docs/feather.md.", show_default=False)],
    output: Annotated[list[Path] | None, typer.Option("--output", "-o", help="A .png, .usda, .usdc, .usd, or .mtlx with its material. May be given again.", show_default=False)] = None,
    level: Annotated[str, typer.Option(help=f"One of {', '.join(LEVELS)}; {NURBS} for OpenUSD.")] = "barbs",
    dial: Annotated[list[str] | None, typer.Option(help=f"NAME=-1..1, of {', '.join(DIAL_NAMES)}. May be given again.")] = None,
    attribute: Annotated[list[str] | None, typer.Option("--set", help="ATTRIBUTE=NUMBER, of one side or of both. May be given again.")] = None,
    to: Annotated[str | None, typer.Option(help="Another feather to blend with and to compare with.")] = None,
    share: Annotated[float, typer.Option(min=0.0, max=1.0, help="How much of the other one.")] = 0.5,
    trace: Annotated[Path | None, typer.Option(help="A photograph of one feather on a plain ground: take its outline and colours.")] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Another number gives another feather of the same kind.")] = 0,
    size: Annotated[str, typer.Option(help="Width x height of a picture in pixels.")] = "600x1000",
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Make one feather."""
    report = Report(as_json)
    if preset == "list":
        names = preset_names()
        report.done({"presets": names, "attributes": len(ATTRIBUTES)}, names)
        return
    if level not in (*LEVELS, NURBS):
        raise typer.BadParameter(f"{level} is not a level; there are {', '.join((*LEVELS, NURBS))}", param_hint="--level")
    outputs = output or []
    for path in outputs:
        if path.suffix.lower() not in (".png", ".mtlx", *SUFFIXES):
            raise UserError(f"{path.name}: a feather is written as .png, .usda, .usdc or .usd, its material as .mtlx.")
        if path.suffix.lower() == ".png" and level == NURBS:
            raise UserError(f"A picture shows one of the levels {', '.join(LEVELS)}; {NURBS} is for OpenUSD.")
    values = preset_values(preset)
    told: dict[str, object] = {"preset": preset, "outputs": [str(path) for path in outputs]}
    if to is not None:
        found = compare(values, preset_values(to))
        told["differs"] = len(found.attributes)
        told["outline"] = found.outline_most
        values = blend(values, preset_values(to), share)
    if trace is not None:
        values = traced(read_colors(trace), values)
    try:
        values = turned(values, **dict(map(_numbered, dial or [])))
    except ValueError as error:
        raise UserError(f"{error}.") from error
    values = _with_attributes(values, attribute or [])
    with report.working(total=max(len(outputs), 1)):
        for path in outputs:
            with report.stage("write", f"writing {path.name}"):
                if path.suffix.lower() == ".png":
                    _picture(path, values, seed, level, size)
                elif path.suffix.lower() == ".mtlx":
                    with atomic_write(path) as beside:
                        write_mtlx(beside, look_of(values))
                else:
                    with atomic_write(path) as beside:
                        write_feather(beside, values, seed, _level(level), maker())
    report.done({**told, "seconds": report.seconds}, [str(path) for path in outputs])


def _level(name: str) -> Level | None:
    return next((level for level in LEVELS if level == name), None)


def _numbered(said: str) -> tuple[str, float]:
    name, _, number = said.partition("=")
    try:
        return name, float(number)
    except ValueError as error:
        raise UserError(f"{said!r} is not NAME=NUMBER; write wear=0.5.") from error


def _with_attributes(values: NDArray[np.float32], said: list[str]) -> NDArray[np.float32]:
    out = values.copy()
    for name, number in map(_numbered, said):
        names = [name] if name in COLUMNS else [name + side for side in SIDES]
        if names[0] not in COLUMNS:
            raise UserError(f"A feather has no attribute {name!r}; docs/feather.md lists them.")
        for full in names:
            known = ATTRIBUTES[COLUMNS[full]]
            if not known.low <= number <= known.high:
                raise UserError(f"{full} goes from {known.low:g} to {known.high:g}, not {number:g}.")
            out[COLUMNS[full]] = number
    return out


def _picture(path: Path, values: NDArray[np.float32], seed: int, level: str, size: str) -> None:
    from viewport.picture import render_png
    from viewport.scene import Scene

    match = re.fullmatch(r"(\d{1,5})[x×](\d{1,5})", size)
    if not match:
        raise typer.BadParameter(f"{size} is not a size; write 600x1000", param_hint="--size")
    wide, high = int(match[1]), int(match[2])
    mesh = feather_mesh(values, seed, _level(level) or "barbs")
    camera = frame_points(mesh.points, TOWARDS, wide / max(high, 1))
    render_png(path, Scene(feathers=(mesh,), background=LIGHT), camera, (wide, high), samples=3)
