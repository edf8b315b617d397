"""``filoplume run SCRIPT.py [ARGS]``: a script with the same calls the hand makes, headless."""

from __future__ import annotations

import runpy
import sys
import traceback
from pathlib import Path
from typing import Annotated

import typer

from core.errors import UserError


def command(
    script: Annotated[Path, typer.Argument(help="Python script; it may import core and tools.", show_default=False)],
    arguments: Annotated[list[str] | None, typer.Argument(help="What the script finds in sys.argv[1:].")] = None,
) -> None:
    """Run a script without a window. Only run scripts you trust: unlike documents, scripts are programs."""
    if not script.is_file():
        raise UserError(f"there is no script {script}")
    before = sys.argv, list(sys.path)
    sys.argv = [str(script), *(arguments or [])]
    sys.path.insert(0, str(script.resolve().parent))
    try:
        runpy.run_path(str(script), run_name="__main__")
    except (UserError, SystemExit, KeyboardInterrupt):
        raise
    except Exception as error:
        # the script's own mistake: show its own lines, not ours
        trace = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in trace if frame.filename == str(script)]
        line = f" on line {own[-1].lineno}" if own else ""
        raise UserError(f"{script.name} stopped{line}: {type(error).__name__}: {error}") from error
    finally:
        sys.argv, sys.path[:] = before
