"""10,000 feathers against as many bare instances of one feather in Blender: built for the view, and written as USD.

Needs FILOPLUME_PEERS (see blender_reads). Ours is shaped, layered and settled before either is timed, as it is on
every redraw and every export; what that costs is in the benchmark of feathers. Our triangles come with normals,
colours and opacity.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from core.evaluator import Evaluator
from core.feather.coat.dress import dress_feathers
from core.feather.coat.export import instances
from core.feather.coat.picture import coat_meshes
from core.feather.coat.plumage import Plumage
from core.feather.look import FeatherLook
from core.formats.usd_feathers import FeatherFrame, FeatherWriter
from tests.bench.bench import Row, median_ms
from tests.bench.blender_reads import peers_python
from tests.core.feather.coat.bodies import egg

TITLE = "Feathers, against bare instancing in Blender"
COUNT = 10_000


def run() -> list[Row]:
    """Seconds of both, and the ratio that is to stay below 1.5; none without Blender."""
    python = peers_python()
    if python is None:
        return []
    evaluator, mesh = Evaluator(), egg(64, 96)
    coat, keys = dress_feathers(mesh, evaluator, COUNT, keys=20)
    rest = Plumage(evaluator).at_rest(coat, keys, mesh)
    found = instances(rest, evaluator.workers)
    rows, columns = rest.layered.vanes.shape[1:3]  # as many triangles a feather as Blender's
    build = 1e-3 * median_ms(lambda: coat_meshes(rest, coat, (rows, columns)))
    with tempfile.TemporaryDirectory(prefix="filoplume-bench-") as name:
        folder = Path(name)
        start = time.perf_counter()
        looks = {"contour": FeatherLook((0.3, 0.2, 0.1))}
        writer = FeatherWriter(folder / "ours.usdc", "coat", mesh, "bench", looks, False)
        writer.write(FeatherFrame(1001.0, rest.skin.points, found, found.ids, None, {}))
        writer.close()
        write = time.perf_counter() - start
        turns = Rotation.from_quat(found.turns[:, [1, 2, 3, 0]]).as_euler("xyz")
        np.savez(folder / "coat.npz", vane=next(iter(found.prototypes.values())), roots=found.positions,
                 turns=turns, scales=found.scales)
        script = Path(__file__).parent / "peers" / "blender_instances.py"
        done = subprocess.run(
            [python, script, folder / "coat.npz", folder / "theirs.usdc"], capture_output=True, text=True, check=False)
    evaluator.close()
    said = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if not said:
        raise RuntimeError(f"Blender could not make the instances: {done.stderr[-500:]}")
    theirs = json.loads(said[-1])
    if theirs["count"] != COUNT:
        raise RuntimeError(f"Blender made {theirs['count']} instances of {COUNT}")
    return [
        Row("evaluated but not built, Blender: what its window instances", theirs["place"], "s"),
        Row("all triangles built: ours, every feather of its own shape", build, "s"),
        Row("all triangles built: Blender, copies of one vane", theirs["build"], "s"),
        Row("building, of Blender's time", build / theirs["build"], "", 1.5),
        Row("written as USD: ours", write, "s"), Row("written as USD: Blender", theirs["write"], "s"),
        Row("writing, of Blender's time", write / theirs["write"], "", 1.5),
    ]
