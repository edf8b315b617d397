"""Cameras of files: what they see is compared with what the formats' own libraries and specifications say."""

import base64
import json

import numpy as np
import pytest

from core.camera import clip_from_world, project
from core.errors import UserError
from core.formats.camera_file import read_cameras
from core.gate import AROUND
from core.navigate import whole_in

POINTS = np.array([[0.1, 0.2, -3.0], [-0.6, 0.9, -5.0], [0.4, -0.3, -2.0], [0.0, 0.0, -10.0]])
WIDE, TALL = 1920, 1080


def places(camera, points):
    """Clip space over w, x and y: what a picture shows where."""
    clip = np.c_[points, np.ones(len(points))] @ clip_from_world(camera, WIDE, TALL).T
    return clip[:, :2] / clip[:, 3:]


def stage_of(path, up="Y", metres=1.0):
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y if up == "Y" else UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, metres)
    return stage


@pytest.mark.parametrize(("up", "metres"), [("Y", 1.0), ("Z", 0.01)])
@pytest.mark.parametrize("parallel", [False, True])
def test_a_camera_of_usd_sees_what_usd_says(tmp_path, up, metres, parallel):
    from pxr import Gf, UsdGeom

    stage = stage_of(tmp_path / "shot.usda", up, metres)
    rig = UsdGeom.Xform.Define(stage, "/rig")
    rig.AddTranslateOp().Set(Gf.Vec3d(3, 4, 5))
    rig.AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
    made = UsdGeom.Camera.Define(stage, "/rig/camera")
    turn = made.AddRotateXYZOp()
    turn.Set(Gf.Vec3f(10, 20, 30), 1001)
    turn.Set(Gf.Vec3f(-25, 70, 5), 1011)
    made.CreateFocalLengthAttr(35.0)
    made.CreateHorizontalApertureAttr(32.0)
    made.CreateVerticalApertureAttr(18.0)
    if parallel:
        made.CreateProjectionAttr(UsdGeom.Tokens.orthographic)
    stage.Save()
    for frame in (1001.0, 1006.0, 1011.0):
        (found,) = read_cameras(tmp_path / "shot.usda", frame)
        frustum = made.GetCamera(frame).frustum
        truth = np.array(frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix())
        own = np.c_[POINTS / metres, np.ones(4)] @ np.linalg.inv(np.array(frustum.ComputeViewMatrix()))
        expected = own @ truth
        world = own[:, :3] * metres
        if up == "Z":
            world = np.stack([world[:, 0], world[:, 2], -world[:, 1]], axis=1)
        assert found.name == "/rig/camera"
        assert found.aspect == pytest.approx(32 / 18)
        assert found.camera.orthographic == parallel
        # y by the file's own; x, too, as this picture has the camera's shape
        assert np.allclose(places(found.camera, world), expected[:, :2] / expected[:, 3:], atol=1e-5)


def test_cameras_of_usd_are_all_found_and_one_without_a_lens_is_left_out(tmp_path):
    from pxr import UsdGeom

    stage = stage_of(tmp_path / "two.usdc")
    UsdGeom.Camera.Define(stage, "/a")
    UsdGeom.Camera.Define(stage, "/broken").CreateVerticalApertureAttr(0.0)
    UsdGeom.Camera.Define(stage, "/b").CreateHorizontalApertureOffsetAttr(2.0)
    stage.Save()
    found = read_cameras(tmp_path / "two.usdc")
    assert [(c.name, c.off_centre) for c in found] == [("/a", False), ("/b", True)]


def test_a_camera_of_alembic_at_its_frames(tmp_path):
    import imath
    from alembic3d import Abc, AbcCoreAbstract, AbcGeom

    path = tmp_path / "shot.abc"
    archive = Abc.CreateArchiveWithInfo(str(path), "test", "")
    times = archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1 / 24.0, 1001 / 24.0))
    outer = AbcGeom.OXform(archive.getTop(), "rig")
    place = AbcGeom.XformSample()
    place.setMatrix(imath.M44d().setTranslation(imath.V3d(0, 2, 0)))
    outer.getSchema().set(place)
    node = AbcGeom.OXform(outer, "camera", times)
    schema = AbcGeom.OCamera(node, "cameraShape", times).getSchema()
    angles = []
    for step in range(3):
        sample = AbcGeom.XformSample()
        sample.setMatrix(imath.M44d().rotate(imath.V3d(0, np.radians(90.0 * step), 0)) * imath.M44d().setTranslation(
            imath.V3d(step, 0, 5)))
        node.getSchema().set(sample)
        lens = AbcGeom.CameraSample()
        lens.setFocalLength(35.0 + 15.0 * step)
        lens.setHorizontalAperture(3.6)
        lens.setVerticalAperture(2.4)
        schema.set(lens)
        angles.append(np.radians(lens.getFieldOfView()))
    del schema, node, outer, archive
    for step in range(3):
        (found,) = read_cameras(path, 1001 + step, fps=24.0)
        camera = found.camera
        assert np.allclose(camera.position, (step, 2, 5))
        assert np.allclose(camera.forward, ((0, 0, -1), (-1, 0, 0), (0, 0, 1))[step], atol=1e-12)
        across = 2.0 * np.arctan(found.aspect * np.tan(0.5 * camera.field_of_view))  # Alembic's angle is horizontal
        assert across == pytest.approx(angles[step], rel=1e-6)
        assert found.aspect == pytest.approx(1.5)


def gltf(tmp_path, cameras, nodes, name="scene.gltf"):
    said = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes, "cameras": cameras}
    (tmp_path / name).write_text(json.dumps(said))
    return tmp_path / name


