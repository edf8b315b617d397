"""The runtime file: the reader printed in the manual gives our results; damaged and hostile files are refused."""

import json
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest

from core.errors import UserError
from core.formats.pose_runtime import read_runtime, runtime_of, write_runtime
from core.pose.corrective import as_kind
from core.pose.skeleton import SkinWeights
from core.pose.synthesis import evaluate, prepare
from core.record import freeze
from tests.core.formats.posed_samples import BENT, BOTH, ELSEWHERE, FLEXED, HALF, posed_arm, turned

MANUAL = Path(__file__).parents[3] / "docs" / "pose.md"
KERNELS = (
    "gaussian", "thin-plate", "multiquadric", "inverse-multiquadric", "wendland", "cubic", "linear", "shepard",
)


def reader():
    """The names the manual's reader defines."""
    code = next(c for c in re.findall(r"```python\n(.*?)```", MANUAL.read_text(encoding="utf-8"), re.DOTALL)
                if "def load" in c)
    assert len(code.splitlines()) <= 100
    assert not re.search(r"^\s*(import|from) (?!json|pathlib|numpy)", code, re.MULTILINE)
    names = {}
    exec(compile(code, str(MANUAL), "exec"), names)
    return names


def check(item, tmp_path):
    write_runtime(tmp_path / "arm.json", item)
    names = reader()
    runtime = names["load"](tmp_path / "arm.json")
    size = float(np.linalg.norm(np.ptp(item.mesh.points, axis=0)))
    ready = prepare(item.correctives, item.rig)
    for pose in ELSEWHERE:
        theirs = names["pose"](runtime, pose.rotations, pose.translations, pose.numbers)
        ours = evaluate(item.mesh.points, item.rig, item.correctives, pose, prepared=ready)
        assert np.abs(theirs - ours).max() <= 1e-6 * size, pose


def test_the_manual_reader_gives_our_results(tmp_path):
    item = posed_arm()
    assert any(layer.after.any() for layer in item.correctives.layers)  # half a turn of the wrist flattens the middle
    check(item, tmp_path)


@pytest.mark.parametrize("kernel", KERNELS)
def test_with_every_kernel(kernel, tmp_path):
    check(posed_arm((BENT, HALF, FLEXED, BOTH), kernel=kernel), tmp_path)


@pytest.mark.parametrize("options", [
    {"affine": True}, {"clamp": True}, {"normalise": "above-one"}, {"normalise": "always"}, {"table": 512},
    {"weighted": 4}, {"smoothing": 0.01},
], ids=str)
def test_with_every_option(options, tmp_path):
    check(posed_arm((BENT, HALF, FLEXED, BOTH), **options), tmp_path)


def test_with_both_ways_of_skinning_in_one_mesh(tmp_path):
    rig = posed_arm(()).rig
    dual = np.arange(len(rig.skin.joints)) % 3 == 0
    check(posed_arm(rig=rig.replace(skinning="mixed", dual=freeze(dual))), tmp_path)
    _, arrays = read_runtime(tmp_path / "arm.json")
    assert np.array_equal(arrays["dual"], dual)


@pytest.mark.parametrize("squashed", [False, True])
def test_with_dual_quaternions(squashed, tmp_path):
    """Where `squashed`, of joints that are scaled and sheared at rest, one of them mirrored."""
    rig = posed_arm(()).rig.replace(skinning="dual-quaternion")
    if squashed:
        rest = rig.skeleton.rest.copy()
        rest[1, :3, :3] @= np.array([[1.3, 0.2, 0.0], [0.0, 0.8, 0.1], [0.0, 0.0, 1.1]])
        rest[2, :3, :3] @= np.diag([1.0, 1.0, -1.0])
        rig = rig.replace(skeleton=rig.skeleton.replace(rest=freeze(rest)))
    check(posed_arm(rig=rig), tmp_path)


def test_what_no_joint_moves(tmp_path):
    item = posed_arm((FLEXED,))
    count = len(item.mesh.points)
    none = SkinWeights(joints=np.zeros((count, 0), np.int32), weights=np.zeros((count, 0), np.float32))
    check(item.replace(rig=item.rig.replace(skin=none)), tmp_path)


