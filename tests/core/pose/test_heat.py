"""Fields on a posed mesh: each is what its name says, measured by hand."""

import math

import numpy as np
import pytest

from core.demo.arm import arm
from core.demo.arm_sculpts import arm_sculpts
from core.mesh.edges import edge_vertices
from core.mesh.normals import mesh_normals
from core.pose import heat
from core.pose.compare import compared
from core.pose.layers import build
from core.pose.pose import local_of_pose
from core.pose.skinning import skin_matrices_of
from core.pose.synthesis import evaluate, prepare
from core.record import freeze


@pytest.fixture(scope="module")
def rigged():
    model = arm()
    sculpts = arm_sculpts(model, 1.0)
    made = build(model.mesh.points, model.rig, sculpts).correctives
    return model.mesh, model.rig, made, sculpts[0].pose


def test_shape_is_the_height_above_the_skin(rigged):
    mesh, rig, _, pose = rigged
    plain = evaluate(mesh.points, rig, None, pose)
    lifted = plain + np.float32(0.003) * mesh_normals(mesh, plain)
    lifted[:100] = plain[:100] - np.float32(0.001) * mesh_normals(mesh, plain)[:100]
    found = heat.shape_heat(mesh, plain, lifted)
    assert found.values[100:] == pytest.approx(0.003, abs=1e-6)
    assert found.values[:100] == pytest.approx(-0.001, abs=1e-6)
    assert found.signed
    assert found.ticks == ("−5 mm", "0", "5 mm")
    assert heat.shares_of(found.values, found.low, found.high)[100:] == pytest.approx(0.8, abs=1e-3)


def test_delta_is_the_length_of_what_is_added_before_the_skin(rigged):
    mesh, rig, made, pose = rigged
    layer = next(lay for lay in made.layers if lay.space.samples[0].name == pose.name)
    found = heat.delta_heat(mesh, rig, prepare(made, rig), pose).values
    known = np.zeros(len(mesh.points))
    known[layer.vertices] = np.linalg.norm(layer.deltas[0], axis=1)
    assert found == pytest.approx(known, abs=1e-6)


def test_strain_of_a_mesh_twice_as_large_is_one(rigged):
    mesh = rigged[0]
    edges = edge_vertices(mesh)
    assert heat.strain_heat(mesh, edges, mesh.points).values == pytest.approx(0.0, abs=1e-6)
    assert heat.strain_heat(mesh, edges, mesh.points * np.float32(2.0)).values == pytest.approx(1.0, abs=1e-4)


def test_condition_is_that_of_the_blended_matrices(rigged):
    mesh, rig, _, pose = rigged
    matrices = skin_matrices_of(rig.skeleton, local_of_pose(rig.skeleton, pose))
    found = heat.condition_heat(rig, len(mesh.points), pose)
    for vertex in range(0, len(mesh.points), 997):
        blend = np.einsum("k,kij->ij", rig.skin.weights[vertex], matrices[rig.skin.joints[vertex]])[:3, :3]
        assert 10.0 ** float(found.values[vertex]) == pytest.approx(np.linalg.cond(blend), rel=1e-4)
    assert found.high == pytest.approx(2.0 * math.log10(30.0))


def test_errors_are_none_where_sculpts_are_met_and_what_the_skin_misses_without_them(rigged):
    mesh, rig, made, _ = rigged
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    assert heat.error_heat(mesh, rig, made, made).values.max() <= 1e-6 * size
    alone = heat.error_heat(mesh, rig, made, compared(mesh.points, rig, made, "skin")).values
    most = np.zeros(len(mesh.points))
    for layer in made.layers:
        for k, sample in enumerate(layer.space.samples):
            gap = evaluate(mesh.points, rig, None, sample.pose)[layer.vertices] - layer.targets[k]
            most[layer.vertices] = np.maximum(most[layer.vertices], np.linalg.norm(gap, axis=1))
    assert alone == pytest.approx(most, abs=1e-6)


def test_weights_sum_to_one_over_the_joints_and_a_mask_is_itself(rigged):
    mesh, rig, _, _ = rigged
    total = sum(heat.weight_heat(rig, joint).values for joint in rig.skeleton.names)
    assert total == pytest.approx(1.0, abs=1e-5)
    mask = freeze(np.linspace(0, 1, len(mesh.points), dtype=np.float32))
    assert np.array_equal(heat.shares_of(heat.mask_heat(mask).values, 0.0, 1.0), mask)


@pytest.mark.parametrize(("metres", "words"), [(0.0, "0"), (0.019, "2 cm"), (0.0013, "2 mm"), (1.5, "2 m")])
def test_ranges_are_round_and_have_a_unit(rigged, metres, words):
    mesh = rigged[0]
    plain = mesh.points
    moved = plain + np.float32(metres) * mesh_normals(mesh, plain)
    found = heat.shape_heat(mesh, plain, moved)
    assert found.ticks[2] == (words if metres else found.ticks[2])
    assert found.high > 0.0