def test_cameras_of_gltf_stand_where_their_nodes_put_them(tmp_path):
    half = np.sqrt(0.5)
    path = gltf(
        tmp_path,
        [{"type": "perspective", "perspective": {"yfov": 0.7, "aspectRatio": 2.0, "znear": 0.1}},
         {"type": "orthographic", "orthographic": {"xmag": 3.0, "ymag": 2.0, "znear": 0.1, "zfar": 50.0}}],
        [{"name": "turned", "rotation": [0, half, 0, half], "translation": [1, 2, 3], "children": [1, 2]},
         {"name": "lens", "camera": 0, "translation": [0, 0, 4], "scale": [2, 2, 2]},
         {"name": "flat", "camera": 1}],
    )
    lens, flat = read_cameras(path)
    # a quarter turn about Y takes z to x: the camera looks along -x from 4 m before the node
    assert np.allclose(lens.camera.position, (5, 2, 3))
    assert np.allclose(lens.camera.forward, (-1, 0, 0))
    assert (lens.name, lens.aspect, lens.camera.field_of_view) == ("lens", pytest.approx(2.0), pytest.approx(0.7))
    assert flat.camera.orthographic
    assert (flat.camera.height, flat.aspect) == (pytest.approx(4.0), pytest.approx(1.5))


def test_a_camera_of_gltf_is_where_its_animation_has_it_at_the_frame(tmp_path):
    """The camera moves from x = 0 to 8 in two seconds while the node above turns by a right angle about Y."""
    half = np.sqrt(0.5)
    columns = [np.array([0.0, 2.0]), np.array([[0.0, 0, 4], [8, 0, 4]]), np.array([[0.0, 0, 0, 1], [0, half, 0, half]])]
    data = [column.astype("<f4").tobytes() for column in columns]
    starts = np.cumsum([0, *map(len, data)]).tolist()
    path = gltf(
        tmp_path, [{"type": "perspective", "perspective": {"yfov": 0.7, "aspectRatio": 2.0, "znear": 0.1}}],
        [{"name": "above", "children": [1]}, {"name": "lens", "camera": 0, "translation": [9, 9, 9]}])
    said = json.loads(path.read_text())
    joined = b"".join(data)
    said |= {
        "buffers": [{"byteLength": len(joined),
                     "uri": "data:application/octet-stream;base64," + base64.b64encode(joined).decode()}],
        "bufferViews": [{"buffer": 0, "byteOffset": start, "byteLength": len(part)}
                        for start, part in zip(starts, data, strict=False)],
        "accessors": [{"bufferView": i, "componentType": 5126, "count": 2, "type": kind}
                      for i, kind in enumerate(("SCALAR", "VEC3", "VEC4"))],
        "animations": [{
            "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}},
                         {"sampler": 1, "target": {"node": 0, "path": "rotation"}}],
            "samplers": [{"input": 0, "output": 1}, {"input": 0, "output": 2}]}],
    }
    path.write_text(json.dumps(said))
    for frame in (-5, 0, 12, 33, 48, 100):
        part = min(max(frame / 24.0 / 2.0, 0.0), 1.0)
        angle = 0.5 * np.pi * part  # of the node above; it takes (x, 0, z) to (x cos + z sin, 0, z cos - x sin)
        cos, sin = np.cos(angle), np.sin(angle)
        [found] = read_cameras(path, frame, 24.0)
        assert np.allclose(found.camera.position, (8 * part * cos + 4 * sin, 0, 4 * cos - 8 * part * sin), atol=1e-5)
        assert np.allclose(found.camera.forward, (-sin, 0, -cos), atol=1e-5)


def test_what_is_no_camera_is_one_sentence(tmp_path):
    with pytest.raises(UserError, match="holds no camera"):
        read_cameras(gltf(tmp_path, [], [{"name": "empty"}]))
    with pytest.raises(UserError, match="contain themselves"):
        read_cameras(gltf(tmp_path, [], [{"children": [0]}]))
    with pytest.raises(UserError, match="not there"):
        read_cameras(tmp_path / "none.usda")
    with pytest.raises(UserError, match=r"use \.usd"):
        read_cameras(tmp_path / "x.fbx")
    for suffix in ("usda", "abc"):
        (tmp_path / f"noise.{suffix}").write_bytes(bytes(range(256)))
        with pytest.raises(UserError, match="noise"):
            read_cameras(tmp_path / f"noise.{suffix}")


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("window", [(400, 900), (1600, 700), (1000, 1000)])
def test_a_window_of_another_shape_shows_the_whole_frame(tmp_path, parallel, window):
    path = gltf(
        tmp_path,
        [{"type": "orthographic", "orthographic": {"xmag": 3.2, "ymag": 1.8, "znear": 0.1, "zfar": 50.0}} if parallel
         else {"type": "perspective", "perspective": {"yfov": 0.7, "aspectRatio": 16 / 9, "znear": 0.1}}],
        [{"camera": 0}],
    )
    (found,) = read_cameras(path)
    high = 1.8 if parallel else 5.0 * np.tan(0.35)
    corners = np.array([[x * high * 16 / 9, y * high, -5.0] for x in (-1, 1) for y in (-1, 1)])
    width, height = window
    seen = project(whole_in(found.camera, found.aspect, width / height), corners, width, height).xy
    low, most = seen.min(axis=0), seen.max(axis=0)
    assert np.all(low >= -0.5 - 1e-6)
    assert np.all(most <= (width - 0.5 + 1e-6, height - 0.5 + 1e-6))
    share = (most - low) / (width, height)
    assert share.max() == pytest.approx(1 / AROUND, abs=1e-6)  # the gate fills it on one axis, with a little around
