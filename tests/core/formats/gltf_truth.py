"""glTF by the letter of its specification, one vertex and one key after another: slow, plain, and none of our code."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp


def gltf_points(path: Path, clip: int | None, seconds: float) -> np.ndarray:
    """Points (V, 3) of all primitives, one vertex after another; at rest without a clip."""
    data = path.read_bytes()
    if data[:4] == b"glTF":
        length = int.from_bytes(data[12:16], "little")
        doc, chunk = json.loads(data[20 : 20 + length]), data[28 + length :]
    else:
        doc, chunk = json.loads(data), b""
    buffers = [
        chunk if "uri" not in b else base64.b64decode(b["uri"].split(",")[1]) if b["uri"].startswith("data:")
        else (path.parent / b["uri"]).read_bytes() for b in doc["buffers"]
    ]
    kinds = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
    widths = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}

    def plain(view, offset, count, kind, width):
        v = doc["bufferViews"][view]
        step = v.get("byteStride", np.dtype(kind).itemsize * width)
        at = v.get("byteOffset", 0) + offset
        return np.array([np.frombuffer(buffers[v["buffer"]], kind, width, at + i * step) for i in range(count)])

    def numbers(row):
        a = doc["accessors"][row]
        kind, width = kinds[a["componentType"]], widths[a["type"]]
        if "bufferView" in a:
            out = plain(a["bufferView"], a.get("byteOffset", 0), a["count"], kind, width).astype(float)
        else:
            out = np.zeros((a["count"], width))
        if "sparse" in a:
            s = a["sparse"]
            rows = plain(s["indices"]["bufferView"], s["indices"].get("byteOffset", 0), s["count"],
                         kinds[s["indices"]["componentType"]], 1)[:, 0]
            out[rows] = plain(s["values"]["bufferView"], s["values"].get("byteOffset", 0), s["count"], kind, width)
        return out / np.iinfo(kind).max if a.get("normalized") else out

    nodes = [dict(n) for n in doc["nodes"]]
    for channel in doc["animations"][clip]["channels"] if clip is not None else ():
        sampler = doc["animations"][clip]["samplers"][channel["sampler"]]
        times, values = numbers(sampler["input"])[:, 0], numbers(sampler["output"]).reshape(-1)
        mode = sampler.get("interpolation", "LINEAR")
        values = values.reshape(len(times), 3 if mode == "CUBICSPLINE" else 1, -1)
        t = np.clip(seconds, times[0], times[-1])
        i = min(max(np.searchsorted(times, t + 1e-6, side="right") - 1, 0), len(times) - 1)
        k = min(i + 1, len(times) - 1)
        p = 0.0 if i == k else (t - times[i]) / (times[k] - times[i])
        if mode == "STEP":
            p = 0.0
        a, b = values[i, len(values[i]) // 2], values[k, len(values[k]) // 2]
        turns = channel["target"]["path"] == "rotation"
        if mode == "CUBICSPLINE":
            d = times[k] - times[i]
            value = ((2 * p**3 - 3 * p**2 + 1) * a + d * (p**3 - 2 * p**2 + p) * values[i, 2]
                     + (-2 * p**3 + 3 * p**2) * b + d * (p**3 - p**2) * values[k, 0])
            value = value / np.linalg.norm(value) if turns else value
        elif channel["target"]["path"] == "rotation":
            value = a if p <= 0 else Slerp([0, 1], Rotation.from_quat([a, b]))(min(p, 1.0)).as_quat()
        else:
            value = a + p * (b - a)
        nodes[channel["target"]["node"]][channel["target"]["path"]] = list(value)

    def local(n):
        if "matrix" in n:
            return np.array(n["matrix"]).reshape(4, 4).T
        m = np.eye(4)
        turn = Rotation.from_quat(n.get("rotation", [0, 0, 0, 1])).as_matrix()
        m[:3, :3] = turn * np.array(n.get("scale", [1, 1, 1]))
        m[:3, 3] = n.get("translation", [0, 0, 0])
        return m

    worlds, order = {}, []

    def walk(row, above):
        worlds[row] = above @ local(nodes[row])
        order.append(row)
        for child in nodes[row].get("children", []):
            walk(child, worlds[row])

    for root in doc["scenes"][doc.get("scene", 0)]["nodes"]:
        walk(root, np.eye(4))
    rows = []
    for row in order:
        if "mesh" not in nodes[row]:
            continue
        mesh = doc["meshes"][nodes[row]["mesh"]]
        shares = nodes[row].get("weights", mesh.get("weights", []))
        for primitive in mesh["primitives"]:
            points = numbers(primitive["attributes"]["POSITION"])
            for share, target in zip(shares, primitive.get("targets", [])):
                points = points + share * numbers(target["POSITION"])
            whole = np.column_stack([points, np.ones(len(points))])
            if "skin" not in nodes[row]:
                rows.append((whole @ worlds[row].T)[:, :3])
                continue
            skin = doc["skins"][nodes[row]["skin"]]
            inverse = numbers(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
            matrices = [worlds[j] @ inverse[k] for k, j in enumerate(skin["joints"])]
            out, total = np.zeros((len(points), 3)), np.zeros(len(points))
            number = 0
            while f"JOINTS_{number}" in primitive["attributes"]:
                joints = numbers(primitive["attributes"][f"JOINTS_{number}"]).astype(int)
                weights = numbers(primitive["attributes"][f"WEIGHTS_{number}"])
                for c in range(4):
                    m = np.array(matrices)[joints[:, c]]
                    out += weights[:, c : c + 1] * np.einsum("vij,vj->vi", m, whole)[:, :3]
                    total += weights[:, c]
                number += 1
            rows.append(out / total[:, None])
    return np.concatenate(rows)
