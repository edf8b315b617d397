"""Rigs as .glb: skin, morph targets, the clip, and corrections as targets with their weights baked along it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.document import MeshObject
from core.errors import UserError
from core.formats.corrective_shapes import CorrectiveShapes, corrective_shapes, shape_weights_at
from core.mesh.triangulate import triangulate
from core.pose.blend_shapes import dense_offsets, shape_weights, target_weights
from core.pose.clip import split_matrices
from core.pose.rig import Rig, resting_numbers
from core.pose.synthesis import pose_at

VERTEX, INDEX = 34962, 34963
FLOAT, USHORT, UINT = 5126, 5123, 5125
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class _Glb:
    """Buffer, views and accessors in the making."""

    def __init__(self) -> None:
        self.blob = bytearray()
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []

    def view(self, array: NDArray[Any], target: int | None = None) -> int:
        self.blob.extend(bytes(-len(self.blob) % 4))
        view = {"buffer": 0, "byteOffset": len(self.blob), "byteLength": array.nbytes}
        self.views.append(view if target is None else {**view, "target": target})
        self.blob.extend(np.ascontiguousarray(array).tobytes())
        return len(self.views) - 1

    def add(self, array: NDArray[Any], kind: int, target: int | None = None, bounds: bool = False) -> int:
        """An accessor over rows (N, ...) of `array`."""
        wide = int(np.prod(array.shape[1:], dtype=int)) if array.ndim > 1 else 1
        dtype = {FLOAT: "<f4", USHORT: "<u2", UINT: "<u4"}[kind]
        rows = np.ascontiguousarray(array, dtype)
        made: dict[str, Any] = {
            "bufferView": self.view(rows, target), "componentType": kind, "count": len(rows), "type": TYPES[wide],
        }
        if bounds and len(rows):
            flat = rows.reshape(len(rows), wide)
            made |= {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        self.accessors.append(made)
        return len(self.accessors) - 1

    def sparse(self, count: int, rows: NDArray[np.integer], values: NDArray[np.float32]) -> int:
        """An accessor (count, 3) that is 0 but in some rows."""
        if not len(rows):
            rows, values = np.zeros(1, np.int64), np.zeros((1, 3), np.float32)
        low, high = (np.minimum(values.min(axis=0), 0.0), np.maximum(values.max(axis=0), 0.0))
        if len(rows) == count:
            low, high = values.min(axis=0), values.max(axis=0)
        self.accessors.append({
            "componentType": FLOAT, "count": count, "type": "VEC3", "min": low.tolist(), "max": high.tolist(),
            "sparse": {
                "count": len(rows),
                "indices": {"bufferView": self.view(rows.astype("<u4")), "componentType": UINT},
                "values": {"bufferView": self.view(values.astype("<f4"))},
            },
        })
        return len(self.accessors) - 1

    def save(self, path: Path, document: dict[str, Any]) -> None:
        self.blob.extend(bytes(-len(self.blob) % 4))
        whole = {
            "asset": {"version": "2.0", "generator": "Filoplume"}, "scene": 0, **document,
            "accessors": self.accessors, "bufferViews": self.views, "buffers": [{"byteLength": len(self.blob)}],
        }
        text = msgspec.json.encode(whole)
        text += b" " * (-len(text) % 4)
        total = 28 + len(text) + len(self.blob)
        head = b"glTF" + (2).to_bytes(4, "little") + total.to_bytes(4, "little")
        path.write_bytes(head + len(text).to_bytes(4, "little") + b"JSON" + text
                         + len(self.blob).to_bytes(4, "little") + b"BIN\0" + self.blob)


def write(path: Path, item: MeshObject, fps: float) -> tuple[str, ...]:
    """Write `item`, metres, Y up; returns sentences about what could not be said.

    Vertices are split at seams of UVs; a blend shape with inbetweens becomes one target for each, weighted along the
    clip so that they give the same. A target of weight 1 is one sculpt. The clip starts at 0 seconds.

    Raises
    ------
    UserError
        When there is no rig.
    """
    rig = item.rig
    if rig is None:
        raise UserError(f"{item.name} has no rig to write; give it a skeleton first.")
    glb, found = _Glb(), corrective_shapes(item)
    notes = list(found.notes)
    if rig.skinning != "linear":
        notes.append("glTF knows linear skinning only: volumes kept by dual quaternions are lost in this file.")
    source, attributes, indices = _vertices(glb, item)
    joints = len(rig.skeleton.names)
    skinned = joints > 0 and rig.skin.joints.shape[1] > 0
    if skinned:
        _influences(glb, rig, source, attributes)
    names, targets = _targets(glb, item, rig, found, source)
    primitive: dict[str, Any] = {"attributes": attributes, "indices": indices, "mode": 4}
    mesh: dict[str, Any] = {"name": item.name, "primitives": [primitive]}
    if targets:
        primitive["targets"] = targets
        mesh |= {"weights": [float(w) for w in _weights(item, rig, found, None)], "extras": {"targetNames": names}}
    nodes = _joint_nodes(rig)
    node: dict[str, Any] = {"name": item.name, "mesh": 0}
    document: dict[str, Any] = {"meshes": [mesh]}
    if skinned:
        inverse = np.linalg.inv(rig.skeleton.bind).swapaxes(1, 2)
        node["skin"] = 0
        document["skins"] = [{
            "joints": list(range(joints)), "inverseBindMatrices": glb.add(inverse.reshape(-1, 16), FLOAT),
        }]
    nodes.append(node)
    roots = [int(j) for j in np.flatnonzero(rig.skeleton.parents < 0)]
    document |= {"nodes": nodes, "scenes": [{"nodes": [*roots, joints]}]}
    if rig.clip is not None:
        document["animations"] = [_animation(glb, item, rig, found, bool(targets))]
    glb.save(path, document)
    return tuple(notes)


def _vertices(glb: _Glb, item: MeshObject) -> tuple[NDArray[np.int64], dict[str, int], int]:
    """Vertex of the mesh for each vertex of the file, accessors of places and UVs, and that of the triangles."""
    mesh, triangles = item.mesh, triangulate(item.mesh)
    if mesh.uvs is None:
        source, split = np.arange(len(mesh.points)), mesh.corners.astype(np.int64)
    else:
        keys = np.column_stack([mesh.corners.astype(np.float64), mesh.uvs.astype(np.float64)])
        rows, inverse = np.unique(keys, axis=0, return_inverse=True)
        source, split = rows[:, 0].astype(np.int64), inverse.ravel()
    attributes = {"POSITION": glb.add(mesh.points[source], FLOAT, VERTEX, bounds=True)}
    if mesh.uvs is not None:
        attributes["TEXCOORD_0"] = glb.add(np.column_stack([rows[:, 1], 1.0 - rows[:, 2]]), FLOAT, VERTEX)
    return source, attributes, glb.add(split[triangles.corners].reshape(-1), UINT, INDEX)


def _influences(glb: _Glb, rig: Rig, source: NDArray[np.int64], attributes: dict[str, int]) -> None:
    joints, weights = rig.skin.joints[source], rig.skin.weights[source]
    for first in range(0, joints.shape[1], 4):
        four = np.zeros((2, len(source), 4))
        wide = min(4, joints.shape[1] - first)
        four[1, :, :wide] = weights[:, first : first + 4]
        four[0, :, :wide] = np.where(weights[:, first : first + 4] > 0.0, joints[:, first : first + 4], 0)
        attributes[f"JOINTS_{first // 4}"] = glb.add(four[0], USHORT, VERTEX)
        attributes[f"WEIGHTS_{first // 4}"] = glb.add(four[1], FLOAT, VERTEX)


def _targets(
    glb: _Glb, item: MeshObject, rig: Rig, found: CorrectiveShapes, source: NDArray[np.int64]
) -> tuple[list[str], list[dict[str, int]]]:
    names: list[str] = []
    out: list[dict[str, int]] = []

    def add(name: str, dense: NDArray[np.float32]) -> None:
        offsets = dense[source]
        rows = np.flatnonzero((offsets != 0.0).any(axis=1))
        names.append(name)
        out.append({"POSITION": glb.sparse(len(source), rows, offsets[rows])})

    own = rig.shapes
    for target in range(0 if own is None else len(own.shape)):
        assert own is not None
        alone = int((own.shape == own.shape[target]).sum()) == 1 and own.at[target] == 1.0
        name = own.names[own.shape[target]]
        add(name if alone else f"{name} at {own.at[target]:g}", dense_offsets(own, target, len(item.mesh.points)))
    for shape in found.shapes:
        dense = np.zeros((len(item.mesh.points), 3), np.float32)
        dense[shape.vertices] = shape.offsets
        add(shape.name, dense)
    return names, out


def _weights(item: MeshObject, rig: Rig, found: CorrectiveShapes, frame: float | None) -> NDArray[np.float64]:
    """Weights of all targets at a frame of the clip, at rest without one."""
    pose = pose_at(rig if frame is not None else rig.replace(clip=None, clips=()), frame or 0.0)
    numbers = {**resting_numbers(rig), **pose.numbers}
    own = np.zeros(0) if rig.shapes is None else target_weights(rig.shapes, shape_weights(rig.shapes, numbers))
    return np.concatenate([own, shape_weights_at(found, item, pose)])


def _joint_nodes(rig: Rig) -> list[dict[str, Any]]:
    t, q, s, lost = split_matrices(rig.skeleton.rest)
    nodes: list[dict[str, Any]] = []
    for joint, name in enumerate(rig.skeleton.names):
        node: dict[str, Any] = {"name": name}
        if lost > 1e-6:  # sheared: only a matrix says that, and no clip can move it
            node["matrix"] = rig.skeleton.rest[joint].T.reshape(-1).tolist()
        else:
            node |= {"translation": t[joint].tolist(), "rotation": q[joint].tolist(), "scale": s[joint].tolist()}
        children = [int(c) for c in np.flatnonzero(rig.skeleton.parents == joint)]
        nodes.append({**node, "children": children} if children else node)
    if rig.clip is not None:
        for node in nodes:
            node.pop("matrix", None)
    return nodes


def _animation(glb: _Glb, item: MeshObject, rig: Rig, found: CorrectiveShapes, morphs: bool) -> dict[str, Any]:
    clip = rig.clip
    assert clip is not None
    frames, joints = clip.translations.shape[:2]
    times = glb.add(np.arange(frames) / clip.frames_per_second, FLOAT, bounds=True)
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []

    def add(node: int, path: str, values: NDArray[Any]) -> None:
        samplers.append({"input": times, "output": glb.add(values, FLOAT), "interpolation": "LINEAR"})
        channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})

    for joint in range(joints):
        add(joint, "translation", clip.translations[:, joint])
        add(joint, "rotation", clip.rotations[:, joint])
        add(joint, "scale", clip.scales[:, joint])
    if morphs:
        weights = np.array([_weights(item, rig, found, clip.start + f) for f in range(frames)])
        add(joints, "weights", weights.reshape(-1))
    return {"name": clip.name, "samplers": samplers, "channels": channels}
