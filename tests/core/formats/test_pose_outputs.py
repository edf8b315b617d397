"""Posed rigs in the files of other programs, read back by readers that did not write them."""

import json
import math
import re
import zipfile

import numpy as np
import pytest

from core.document import Document
from core.errors import UserError
from core.formats.corrective_shapes import corrective_shapes, shape_weights_at
from core.formats.pose_drivers import mel_assignments, program, python_function
from core.formats.pose_export import write, write_points
from core.formats.project import read_project, write_project
from core.formats.rig_file import document_of, read_rig
from core.leaves import same_bits
from core.pose.corrective import as_kind
from core.pose.kernels import VERSION
from core.pose.pose import Pose, local_of_pose
from core.pose.rig import Constraint, Control
from core.pose.rotation import euler_from_quaternion
from core.pose.skinning import deformed, posed_points
from core.pose.synthesis import evaluate, evaluate_at, pose_at, prepare
from core.record import freeze
from tests.core.formats.posed_samples import BENT, BOTH, ELSEWHERE, FLEXED, HALF, TWISTED, posed_arm, turned

EARLY = (BENT, HALF, TWISTED, FLEXED, BOTH)  # none of which is corrected after skinning


@pytest.fixture(scope="module")
def item():
    made = posed_arm(EARLY)
    assert not any(layer.after.any() for layer in made.correctives.layers)
    return made


def size(item):
    return float(np.linalg.norm(np.ptp(item.mesh.points, axis=0)))


def test_shapes_and_their_weights_are_the_corrections(item):
    found = corrective_shapes(item)
    assert len({s.name for s in found.shapes}) == len(found.shapes)
    assert not found.notes
    for pose in ELSEWHERE:
        rest = item.replace(correctives=None)
        points = item.mesh.points.astype(np.float64)
        for shape, weight in zip(found.shapes, shape_weights_at(found, item, pose), strict=True):
            points[shape.vertices] += weight * shape.offsets
        ours = evaluate(item.mesh.points, item.rig, item.correctives, pose)
        theirs = evaluate(points.astype(np.float32), rest.rig, None, pose)
        assert np.abs(ours - theirs).max() <= 1e-6 * size(item)


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".glb"])
def test_the_baked_clip_read_back_moves_as_ours(item, suffix, tmp_path):
    path = tmp_path / f"arm{suffix}"
    assert write(path, item, 24.0) == ()
    found = read_rig(path)
    clip = found.rig.clip
    assert len(clip.translations) == len(item.rig.clip.translations)
    ready = prepare(item.correctives, item.rig)
    file = np.arange(len(item.mesh.points)) if found.rig.file_vertices is None else None
    for sample in range(len(clip.translations)):
        ours = evaluate_at(item.mesh.points, item.rig, ready, item.rig.clip.start + sample)
        layers = prepare(found.correctives, found.rig)  # of .glb there are none: its shapes are the corrections
        theirs = evaluate_at(found.mesh.points, found.rig, layers, clip.start + sample)
        if file is None:  # split at seams and welded again: the same places in another order
            theirs = theirs[by_place(found.mesh.points, item.mesh.points)]
        assert np.abs(ours - theirs).max() <= 2e-6 * size(item), sample


def by_place(points, wanted):
    from scipy.spatial import cKDTree

    distance, row = cKDTree(points).query(wanted)
    assert distance.max() < 1e-7
    return row