def test_read_back_it_is_what_was_written(tmp_path):
    item = posed_arm()
    write_runtime(tmp_path / "arm.json", item)
    found, wanted = read_runtime(tmp_path / "arm.json"), runtime_of(item, "arm.npz")
    assert found.arrays.keys() == wanted.arrays.keys()
    for name, array in wanted.arrays.items():
        assert np.array_equal(found.arrays[name], array), name
    assert [layer.name for layer in found.head.layers] == [layer.name for layer in item.correctives.layers]


def test_what_the_format_cannot_say_is_refused():
    item = posed_arm((BENT,))
    with pytest.raises(UserError, match="plain corrective"):
        runtime_of(item.replace(correctives=as_kind(item.correctives, "linear")), "arm.npz")
    with pytest.raises(UserError, match="no rig"):
        runtime_of(item.replace(rig=None, correctives=None), "arm.npz")


def rewritten(source, target, **changes):
    """The .npz with arrays replaced (None: left out), as any program could write it."""
    with np.load(source) as file:
        arrays = {name: file[name] for name in file.files} | changes
    np.savez(target, **{name: array for name, array in arrays.items() if array is not None})


@pytest.mark.parametrize("changes", [
    {"joints": np.full((2, 2), 99, np.int32)},
    {"points": np.full((4, 3), np.nan, np.float32)},
    {"points": np.zeros((4, 3), np.float64)},
    {"parents": np.array([0, 0, 1, 2, 3], np.int32)},
    {"file_vertices": np.array([-1], np.int32)},
    {"layer0.run0.vertices": np.array([1 << 30], np.int32)},
    {"layer0.system0.inverse": np.zeros((1, 1))},
    {"layer0.system0.samples": np.array([7], np.int32)},
    {"shape_starts": np.array([0, 1 << 40, 5], np.int64)},
    {"shape_at": np.array([0.0, 0.5, 0.5])},
    {"layer0.run0.deltas": None},
    {"extra": np.zeros(1)},
    {"points": np.array([object()])},
], ids=lambda c: "-".join(c))
def test_hostile_arrays_are_refused(changes, tmp_path):
    write_runtime(tmp_path / "arm.json", posed_arm((BENT,)))
    rewritten(tmp_path / "arm.npz", tmp_path / "bad.npz", **changes)
    (tmp_path / "bad.npz").replace(tmp_path / "arm.npz")
    with pytest.raises(UserError, match=r"arm\.npz"):
        read_runtime(tmp_path / "arm.json")


@pytest.mark.parametrize("change", [
    {"version": 1}, {"version": 3}, {"skinning": "cubic"}, {"format": "other"}, {"arrays": "../arm.npz"},
    {"arrays": "gone.npz"}, {"extra": 1},
    {"joints": ["a"]}, {"shapes": []}, {"layers": []},
], ids=str)
def test_hostile_heads_are_refused(change, tmp_path):
    path = tmp_path / "arm.json"
    write_runtime(path, posed_arm((BENT,)))
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(UserError):
        read_runtime(path)


def test_bombs_and_torn_files_are_refused(tmp_path):
    path = tmp_path / "arm.json"
    write_runtime(path, posed_arm((BENT,)))
    whole = (tmp_path / "arm.npz").read_bytes()
    for cut in (0, 10, len(whole) // 2, len(whole) - 3):
        (tmp_path / "arm.npz").write_bytes(whole[:cut])
        with pytest.raises(UserError):
            read_runtime(path)
    with zipfile.ZipFile(tmp_path / "arm.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("points.npy", bytes(50_000_000))
    with pytest.raises(UserError):
        read_runtime(path)
    for text in ("", "{", "[]", '{"format": "filoplume-runtime"}', "[" * 100_000):
        path.write_text(text)
        with pytest.raises(UserError):
            read_runtime(path)


def test_a_turn_given_with_the_other_sign_is_the_same(tmp_path):
    item = posed_arm((BENT,))
    write_runtime(tmp_path / "arm.json", item)
    names = reader()
    runtime = names["load"](tmp_path / "arm.json")
    q = np.array(turned(10, 20, 70))
    a, b = (names["pose"](runtime, {"elbow": sign * q}) for sign in (1, -1))
    assert np.allclose(a, b, atol=1e-12)
