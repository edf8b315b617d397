"""The form of a feather: its coarse vane, its quill, its barbs and its levels of detail."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from core.feather.attributes import COLUMNS, NAMES, SHAPE_NAMES, defaults, limits
from core.feather.barbs import Barbs, condense, expand
from core.feather.compare import compare
from core.feather.levels import feather_mesh, vane_patches
from core.feather.nurbs import Nurbs, evaluate, through
from core.feather.presets import preset_values
from core.feather.shaft import CIRCLE_KNOTS, CORNERS, WEIGHTS
from core.feather.simplify import kept_of_line
from core.feather.vane import vane_grids


def with_(base: NDArray[np.float32], **changes: float) -> NDArray[np.float32]:
    out = base.copy()
    for name, value in changes.items():
        for full in (name, name + "Left", name + "Right"):
            if full in COLUMNS:
                out[COLUMNS[full]] = value
    return out


def flat() -> NDArray[np.float32]:
    """A feather of length 1 without any bend: everything lies in the plane z = 0."""
    bends = ("shaftBend", "vaneCamber", "vaneCup", "vaneAngle")
    return with_(defaults(), shaftLength=1.0, **{name: 0.0 for name in SHAPE_NAMES if name.startswith(bends)})


def test_a_coarse_vane_is_as_wide_and_long_as_its_attributes_say() -> None:
    values = with_(flat(), vaneWidthLeft=0.1, vaneWidthRight=0.3, vaneEnd=1.0, vaneTipFullness=2.0)
    grid = vane_grids(values[None], rows=65, columns=5)[0].astype(np.float64)
    assert grid[..., 0].max() == pytest.approx(0.3, abs=1e-3)
    assert grid[..., 0].min() == pytest.approx(-0.1, abs=1e-3)
    assert grid[..., 1].max() == pytest.approx(1.0, abs=1e-5)
    assert np.abs(grid[..., 2]).max() < 1e-6
    # the tip is a quarter of an ellipse about the widest place, from 0.12 + 0.5 * 0.88 to 1
    edge = grid[:, 4]
    tip = edge[edge[:, 1] > 0.56]
    off = (tip[:, 1] - 0.56) / 0.44
    assert np.abs(tip[:, 0] - 0.3 * np.sqrt(np.maximum(1.0 - off**2, 0.0))).max() < 1e-3
    assert np.all(np.diff(grid[:, 2, 1]) > 0.0)


def test_a_bent_shaft_turns_by_its_angles_and_keeps_its_length() -> None:
    values = with_(flat(), shaftBendBase=0.4, shaftBendMiddle=0.5, shaftBendTip=0.3, shaftTipInset=0.0)
    line = vane_grids(values[None], rows=129, columns=3)[0, :, 1].astype(np.float64)
    steps = np.diff(line, axis=0)
    steps = steps[np.linalg.norm(steps, axis=1) > 1e-5]
    assert np.linalg.norm(steps, axis=1).sum() == pytest.approx(1.0, abs=2e-3)
    assert np.arctan2(-steps[-1, 2], steps[-1, 1]) == pytest.approx(1.2, abs=0.02)


def test_many_feathers_are_each_the_feather_alone() -> None:
    rows = np.stack([preset_values(name) for name in ("owl-contour", "duck-curl", "peregrine-primary")])
    many = vane_grids(rows)
    for row, grid in zip(rows, many, strict=True):
        assert np.array_equal(vane_grids(row[None])[0], grid)
    assert np.array_equal(vane_grids(rows[:, : len(SHAPE_NAMES)]), many)  # the others do not shape it
    with pytest.raises(ValueError, match="columns"):
        vane_grids(rows[:, :5])


def test_a_section_of_the_quill_is_a_circle() -> None:
    ring = np.concatenate([CORNERS[:, :1], np.zeros((9, 1)), CORNERS[:, 1:]], axis=1)
    tube = Nurbs(
        np.stack([ring, ring + np.array([0.0, 1.0, 0.0])]), np.tile(WEIGHTS, (2, 1)), (2, 3),
        (np.array([0.0, 0.0, 1.0, 1.0]), CIRCLE_KNOTS),
    )  # fmt: skip
    points = evaluate(tube, np.linspace(0.0, 1.0, 3), np.linspace(0.0, 1.0, 50))
    assert np.abs(np.hypot(points[..., 0], points[..., 2]) - 1.0).max() < 1e-12


def test_a_patch_runs_through_its_grid() -> None:
    grid = np.random.default_rng(1).normal(size=(7, 5, 3))
    patch = through(grid)
    assert np.abs(evaluate(patch, np.linspace(0, 1, 7), np.linspace(0, 1, 5)) - grid).max() < 1e-12
    assert len(vane_patches(with_(flat(), splitCountLeft=2.0, splitWidth=0.08), 1)) == 4  # three left, one right


def test_barbs_are_ten_bytes_each_and_stay_what_they_are() -> None:
    rows = np.tile(with_(defaults(), barbCount=300.0), (50, 1))
    barbs = condense(rows, np.arange(50))
    assert len(barbs.place) == 50 * 600
    assert (barbs.nbytes - barbs.starts.nbytes) * 200 <= 400e6 / 5  # of 10,000 feathers
    alone = condense(rows[:1], np.array([7]))
    part = slice(int(barbs.starts[7]), int(barbs.starts[8]))
    for ours, theirs in zip(alone[1:], barbs[1:], strict=True):
        assert np.array_equal(ours, theirs[part])


def test_barbs_stand_evenly_along_the_shaft_and_end_on_the_outline() -> None:
    values = with_(
        flat(), barbCount=100.0, barbSpacingNoise=0.0, barbLengthNoise=0.0, barbAngleNoise=0.0, barbLiftNoise=0.0,
        vaneEnd=1.0, vaneTipFullness=2.0, vaneWidth=0.2,
    )  # fmt: skip
    curves = expand(values, condense(values[None], np.zeros(1, int)), 0)
    right = curves.points[curves.sides == 1].astype(np.float64)
    gaps = np.diff(right[:, 0, 1])
    assert gaps.min() > 0.0
    assert gaps.std() / gaps.mean() < 0.05
    tips = right[right[:, -1, 1] > 0.56][:, -1]
    off = (tips[:, 1] - 0.56) / 0.44
    assert np.abs(tips[:, 0] - 0.2 * np.sqrt(np.maximum(1.0 - off**2, 0.0))).max() < 1e-3


def test_simplified_lines_stay_within_their_tolerance() -> None:
    at = np.linspace(0.0, 6.0, 300)
    line = np.stack([at, np.sin(at)], axis=1)
    kept = line[kept_of_line(line, 0.01)]
    assert 5 < len(kept) < 60
    assert np.abs(np.interp(at, kept[:, 0], kept[:, 1]) - line[:, 1]).max() < 0.01 * np.sqrt(2.0) + 1e-9


def test_odd_feathers_are_made_without_a_number_that_is_none() -> None:
    low, high = limits()
    for values in (low, high):
        values = with_(values, barbCount=8.0, downHairDensityVane=3.0, afterfeatherHairs=3.0, downHairFringeVane=1.0)
        for level in ("card", "vane", "barbs"):
            mesh = feather_mesh(values, 0, level)  # type: ignore[arg-type]
            assert all(np.isfinite(part).all() for part in mesh[:8])
            assert not len(mesh.triangles) or mesh.triangles.max() < len(mesh.points)
    bald = feather_mesh(with_(defaults(), barbCount=0.0, downHairDensityVane=0.0), 0, "vane")
    assert len(bald.points)
    assert bald.points[:, 1].max() > 0.03
    empty = condense(np.zeros((0, len(NAMES)), np.float32), np.zeros(0, int))
    assert isinstance(empty, Barbs)
    assert len(empty.place) == 0


def test_a_comparison_finds_what_differs() -> None:
    first = preset_values("remex")
    assert compare(first, first).attributes == ()
    assert compare(first, first).outline_most == 0.0
    wider = with_(first, vaneWidthRight=float(first[COLUMNS["vaneWidthRight"]]) + 0.05)
    found = compare(first, wider)
    assert [difference.name for difference in found.attributes] == ["vaneWidthRight"]
    assert 0.03 < found.outline_most <= 0.055
