"""Symmetry maps on the demo animal, whose pairs are known, and on meshes that have none."""

import numpy as np
import pytest

from core.demo.shape import shape
from core.errors import UserError
from core.pose.sculpt.brushes import draw, grab
from core.pose.sculpt.ring import ring_at
from core.pose.sculpt.surface import sculpt_surface
from core.pose.sculpt.symmetry import (
    mirrored_offsets,
    mirrored_ring,
    opposites_by_axis,
    opposites_by_topology,
    reflected,
    symmetrised_offsets,
)
from tests.core.pose.sculpt.sculpt_samples import grid, joined


@pytest.fixture(scope="module")
def animal():
    return shape()


def test_by_axis(animal):
    pairs = opposites_by_axis(animal.mesh.points)
    assert np.array_equal(pairs, animal.pairs)
    dented = animal.mesh.points.copy()
    left = int(np.argmax(dented[:, 0]))
    dented[left] *= 1.5
    pairs = opposites_by_axis(dented)
    assert pairs[left] == -1
    assert pairs[animal.pairs[left]] == -1
    assert (pairs >= 0).sum() == len(pairs) - 2


def test_by_topology_whatever_the_shape(animal):
    assert np.array_equal(opposites_by_topology(animal.mesh), animal.pairs)
    rng = np.random.default_rng(5)
    bent = animal.mesh.points + rng.normal(0.0, 0.002, animal.mesh.points.shape)
    side = np.clip(animal.mesh.points[:, 2:] - 0.1, 0.0, None)
    bent[:, :1] += 3.0 * side**2  # the neck leans to one side
    assert np.array_equal(opposites_by_topology(animal.mesh.replace(points=bent.astype(np.float32))), animal.pairs)


def test_by_topology_pairs_pieces_that_lie_apart():
    eye = grid(7)
    right = eye.replace(points=eye.points + np.float32([2, 0, 0]))
    flipped = right.points * np.float32([-1, 1, 1])
    left = right.replace(points=flipped, corners=right.corners.reshape(-1, 4)[:, ::-1].reshape(-1).copy())
    both = joined(right, left)
    pairs = opposites_by_topology(both)
    assert np.array_equal(pairs, (np.arange(98) + 49) % 98)


def test_what_is_not_symmetric_is_refused(animal):
    mesh = animal.mesh
    kept = np.ones(len(mesh.counts), bool)
    kept[int(np.argmax(mesh.points[mesh.corners.reshape(-1, 4)].mean(axis=1)[:, 0]))] = False
    holed = mesh.replace(
        counts=mesh.counts[kept], corners=mesh.corners.reshape(-1, 4)[kept].reshape(-1), parts=mesh.parts[kept],
        uvs=None,
    )
    with pytest.raises(UserError, match="no opposite"):
        opposites_by_topology(holed)


def test_a_mirrored_ring_does_on_the_other_side_what_the_ring_does_here(animal):
    points, surface, pairs = animal.mesh.points, sculpt_surface(animal.mesh), opposites_by_topology(animal.mesh)
    centre = points[int(np.argmax(points[:, 0]))]
    ring = ring_at(surface, points, centre, 0.04)
    other = mirrored_ring(ring, pairs)
    there = ring_at(surface, points, reflected(centre), 0.04)
    assert np.array_equal(other.sites, there.sites)
    assert np.allclose(other.weights, there.weights, atol=1e-6)
    raised = draw(surface, draw(surface, points, ring, 0.01), other, 0.01)
    assert np.allclose(raised[pairs], reflected(raised), atol=1e-6)
    move = np.array([0.01, 0.02, -0.01])
    pulled = grab(surface, grab(surface, points, ring, move), other, reflected(move))
    assert np.allclose(pulled[pairs], reflected(pulled), atol=1e-6)


def test_mirrored_twice_is_the_same(animal):
    pairs = opposites_by_axis(animal.mesh.points)
    offsets = np.random.default_rng(0).normal(size=animal.mesh.points.shape).astype(np.float32)
    assert np.array_equal(mirrored_offsets(mirrored_offsets(offsets, pairs), pairs), offsets)
    even = symmetrised_offsets(offsets, pairs, animal.mesh.points)
    assert np.array_equal(mirrored_offsets(even, pairs), even)
    right = animal.mesh.points[:, 0] > 0.0
    assert np.array_equal(even[right], offsets[right])
