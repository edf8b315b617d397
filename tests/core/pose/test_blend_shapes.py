"""Truths: UsdSkel's own blend shapes with inbetweens, closed forms, and plain sums."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdSkel, Vt

from core.pose.blend_shapes import BlendShapes, dense_offsets, morphed, target_weights, targets_from_dense
from core.workers import Workers

rng = np.random.default_rng(4)
AT = {"brow": (1.0,), "jaw": (0.5, 1.0), "lip": (-0.5, 1.0, 1.5), "lid": (0.25, 0.5, 0.75, 1.0)}


def some_shapes(vertices=50, part=0.3):
    names, shape, at, offsets = tuple(AT), [], [], []
    for row, name in enumerate(names):
        for weight in AT[name]:
            moved = rng.normal(size=(vertices, 3)) * (rng.random((vertices, 1)) < part)
            shape.append(row)
            at.append(weight)
            offsets.append(moved.astype(np.float32))
    return targets_from_dense(names, shape, at, offsets), offsets


def in_usd(points, shapes):
    """The same shapes on a stage, and UsdSkel's query for them."""
    stage = Usd.Stage.CreateInMemory()
    UsdSkel.Root.Define(stage, "/r")
    mesh = UsdGeom.Mesh.Define(stage, "/r/m")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    paths = []
    for row, name in enumerate(shapes.names):
        made = UsdSkel.BlendShape.Define(stage, f"/r/m/{name}")
        for t in np.flatnonzero(shapes.shape == row):
            rows = slice(int(shapes.starts[t]), int(shapes.starts[t + 1]))
            if shapes.at[t] == 1.0:
                made.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(shapes.offsets[rows]))
                made.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(shapes.vertices[rows]))
        for t in np.flatnonzero((shapes.shape == row) & (shapes.at != 1.0)):
            between = made.CreateInbetween(f"t{t}")
            between.SetWeight(float(shapes.at[t]))
            rows = np.asarray(made.GetPointIndicesAttr().Get())
            between.SetOffsets(Vt.Vec3fArray.FromNumpy(dense_offsets(shapes, t, len(points))[rows]))
        paths.append(made.GetPath())
    binding.CreateBlendShapesAttr(Vt.TokenArray(list(shapes.names)))
    binding.CreateBlendShapeTargetsRel().SetTargets(paths)
    return stage, UsdSkel.BlendShapeQuery(binding)


def test_agrees_with_usdskel_within_between_and_beyond():
    points = rng.normal(size=(50, 3)).astype(np.float32)
    names, shape, at, offsets = tuple(AT), [], [], []
    for row, name in enumerate(names):
        rows = rng.random((50, 1)) < 0.4  # in UsdSkel the targets of a shape share their vertices
        for weight in AT[name]:
            shape.append(row)
            at.append(weight)
            offsets.append((rng.uniform(0.1, 1.0, (50, 3)) * rows).astype(np.float32))
    shapes = targets_from_dense(names, shape, at, offsets)
    stage, query = in_usd(points, shapes)
    for weights in [*np.eye(4), *rng.uniform(-1.2, 2.2, (60, 4)), [0.5, 0.5, -0.5, 0.75], [0, 0, 1.5, 0.25]]:
        sub = query.ComputeSubShapeWeights(Vt.FloatArray([float(w) for w in weights]))
        out = Vt.Vec3fArray.FromNumpy(points.copy())
        assert query.ComputeDeformedPoints(
            *sub, query.ComputeBlendShapePointIndices(), query.ComputeSubShapePointOffsets(), out)
        truth = np.array(out)
        assert np.abs(morphed(points, shapes, weights) - truth).max() <= 1e-5 * np.ptp(truth)
    assert stage


def test_target_weights_in_closed_form():
    shapes, _ = some_shapes()
    found = target_weights(shapes, [0.3, 0.25, -0.25, 0.6])
    # brow 0.3; jaw half way to 0.5; lip half way to -0.5; lid between 0.5 and 0.75
    assert np.allclose(found, [0.3, 0.5, 0.0, 0.5, 0.0, 0.0, 0.0, 0.6, 0.4, 0.0])
    assert not target_weights(shapes, np.zeros(4)).any()
    assert np.allclose(target_weights(shapes, [-2.0, 1.5, 2.0, 0.0])[:6], [-2.0, -1.0, 2.0, 0.0, -1.0, 2.0])


def test_every_target_is_met_at_its_weight_and_is_a_plain_sum():
    shapes, offsets = some_shapes(vertices=500)
    points = rng.normal(size=(500, 3)).astype(np.float32)
    for t, at in enumerate(shapes.at):
        weights = np.zeros(4)
        weights[shapes.shape[t]] = at
        assert np.abs(morphed(points, shapes, weights) - (points + offsets[t])).max() < 1e-6
    weights = [0.4, 0.7, 1.2, 0.1]
    share = target_weights(shapes, weights)
    truth = points.astype(np.float64) + np.tensordot(share, np.array(offsets, np.float64), 1)
    assert np.abs(morphed(points, shapes, weights) - truth).max() < 2e-6


def test_threads_give_the_same_to_the_bit():
    shapes, _ = some_shapes(vertices=20_000)
    points = rng.normal(size=(20_000, 3)).astype(np.float32)
    workers = Workers(2)
    weights = [0.4, 0.7, 1.2, 0.1]
    both = morphed(points, shapes, weights, workers.ranges)
    workers.close()
    assert np.array_equal(both, morphed(points, shapes, weights))


def test_refusals():
    shapes, _ = some_shapes()
    wrong = [
        {"names": ("a", "a", "b", "c")},
        {"at": -np.abs(shapes.at) * 0},
        {"at": shapes.at[::-1].copy()},
        {"shape": shapes.shape[::-1].copy()},
        {"starts": shapes.starts + 1},
        {"vertices": shapes.vertices[::-1].copy()},
        {"vertices": shapes.vertices - np.int32(100)},
        {"offsets": shapes.offsets * np.float32(np.nan)},
    ]
    for change in wrong:
        with pytest.raises(ValueError):
            BlendShapes(**{f: change.get(f, getattr(shapes, f)) for f in shapes.__struct_fields__})
