"""Feathers as OpenUSD: what a reader places is what was laid, every one with its id."""

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdShade

from core.evaluator import Evaluator
from core.feather.coat.dress import dress_feathers
from core.feather.coat.export import BY_HAND, added_at_rest, instances
from core.feather.coat.plumage import Plumage
from core.feather.coat.posing import LENGTH
from core.feather.coat.proxy import keyed, promoted
from core.feather.look import FeatherLook
from core.formats.usd_feathers import FeatherFrame, FeatherWriter
from core.value import constant
from tests.core.feather.coat.bodies import crossing_by_solving, egg

LOOKS = {"contour": FeatherLook((0.3, 0.2, 0.1)), "down": FeatherLook((0.8, 0.8, 0.8))}


@pytest.fixture(scope="module")
def laid():
    evaluator = Evaluator()
    mesh = egg()
    coat, keys = dress_feathers(mesh, evaluator, 150, keys=12)
    yield Plumage(evaluator).at_rest(coat.replace(density=constant(0.8)), keys, mesh), evaluator, mesh
    evaluator.close()


def opened(path, laid, animated=False, **given):
    rest, _, mesh = laid
    writer = FeatherWriter(path, "plumage", mesh, "test", LOOKS, animated)
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


def test_every_type_has_its_material_on_instances_and_on_meshes(tmp_path, laid):
    rest, evaluator, _ = laid
    found = instances(rest, evaluator.workers)
    kinds = (np.arange(len(found.ids)) % 3 == 0).astype(np.int32)
    wanted = np.array([look.color for look in LOOKS.values()], np.float32)[kinds]
    stage = opened(tmp_path / "coat.usdc", laid, instances=found, ids=found.ids, vanes=None, kinds=kinds)
    coat = UsdGeom.PointInstancer(stage.GetPrimAtPath("/Feathers/plumage"))
    shapes = [stage.GetPrimAtPath(path) for path in coat.GetPrototypesRel().GetTargets()]
    worn = [UsdShade.MaterialBindingAPI(shape).ComputeBoundMaterial()[0].GetPath().name for shape in shapes]
    told = [worn[proto] for proto in coat.GetProtoIndicesAttr().Get()]
    assert told == [list(LOOKS)[kind] for kind in kinds]
    color = UsdGeom.PrimvarsAPI(coat).GetPrimvar("displayColor")
    np.testing.assert_array_equal(np.array(color.Get()), wanted)
    ids, vanes = rest.ids[rest.shown], rest.layered.vanes[rest.shown]
    stage = opened(tmp_path / "each.usdc", laid, instances=None, ids=ids, vanes=vanes, kinds=kinds)
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Feathers/plumage"))
    faces = len(mesh.GetFaceVertexCountsAttr().Get())
    subsets = UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets()
    assert UsdGeom.Subset.ValidateFamily(mesh, UsdGeom.Tokens.face, UsdShade.Tokens.materialBind)[0]
    of_face = np.full(faces, -1)
    for subset in subsets:
        name = UsdShade.MaterialBindingAPI(subset).ComputeBoundMaterial()[0].GetPath().name
        of_face[np.array(subset.GetIndicesAttr().Get())] = list(LOOKS).index(name)
    np.testing.assert_array_equal(of_face, np.repeat(kinds, faces // len(kinds)))


def test_a_feather_bent_by_hand_is_an_instance_exactly_as_it_lies(tmp_path, laid):
    _, evaluator, mesh = laid
    coat, keys = dress_feathers(mesh, evaluator, 150, keys=12)
    plumage = Plumage(evaluator)
    rest = plumage.at_rest(coat, keys, mesh)
    row = 40
    frames = plumage.root_frames(coat, keys, mesh)
    taken = promoted(
        coat, int(rest.ids[row]), rest.layered.vanes[row], rest.feathers.roots[row], frames[row], 1001.0)
    shaft = taken.proxies[0].rest.copy()
    shaft[:, 2] += 0.5 * np.abs(shaft[-1, 1]) * np.linspace(0.0, 1.0, len(shaft), dtype=np.float32) ** 2
    by_hand = keyed(taken, int(rest.ids[row]), 1001.0, shaft)
    posed = plumage.at_frame(by_hand, keys, mesh, rest.skin, 1001.0)
    length = rest.layered.poses[row, LENGTH]
    assert np.abs(posed.layered.vanes[row] - rest.layered.vanes[row]).max() > 0.3 * length
    for added in (None, added_at_rest(rest, evaluator.workers)):
        found = instances(posed, evaluator.workers, added)
        assert np.array_equal(found.ids, rest.ids)
        assert np.abs(found.vanes[row] - posed.layered.vanes[row]).max() < 1e-5 * length + 1e-6
        assert len(crossing_by_solving(found.vanes)) == len(found.left.first)
    (mine,) = (key for key in found.prototypes if key[0] == BY_HAND)
    assert mine[1] == rest.ids[row]
    stage = opened(tmp_path / "coat.usdc", laid, instances=found, ids=found.ids, vanes=None)
    coat = UsdGeom.PointInstancer(stage.GetPrimAtPath("/Feathers/plumage"))
    place = coat.ComputeInstanceTransformsAtTime(Usd.TimeCode.Default(), Usd.TimeCode.Default())[row]
    targets = coat.GetPrototypesRel().GetTargets()
    shape = UsdGeom.Mesh(stage.GetPrimAtPath(targets[coat.GetProtoIndicesAttr().Get()[row]]))
    placed = np.array([place.Transform(Gf.Vec3d(*map(float, point))) for point in shape.GetPointsAttr().Get()])
    np.testing.assert_allclose(placed, posed.layered.vanes[row].reshape(-1, 3), atol=1e-5 * length + 1e-6)


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
