"""Truths: scipy's Rotation, orthonormality, and the defining property of each function."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from core import transform

rng = np.random.default_rng(5)


def units(count):
    return transform.normalized(rng.normal(size=(count, 3)))


def test_quaternions_agree_with_scipy():
    a, b = Rotation.random(200, random_state=1), Rotation.random(200, random_state=2)
    assert np.allclose(transform.matrix_from_quaternion(a.as_quat()), a.as_matrix(), atol=1e-14)
    product = transform.matrix_from_quaternion(transform.quaternion_product(a.as_quat(), b.as_quat()))
    assert np.allclose(product, (a * b).as_matrix(), atol=1e-14)
    back = transform.quaternion_from_matrix(a.as_matrix())
    assert np.allclose(back, a.as_quat(canonical=True), atol=1e-12)
    axis, angle = units(50), rng.uniform(-7, 7, 50)
    assert np.allclose(
        transform.matrix_from_quaternion(transform.quaternion_about(axis, angle)),
        Rotation.from_rotvec(axis * angle[:, None]).as_matrix(), atol=1e-13,
    )


def test_quaternion_of_half_turns():
    half_turns = Rotation.from_rotvec(np.pi * units(100)).as_matrix()
    back = transform.matrix_from_quaternion(transform.quaternion_from_matrix(half_turns))
    assert np.allclose(back, half_turns, atol=1e-12)


def test_slerp_agrees_with_scipy():
    pair = Rotation.random(2, random_state=4)
    f = np.linspace(0, 1, 21)
    got = transform.slerp(pair[0].as_quat(), pair[1].as_quat(), f)
    assert np.allclose(transform.matrix_from_quaternion(got), Slerp([0, 1], pair)(f).as_matrix(), atol=1e-12)


def test_compose_and_transform_points():
    q = Rotation.random(random_state=8)
    m = transform.compose((1, 2, 3), q.as_quat(), (2, 3, 4))
    chain = transform.translation((1, 2, 3)) @ np.block([
        [q.as_matrix(), np.zeros((3, 1))], [np.zeros((1, 3)), 1],
    ]) @ transform.scaling((2, 3, 4))
    assert np.allclose(m, chain)
    p = rng.normal(size=(30, 3))
    assert np.allclose(transform.transform_points(m, p), (chain @ np.c_[p, np.ones(30)].T).T[:, :3])
    normal, tangent = np.array([0.0, 0.0, 1.0]), np.array([[1.0, 0, 0], [0, 1.0, 0]])
    assert np.allclose(transform.transform_vectors(m, tangent) @ transform.transform_normals(m, normal), 0, atol=1e-12)


@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-9, 3e-9, 1e-7, 1e-4, 0.1, 1.0, 3.0])
def test_minimal_rotation(gap):
    """Near identical and near opposite directions included: orthonormal, maps one to the other, smallest angle."""
    a = units(300)
    side = transform.any_perpendicular(a)
    for sign in (1.0, -1.0):
        b = sign * (np.cos(gap) * a + np.sin(gap) * side)
        r = transform.minimal_rotation(a, 3.0 * b)
        assert np.allclose(r @ r.swapaxes(-1, -2), np.eye(3), atol=1e-14)
        assert np.allclose(np.linalg.det(r), 1.0)
        assert np.allclose(np.einsum("nij,nj->ni", r, a), b, atol=5e-8)
        cosine = np.clip(np.sum(a * b, axis=1), -1, 1)
        assert np.allclose((np.trace(r, axis1=1, axis2=2) - 1) / 2, cosine, atol=1e-12)  # angle no larger than between


def test_minimal_rotation_of_nothing_is_identity():
    assert np.array_equal(transform.minimal_rotation([0, 0, 0], [0, 0, 1]), np.eye(3))


def test_tangent_frames():
    n = np.concatenate([units(300), [[0, 0, 1], [0, 0, -1], [1e-9, 0, -1], [0, 0, 0]]])
    hints = rng.normal(size=n.shape)
    hints[:3] = n[:3]
    for f in (transform.tangent_frames(n), transform.tangent_frames(n, hints)):
        assert np.allclose(f @ f.swapaxes(-1, -2), np.eye(3), atol=1e-12)
        assert np.allclose(np.linalg.det(f), 1.0)
        assert np.allclose(f[:-1, 2], transform.normalized(n)[:-1])
    f = transform.tangent_frames(n, hints)
    assert np.all(np.sum(f[3:-4, 0] * hints[3:-4], axis=1) > 0)
    assert np.allclose(np.sum(f[3:-4, 1] * hints[3:-4], axis=1), 0, atol=1e-9)


def test_normalized_of_extreme_lengths():
    assert np.allclose(transform.normalized([[1e300, 1e300, 0], [1e-300, 0, 0], [0, 0, 0]]),
                       [[2**-0.5, 2**-0.5, 0], [1, 0, 0], [0, 0, 0]])
