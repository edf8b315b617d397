"""``filoplume pose`` as a script calls it: files in, files out, words and exit codes."""

import json
import math

import numpy as np
import pytest
import trimesh

from core.document import Document
from core.formats.pose_export import write
from core.formats.project import read_project, write_project
from core.formats.rig_file import read_rig
from core.pose.pose import Pose, local_of_pose
from core.pose.skinning import deformed
from tests.app.command_line import filoplume
from tests.core.formats.posed_samples import posed_arm, turned


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """An arm as .glb, whose vertices are split at seams, and two sculpts in the order of that file."""
    path = tmp_path_factory.mktemp("pose")
    write(path / "arm.glb", posed_arm(()).replace(correctives=None), 24.0)
    found = read_rig(path / "arm.glb")
    assert len(found.rig.file_vertices) > len(found.mesh.points)
    rng = np.random.default_rng(0)
    for name, pose in (("bent", {"elbow": turned(0, 0, 110)}), ("twist", {"wrist": turned(120, 0, 0)})):
        points = deformed(found.mesh.points, found.rig, local_of_pose(found.rig.skeleton, Pose(rotations=pose)))
        near = np.abs(found.mesh.points[:, 0] - 0.35) < 0.1
        points = points + near[:, None] * rng.normal(0.0, 0.004, points.shape)
        write_points(path / f"{name}.obj", points[found.rig.file_vertices])
    return path


def write_points(path, points):
    path.write_text("".join(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in points))


def read_points(path):
    return np.array([line.split()[1:4] for line in path.read_text().splitlines() if line.startswith("v ")], np.float64)


POSES = [
    {"name": "bent", "controls": {"elbow": {"rotate": [0, 0, 110]}, "wrist": {"rotate": [0, 0, 0]}},
     "sculpt": "bent.obj", "falloff": {"elbow": 60, "wrist": 40}},  # the second of which says nothing
    {"name": "twist", "controls": {"wrist": {"rotate": [120, 0, 0]}}, "sculpt": "twist.obj"},
    {"name": "plain", "controls": {"elbow": {"rotate": [0, 0, 60]}, "swell at 1": 0.5}, "sculpt": None},
]


def build(folder, poses, *extra, kernel="gaussian", **more):
    said = json.dumps({"kernel": kernel, "poses": poses, **more})
    (folder / "poses.json").write_text(said, "utf-8-sig")  # as editors of Windows write it
    return filoplume("pose", folder / "arm.glb", "--poses", folder / "poses.json", *extra, "--json")


def surface(folder, pose, project="out.filo"):
    (folder / "pose.json").write_text(json.dumps(pose))
    done = filoplume("pose", folder / project, "--at", folder / "pose.json", "--obj", folder / "at.obj", "--json")
    assert done.returncode == 0, done.stderr
    return read_points(folder / "at.obj")


def test_every_sculpt_comes_back_in_the_order_of_the_rig_file(folder):
    done = build(folder, POSES, "-o", folder / "out.filo")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert {p["name"] for p in said["poses"]} == {"bent", "twist", "plain"}
    assert all(p["error"] <= 1e-6 for p in said["poses"])
    assert [set(layer["controls"]) for layer in said["layers"]] == [{"elbow"}, {"wrist"}, {"elbow", "swell at 1"}]
    assert all(1.0 <= c < 1e6 for c in said["conditions"].values())
    assert said["refusals"] == []
    for pose in POSES[:2]:
        wanted = read_points(folder / pose["sculpt"])
        got = surface(folder, {"controls": pose["controls"]})
        assert got.shape == wanted.shape
        assert np.abs(got - wanted).max() <= 1e-6 * np.linalg.norm(np.ptp(wanted, axis=0))
    shown = trimesh.load(folder / "at.obj", process=False)
    assert len(shown.faces) > 0
    controls = json.loads(filoplume("info", folder / "out.filo", "--json").stdout)["controls"]
    assert {"elbow", "wrist", "swell at 1"} <= set(controls)
    assert {"elbow", "wrist", "swell at 1"} <= set(json.loads(
        filoplume("info", folder / "arm.glb", "--json").stdout)["controls"])


def test_a_sculpt_with_other_faces_is_told(folder):
    """As many vertices, but joined otherwise: as another program's order of vertices shows itself."""
    text = (folder / "bent.obj").read_text()
    faces = read_rig(folder / "arm.glb")
    count = len(faces.rig.file_vertices)
    (folder / "mixed.obj").write_text(text + f"f 1 {count // 2} {count}\n")
    done = build(folder, [{**POSES[0], "sculpt": "mixed.obj"}], "-o", folder / "mixed.filo")
    assert done.returncode == 0
    assert "which no face of the rig does" in done.stderr
    done = build(folder, POSES[:1], "-o", folder / "alike.filo")
    assert "no face of the rig" not in done.stderr