@pytest.mark.parametrize("suffix", [".usdc", ".usda"])
def test_a_rig_goes_out_and_comes_back_with_its_poses_and_layers(suffix, tmp_path):
    """As it was built, by way of a project and USD: every array, every field, and the surface at any pose."""
    made = posed_arm()  # some of which is corrected after skinning
    constraint = Constraint(joint="wrist", kind="limit")
    swing = Control(name="swing", kind="joint", joint="wrist", axis=(1.0, 0.0, 0.0), travel=0.1)
    piece = Control(name="pad", kind="geometry", vertices=freeze(np.array([3, 9], np.int32)))
    rig = made.rig.replace(controls=(*made.rig.controls, swing, piece), constraints=(constraint,))
    off = made.correctives.layers[-1].replace(enabled=False)
    made = made.replace(rig=rig, correctives=made.correctives.replace(layers=(*made.correctives.layers[:-1], off)))
    write_project(tmp_path / "arm.filo", Document(meshes=(made,)))
    item = read_project(tmp_path / "arm.filo").document.meshes[0]
    write(tmp_path / f"arm{suffix}", item, 24.0)
    found = read_rig(tmp_path / f"arm{suffix}")
    assert found.notes == ()
    assert np.array_equal(found.mesh.points, made.mesh.points)
    assert np.array_equal(found.mesh.corners, made.mesh.corners)
    assert found.rig.skeleton.names == rig.skeleton.names
    assert np.allclose(found.rig.skeleton.bind, rig.skeleton.bind, atol=1e-12)
    assert np.allclose(found.rig.skeleton.rest, rig.skeleton.rest, atol=1e-12)
    for what in ("controls", "constraints", "shapes"):
        assert same_bits(getattr(found.rig, what), getattr(rig, what)), what
    assert same_bits(found.correctives, made.correctives)
    for pose in ELSEWHERE:
        ours = evaluate(made.mesh.points, rig, made.correctives, pose)
        assert np.abs(evaluate(found.mesh.points, found.rig, found.correctives, pose) - ours).max() <= 2e-7 * size(made)
    ready, again = prepare(made.correctives, rig), prepare(found.correctives, found.rig)
    for frame in np.arange(rig.clip.start, rig.clip.end, 0.5):
        ours = evaluate_at(made.mesh.points, rig, ready, frame)
        theirs = evaluate_at(found.mesh.points, found.rig, again, frame)
        assert np.abs(theirs - ours).max() <= 1e-6 * size(made)
    assert document_of(found).meshes[0].correctives is found.correctives
    kernels = [(layer.space.kernel, layer.space.kernel_version) for layer in found.correctives.layers]
    assert kernels == [("gaussian", VERSION)] * len(found.correctives.layers)


def test_corrections_of_a_mesh_that_was_edited_elsewhere_are_shapes(item, tmp_path):
    from pxr import Usd, UsdGeom

    write(tmp_path / "arm.usdc", item, 24.0)
    stage = Usd.Stage.Open(str(tmp_path / "arm.usdc"))
    points = next(UsdGeom.Mesh(p) for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)).GetPointsAttr()
    points.Set([p * 1.01 for p in points.Get()])
    stage.Export(str(tmp_path / "edited.usdc"))
    found = read_rig(tmp_path / "edited.usdc")
    assert found.correctives is None
    assert "not the one" in found.notes[0]
    assert len(found.rig.shapes.names) == 1 + len(corrective_shapes(item).shapes)
    for attribute, value in (
        ("filoplume:said", "{"), ("filoplume:layer0:deltas", [1.0]), ("filoplume:layer0:vertices", [1 << 30]),
    ):
        stage = Usd.Stage.Open(str(tmp_path / "arm.usdc"))
        stage.GetPrimAtPath("/Model/Corrections").GetAttribute(attribute).Set(value)
        stage.GetRootLayer().Export(str(tmp_path / "bad.usdc"))
        found = read_rig(tmp_path / "bad.usdc")
        assert found.correctives is None, attribute
        assert found.notes


def test_usd_bakes_the_same_points_itself(item, tmp_path):
    from pxr import Usd, UsdGeom, UsdSkel

    write(tmp_path / "arm.usda", item, 24.0)
    stage = Usd.Stage.Open(str(tmp_path / "arm.usda"))
    assert UsdSkel.BakeSkinning(stage.Traverse())
    mesh = UsdGeom.Mesh(next(p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)))
    ready = prepare(item.correctives, item.rig)
    for sample in range(len(item.rig.clip.translations)):
        frame = item.rig.clip.start + sample
        theirs = np.array(mesh.GetPointsAttr().Get(frame))
        assert np.abs(theirs - evaluate_at(item.mesh.points, item.rig, ready, frame)).max() <= 1e-5 * size(item)


