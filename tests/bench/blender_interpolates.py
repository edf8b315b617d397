"""Scatter, bind and evaluate a coat beside Blender's Interpolate Hair Curves, on the same ball, in the same run.

Needs FILOPLUME_PEERS (see blender_reads) and the peers' script, in the folder FILOPLUME_PEER_SCRIPTS or beside the
checkout in ../shared/peers. Blender scatters at random; ours is an even, progressive scatter.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from core.evaluator import Evaluator
from core.groom.children import Children, evaluate, update_roots
from core.mesh.intrinsic import bind
from core.mesh.mesh import Mesh
from core.mesh.scatter import scatter
from core.mesh.skin import skin_at_rest
from tests.bench.bench import Row, median_ms
from tests.bench.blender_reads import peers_python

TITLE = "A coat of 200,000 from 4,000 guides, beside Blender"
GUIDES, HAIRS, POINTS = 4000, 200_000, 16
ROUNDS, RUNS = 3, 5  # ours and Blender in turns, so that both meet the machine in the same moods


def run() -> list[Row]:
    """Ours always; Blender's seconds and the ratios where Blender is."""
    evaluator = Evaluator()
    skin = skin_at_rest(_ball(), evaluator)
    triangles, workers = skin.triangles.vertices, evaluator.workers
    sites = scatter(skin.points, triangles, GUIDES, seed=1, workers=workers)
    root = np.einsum("nk,nkc->nc", sites.barycentric, skin.points[triangles[sites.triangle]])
    normal = root / np.linalg.norm(root, axis=1, keepdims=True)
    t = np.linspace(0.0, 1.0, POINTS)[None, :, None]
    guides = (root[:, None] * (1 + 0.3 * t) + np.array([0, 0, -0.2]) * t**2).astype(np.float32)
    facing = normal.astype(np.float32)
    times: list[NDArray[np.float64]] = []  # seconds of each run: scatter, bind, evaluate
    blender: list[float] = []
    for _ in range(ROUNDS):
        for run_of_round in range(RUNS + 1):
            marks = [time.perf_counter()]
            places = scatter(skin.points, triangles, HAIRS, workers=workers)
            marks.append(time.perf_counter())
            binding = bind(
                skin.points, triangles, sites.triangle, sites.barycentric, places.triangle, places.barycentric,
                workers=workers,
            )
            children = Children(places.triangle, places.barycentric, binding, triangles, ranges=workers.ranges)
            marks.append(time.perf_counter())
            update_roots(children, skin.points, skin.normals)
            evaluate(children, guides, facing, workers)
            marks.append(time.perf_counter())
            if run_of_round > 0:
                times.append(np.diff(marks))
        blender += _blender_seconds()
    ours = 1e3 * float(np.median(np.sum(times, axis=1)))
    combed = guides * np.float32(1.0001)
    after_comb = median_ms(lambda: evaluate(children, combed, facing, workers))
    rows = [
        Row(f"ours: {name}", 1e3 * float(seconds), "ms")
        for name, seconds in zip(("scatter", "bind", "evaluate"), np.median(times, axis=0), strict=True)
    ]
    rows += [Row("ours: all three", ours, "ms"), Row("ours: again after a comb", after_comb, "ms")]
    if blender:
        theirs = 1e3 * statistics.median(blender)
        rows += [
            Row("Blender", theirs, "ms"),
            Row("times as fast as Blender", theirs / ours, "x", 2.0, at_least=True),
            Row("times as fast as Blender after a comb", theirs / after_comb, "x", 75.0, at_least=True),
        ]
    evaluator.close()
    return rows


def _blender_seconds() -> list[float]:
    """Seconds of each of Blender's runs but the first; empty where it is not."""
    python = peers_python()
    folder = Path(os.environ.get("FILOPLUME_PEER_SCRIPTS", Path(__file__).parents[3] / "shared" / "peers"))
    script = folder / "blender_interpolate.py"
    if python is None or not script.is_file():
        return []
    command = [python, script, "--guides", str(GUIDES), "--hairs", str(HAIRS), "--runs", str(RUNS + 1)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    result = json.loads(next(line for line in done.stdout.splitlines() if line.startswith("{")))
    return list(result["seconds"][1:])


def _ball(segments: int = 128, rings: int = 64) -> Mesh:
    """The UV sphere the peer uses: 128 x 64, triangles at the poles."""
    theta = np.linspace(0.0, np.pi, rings + 1)[1:-1, None]
    phi = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)[None, :]
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    z = np.broadcast_to(np.cos(theta), x.shape)
    grid = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    points = np.concatenate([grid, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]]).astype(np.float32)
    number = np.arange((rings - 1) * segments).reshape(rings - 1, segments)
    after = np.roll(number, -1, axis=1)
    quads = np.stack([number[:-1], number[1:], after[1:], after[:-1]], axis=-1).reshape(-1, 4)
    north, south = len(grid), len(grid) + 1
    top = np.stack([np.full(segments, north), number[0], after[0]], axis=-1)
    bottom = np.stack([np.full(segments, south), after[-1], number[-1]], axis=-1)
    counts = np.concatenate([np.full(len(quads), 4), np.full(2 * segments, 3)]).astype(np.int32)
    corners = np.concatenate([quads.ravel(), top.ravel(), bottom.ravel()]).astype(np.int32)
    parts = np.zeros(len(counts), np.int32)
    return Mesh(points=points, counts=counts, corners=corners, parts=parts, part_names=("ball",))