def test_a_sculpt_that_opens_seams_leaves_them_closed_and_is_told(folder):
    """Every vertex of the file is pushed by itself, as no program with seams of UVs would show it."""
    found = read_rig(folder / "arm.glb")
    there = found.rig.file_vertices
    points = read_points(folder / "bent.obj")
    torn = points + np.random.default_rng(1).normal(0.0, 0.002, points.shape)
    write_points(folder / "torn.obj", torn)
    done = build(folder, [{**POSES[0], "sculpt": "torn.obj"}], "-o", folder / "torn.filo")
    assert done.returncode == 0
    assert "opens seams" in done.stderr
    got = surface(folder, {"controls": POSES[0]["controls"]}, "torn.filo")
    for vertex in np.flatnonzero(np.bincount(there) > 1):
        sides = np.flatnonzero(there == vertex)
        assert np.ptp(got[sides], axis=0).max() == 0.0
        assert np.allclose(got[sides[0]], torn[sides].mean(axis=0), atol=1e-6)
    alone = np.bincount(there)[there] == 1
    assert np.abs(got[alone] - torn[alone]).max() <= 1e-6 * np.linalg.norm(np.ptp(points, axis=0))
    assert "opens seams" not in build(folder, POSES, "-o", folder / "out.filo").stderr


def test_euler_angles_are_degrees_about_x_then_y_then_z(folder):
    assert build(folder, [], "-o", folder / "empty.filo").returncode == 0
    got = surface(folder, {"controls": {"chest": {"rotate": [30, 40, 50]}}}, "empty.filo")
    rest = surface(folder, {"controls": {}}, "empty.filo")
    x, y, z = np.radians([30, 40, 50])
    rx = np.array([[1, 0, 0], [0, math.cos(x), -math.sin(x)], [0, math.sin(x), math.cos(x)]])
    ry = np.array([[math.cos(y), 0, math.sin(y)], [0, 1, 0], [-math.sin(y), 0, math.cos(y)]])
    rz = np.array([[math.cos(z), -math.sin(z), 0], [math.sin(z), math.cos(z), 0], [0, 0, 1]])
    root = np.array([-0.16, 0.0, 0.0])  # every other joint follows it
    assert np.allclose(got, (rest - root) @ (rz @ ry @ rx).T + root, atol=2e-6)


def test_a_frame_of_a_clip(folder):
    assert build(folder, [], "-o", folder / "empty.filo").returncode == 0
    found = read_rig(folder / "arm.glb")
    clip = found.rig.clip
    from core.pose.skinning import posed_points

    wanted = posed_points(found.mesh.points, found.rig, clip.start + 2.5)[found.rig.file_vertices]
    got = surface(folder, {"clip": clip.name, "frame": clip.start + 2.5}, "empty.filo")
    assert np.allclose(got, wanted, atol=1e-6)


def test_refusals_name_the_poses(folder):
    twins = [POSES[0], {**POSES[0], "name": "again"}]
    done = build(folder, twins, "-o", folder / "no.filo")
    assert done.returncode == 1
    said = json.loads(done.stdout)
    assert set(said["refusals"][0]["poses"]) == {"bent", "again"}
    assert said["refusals"][0]["reason"] == "duplicate"
    assert "'bent'" in said["error"]
    assert "'bent'" in done.stderr
    assert not (folder / "no.filo").exists()
    still = [{"name": "still", "controls": {"elbow": {"rotate": [0, 0, 0]}}, "sculpt": None}]
    assert set(json.loads(build(folder, still, "-o", folder / "no.filo").stdout)["refusals"][0]["poses"]) == {
        "rest", "still"}


@pytest.mark.parametrize(("pose", "words"), [
    ({"controls": {"knee": {"rotate": [0, 0, 1]}}}, "no control 'knee'"),
    ({"controls": {"elbow": 4}}, "'elbow' is a joint"),
    ({"controls": {"swell at 1": {"rotate": [0, 0, 1]}}}, "'swell at 1' is a number"),
    ({"controls": {"elbow": {"rotate": [0, 0]}}}, "rotate"),
    ({"controls": {"elbow": {"rotate": [0, 0, 9]}}, "sculpt": "gone.obj"}, "gone.obj"),
    ({"controls": {"elbow": {"rotate": [0, 0, 9]}}, "sculpt": "short.obj"}, "1 vertices"),
    ({"controls": {"elbow": {"rotate": [0, 0, 9]}}, "falloff": {"elbow": 0}}, "falloff"),
    ({"controls": {"elbow": {"rotate": [0, 0, 9]}}, "falloff": {"knee": 3}}, "knee"),
    ({"controls": {"elbow": {"rotate": [0, 0, 9]}}, "falloff": {"elbow": [3, 3]}}, "falloff"),
    ({"controls": {}, "name": "rest"}, "'rest'"),
    ({"controls": {"elbow": {"translate": [0, 1e300, 0]}}}, "'elbow' is set beyond"),
    ({"controls": {"elbow": {"rotate": [0, 0, 9]}}, "sculpt": "far.obj"}, "metres"),
    ({"controls": {"elbow": {"rotate": [0, 0, 9]}}, "sculpt": "a\0.obj"}, "no name of a file"),
    ({"controls": {"elbow": {"rotate": [0, 0, 9]}}, "colour": 1}, "colour"),
], ids=str)
def test_what_is_wrong_with_a_pose_is_said_in_one_sentence(folder, pose, words):
    (folder / "short.obj").write_text("v 0 0 0\n")
    write_points(folder / "far.obj", read_points(folder / "bent.obj") * 1e9)
    done = build(folder, [{"name": "odd", "sculpt": None, **pose}], "-o", folder / "no.filo")
    assert done.returncode == 1
    said = json.loads(done.stdout)["error"]
    assert words in said
    assert "fault of filoplume" not in said