def test_every_file_says_which_version_of_the_kernels_it_was_made_with(item, tmp_path):
    """So that a release with other formulas can go on using these."""
    from pxr import Usd

    write(tmp_path / "arm.usdc", item, 24.0)
    write(tmp_path / "arm.json", item, 24.0)
    write_project(tmp_path / "arm.filo", Document(meshes=(item,)))
    stage = Usd.Stage.Open(str(tmp_path / "arm.usdc"))
    drivers = json.loads(stage.GetDefaultPrim().GetCustomDataByKey("filoplume:drivers"))
    assert {layer["space"]["kernel_version"] for layer in drivers["layers"]} == {VERSION}
    assert {layer["kernel_version"] for layer in json.loads((tmp_path / "arm.json").read_text())["layers"]} == {VERSION}
    with zipfile.ZipFile(tmp_path / "arm.filo") as archive:
        trees = [archive.read(name).decode() for name in archive.namelist() if name.endswith(".json")]
    assert sum(tree.count(f'"kernel_version":{VERSION}') for tree in trees) == len(item.correctives.layers)


def test_usd_says_what_drives_the_shapes(item, tmp_path):
    import msgspec
    from pxr import Usd

    from core.pose.pose_space import PoseSpace
    from core.pose.solve import solve, weights

    write(tmp_path / "arm.usdc", item, 24.0)
    stage = Usd.Stage.Open(str(tmp_path / "arm.usdc"))
    said = msgspec.json.decode(stage.GetDefaultPrim().GetCustomDataByKey("filoplume:drivers"))
    spaces = [msgspec.convert(layer["space"], PoseSpace) for layer in said["layers"]]
    found = corrective_shapes(item)
    for pose in ELSEWHERE:
        ours = shape_weights_at(found, item, pose)
        for shape, weight in zip(said["shapes"], ours, strict=True):
            space = spaces[shape["layer"]]
            known = np.isin(np.arange(len(space.samples)), shape["known"])
            theirs = weights(solve(space, known), pose)[shape["known"].index(shape["sample"])]
            assert abs(theirs - weight) < 1e-6


def test_baked_points(item, tmp_path):
    from pxr import Usd, UsdGeom

    write_points(tmp_path / "cache.usdc", item)
    stage = Usd.Stage.Open(str(tmp_path / "cache.usdc"))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1001.0, 1010.0)
    assert stage.GetTimeCodesPerSecond() == 24.0
    mesh = UsdGeom.Mesh(next(p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)))
    ready = prepare(item.correctives, item.rig)
    for frame in range(1001, 1011):
        assert np.array_equal(np.array(mesh.GetPointsAttr().Get(frame)),
                              evaluate_at(item.mesh.points, item.rig, ready, frame))
    with pytest.raises(UserError, match="no clip"):
        write_points(tmp_path / "still.usdc", item.replace(rig=item.rig.replace(clip=None)))
    assert not (tmp_path / "still.usdc").exists()


def test_what_is_corrected_after_skinning_is_told_and_baked(tmp_path):
    whole = posed_arm()
    for suffix in (".usdc", ".glb", ".py", ".mel"):
        notes = write(tmp_path / f"arm{suffix}", whole, 24.0)
        assert "corrected after skinning" in notes[0]


def inputs_of(made, pose):
    values = {}
    for name, control, part in made.inputs:
        if part == "number":
            values[name] = pose.numbers.get(control, 0.0)
        elif part.startswith("t"):
            values[name] = pose.translations.get(control, (0.0, 0.0, 0.0))["xyz".index(part[1])]
        else:
            values[name] = pose.rotations.get(control, (0.0, 0.0, 0.0, 1.0))["xyzw".index(part)]
    return values


