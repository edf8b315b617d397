"""Blender opens our USD and Alembic: same counts, points, widths, axis and unit. 1 is yes.

Needs the environment variable FILOPLUME_PEERS, the folder of an environment (or its Python) that has Blender as
a module; it runs as a program of its own and is no part of this one.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from core.formats.curve_file import write_groom
from core.groom.strands import GroomStrands
from tests.bench.bench import Row
from tests.bench.formats import make_coat

TITLE = "Blender opens our files"
ROUNDING = 3e-7  # relative to the size of the coat: two roundings to float32


def run() -> list[Row]:
    """Rows of 1 (the same) and 0; none where there is no Blender."""
    python = peers_python()
    if python is None:
        return []
    coat, rows = make_coat(hairs=20_000, guides=500), []
    cases = [(".usdc", "y", 1.0), (".usdc", "z", 0.01), (".usdz", "y", 1.0), (".abc", "y", 1.0)]
    with tempfile.TemporaryDirectory(prefix="filoplume-bench-") as folder:
        for suffix, up, metres in cases:
            path, out = Path(folder) / f"coat{suffix}", Path(folder) / "seen.npz"
            write_groom(path, coat, up=up, metres_per_unit=metres)
            out.unlink(missing_ok=True)
            script = Path(__file__).parent / "peers" / "blender_curves.py"
            done = subprocess.run([python, script, path, out], capture_output=True, text=True, check=False)
            if not out.exists():
                raise RuntimeError(f"Blender could not open {path.name}: {done.stderr[-500:]}")
            with np.load(out, allow_pickle=False) as seen:
                for what, same in compare(coat, dict(seen)).items():
                    rows.append(Row(f"{suffix[1:]} {up} up, {metres:g} m: {what}", float(same), "", 1.0, at_least=True))
    return rows


def peers_python() -> str | None:
    """The Python of the peers' environment, or None."""
    given = os.environ.get("FILOPLUME_PEERS")
    if not given:
        return None
    path = Path(given)
    return str(path / "bin" / "python" if path.is_dir() else path)


def compare(coat: GroomStrands, seen: dict[str, np.ndarray]) -> dict[str, bool]:
    """What Blender sees against the coat: counts, points (which holds axis and unit), widths, each by itself."""
    same = {"counts": True, "points": True, "widths": True, "axis": True, "unit": bool(seen["scale_length"] == 1.0)}
    for role, ours in (("guides", coat.guides), ("children", coat.children)):
        assert ours is not None
        assert ours.widths is not None
        counts = seen.get(f"{role}.counts")
        if counts is None or not np.array_equal(counts, ours.counts):
            return dict.fromkeys(same, False)
        points, widths = seen[f"{role}.points"], seen[f"{role}.widths"]
        truth = np.stack([ours.points[:, 0], -ours.points[:, 2], ours.points[:, 1]], 1)  # Blender's Z is up
        reach = float(np.abs(truth).max())
        same["points"] &= bool(np.abs(points - truth).max() <= ROUNDING * reach)
        same["widths"] &= bool(np.allclose(widths, ours.widths, rtol=ROUNDING, atol=0))
        # the turn and the scale that best carry ours onto Blender's: the identity, and one
        turn = np.linalg.lstsq(truth.astype(np.float64), points, rcond=None)[0]
        scale = abs(np.linalg.det(turn)) ** (1 / 3)
        same["axis"] &= bool(np.allclose(turn / scale, np.eye(3), atol=1e-6))
        same["unit"] &= bool(abs(scale - 1) < 1e-6)
    return same
