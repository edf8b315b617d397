"""Corrections as blend shapes for programs that know nothing of pose spaces: one shape for each weight there is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.document import MeshObject
from core.errors import UserError
from core.pose.pose import Pose, local_of_pose
from core.pose.synthesis import Prepared, felt, prepare, run_weights


class CorrectiveShape(NamedTuple):
    """Offsets before skinning whose weight is that of one sample in one system of a layer.

    vertices : (n,) int32, ascending; offsets : (n, 3) float32, metres. run : a run of the layer with that weight.
    """

    name: str
    layer: int
    run: int
    sample: int
    vertices: NDArray[np.int32]
    offsets: NDArray[np.float32]


class CorrectiveShapes(NamedTuple):
    """All shapes of the correctives of a mesh, the layers they come from, and what to tell the artist."""

    shapes: tuple[CorrectiveShape, ...]
    layers: tuple[Prepared, ...]
    notes: tuple[str, ...]


def corrective_shapes(item: MeshObject) -> CorrectiveShapes:
    """The corrections of `item` as blend shapes, and a note where some cannot be (those made after skinning).

    Raises
    ------
    UserError
        When a layer mixes whole surfaces, which no sum of shapes before the skin can say.
    """
    if item.rig is None or item.correctives is None:
        return CorrectiveShapes((), (), ())
    layers = prepare(item.correctives, item.rig)
    taken = set() if item.rig.shapes is None else set(item.rig.shapes.names)
    shapes, late = [], 0
    for k, ready in enumerate(layers):
        if ready.layer.kind == "interpolation":
            raise UserError(f"The layer {ready.layer.name!r} mixes shapes; switch it to pose space before writing it.")
        late += len(ready.late)
        systems: dict[int, list[int]] = {}
        for g, solved in enumerate(ready.solved):
            if not ready.after[g]:
                systems.setdefault(id(solved), []).append(g)
        # plain correctives have one weight for all rows, but rows differ in the samples they know
        plain = ready.layer.kind != "pose-space"
        groups = [[g] for runs in systems.values() for g in runs] if plain else list(systems.values())
        for runs in groups:
            rows = np.concatenate([np.arange(ready.starts[g], ready.starts[g + 1]) for g in runs])
            rows = rows[np.argsort(ready.layer.vertices[rows])]
            for m in np.flatnonzero(ready.layer.moved[:, rows[0]]):
                name = _free_name(ready.layer.space.samples[m].name, taken)
                shapes.append(CorrectiveShape(
                    name, k, runs[0], int(m), ready.layer.vertices[rows], ready.layer.deltas[m, rows]))
    notes = () if not late else (
        f"{late} vertices of {item.name} are corrected after skinning, which blend shapes cannot say: they are left as "
        "they are skinned; bake the points where that matters.",)
    return CorrectiveShapes(tuple(shapes), layers, notes)


def shape_weights_at(found: CorrectiveShapes, item: MeshObject, pose: Pose) -> NDArray[np.float64]:
    """Weights (S,) of the shapes at a pose."""
    if not found.shapes or item.rig is None:
        return np.zeros(len(found.shapes))
    whole = felt(pose, item.rig, item.mesh.points, local_of_pose(item.rig.skeleton, pose))
    runs = [run_weights(ready, whole) for ready in found.layers]
    return np.array([runs[shape.layer][shape.run, shape.sample] for shape in found.shapes], np.float64)


def _free_name(name: str, taken: set[str]) -> str:
    free = next(n for n in (name, *(f"{name} {i}" for i in range(2, len(taken) + 3))) if n not in taken)
    taken.add(free)
    return free