@pytest.mark.parametrize("options", [
    *({"kernel": k} for k in ("gaussian", "thin-plate", "multiquadric", "inverse-multiquadric", "wendland", "cubic",
                              "linear", "shepard")),
    {"affine": True}, {"clamp": True}, {"normalise": "above-one"}, {"normalise": "always"},
], ids=str)
def test_scripts_for_other_programs_compute_our_weights(options):
    item = posed_arm((BENT, HALF, FLEXED, BOTH), **options)
    found = corrective_shapes(item)
    made = program(found)
    names = {"exp": math.exp, "log": math.log, "sqrt": math.sqrt}
    exec(python_function(made), names)
    # MEL's assignments are Python's but for the dollars, the types and the semicolons
    mel = re.sub(r"^float ", "", mel_assignments(made), flags=re.MULTILINE).replace("$", "").replace(";", "")
    for pose in ELSEWHERE:
        ours, values = shape_weights_at(found, item, pose), inputs_of(made, pose)
        assert np.allclose(names["weights"](**values), ours, atol=2e-6)
        scope = {**names, **values}
        exec(mel, scope)
        assert np.allclose([scope[name] for name in made.outputs], ours, atol=2e-6)


def maya(text, rest, euler, moved, numbers):
    """What Maya does with a script and a pose: deltas (V, 3) metres of its blendShape, by a small reading of MEL.

    rest : by joint, metres. euler : XYZ degrees, and moved : metres from rest, by joint; numbers by dial.
    """
    assert text.count('"') % 2 == 0
    head, body = re.search(r'^(.*)expression -name "filoplumeDrivers" -string (".*");$', text, re.DOTALL).groups()
    dials = dict(re.findall(r"addAttr -longName (\w+) -attributeType double -defaultValue (\S+) ", head))
    scene = {f"filoplume.{name}": float(rest_value) for name, rest_value in dials.items()}
    assert set(numbers) <= set(dials)
    scene |= {f"filoplume.{name}": value for name, value in numbers.items()}
    for joint, place in rest.items():
        for k, axis in enumerate("XYZ"):
            scene[f"{joint}.rotate{axis}"] = euler.get(joint, (0.0, 0.0, 0.0))[k]
            scene[f"{joint}.translate{axis}"] = 100.0 * (place[k] + moved.get(joint, (0.0, 0.0, 0.0))[k])
    shares = {}
    scope = {"exp": math.exp, "log": math.log, "sqrt": math.sqrt, "pow": math.pow, "sin": math.sin, "cos": math.cos,
             "min": min, "max": max, "deg_to_rad": math.radians, "scene": scene, "shares": shares}
    for line in json.loads(body).splitlines():
        for statement in filter(None, line.split(";")):
            if re.fullmatch(r" ?float \$\w+", statement):
                continue  # declared
            word = re.sub(r"filoplumeShapes\.weight\[(\d+)\]", r"shares[\1]", statement.removeprefix("float "))
            word = re.sub(r"(?<![\w$.])([A-Za-z_]\w*\.[A-Za-z_]\w*)", r'scene["\1"]', word)
            exec(re.sub(r"\$(\w+)", r"v_\1", word), scope)
    found = np.zeros((10_000, 3))
    points = re.findall(r'TargetGroup\[(\d+)\].*inputPointsTarget"\) -type "pointArray" (\d+) (.*);', head)
    places = re.findall(r'TargetGroup\[(\d+)\].*inputComponentsTarget"\) -type "componentList" (\d+) (.*);', head)
    assert [p[:2] for p in points] == [p[:2] for p in places]
    assert [int(p[0]) for p in points] == sorted(shares)
    for (row, count, moves), (_, _, names) in zip(points, places, strict=True):
        vertices = [int(v) for v in re.findall(r'"vtx\[(\d+)\]"', names)]
        offsets = np.array([float(x) for x in moves.split()]).reshape(-1, 4)
        assert len(vertices) == len(offsets) == int(count)
        assert (offsets[:, 3] == 1.0).all()
        found[vertices] += 0.01 * shares[int(row)] * offsets[:, :3]
    return found


