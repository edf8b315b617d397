"""``filoplume convert IN OUT``: from one format to another."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.conversion import convert
from app.report import Report


def command(
    source: Annotated[Path, typer.Argument(metavar="IN", help="A project, a mesh or a groom.", show_default=False)],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="The file to write; its suffix chooses the format.", show_default=False)],
    unit: Annotated[str | None, typer.Option(help="Unit of IN where it does not say: m, cm, mm, in, ft.")] = None,
    up: Annotated[str | None, typer.Option(help="Up axis of IN where it does not say: y or z.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Convert meshes to meshes, grooms to grooms, and projects to either."""
    report = Report(as_json)
    with report.working(total=1), report.stage("convert", f"writing {target.name}"):
        what = convert(source, target, unit, up, report.note)
    result = {"from": str(source), "to": str(target), "seconds": report.seconds, "outputs": [str(target)], **what}
    report.done(result, [f"{source.name} to {target}: " + ", ".join(f"{k} {v}" for k, v in what.items())])
