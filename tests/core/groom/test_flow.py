"""The direction a coat lies in: properties on shapes whose answer is known."""

import numpy as np
import trimesh

from core.groom.flow import flow_field, nose_vertex, smooth_over_surface
from core.mesh.normals import vertex_normals


def lollipop() -> trimesh.Trimesh:
    """A lying animal in the plainest form: a long body, a big head at +z, a thin tail at -z, four feet."""
    parts = [
        trimesh.creation.capsule(height=2.0, radius=0.3, count=[24, 24]),
        trimesh.creation.icosphere(subdivisions=3, radius=0.45).apply_translation([0, 0.2, 2.6]),
        trimesh.creation.capsule(height=1.0, radius=0.06, count=[12, 12]).apply_translation([0, 0.1, -1.2]),
    ]
    return trimesh.util.concatenate(parts)


def test_the_gradient_runs_from_the_nose_along_a_bar():
    bar = trimesh.creation.box(extents=[0.4, 0.4, 4.0]).subdivide_to_size(0.12)
    bar.merge_vertices()
    p = np.asarray(bar.vertices, np.float32)
    p[:, :2] *= (1.0 + 0.6 * (p[:, 2:] > 1.2)).astype(np.float32)  # a thick end: the head, at +z
    t = np.asarray(bar.faces, np.int32)
    flow = flow_field(p, t, vertex_normals(p, t), gravity=0.0)
    assert p[flow.nose, 2] > 1.5
    middle = np.abs(p[:, 2]) < 0.8
    assert np.median(flow.directions[middle, 2]) < -0.95


def test_directions_are_unit_tangents_everywhere_even_on_a_ball():
    ball = trimesh.creation.icosphere(subdivisions=3)
    p, t = np.asarray(ball.vertices, np.float32), np.asarray(ball.faces, np.int32)
    normals = vertex_normals(p, t)
    flow = flow_field(p, t, normals)
    assert np.isfinite(flow.directions).all()
    np.testing.assert_allclose(np.linalg.norm(flow.directions, axis=1), 1.0, atol=1e-5)
    np.testing.assert_allclose(np.sum(flow.directions * normals, axis=1), 0.0, atol=1e-5)


def test_gravity_alone_points_down_the_flanks():
    ball = trimesh.creation.icosphere(subdivisions=3)
    p, t = np.asarray(ball.vertices, np.float32), np.asarray(ball.faces, np.int32)
    flow = flow_field(p, t, vertex_normals(p, t), gravity=5.0)
    sides = np.abs(p[:, 1]) < 0.3
    assert flow.directions[sides, 1].mean() < -0.8


def test_islands_and_loose_vertices_are_survived():
    two = lollipop()
    p = np.concatenate([np.asarray(two.vertices, np.float32), [[9, 9, 9]]]).astype(np.float32)
    t = np.asarray(two.faces, np.int32)
    flow = flow_field(p, t, vertex_normals(p, t))
    assert np.isfinite(flow.directions).all()
    assert np.isinf(flow.distance[-1])


def test_too_little_surface_has_no_nose():
    p = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    assert nose_vertex(p, np.array([[0, 1, 2]], np.int32)) == -1


def test_smoothing_keeps_constants_and_calms_noise():
    ball = trimesh.creation.icosphere(subdivisions=3)
    t = np.asarray(ball.faces, np.int32)
    constant = np.full(len(ball.vertices), 3.5)
    np.testing.assert_allclose(smooth_over_surface(constant, t, 10), 3.5)
    noise = np.random.default_rng(1).normal(size=len(ball.vertices))
    assert smooth_over_surface(noise, t, 10).std() < 0.3 * noise.std()
