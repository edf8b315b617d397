"""Curves of any basis become points that lie on them, by the definitions of scipy; bad ones are left out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BPoly, BSpline, CubicHermiteSpline

from core.formats.raw_curves import OnCurve, RawCurves, as_ids, clean, merge, on_points, pack, spread

rng = np.random.default_rng(4)


def control(count):
    return rng.normal(size=(count, 3)).astype(np.float32)


def on_curve(basis, wrap, *curves):
    shape = OnCurve(basis, wrap, np.array([len(c) for c in curves]))
    kept = shape.vertex(np.concatenate(curves))
    assert len(kept) == shape.counts.sum()
    return np.split(kept, np.cumsum(shape.counts)[:-1])


def test_linear_points_are_kept_to_the_bit_and_closed_when_periodic():
    a, b = control(5), control(2)
    for ours, theirs in zip(on_curve("linear", "nonperiodic", a, b), (a, b), strict=True):
        assert np.array_equal(ours, theirs)
    for ours, theirs in zip(on_curve("linear", "periodic", a, b), (a, b), strict=True):
        assert np.array_equal(ours, np.concatenate([theirs, theirs[:1]]))


def test_bezier_samples_agree_with_bernstein_polynomials():
    curves = control(4), control(10)
    for kept, p in zip(on_curve("bezier", "nonperiodic", *curves), curves, strict=True):
        pieces = (len(p) - 1) // 3
        coefficients = np.stack([p[k::3][:pieces] for k in range(4)])
        truth = BPoly(coefficients.astype(float), np.arange(pieces + 1))(np.linspace(0, pieces, 3 * pieces + 1))
        np.testing.assert_allclose(kept, truth, atol=1e-6)


def test_bspline_samples_agree_with_uniform_bsplines():
    curves = control(4), control(9)
    for kept, p in zip(on_curve("bspline", "nonperiodic", *curves), curves, strict=True):
        spline = BSpline(np.arange(-3, len(p) + 1), p.astype(float), 3)
        np.testing.assert_allclose(kept, spline(np.arange(len(p) - 2)), atol=1e-6)


def test_catmull_rom_passes_through_its_control_points():
    curves = control(4), control(9)
    for kept, p in zip(on_curve("catmullRom", "nonperiodic", *curves), curves, strict=True):
        assert np.array_equal(kept, p[1:-1])


def test_catmull_rom_inside_a_segment_is_the_hermite_curve_of_central_tangents():
    p = control(4)
    shape = OnCurve("catmullRom", "nonperiodic", np.array([4]))
    shape.per_segment, shape.counts = 4, np.array([5])
    truth = CubicHermiteSpline([0, 1], p[1:3], [(p[2] - p[0]) / 2, (p[3] - p[1]) / 2])(np.linspace(0, 1, 5))
    np.testing.assert_allclose(shape.vertex(p), truth, atol=1e-6)


@pytest.mark.parametrize("basis", ["bspline", "catmullRom"])
def test_pinned_curves_reach_their_ends(basis):
    curves = control(5), control(2), control(3)
    for kept, p in zip(on_curve(basis, "pinned", *curves), curves, strict=True):
        np.testing.assert_allclose(kept[[0, -1]], p[[0, -1]], atol=1e-6)
        assert len(kept) == len(p)


@pytest.mark.parametrize(("basis", "count"), [("bezier", 6), ("bspline", 5), ("catmullRom", 5)])
def test_periodic_curves_close(basis, count):
    first, second = on_curve(basis, "periodic", control(count), control(count))
    np.testing.assert_allclose(first[0], first[-1], atol=1e-6)
    np.testing.assert_allclose(second[0], second[-1], atol=1e-6)
    assert not np.allclose(first, second)


def test_curves_too_short_for_their_basis_vanish_without_disturbing_the_others():
    a, short, b = control(5), control(3), control(4)
    kept = on_curve("bspline", "nonperiodic", a, short, b)
    assert [len(k) for k in kept] == [3, 0, 2]
    np.testing.assert_array_equal(kept[2], on_curve("bspline", "nonperiodic", b)[0])


@pytest.mark.parametrize(("basis", "wrap", "count", "joints"), [
    ("linear", "nonperiodic", 4, 4), ("bezier", "nonperiodic", 7, 3), ("bezier", "periodic", 6, 2),
    ("bspline", "nonperiodic", 6, 4), ("bspline", "pinned", 4, 4), ("catmullRom", "periodic", 5, 5),
])  # fmt: skip
def test_varying_values_stand_at_the_joints(basis, wrap, count, joints):
    shape = OnCurve(basis, wrap, np.array([count, count]))
    values = np.arange(2 * joints, dtype=np.float32)
    kept = shape.varying(values).reshape(2, -1)
    step = shape.per_segment
    closing = [[0], [joints]] if wrap == "periodic" else [[], []]
    for row, first in ((0, 0), (1, joints)):
        np.testing.assert_array_equal(kept[row, ::step], [*range(first, first + joints), *closing[row]])
    if step == 3:
        np.testing.assert_allclose(kept[0, 1], 1 / 3, atol=1e-6)
    assert shape.varying(values[:-1]) is None


def test_values_of_every_scope_reach_the_points_or_are_left_out():
    shape = OnCurve("linear", "nonperiodic", np.array([2, 3]))
    points = np.arange(5, dtype=np.float32)
    assert on_points(np.float32([7]), "constant", shape).tolist() == [7] * 5
    assert on_points(np.float32([7, 8]), "uniform", shape).tolist() == [7, 7, 8, 8, 8]
    assert on_points(points, "vertex", shape).tolist() == points.tolist()
    assert on_points(points[:4], "vertex", shape) is None
    assert on_points(points[:3], "uniform", shape) is None
    assert spread(points, "nonsense", np.array([2, 3])) is None


def test_short_and_unfinite_curves_are_left_out_with_their_rows():
    points = np.arange(30, dtype=np.float32).reshape(10, 3)
    points[3, 1] = np.nan
    uvs = np.array([[0, 0], [1, 1], [2, np.inf], [3, 3], [4, 4], [5, 5]], np.float32)
    ids = np.arange(6, dtype=np.int32)
    raw = RawCurves(counts=np.array([3, 2, 2, 2, 0, 1]), points=points, ids=ids, root_uvs=uvs)
    kept = clean(raw, "it")
    assert kept.counts.tolist() == [3, 2]
    assert kept.ids.tolist() == [0, 3]
    np.testing.assert_array_equal(kept.points, points[[0, 1, 2, 7, 8]])
    assert "4 curves" in kept.notes[0]


def test_merge_drops_columns_only_some_have_and_says_so():
    a = RawCurves(counts=np.array([2]), points=control(2), ids=np.array([4]), widths=np.ones(2, np.float32))
    b = RawCurves(counts=np.array([3]), points=control(3), ids=np.array([5]))
    merged = merge([a, b])
    assert merged.counts.tolist() == [2, 3]
    assert merged.ids.tolist() == [4, 5]
    assert merged.widths is None
    assert "widths" in merged.notes[0]


def test_pack_keeps_roles_apart_and_refuses_colliding_ids():
    guide = RawCurves(counts=np.array([2]), points=control(2), ids=np.array([1]), guides=True)
    hairs = [RawCurves(counts=np.array([2]), points=control(2), ids=np.array([1])) for _ in range(2)]
    packed = pack([hairs[0], guide, hairs[1]], name="x")
    assert packed["guides.ids"].tolist() == [1]
    assert packed["children.counts"].tolist() == [2, 2]
    assert "children.ids" not in packed
    assert packed["name"] == "x"
    assert len(packed["notes"]) == 1


def test_only_whole_numbers_of_32_bits_are_ids():
    assert as_ids(np.array([1.0, -3.0])).tolist() == [1, -3]
    assert as_ids(np.array([1.5])) is None
    assert as_ids(np.array([2**31])) is None
    assert as_ids(np.array([np.nan])) is None
