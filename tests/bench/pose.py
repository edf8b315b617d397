"""Pose space: milliseconds to fit, to add a pose, to synthesise, and of a whole posed mesh; against SciPy."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial.transform import Rotation

from core.pose.blend_shapes import targets_from_dense
from core.pose.edit_layers import add_sculpt
from core.pose.embedding import embed, scales
from core.pose.layers import Sculpt, build
from core.pose.pose import Pose, local_of_pose
from core.pose.pose_space import Correctives, Dof, PoseLayer, PoseSample, PoseSpace
from core.pose.rig import Control, Rig
from core.pose.skeleton import Skeleton, SkinWeights
from core.pose.skinning import deformed
from core.pose.solve import solve, weights
from core.pose.synthesis import add_deltas as synthesise
from core.pose.synthesis import evaluate, prepare, run_weights
from core.record import freeze
from core.workers import Workers
from tests.bench.bench import Row, median_ms

TITLE = "Pose space"


def run() -> list[Row]:
    workers = Workers(2)
    rows = [*_on_one_thread(), *_whole_mesh(workers), *_adding()]
    workers.close()
    return rows


def _on_one_thread() -> list[Row]:
    """What is compared with other libraries, in a process whose BLAS has no threads that keep a core busy after use."""
    made = subprocess.run(
        [sys.executable, "-m", "tests.bench.pose"], env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}, check=True,
        stdout=subprocess.PIPE, timeout=600)
    return [Row(*row) for row in json.loads(made.stdout)]


def _poses(count: int, joints: int, seed: int = 0) -> list[Pose]:
    turns = Rotation.from_rotvec(np.random.default_rng(seed).normal(size=(count * joints, 3)) * 0.5)
    q = turns.as_quat().reshape(count, joints, 4)
    return [Pose(name=f"p{k}", rotations={f"j{j}": tuple(q[k, j].tolist()) for j in range(joints)})
            for k in range(count)]


def _space(count: int, joints: int) -> PoseSpace:
    dofs = tuple(Dof(control=f"j{j}") for j in range(joints))
    return PoseSpace(dofs=dofs, samples=tuple(PoseSample(pose=p) for p in _poses(count, joints)))


def _layer(space: PoseSpace, vertices: int) -> PoseLayer:
    shape = (len(space.samples), vertices)
    deltas = np.random.default_rng(0).normal(size=(*shape, 3)).astype(np.float32) * np.float32(0.01)
    return PoseLayer(
        space=space, vertices=freeze(np.arange(vertices, dtype=np.int32)), moved=freeze(np.ones(shape, np.bool_)),
        after=freeze(np.zeros(vertices, np.bool_)), deltas=freeze(deltas), targets=freeze(np.zeros_like(deltas)))


def _fit() -> list[Row]:
    rows = []
    for samples, vertices in ((32, 100_000), (128, 100_000)):
        space = _space(samples, 3)
        solved = solve(space)
        centres = solved.centres * scales(space.dofs)
        values = np.random.default_rng(0).normal(size=(samples + 1, 3 * vertices))
        ours = median_ms(lambda: solve(space), runs=31, warm=3)  # noqa: B023
        theirs = median_ms(
            lambda: RBFInterpolator(centres, values, kernel="gaussian", epsilon=2**-0.5, degree=-1),  # noqa: B023
            runs=3)
        what = f"fit {samples} poses x {vertices:,} vertices, one thread"
        rows += [Row(what, ours, "ms"), Row(f"{what}: SciPy's time over ours", theirs / ours, "", 1000.0, True)]
    at = _poses(1, 3, seed=5)[0]
    oracle = RBFInterpolator(centres, np.eye(129), kernel="gaussian", epsilon=2**-0.5, degree=-1)
    truth = oracle(embed(space.dofs, [at]) * scales(space.dofs))[0, 1:]
    rows.append(Row("largest difference of a weight from SciPy's, 128 poses",
                    float(np.abs(weights(solved, at) - truth).max()), "", 1e-10))
    return rows


def _synthesis() -> list[Row]:
    vertices, samples = 100_000, 32
    rig, _ = _rig(vertices, 3)
    prepared = prepare(Correctives(layers=(_layer(_space(samples, 3), vertices),)), rig)[0]
    pose = _poses(1, 3, seed=9)[0]
    points, late = np.zeros((vertices, 3), np.float32), np.zeros((0, 3), np.float32)
    share = run_weights(prepared, pose)
    flat = np.zeros(3 * vertices, np.float32)

    def sums(now: np.ndarray) -> None:
        synthesise(prepared.deltas, now, prepared.starts, prepared.after, prepared.places, points, late, 0, vertices)

    calls = {
        "weights from the pose, then sums": lambda: sums(run_weights(prepared, pose)),
        "the sums alone": lambda: sums(share),
        # given weights, the same sums, by the library every program would take
        "plain blend shapes by BLAS": lambda: np.add(flat, share[0] @ prepared.deltas, out=flat),
    }
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(60):  # in turns: whatever else the machine does, it does to all of them
        for name, call in calls.items():
            start = time.perf_counter()
            call()
            times[name].append((time.perf_counter() - start) * 1e3)
    best = {name: min(each) for name, each in times.items()}
    what = f"synthesis of {vertices:,} vertices x {samples} poses, one thread, best of 60"
    whole, mine, plain = best.values()
    return [
        *(Row(f"{what}: {name}", each, "ms") for name, each in best.items()),
        Row("  weights and sums over plain blend shapes", whole / plain, "", 1.1),
        Row("  the sums alone over plain blend shapes", mine / plain, "", 1.1),
    ]


def _rig(vertices: int, joints: int, shapes: int = 0) -> tuple[Rig, np.ndarray]:
    rng = np.random.default_rng(1)
    rest = np.tile(np.eye(4), (joints, 1, 1))
    rest[1:, 0, 3] = 0.1
    bind = rest.copy()
    for j in range(1, joints):
        bind[j] = bind[j - 1] @ rest[j]
    skeleton = Skeleton(names=tuple(f"j{j}" for j in range(joints)), parents=np.arange(-1, joints - 1, dtype=np.int32),
                        rest=rest, bind=bind)
    points = (rng.uniform(-0.05, 0.05, (vertices, 3)) + np.array([0.05 * joints, 0, 0])).astype(np.float32)
    skin = SkinWeights(joints=rng.integers(0, joints, (vertices, 4)).astype(np.int32),
                       weights=rng.dirichlet(np.ones(4), vertices).astype(np.float32))
    if not shapes:
        return Rig(skeleton=skeleton, skin=skin), points
    names = tuple(f"shape {i}" for i in range(shapes))
    offsets = [rng.normal(size=(vertices, 3)).astype(np.float32) * np.float32(0.001) for _ in names]
    morphs = targets_from_dense(names, range(shapes), np.ones(shapes), offsets)
    controls = tuple(Control(name=n) for n in names)
    return Rig(skeleton=skeleton, skin=skin, shapes=morphs, controls=controls), points


def _whole_mesh(workers: Workers) -> list[Row]:
    vertices, joints, samples = 35_000, 24, 16
    rig, points = _rig(vertices, joints, shapes=1)
    correctives = Correctives(layers=(_layer(_space(samples, 4), vertices),))
    prepared = prepare(correctives, rig)
    pose = _poses(1, joints, seed=3)[0].replace(numbers={"shape 0": 0.5})
    spent: list[float] = []

    def whole() -> None:
        start = time.process_time()
        evaluate(points, rig, correctives, pose, workers.ranges, prepared)
        spent.append(time.process_time() - start)

    wall = median_ms(whole, runs=61, warm=5)
    what = f"posed mesh (skin, one morph, corrections), {vertices:,} vertices x {joints} joints x {samples} poses"
    return [Row(f"{what}, wall time on 2 cores", wall, "ms", 4.0),
            Row("  processor time of both", float(np.median(spent)) * 1e3, "ms")]


def _adding() -> list[Row]:
    space = _space(33, 3)
    layer = _layer(space, 100_000)
    rig, points = _rig(100_000, 3)
    refresh = median_ms(lambda: prepare(Correctives(layers=(layer,)), rig), runs=15)
    rows = [Row("a pose added to 32: system and runs of 100,000 vertices anew", refresh, "ms", 20.0)]
    ring = np.argsort(np.linalg.norm(points - points[0], axis=1))[:2000]
    made = [Sculpt(p, _dented(points, rig, p, k, ring)) for k, p in enumerate(_poses(33, 3))]
    have = build(points, rig, made[:-1]).correctives
    last = made[-1]
    whole = median_ms(lambda: add_sculpt(points, rig, have, last.pose, last.target), runs=9)
    rows.append(Row("a sculpt of a ring over 2 % of 100,000 vertices added to 32, as a whole", whole, "ms", 20.0))
    sculpted = add_sculpt(points, rig, have, last.pose, last.target).correctives
    assert last.target is not None
    further = last.target.copy()
    further[np.argsort(np.linalg.norm(points - points[7], axis=1))[:2000]] += np.float32(0.01)
    stroke = median_ms(lambda: add_sculpt(points, rig, sculpted, last.pose, further), runs=9)
    rows.append(Row("a further stroke over 2 % of 100,000 vertices at one of 33 sculpted poses, at release", stroke,
                    "ms", 100.0))
    full = build(points, rig, [Sculpt(p, _dented(points, rig, p, k, slice(None))) for k, p in enumerate(_poses(33, 3))])
    again = _dented(points, rig, last.pose, 32, slice(None))
    again[ring] += np.float32(0.01)
    stroke = median_ms(lambda: add_sculpt(points, rig, full.correctives, last.pose, again), runs=9)
    rows.append(Row("  the same where all of the mesh is sculpted at all 33", stroke, "ms", 100.0))
    return rows


def _dented(points: np.ndarray, rig: Rig, pose: Pose, seed: int, ring: np.ndarray | slice) -> np.ndarray:
    push = np.random.default_rng(seed).normal(size=3).astype(np.float32) * np.float32(0.01)
    out = deformed(points, rig, local_of_pose(rig.skeleton, pose))
    out[ring] += push
    return out


if __name__ == "__main__":
    print(json.dumps([*_fit(), *_synthesis()]))
