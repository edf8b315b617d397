"""A display for tests of windows: the one there is, or an Xvfb with a window manager that ends with the tests."""

from __future__ import annotations

import atexit
import ctypes
import os
import shutil
import signal
import subprocess
from contextlib import suppress

SIZE = "1920x1200x24"


def ensure_display() -> str | None:
    """See to it that windows can be opened. None when they can, else why only "offscreen" ones can be.

    Workers of pytest-xdist never share a display: their windows would take the focus from each other.
    """
    server = shutil.which("Xvfb")
    if os.environ.get("QT_QPA_PLATFORM"):
        return None if os.environ["QT_QPA_PLATFORM"] != "offscreen" else "windows are offscreen"
    if os.environ.get("DISPLAY") and not (server and "PYTEST_XDIST_WORKER" in os.environ):
        return None
    if server is None:
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
        return "there is no display and no Xvfb: sudo apt install xvfb openbox"
    read, write = os.pipe()
    command = [server, "-displayfd", str(write), "-screen", "0", SIZE, "-nolisten", "tcp"]
    process = _started(command, write)
    os.close(write)
    with os.fdopen(read) as told:
        number = told.readline().strip()
    atexit.register(_end, process)
    os.environ["DISPLAY"] = f":{number}"
    manager = shutil.which("openbox")
    if manager is not None:
        atexit.register(_end, _started([manager]))
    return None


def _started(command: list[str], *files: int) -> subprocess.Popen[bytes]:
    quiet = subprocess.DEVNULL  # whoever waits for the output of the tests shall not wait for the display
    return subprocess.Popen(
        command, pass_fds=files, stdin=quiet, stdout=quiet, stderr=quiet, preexec_fn=_die_with_parent)  # noqa: PLW1509


def _die_with_parent() -> None:
    """Tests that are killed leave no display behind (Linux)."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(1, signal.SIGTERM)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    process.wait(10)
