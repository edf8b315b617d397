"""``filoplume doctor``: is everything here that the program needs, and does it work?"""

from __future__ import annotations

import importlib
import json
import os
import platform
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from typing import Annotated

import typer

PACKAGES = {
    "numpy": "numpy", "scipy": "scipy", "numba": "numba", "msgspec": "msgspec",
    "opencv-python-headless": "cv2", "usd-core": "pxr", "alembic3d": "alembic3d", "moderngl": "moderngl",
}
GL_PROBE = (
    "import moderngl; c = moderngl.create_standalone_context(backend='egl', require=330); "
    "print(c.info['GL_RENDERER'], '| GL', c.version_code)"
)


def command(as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False) -> None:
    """Look at Python, the libraries, GL, memory and cores, and say what to do about what is wrong."""
    found: dict[str, str] = {"python": f"{platform.python_version()} on {platform.system()} {platform.machine()}"}
    trouble: list[str] = []
    if not (3, 11) <= sys.version_info[:2] <= (3, 13):
        trouble.append(f"Python {platform.python_version()} is not tested; use 3.11, 3.12 or 3.13")
    for package, module in PACKAGES.items():
        try:
            importlib.import_module(module)
            found[package] = version(package)
        except (ImportError, PackageNotFoundError) as error:
            trouble.append(f"{package} cannot be loaded ({error}); run make, or pip install -r requirements.lock")
    found["cores"] = str(os.cpu_count())
    found["gl"], problem = _probe_gl()
    if problem:
        trouble.append(problem)
    if as_json:
        print(json.dumps({"found": found, "trouble": trouble}))
    else:
        for name, value in found.items():
            print(f"{name:<24} {value}")
        print("\n".join(f"trouble: {line}" for line in trouble) or "all is well")
    if trouble:
        raise typer.Exit(1)


def _probe_gl() -> tuple[str, str | None]:
    """GL is tried in a child process: a broken driver may take its process with it."""
    try:
        child = subprocess.run([sys.executable, "-c", GL_PROBE], capture_output=True, text=True, timeout=30, check=False)
    except subprocess.TimeoutExpired:
        return "none", "the GL driver hangs; pictures will not work until it is repaired"
    if child.returncode == 0:
        return child.stdout.strip(), None
    return "none", "no GL 3.3 through EGL; pictures need: apt install libegl1 libgl1-mesa-dri libgl1"
