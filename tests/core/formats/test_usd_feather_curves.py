"""Feathers as curves of OpenUSD, read back by OpenUSD: shafts, barbs, and Houdini's condensed form expanded again."""

import itertools

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdShade
from scipy.interpolate import BSpline

from app.feather_frames import coat_looks, export_frame
from core.demo.bird_document import bare_bird_document
from core.evaluator import Evaluator
from core.feather.attributes import COLUMNS
from core.feather.barbs import condense, expand
from core.feather.coat.curves import coat_curves, kinds_of
from core.feather.coat.dress import dress_feathers
from core.feather.coat.plumage import Plumage
from core.feather.coat.posing import LENGTH
from core.feather.coat.wing import WING_IDS
from core.feather.coat.worn import worn_values
from core.feather.vane import vane_grids
from core.formats.usd_feathers import FeatherWriter


@pytest.fixture(scope="module")
def bird():
    """A bird with wings and tail, one of its feathers bent by hand; the coat laid and the evaluator."""
    evaluator, item = Evaluator(), bare_bird_document().meshes[0]
    dressed = dress_feathers(item.mesh, evaluator, 60, keys=12, mesh_id=item.id, rig=item.rig)
    laid = Plumage(evaluator).at_rest(dressed.coat, dressed.keys, item.mesh)
    yield laid, dressed.coat, item.mesh, evaluator
    evaluator.close()


def opened(path, bird, form, barbs=12):
    laid, coat, mesh, evaluator = bird
    writer = FeatherWriter(path, "plumage", mesh, "test", coat_looks(coat), False)
    written, _ = export_frame(laid, coat, 1001.0, form, evaluator, barbs=barbs)
    writer.write(written)
    writer.close()
    return Usd.Stage.Open(str(path))


def prims(stage):
    return [UsdGeom.BasisCurves(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.BasisCurves)]


def primvar(prim, name):
    return np.array(UsdGeom.PrimvarsAPI(prim).GetPrimvar(name).Get())


