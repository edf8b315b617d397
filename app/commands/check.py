"""``filoplume check FILE``: is a project, a journal or an export whole?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.inspection import troubles
from app.report import Report


def command(
    file: Annotated[Path, typer.Argument(help="A project (.filo), a journal, a mesh or a groom.", show_default=False)],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Read every byte of a file and say what is wrong. Exit code 0 when it is whole, 1 when not."""
    found = troubles(file)
    lines = [f"{file}: {line}" for line in found] or [f"{file} is whole"]
    Report(as_json).done({"file": str(file), "whole": not found, "trouble": found}, lines)
    if found:
        raise typer.Exit(1)
