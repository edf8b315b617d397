"""How long a coat takes to go out and come in: 100,000 hairs of 16 points, guides beside, child processes included."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from core.formats.curve_file import read_groom, write_groom
from core.groom.strands import GroomStrands, Strands
from tests.bench.bench import Row, median_ms

TITLE = "Curve files, 100,000 hairs x 16 points and 4,000 guides"


def run() -> list[Row]:
    """Write and read through the calls the command line makes."""
    coat, rows = make_coat(), []
    with tempfile.TemporaryDirectory(prefix="filoplume-bench-") as folder:
        for name, suffix, target in (("USD", ".usdc", 1000), ("Alembic", ".abc", 1000), (".hair", ".hair", None)):
            path = Path(folder) / f"coat{suffix}"
            rows.append(Row(f"{name} write", median_ms(lambda p=path: write_groom(p, coat), runs=5), "ms", target))
            rows.append(Row(f"{name} read", median_ms(lambda p=path: read_groom(p), runs=5), "ms", target))
            rows.append(Row(f"{name} size", path.stat().st_size / 2**20, "MB"))
    return rows


def make_coat(hairs: int = 100_000, guides: int = 4_000, points: int = 16) -> GroomStrands:
    """Curls on a unit sphere with widths that taper, ids, root UVs and guide triples; the same every time."""
    rng = np.random.default_rng(20)

    def strands(count: int, children: bool) -> Strands:
        root = rng.normal(size=(count, 1, 3))
        root /= np.linalg.norm(root, axis=2, keepdims=True)
        along = np.linspace(0, 1, points)[None, :, None]
        curl = 0.01 * np.sin(9 * along + rng.uniform(0, 6, (count, 1, 3)))
        taper = np.broadcast_to(np.linspace(8e-5, 1e-5, points), (count, points))
        weights = rng.random((count, 3))
        return Strands(
            counts=np.full(count, points, np.int32),
            points=(root * (1 + 0.1 * along) + along * curl).reshape(-1, 3).astype(np.float32),
            widths=taper.reshape(-1).astype(np.float32), ids=rng.permutation(count).astype(np.int32),
            root_uvs=rng.random((count, 2), np.float32),
            guide_ids=rng.integers(0, guides, (count, 3)).astype(np.int32) if children else None,
            guide_weights=(weights / weights.sum(1, keepdims=True)).astype(np.float32) if children else None,
        )  # fmt: skip

    return GroomStrands(name="coat", guides=strands(guides, False), children=strands(hairs, True))