def by_id(stage):
    """Of every feather its curves as (barb, side, points, widths)."""
    found = {}
    for prim in prims(stage):
        starts = np.concatenate([[0], np.cumsum(prim.GetCurveVertexCountsAttr().Get())])
        points, widths = np.array(prim.GetPointsAttr().Get()), np.array(prim.GetWidthsAttr().Get())
        for k, (feather, barb, side) in enumerate(
            zip(*(primvar(prim, name) for name in ("feather_id", "barb", "side")), strict=True)):
            part = slice(starts[k], starts[k + 1])
            found.setdefault(int(feather), []).append((int(barb), int(side), points[part], widths[part]))
    return found


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
def test_shafts_of_all_feathers_of_body_wings_and_tail_are_curves(tmp_path, bird, suffix):
    laid = bird[0]
    found = by_id(opened(tmp_path / f"coat{suffix}", bird, "shafts"))
    assert sorted(found) == sorted(laid.ids[laid.shown].tolist())
    assert sum(feather >= WING_IDS for feather in found) > 300
    for row in np.flatnonzero(laid.shown):
        ((barb, side, points, widths),) = found[int(laid.ids[row])]
        assert (barb, side) == (-1, 0)
        vane = laid.layered.vanes[row]
        np.testing.assert_array_equal(points, vane[:, vane.shape[1] // 2])
        assert widths[0] > widths[-1] > 0.0
        if laid.ids[row] < WING_IDS:
            along = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
            assert along == pytest.approx(laid.layered.poses[row, LENGTH], rel=0.02)


def test_barbs_stand_on_their_shafts_within_their_vanes_and_carry_what_they_are(tmp_path, bird):
    laid, _coat, *_ = bird
    stage = opened(tmp_path / "coat.usdc", bird, "barbs")
    found = by_id(stage)
    assert sorted(found) == sorted(laid.ids[laid.shown].tolist())
    apart, beyond = [], []
    for row in np.flatnonzero(laid.shown):
        curves, vane = found[int(laid.ids[row])], laid.layered.vanes[row]
        barbs = [curve for curve in curves if curve[1] != 0]
        assert len(curves) - len(barbs) == 1
        for side in (-1, 1):
            numbers = [barb for barb, s, *_ in barbs if s == side]
            assert len(numbers) <= 12
            assert numbers == sorted(set(numbers))
        shaft = vane[:, vane.shape[1] // 2].astype(float)
        dense = np.concatenate([np.linspace(a, b, 20) for a, b in itertools.pairwise(shaft)])
        length = np.linalg.norm(np.diff(shaft, axis=0), axis=1).sum()
        low, high = vane.reshape(-1, 3).min(axis=0), vane.reshape(-1, 3).max(axis=0)
        for _, _, points, widths in barbs:
            apart.append(np.linalg.norm(dense - points[0], axis=1).min() / length)
            beyond.append(np.maximum(low - points, points - high).max() / length)
            assert (widths > 0.0).all()
            assert np.isfinite(points).all()
    assert len(apart) > 4000
    assert np.quantile(apart, 0.99) < 0.03
    assert np.quantile(beyond, 0.99) < 0.08
    looks = set()
    for prim in prims(stage):
        material, _ = UsdShade.MaterialBindingAPI(prim.GetPrim()).ComputeBoundMaterial()
        looks.add(material.GetPath().name)
        for name in ("age", "tract", "wear", "length"):
            assert len(primvar(prim, name)) == len(prim.GetCurveVertexCountsAttr().Get())
        assert len(primvar(prim, "displayColor")) == len(prim.GetPointsAttr().Get())
    assert len(looks) > 3  # a material for every type of feather


def test_at_rest_in_its_own_frame_a_barb_is_where_the_feather_model_has_it(bird):
    """A vane that is the preset's own grid carries every barb onto the model's own expansion."""
    laid, coat, *_ = bird
    names, kinds = kinds_of(laid, coat)
    row = int(np.flatnonzero(laid.shown & (laid.ids < WING_IDS))[0])
    values = worn_values(coat, names[kinds[row]]).copy()
    values[COLUMNS["shaftLength"]] = 1.0
    vanes = laid.layered.vanes.copy()
    vanes[row] = vane_grids(values[None], *vanes.shape[1:3])[0]
    own = laid._replace(
        shown=np.arange(len(laid.ids)) == row, layered=laid.layered._replace(vanes=vanes),
        feathers=laid.feathers._replace(own=np.abs(laid.feathers.own) * 0.0 + vanes[row]))
    (found,) = coat_curves(own, coat, True, points=9)
    barbs = found.points[found.counts[0] :].reshape(-1, 9, 3)
    model = expand(values, condense(values[None], laid.ids[row : row + 1]), 0, 9)
    np.testing.assert_allclose(barbs, model.points, atol=2e-6)


def expanded(prim):
    """Barbs of condensed feathers by the layout SideFX documents in its scene indices, written anew from its words."""
    points, turns = np.array(prim.GetPointsAttr().Get()), UsdGeom.PrimvarsAPI(prim).GetPrimvar("barborient").Get()
    both = {}
    for side in ("l", "r"):
        flat = np.array(UsdGeom.PrimvarsAPI(prim).GetPrimvar(f"P_barb{side}").Get())
        assert len(flat) % (3 * len(points)) == 0
        many = len(flat) // (3 * len(points))
        made = np.empty((len(points), many, 3))
        for i, turn in enumerate(turns):
            rotation = Gf.Rotation(Gf.Quatd(turn))
            for j in range(many):
                at = 3 * (many * i + j)
                made[i, j] = np.array(rotation.TransformDir(Gf.Vec3d(*map(float, flat[at : at + 3])))) + points[i]
        both[side] = made
    return both


def test_condensed_feathers_expand_to_the_same_barbs(tmp_path, bird):
    laid = bird[0]
    barbs = by_id(opened(tmp_path / "barbs.usdc", bird, "barbs", 6))
    stage = opened(tmp_path / "condensed.usdc", bird, "condensed", 6)
    size, seen = float(np.ptp(laid.skin.points, axis=0).max()), set()
    for prim in prims(stage):
        sides = expanded(prim)
        starts = np.concatenate([[0], np.cumsum(prim.GetCurveVertexCountsAttr().Get())])
        for k, feather in enumerate(primvar(prim, "id")):
            seen.add(int(feather))
            for side, number in (("l", -1), ("r", 1)):
                ours = np.array([points for _, s, points, _ in barbs[int(feather)] if s == number])
                theirs = sides[side][starts[k] : starts[k + 1]]
                first = np.linalg.norm(theirs - np.array(prim.GetPointsAttr().Get())[starts[k] : starts[k + 1], None],
                                       axis=2).max(axis=1) > 0.0  # one without length is none
                assert first.sum() == len(ours)
                if len(ours):
                    assert np.abs(theirs[first] - ours).max() < 1e-6 * size + 1e-7
        for name in ("width_barbl", "width_barbr"):
            assert (primvar(prim, name) >= 0.0).all()
        assert UsdGeom.PrimvarsAPI(prim).GetPrimvar("P_barbl").GetElementSize() == 15
    assert sorted(seen) == sorted(laid.ids[laid.shown].tolist())


def test_patches_and_shafts_of_nurbs_go_through_the_laid_vanes(tmp_path, bird):
    laid = bird[0]
    stage = opened(tmp_path / "coat.usdc", bird, "nurbs")
    patches = {
        UsdGeom.PrimvarsAPI(prim).GetPrimvar("feather_id").Get(): UsdGeom.NurbsPatch(prim)
        for prim in stage.Traverse() if prim.IsA(UsdGeom.NurbsPatch)
    }
    assert sorted(patches) == sorted(laid.ids[laid.shown].tolist())
    for row in np.flatnonzero(laid.shown)[::7]:
        patch, vane = patches[int(laid.ids[row])], laid.layered.vanes[row]
        many = (patch.GetVVertexCountAttr().Get(), patch.GetUVertexCountAttr().Get())
        points = np.array(patch.GetPointsAttr().Get(), np.float64).reshape(*many, 3)
        along = BSpline(np.array(patch.GetVKnotsAttr().Get()), points, patch.GetVOrderAttr().Get() - 1, axis=0)
        across = BSpline(
            np.array(patch.GetUKnotsAttr().Get()), along(np.linspace(0.0, 1.0, vane.shape[0])),
            patch.GetUOrderAttr().Get() - 1, axis=1)
        np.testing.assert_allclose(across(np.linspace(0.0, 1.0, vane.shape[1])), vane, atol=2e-6)
    (shafts,) = (UsdGeom.NurbsCurves(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.NurbsCurves))
    ids = primvar(shafts, "feather_id").tolist()
    many = laid.layered.vanes.shape[1]
    points = np.array(shafts.GetPointsAttr().Get(), np.float64).reshape(len(ids), many, 3)
    knots = np.array(shafts.GetKnotsAttr().Get()).reshape(len(ids), -1)
    for row in np.flatnonzero(laid.shown)[::7]:
        k = ids.index(int(laid.ids[row]))
        curve = BSpline(knots[k], points[k], shafts.GetOrderAttr().Get()[k] - 1)
        wanted = laid.layered.vanes[row][:, laid.layered.vanes.shape[2] // 2]
        np.testing.assert_allclose(curve(np.linspace(0.0, 1.0, many)), wanted, atol=2e-6)


def test_a_feather_bent_by_hand_takes_its_barbs_with_it(bird):
    laid, coat, *_ = bird
    row = int(np.flatnonzero(laid.shown & (laid.ids < WING_IDS))[5])
    vanes = laid.layered.vanes.copy()
    before = next(c for c in coat_curves(laid._replace(shown=np.arange(len(laid.ids)) == row), coat, True, 5))
    vanes[row] += np.float32([0.0, 0.05, 0.0])
    moved = laid._replace(shown=np.arange(len(laid.ids)) == row, layered=laid.layered._replace(vanes=vanes))
    after = next(coat_curves(moved, coat, True, 5))
    wanted = np.tile([0.0, 0.05, 0.0], (len(after.points), 1))
    np.testing.assert_allclose(after.points - before.points, wanted, atol=1e-5)
