"""The command line as tests call it: within this process, or as a process of its own."""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from app.cli import main

ROOT = Path(__file__).parents[2]


class Done(NamedTuple):
    """What a command left behind."""

    returncode: int
    stdout: str
    stderr: str


def filoplume(*arguments: object, cwd: Path | None = None) -> Done:
    """A command within this process: libraries and kernels are loaded once for all of them."""
    out, words = io.StringIO(), io.StringIO()
    with (
        contextlib.chdir(cwd or Path.cwd()), contextlib.redirect_stdout(out), contextlib.redirect_stderr(words),
    ):
        try:
            main([str(argument) for argument in arguments])
        except SystemExit as left:
            code = left.code
    assert isinstance(code, int)
    return Done(code, out.getvalue(), words.getvalue())


def filoplume_process(*arguments: object, cwd: Path = ROOT) -> Done:
    """A command as a user or a farm calls it: a process with its own start, words and exit code."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "app", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=cwd, env=environment, timeout=280, check=False)
    return Done(done.returncode, done.stdout, done.stderr)