def test_dials_of_ones_own_and_what_is_read_of_a_joint(folder):
    """A dial, a switch that is a joint, and an elbow of which the swing alone counts, each with its own falloff."""
    controls = {"strain": {"low": 0, "high": 2}, "reach": {"joint": "wrist", "axis": [0, 1, 0], "travel": 0.1}}
    poses = [
        {"name": "strained", "controls": {"strain": 1.0}, "sculpt": "bent.obj", "falloff": {"strain": 0.5}},
        {**POSES[0], "falloff": {"elbow": [60, 20]}},
    ]
    follows = [{"name": "odd", "controls": {"reach": 1.0}, "sculpt": None}]
    assert "the joint it follows" in build(folder, follows, "-o", folder / "dials.filo", controls=controls).stderr
    done = build(folder, poses, "-o", folder / "dials.filo", controls=controls, reads={"elbow": "swing"})
    assert done.returncode == 0, done.stdout
    info = json.loads(filoplume("info", folder / "dials.filo", "--json").stdout)
    assert {"strain", "reach", "elbow"} <= set(info["controls"])
    assert np.abs(surface(folder, {"controls": {"strain": 1.0}}, "dials.filo") - read_points(folder / "bent.obj")
                  ).max() < 1e-6
    bent = surface(folder, {"controls": {"elbow": {"rotate": [0, 0, 110]}}}, "dials.filo")
    assert np.abs(bent - read_points(folder / "bent.obj")).max() < 1e-6
    layers = read_project(folder / "dials.filo").document.meshes[0].correctives.layers
    assert {d.kind for layer in layers for d in layer.space.dofs if d.control == "elbow"} == {"swing"}


@pytest.mark.parametrize(("more", "words"), [
    ({"controls": {"elbow": {}}}, "'elbow'"), ({"controls": {"a": {"low": 2}}}, "range"),
    ({"controls": {"a": {"joint": "knee"}}}, "joint"), ({"controls": {"a": {"vertices": [10**9]}}}, "vertex"),
    ({"controls": {"a": {"vertices": []}}}, "vertex"), ({"reads": {"knee": "swing"}}, "knee"),
    ({"reads": {"elbow": "shake"}}, "shake"), ({"controls": {"a": {"joint": "elbow", "vertices": [1]}}}, "not both"),
], ids=str)
def test_a_dial_that_cannot_be_is_said_in_one_sentence(folder, more, words):
    done = build(folder, [], "-o", folder / "no.filo", **more)
    assert done.returncode == 1
    assert words in json.loads(done.stdout)["error"]
    assert "fault of filoplume" not in done.stdout


def test_wrong_use_and_other_outputs(folder, tmp_path):
    assert filoplume("pose", folder / "arm.glb").returncode == 2
    assert filoplume("pose", folder / "arm.glb", "--at", folder / "pose.json").returncode == 2
    assert filoplume("pose", folder / "arm.glb", "-o", tmp_path / "a.xyz").returncode == 1
    (folder / "poses.json").write_text(json.dumps({"kernel": "bell", "poses": []}))
    done = filoplume("pose", folder / "arm.glb", "--poses", folder / "poses.json", "-o", tmp_path / "a.filo")
    assert done.returncode == 1
    assert "bell" in done.stderr
    item = posed_arm()
    write_project(tmp_path / "arm.filo", Document(meshes=(item,)))
    names = [tmp_path / f"arm.{s}" for s in ("usda", "usdc", "glb", "py", "mel", "json")]
    outputs = [word for name in names for word in ("-o", name)]
    done = filoplume("pose", tmp_path / "arm.filo", *outputs, "--baked", tmp_path / "points.usdc", "--json")
    assert done.returncode == 0, done.stderr
    assert all(name.stat().st_size for name in [*names, tmp_path / "points.usdc", tmp_path / "arm.npz"])
    again = read_project(tmp_path / "arm.filo").document.meshes[0]
    assert len(again.correctives.layers) == len(item.correctives.layers)
