"""glTF rigs packed by hand, against the specification spelled out in ``gltf_truth``."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.formats.rig_assembly import NoRig
from core.formats.rig_file import read_rig
from core.pose.rig import playing
from core.pose.skinning import deformed, posed_points
from tests.core.formats.gltf_truth import gltf_points

KINDS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
WIDE = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Maker:
    """A glTF document whose arrays are added one by one."""

    def __init__(self):
        self.blob, self.views, self.accessors = b"", [], []

    def view(self, array):
        self.blob += bytes(-len(self.blob) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": array.nbytes})
        self.blob += np.ascontiguousarray(array).tobytes()
        return len(self.views) - 1

    def add(self, array, **words):
        array = np.asarray(array)
        array = array.astype(array.dtype.newbyteorder("<"))
        width = 1 if array.ndim == 1 else array.shape[1]
        self.accessors.append({
            "bufferView": self.view(array), "componentType": KINDS[array.dtype.str[1:]], "count": len(array),
            "type": WIDE[width], **words,
        })
        return len(self.accessors) - 1

    def sparse(self, count, rows, values):
        self.accessors.append({
            "componentType": 5126, "count": count, "type": "VEC3",
            "sparse": {"count": len(rows), "indices": {"bufferView": self.view(np.uint16(rows)), "componentType": 5123},
                       "values": {"bufferView": self.view(np.float32(values))}},
        })
        return len(self.accessors) - 1

    def write(self, path, **document):
        (path.parent / "rig.bin").write_bytes(self.blob)
        whole = {
            "asset": {"version": "2.0"}, "accessors": self.accessors, "bufferViews": self.views,
            "buffers": [{"uri": "rig.bin", "byteLength": len(self.blob)}], **document,
        }
        path.write_text(json.dumps(whole))
        return path


def matrix(rng, scale=True):
    m = np.eye(4)
    m[:3, :3] = Rotation.random(random_state=int(rng.integers(1e6))).as_matrix() * (rng.uniform(0.5, 2) if scale else 1)
    m[:3, 3] = rng.normal(size=3)
    return m


def flat(matrices):
    return np.asarray(matrices, np.float32).swapaxes(-1, -2).reshape(-1, 16)


def full_rig(tmp_path, seed=5):
    """Everything at once: a scaled armature, 12 joints, 8 influences, two skins bound in two places, morph targets
    (one sparse), cubic, step and linear keys, a mesh on an animated node and one that stands still."""
    rng = np.random.default_rng(seed)
    maker = Maker()
    count = 90
    points = rng.normal(size=(count, 3)).astype("f4")
    nodes = [{"name": "armature", "scale": [0.01] * 3, "rotation": [0.5, 0.5, 0.5, 0.5], "children": [1]}]
    for j in range(12):
        q = Rotation.random(random_state=j).as_quat().tolist()
        nodes.append({
            "name": f"j{j}", "translation": rng.normal(size=3).tolist(), "rotation": q,
            "scale": rng.uniform(0.7, 1.3, 3).tolist(), "children": [j + 2] if j < 11 and j != 5 else [],
        })
    nodes[2]["children"].append(7)  # j6 hangs on j1
    between = matrix(rng)
    nodes.append({"name": "between", "matrix": (between * 1.0).T.ravel().tolist(), "children": [10]})
    nodes[9]["children"] = [13]  # a node that is no joint lies above j9
    joints = np.argsort(rng.random((count, 12)), axis=1)[:, :8]
    shares = rng.dirichlet(np.ones(8), count)
    quantised = np.round(shares[:, :4] * 255).astype("u1")
    attributes = {
        "POSITION": maker.add(points),
        "JOINTS_0": maker.add(joints[:, :4].astype("u1")), "WEIGHTS_0": maker.add(quantised, normalized=True),
        "JOINTS_1": maker.add(joints[:, 4:].astype("u2")),
        "WEIGHTS_1": maker.add(np.round(shares[:, 4:] * 65535).astype("u2"), normalized=True),
    }
    rows = np.sort(rng.permutation(count)[:20])
    targets = [{"POSITION": maker.add(rng.normal(size=(count, 3)).astype("f4"))},
               {"POSITION": maker.sparse(count, rows, rng.normal(size=(20, 3)))},
               {"POSITION": maker.add(rng.integers(-127, 127, (count, 3)).astype("i1"), normalized=True)}]
    first = [matrix(rng) for _ in range(12)]
    other = first.copy()
    other[3] = matrix(rng)  # bound elsewhere by the second skin
    meshes = [
        {"primitives": [{"attributes": attributes, "targets": targets}], "weights": [0.0, 0.25, 0.0],
         "extras": {"targetNames": ["smile", "frown"]}},
        {"primitives": [{"attributes": {"POSITION": maker.add(rng.normal(size=(12, 3)).astype("f4"))}}], "name": "box"},
    ]
    order = list(range(1, 13))
    skins = [{"joints": order, "inverseBindMatrices": maker.add(flat(first))},
             {"joints": order, "inverseBindMatrices": maker.add(flat(other))}]
    nodes += [
        {"name": "body", "mesh": 0, "skin": 0, "translation": [9, 9, 9]}, {"name": "coat", "mesh": 0, "skin": 1},
        {"name": "carried", "mesh": 1, "translation": [1, 2, 3]}, {"name": "lift", "children": [16]},
        {"name": "floor", "mesh": 1, "scale": [2, 2, 2]}, {"name": "hat", "mesh": 1, "translation": [0, 1, 0]},
    ]
    nodes[5]["children"].append(19)  # the hat is on j4, which is a joint
    times = np.float32(np.array([0, 6, 7, 18]) / 24)

    def sampler(values, mode="LINEAR"):
        return {"input": maker.add(times), "output": maker.add(np.float32(values)), "interpolation": mode}

    turns = Rotation.random(12, random_state=3).as_quat()
    samplers = [
        sampler(turns[:4]), sampler(rng.normal(size=(12, 3)), "CUBICSPLINE"), sampler(turns[:12], "CUBICSPLINE"),
        sampler(rng.uniform(0.5, 2, (4, 3)), "STEP"), sampler(rng.normal(size=(4, 3))),
        sampler(rng.random(12)), sampler(rng.random(36), "CUBICSPLINE"), sampler(rng.normal(size=(4, 3))),
    ]
    aims = [(1, "rotation"), (3, "translation"), (6, "rotation"), (2, "scale"), (10, "translation"), (14, "weights"),
            (15, "weights"), (17, "translation")]
    animations = [
        {"name": "all", "samplers": samplers,
         "channels": [{"sampler": s, "target": {"node": n, "path": p}} for s, (n, p) in enumerate(aims)]},
        {"samplers": samplers[:1], "channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}]},
    ]
    return maker.write(
        tmp_path / "rig.gltf", nodes=nodes, meshes=meshes, skins=skins, animations=animations,
        scenes=[{"nodes": [0, 14, 15, 17, 18]}],
    )


def in_file_order(rig, points):
    return points if rig.file_vertices is None else points[rig.file_vertices]


def test_everything_at_once_is_as_the_specification_says(tmp_path):
    path = full_rig(tmp_path)
    found = read_rig(path)
    rig = found.rig
    assert rig.skin.joints.shape[1] == 8
    assert rig.skeleton.names[-2:] == ("j3 (bound again)", "still")
    assert {"lift", "j11"} < set(rig.skeleton.names)
    assert not {"armature", "between", "floor", "carried"} & set(rig.skeleton.names)
    assert [c.name for c in rig.controls] == [
        "smile", "frown", "target3", "coat smile", "coat frown", "coat target3"]
    assert rig.controls[1].rest == 0.25
    assert [(c.name, c.start, c.end, c.frames_per_second) for c in found.clips] == [
        ("all", 0.0, 18.0, 24.0), ("clip2", 0.0, 18.0, 24.0)]
    rest = in_file_order(rig, deformed(found.mesh.points, rig, rig.skeleton.rest))
    truth = gltf_points(path, None, 0.0)
    assert np.abs(rest - truth).max() <= 1e-5 * np.ptp(truth, axis=0).max()
    for number, clip in enumerate(found.clips):
        for frame in range(19):
            points = in_file_order(rig, posed_points(found.mesh.points, playing(rig, clip.name), frame))
            truth = gltf_points(path, number, frame / 24)
            assert np.abs(points - truth).max() <= 1e-5 * np.ptp(truth, axis=0).max(), (number, frame)


def simple(tmp_path, **changes):
    """Two joints, four vertices; `changes` to the document, or functions of it."""
    maker = Maker()
    shares = np.float32([[1, 0, 0, 0], [0.5, 0.5, 0, 0], [0.2, 0.8, 0, 0], [0, 1, 0, 0]])
    shares = changes.pop("weights", shares)
    joints = np.tile(np.uint8([0, 1, 0, 0]), (4, 1))
    primitive = {
        "attributes": {"POSITION": maker.add(np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])),
                       "JOINTS_0": maker.add(changes.pop("joints", joints)), "WEIGHTS_0": maker.add(shares)},
        "indices": maker.add(np.uint16([0, 1, 2, 0, 2, 3])),
    }
    document = {
        "nodes": [{"name": "a", "children": [1]}, {"name": "b", "translation": [0, 1, 0]}, {"mesh": 0, "skin": 0}],
        "scenes": [{"nodes": [0, 2]}], "meshes": [{"primitives": [primitive]}],
        "skins": [{"joints": [0, 1], "inverseBindMatrices": maker.add(flat([np.eye(4)] * 2))}],
        "animations": [{"channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
                        "samplers": [{"input": maker.add(np.float32([0, 1])),
                                      "output": maker.add(np.float32([[0, 1, 0], [0, 2, 0]]))}]}],
    }
    for key, change in changes.items():
        document[key] = change(document[key], maker) if callable(change) else change
    return maker.write(tmp_path / "simple.gltf", **document)


BAD_WEIGHTS = np.float32([[1, 0, 0, 0], [0, 0, 0, 0], [np.nan, 1, 0, 0], [-1, 3, 0, 0]])


def test_bad_weights_are_repaired_with_a_word(tmp_path):
    found = read_rig(simple(tmp_path, weights=BAD_WEIGHTS, joints=np.tile(np.uint8([0, 1, 9, 0]), (4, 1))))
    said = " ".join(found.notes)
    for word in ("no weights", "negative or not finite", "normalised"):
        assert word in said
    assert np.allclose(found.rig.skin.weights.sum(axis=1), 1.0)
    wrong = read_rig(simple(tmp_path, joints=np.tile(np.uint8([0, 200, 9, 0]), (4, 1))))
    assert "joints that do not exist" in " ".join(wrong.notes)


def animation(**changes):
    def change(animations, maker):
        made = [dict(a) for a in animations]
        made[0]["samplers"] = [made[0]["samplers"][0] | {k: v(maker) if callable(v) else v for k, v in changes.items()}]
        return made

    return change


@pytest.mark.parametrize(("changes", "said"), [
    ({"skins": [{"joints": [0, 77]}]}, "does not exist"),
    ({"skins": [{"joints": [0, -1]}]}, "contradicts|negative"),
    ({"skins": lambda s, m: [{"joints": [0, 1], "inverseBindMatrices": m.add(flat([np.eye(4)]))}]}, "bind matrices"),
    ({"skins": lambda s, m: [{"joints": [0, 1], "inverseBindMatrices": m.add(np.zeros((2, 4), "f4"))}]}, "type"),
    ({"nodes": [{"children": [1]}, {"children": [0]}, {"mesh": 0, "skin": 0}]}, "contain themselves"),
    ({"nodes": [{"children": [1]}, {}, {"mesh": 0, "skin": 5}]}, "contradicts"),
    ({"weights": np.ones((3, 4), "f4")}, "3 weights for 4"),
    ({"animations": animation(output=lambda m: m.add(np.zeros((5, 3), "f4")))}, "values where"),
    ({"animations": animation(output=99)}, "contradicts"),
    ({"animations": animation(output=lambda m: m.add(np.zeros((2, 16), "f4")))}, "type"),
    ({"animations": animation(input=lambda m: m.add(np.float32([0, 1e9])))}, "too long"),
    ({"animations": [{"channels": [{"sampler": 4, "target": {"node": 1, "path": "scale"}}]}]}, "contradicts"),
    ({"meshes": lambda ms, m: [{"primitives": [
        ms[0]["primitives"][0] | {"targets": [{"POSITION": m.add(np.zeros((9, 3), "f4"))}]}]}]}, "morph target of 9"),
    ({"meshes": lambda ms, m: [{"primitives": [ms[0]["primitives"][0] | {"targets": [{}] * 5000}]}]}, "morph targets"),
])
def test_what_contradicts_itself_is_refused_in_a_sentence(tmp_path, changes, said):
    with pytest.raises(UserError, match=said) as error:
        read_rig(simple(tmp_path, **changes))
    assert "simple.gltf" in str(error.value)


@pytest.mark.parametrize("changes", [
    {"animations": animation(input=lambda m: m.add(np.float32([1, 0])))},
    {"animations": animation(input=lambda m: m.add(np.float32([0, np.nan])))},
    {"animations": [{"channels": [{"sampler": 0, "target": {"path": "pointer"}}],
                     "samplers": [{"input": 0, "output": 0}]}]},
    {"skins": lambda s, m: [{"joints": [0, 1], "inverseBindMatrices": m.add(np.full((2, 16), np.nan, "f4"))}]},
    {"skins": lambda s, m: [{"joints": [0, 1, 1], "inverseBindMatrices": m.add(np.zeros((3, 16), "f4"))}]},
    {"animations": animation(output=lambda m: m.add(np.full((2, 3), np.inf, "f4")))},
])
def test_what_cannot_be_used_is_left_out_and_the_rest_stays(tmp_path, changes):
    found = read_rig(simple(tmp_path, **changes))
    assert np.isfinite(posed_points(found.mesh.points, found.rig, 3)).all()
    for joint in ("a", "b"):
        assert joint in found.rig.skeleton.names


def test_a_plain_mesh_has_no_rig(tmp_path):
    with pytest.raises(NoRig, match="no skeleton"):
        read_rig(simple(tmp_path, skins=[], animations=[], nodes=[{"mesh": 0}, {}, {}]))
