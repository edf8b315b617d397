"""``filoplume [FILE]``: the window."""

from __future__ import annotations

import gc
import importlib
import re
from pathlib import Path
from typing import Annotated

import typer

from core.errors import UserError


def command(
    file: Annotated[Path | None, typer.Argument(help="A project, a mesh or a plate to open.", show_default=False)] = None,
    demo: Annotated[bool, typer.Option("--demo", help="Open the demo animal with its coat.")] = False,
    safe: Annotated[bool, typer.Option("--safe", help="Start without a studio's own tools.")] = False,
    screenshot: Annotated[Path | None, typer.Option(help="Save a picture of the settled window as PNG, then leave.", show_default=False)] = None,
    size: Annotated[str | None, typer.Option(help="Width x height of the window in pixels.", show_default=False)] = None,
    after: Annotated[Path | None, typer.Option(help="Script to run first, with window, desk and session at hand.", show_default=False)] = None,
) -> None:
    """Open the window, on a file or empty."""
    wanted = None
    if size is not None:
        match = re.fullmatch(r"(\d{2,5})[x×](\d{2,5})", size)
        if not match:
            raise typer.BadParameter(f"{size} is not a size; write 1600x1000", param_hint="--size")
        wanted = int(match[1]), int(match[2])
    if screenshot is not None and screenshot.suffix.lower() != ".png":
        raise UserError(f"{screenshot.name}: pictures are written as .png")
    gc.disable()  # loading leaves nothing to collect, and looking for it takes a sixth of the start
    try:
        # only here Qt is loaded: every other command runs on machines that have none
        start = importlib.import_module("app.window.start")
        code = start.run(start.Wish(file, demo, wanted, screenshot, after, safe))
    finally:
        gc.enable()
    if code:
        raise typer.Exit(code)
