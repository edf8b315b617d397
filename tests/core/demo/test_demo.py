"""The demo animal against its promises; trimesh and a rasterised atlas are the judges."""

import cv2
import numpy as np
import pytest
import trimesh

from core.demo.creature import demo_creature
from core.demo.shape import opposites, shape
from core.pose.skinning import posed_points


@pytest.fixture(scope="module")
def animal():
    return demo_creature()


def triangles(mesh):
    return mesh.corners.reshape(-1, 4)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def test_one_closed_oriented_body_of_quads(animal):
    mesh = animal.mesh
    assert np.all(mesh.counts == 4)
    assert 6000 <= len(mesh.counts) <= 12000
    body = trimesh.Trimesh(mesh.points, triangles(mesh), process=False)
    assert body.is_watertight
    assert body.is_winding_consistent
    assert body.volume > 0
    assert body.euler_number == 2  # a sphere with limbs, no handle
    assert len(body.split(only_watertight=False)) == 1
    assert body.area_faces.min() > 1e-9


def test_size_and_stance(animal):
    points = animal[0].points
    assert points[:, 1].min() == pytest.approx(0, abs=0.003)  # stands on the ground
    assert 0.3 < np.ptp(points[:, 1]) < 0.5
    assert 0.4 < np.ptp(points[:, 2]) < 0.8
    nose = points[np.unique(animal[0].corners.reshape(-1, 4)[animal[0].parts == 5])]
    assert nose[:, 2].max() == points[:, 2].max()  # it looks along +z


def test_exactly_symmetric(animal):
    mesh = animal.mesh
    pairs = opposites(mesh.points)
    assert np.array_equal(mesh.points[pairs], mesh.points * np.array([-1, 1, 1], np.float32))
    faces = {frozenset(f): p for f, p in zip(mesh.corners.reshape(-1, 4).tolist(), mesh.parts, strict=True)}
    mirrored = {frozenset(f): p for f, p in zip(pairs[mesh.corners].reshape(-1, 4).tolist(), mesh.parts, strict=True)}
    assert faces == mirrored


def test_uvs_lie_in_the_square_and_do_not_overlap(animal):
    mesh = animal.mesh
    uv = mesh.uvs.reshape(-1, 4, 2)
    assert uv.min() >= 0
    assert uv.max() <= 1
    a, b = uv[:, 2] - uv[:, 0], uv[:, 3] - uv[:, 1]
    area = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    assert area.min() > 1e-8
    size = 4096
    covered = np.zeros((size, size), np.uint8)
    for quad in uv:
        cv2.fillConvexPoly(covered, np.round(quad * (size - 1) * 16).astype(np.int32), 1, shift=4)
    # Quads that lay on one another would cover less than the sum of their areas; borders only add to the cover.
    assert covered.sum() / size**2 >= area.sum()
    assert area.sum() > 0.35


def test_parts(animal):
    mesh = animal.mesh
    assert set(mesh.part_names) >= {"body", "head", "ears", "legs", "tail", "nose", "eyes"}
    assert np.all(np.bincount(mesh.parts, minlength=len(mesh.part_names)) > 0)


def test_the_same_every_time(animal):
    mesh, rig, _ = demo_creature()
    assert mesh.points.tobytes() == animal[0].points.tobytes()
    assert rig.skin.weights.tobytes() == animal[1].skin.weights.tobytes()
    assert rig.clip.rotations.tobytes() == animal[1].clip.rotations.tobytes()


def test_first_frame_is_the_rest_pose_and_the_head_turns_both_ways(animal):
    mesh, rig, _ = animal
    assert (rig.clip.start, rig.clip.end, rig.clip.frames_per_second) == (1001, 1048, 24)
    assert np.allclose(posed_points(mesh.points, rig, 1001), mesh.points, atol=1e-7)
    assert np.allclose(posed_points(mesh.points, rig, 1048), mesh.points, atol=1e-4)
    nose = int(np.argmax(mesh.points[:, 2]))
    side = [posed_points(mesh.points, rig, f)[nose, 0] for f in (1019, 1037)]
    assert side[0] > 0.08
    assert side[1] < -0.08
    paws = mesh.points[:, 1] < 0.02
    for f in (1019, 1037):  # feet stay on the ground
        moved = posed_points(mesh.points, rig, f) - mesh.points
        assert np.abs(moved[paws]).max() < 0.015


def test_turning_keeps_the_surface_whole(animal):
    mesh, rig, _ = animal
    for frame in (1017, 1036):
        body = trimesh.Trimesh(posed_points(mesh.points, rig, frame), triangles(mesh), process=False)
        rest = trimesh.Trimesh(mesh.points, triangles(mesh), process=False)
        assert body.volume == pytest.approx(rest.volume, rel=0.05)
        assert np.quantile(body.area_faces / rest.area_faces, [0.001, 0.999]) == pytest.approx([1, 1], abs=0.9)


def test_weights_are_smooth_and_symmetric():
    animal = shape()
    assert np.allclose(animal.weights.sum(axis=1), 1)
    assert np.array_equal(animal.weights, animal.weights[animal.pairs])
    quads = animal.mesh.corners.reshape(-1, 4)
    steps = np.abs(animal.weights[quads] - animal.weights[np.roll(quads, -1, 1)])
    assert steps.max() < 0.25


def test_maps(animal):
    mesh = animal.mesh
    maps = {m.name: m.values for m in animal.maps}
    pairs = opposites(mesh.points)
    quads = mesh.corners.reshape(-1, 4)
    mean = {}
    for name, values in maps.items():
        assert values.dtype == np.float32
        assert values.shape == (len(mesh.points),)
        assert 0 <= values.min() <= values.max() <= 1
        assert np.array_equal(values, values[pairs])
        mean[name] = {part: values[quads[mesh.parts == i]].mean() for i, part in enumerate(mesh.part_names)}
        for bare in ("nose", "eyes", "pads"):
            assert np.all(values[quads[mesh.parts == mesh.part_names.index(bare)]] == 0)
    length = mean["length"]
    assert length["tail"] > length["body"] > length["legs"] > length["ears"]
    assert length["body"] > length["head"]