@pytest.mark.parametrize("kernel", ["gaussian", "thin-plate", "shepard"])
def test_the_script_for_maya_gives_our_corrections_at_every_pose(kernel, tmp_path):
    made = posed_arm((*EARLY[:-1], BOTH.replace(translations={"wrist": (0.0, 0.02, 0.01)})), kernel=kernel)
    write(tmp_path / "arm.mel", made, 24.0)
    text, skeleton = (tmp_path / "arm.mel").read_text(), made.rig.skeleton
    rest = dict(zip(skeleton.names, skeleton.rest[:, :3, 3], strict=True))
    found, rng = corrective_shapes(made), np.random.default_rng(3)
    poses = [*(s.pose for layer in made.correctives.layers for s in layer.space.samples), Pose()]
    poses += [Pose(rotations={j: turned(*rng.uniform(-170, 170, 3)) for j in ("elbow", "wrist")},
                   translations={"wrist": (0.01, 0.0, -0.03)}, numbers={"strain": float(rng.uniform(-1, 1))})
              for _ in range(6)]
    for pose in poses:
        euler = {j: np.degrees(euler_from_quaternion(q)) for j, q in pose.rotations.items()}
        theirs = maya(text, rest, euler, pose.translations, {n: v for n, v in pose.numbers.items() if n == "strain"})
        ours = np.zeros((len(made.mesh.points), 3))
        for shape, weight in zip(found.shapes, shape_weights_at(found, made, pose), strict=True):
            ours[shape.vertices] += weight * shape.offsets
        assert np.abs(theirs[: len(ours)] - ours).max() <= 1e-7, pose


def test_programs_are_told_of_dual_quaternions(item, tmp_path):
    dual = item.replace(rig=item.rig.replace(skinning="dual-quaternion"))
    assert "dual quaternions" in write(tmp_path / "arm.mel", dual, 24.0)[0]
    assert "dual quaternions" in write(tmp_path / "arm.glb", dual, 24.0)[0]
    write(tmp_path / "arm.py", dual, 24.0)
    assert "preserve_volume = True" in (tmp_path / "arm.py").read_text()
    write(tmp_path / "arm.usdc", dual, 24.0)
    assert read_rig(tmp_path / "arm.usdc").rig.skinning == "dual-quaternion"


def test_scripts_are_whole(item, tmp_path):
    write(tmp_path / "arm.py", item, 24.0)
    write(tmp_path / "arm.mel", item, 24.0)
    compile((tmp_path / "arm.py").read_text(), "arm.py", "exec")
    mel = (tmp_path / "arm.mel").read_text()
    assert mel.count("inputPointsTarget") == len(corrective_shapes(item).shapes)
    assert "{" not in re.sub(r'"(\\.|[^"\\])*"', "", mel)
    with pytest.raises(UserError, match="plain corrective"):
        write(tmp_path / "plain.py", item.replace(correctives=as_kind(item.correctives, "linear")), 24.0)


def test_a_rig_without_corrections_goes_out_too(tmp_path):
    bare = posed_arm(()).replace(correctives=None)
    for suffix in (".usdc", ".glb", ".json", ".py", ".mel"):
        write(tmp_path / f"bare{suffix}", bare, 24.0)
    found = read_rig(tmp_path / "bare.glb")
    pose = pose_at(bare.rig, 1004.0)
    ours = deformed(bare.mesh.points, bare.rig, local_of_pose(bare.rig.skeleton, pose), pose.numbers)
    theirs = posed_points(found.mesh.points, found.rig, found.rig.clip.start + 3.0)
    assert np.abs(theirs[by_place(found.mesh.points, bare.mesh.points)] - ours).max() <= 2e-6 * size(bare)
    with pytest.raises(UserError, match="written as"):
        write(tmp_path / "bare.fbx", bare, 24.0)
