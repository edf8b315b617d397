"""``filoplume info FILE``: what is in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from app.inspection import describe
from app.report import Report


def command(
    file: Annotated[Path, typer.Argument(help="A project, a mesh or a groom.", show_default=False)],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Say what a file holds and what is wrong with it."""
    found = describe(file)
    Report(as_json).done(found, [f"{name:<14} {_words(value)}" for name, value in found.items()])


def _words(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name} {count}" for name, count in value.items()) or "none"
    if isinstance(value, list):
        return ", ".join(map(str, value)) or "none"
    return f"{value:,}" if isinstance(value, int) and not isinstance(value, bool) else str(value)
