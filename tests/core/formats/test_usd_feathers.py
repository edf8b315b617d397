"""Feathers as OpenUSD: what a reader places is what was laid, every one with its id."""

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdShade

from core.evaluator import Evaluator
from core.feather.coat.dress import dress_feathers
from core.feather.coat.export import added_at_rest, instances
from core.feather.coat.plumage import Plumage
from core.feather.coat.posing import LENGTH
from core.feather.look import FeatherLook
from core.formats.usd_feathers import FeatherFrame, FeatherWriter
from core.value import constant
from tests.core.feather.coat.bodies import crossing_by_solving, egg


@pytest.fixture(scope="module")
def laid():
    evaluator = Evaluator()
    mesh = egg()
    coat, keys = dress_feathers(mesh, evaluator, 150, keys=12)
    yield Plumage(evaluator).at_rest(coat.replace(density=constant(0.8)), keys, mesh), evaluator, mesh
    evaluator.close()


def opened(path, laid, animated=False, shafts=None, **given):
    rest, _, mesh = laid
    writer = FeatherWriter(path, "plumage", mesh, "test", FeatherLook((0.3, 0.2, 0.1)), animated, shafts=shafts)
    for frame in (1001.0, 1002.0) if animated else (1001.0,):
        writer.write(FeatherFrame(frame, rest.skin.points, **given, attributes={}))
    writer.close(*((1001.0, 1002.0) if animated else ()))
    return Usd.Stage.Open(str(path))


def test_instances_are_placed_by_openusd_as_they_were_laid(tmp_path, laid):
    rest, evaluator, _ = laid
    found = instances(rest, evaluator.workers)
    stage = opened(tmp_path / "coat.usdc", laid, instances=found, ids=found.ids, vanes=None)
    coat = UsdGeom.PointInstancer(stage.GetPrimAtPath("/Feathers/plumage"))
    matrices = coat.ComputeInstanceTransformsAtTime(Usd.TimeCode.Default(), Usd.TimeCode.Default())
    prototypes = [
        np.array(UsdGeom.Mesh(stage.GetPrimAtPath(path)).GetPointsAttr().Get())
        for path in coat.GetPrototypesRel().GetTargets()
    ]
    placed = np.array([
        [matrix.Transform(Gf.Vec3d(*map(float, point))) for point in prototypes[proto]]
        for matrix, proto in zip(matrices, coat.GetProtoIndicesAttr().Get(), strict=True)
    ])
    np.testing.assert_allclose(placed, found.vanes.reshape(len(found.ids), -1, 3), atol=2e-6)
    assert np.array(coat.GetIdsAttr().Get()).tolist() == rest.ids[rest.shown].tolist()
    assert 0 < len(prototypes) < len(found.ids)
    assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y
    shape = stage.GetPrimAtPath(coat.GetPrototypesRel().GetTargets()[0])
    bound, _ = UsdShade.MaterialBindingAPI(shape).ComputeBoundMaterial()
    assert bound.ComputeSurfaceSource()[0].GetIdAttr().Get() == "UsdPreviewSurface"


def test_the_quantising_error_and_the_crossings_told_are_those_of_what_is_written(laid):
    rest, evaluator, _ = laid
    found = instances(rest, evaluator.workers)
    assert 0.0 < found.error < 0.05
    assert len(crossing_by_solving(found.vanes)) == len(found.left.first)
    exact = rest.layered.vanes[rest.shown].astype(np.float64)
    apart = np.linalg.norm(found.vanes - exact, axis=-1).max(axis=(1, 2)) / found.scales
    assert np.quantile(apart, 0.9) < 0.05  # a few were turned a little more, so that they do not cross


def test_every_feather_its_own_mesh_keeps_every_point_and_id(tmp_path, laid):
    rest, _, _ = laid
    vanes = rest.layered.vanes[rest.shown]
    stage = opened(tmp_path / "coat.usda", laid, instances=None, ids=rest.ids[rest.shown], vanes=vanes)
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Feathers/plumage"))
    np.testing.assert_array_equal(np.array(mesh.GetPointsAttr().Get()), vanes.reshape(-1, 3))
    ids = np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("feather_id").Get())
    assert len(ids) == len(mesh.GetFaceVertexCountsAttr().Get())
    assert sorted(set(ids.tolist())) == rest.ids[rest.shown].tolist()


def test_shafts_are_curves_from_root_to_tip_with_widths_and_ids(tmp_path, laid):
    rest, _, _ = laid
    ids, vanes = rest.ids[rest.shown], rest.layered.vanes[rest.shown]
    stage = opened(tmp_path / "hair.usdc", laid, shafts=(0.01, 0.002), instances=None, ids=ids, vanes=vanes)
    curves = UsdGeom.BasisCurves(stage.GetPrimAtPath("/Feathers/plumage"))
    points = np.array(curves.GetPointsAttr().Get()).reshape(len(ids), -1, 3)
    assert curves.GetCurveVertexCountsAttr().Get() == [points.shape[1]] * len(ids)
    np.testing.assert_allclose(points[:, 0], rest.feathers.roots[rest.shown], atol=1e-6)
    along = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
    np.testing.assert_allclose(along, rest.layered.poses[rest.shown][:, LENGTH], rtol=0.02)
    widths = np.array(curves.GetWidthsAttr().Get()).reshape(len(ids), -1)
    np.testing.assert_allclose(widths[:, [0, -1]] / along[:, None], [[0.02, 0.004]] * len(ids), rtol=1e-5)
    assert curves.GetWidthsInterpolation() == UsdGeom.Tokens.vertex
    named = UsdGeom.PrimvarsAPI(curves).GetPrimvar("feather_id")
    assert (named.GetInterpolation(), list(named.Get())) == (UsdGeom.Tokens.uniform, ids.tolist())


def test_frames_become_time_samples(tmp_path, laid):
    rest, evaluator, _ = laid
    found = instances(rest, evaluator.workers, added_at_rest(rest, evaluator.workers))
    stage = opened(tmp_path / "coat.usd", laid, animated=True, instances=found, ids=found.ids, vanes=None)
    coat = UsdGeom.PointInstancer(stage.GetPrimAtPath("/Feathers/plumage"))
    assert coat.GetPositionsAttr().GetTimeSamples() == [1001.0, 1002.0]
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1001.0, 1002.0)


def test_a_frame_in_which_nothing_moves_is_as_free_of_crossings_as_the_rest(laid):
    rest, evaluator, _ = laid
    alone = instances(rest, evaluator.workers)
    frame = instances(rest, evaluator.workers, added_at_rest(rest, evaluator.workers))
    assert crossing_by_solving(frame.vanes) == set()
    assert len(frame.left.first) == len(frame.left.skin) == 0
    np.testing.assert_allclose(frame.scales, alone.scales, rtol=1e-6)
