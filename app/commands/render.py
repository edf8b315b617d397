"""``filoplume render FILE -o PNG``: a picture without a window."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from app.deliver import SAVED, VIEWS
from app.drawing import draw_file
from app.report import Report
from core.errors import UserError


def command(
    file: Annotated[Path, typer.Argument(help="A project, a mesh or a groom.", show_default=False)],
    output: Annotated[Path, typer.Option("--output", "-o", help="The PNG to write.", show_default=False)],
    size: Annotated[str | None, typer.Option(help="Width x height in pixels; 1600 wide when not given.", show_default=False)] = None,
    frame: Annotated[float | None, typer.Option(help="Frame of the clip to show; at rest when not given.")] = None,
    view: Annotated[str | None, typer.Option(help=f"One of {', '.join(VIEWS)}, or {SAVED} as a project was left. Without it through the film gate of a project that shows one, else three-quarter.", show_default=False)] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of FILE where it does not say: m, cm, mm, in, ft.")] = None,
    up: Annotated[str | None, typer.Option(help="Up axis of FILE where it does not say: y or z.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Draw a file."""
    match = None if size is None else re.fullmatch(r"(\d{1,5})[x×](\d{1,5})", size)
    if size is not None and not match:
        raise typer.BadParameter(f"{size} is not a size; write 1920x1080", param_hint="--size")
    if view is not None and view not in (*VIEWS, SAVED):
        raise typer.BadParameter(f"{view} is not a view; there are {', '.join((*VIEWS, SAVED))}", param_hint="--view")
    if output.suffix.lower() != ".png":
        raise UserError(f"{output.name}: pictures are written as .png")
    report = Report(as_json)
    with report.working(total=1), report.stage("picture", f"drawing {output.name}"):
        wanted = None if match is None else (int(match[1]), int(match[2]))
        draw_file(file, output, wanted, view, frame, report.note, unit, up)
    report.done({"outputs": [str(output)], "seconds": report.seconds}, [str(output)])
