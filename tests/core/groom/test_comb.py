from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from core.camera import clip_from_world, frame_points
from core.errors import UserError
from core.evaluator import Evaluator
from core.groom.comb import comb
from core.groom.commands import skin_context
from core.groom.plant import plant_scatter
from core.groom.region import View, facing, side_of_line
from core.groom.rows import no_guides
from core.mesh.signed_distance import build_signed_skin, signed_distances
from core.record import freeze
from core.workers import Workers
from tests.bench import comb_targets as bench
from tests.core.groom.small_grooms import (
    ball,
    fur,
    may_change,
    mesh_of,
    mixed,
    radial_depth,
    segment_lengths,
    stays,
    view,
)

FIELDS = {sphere: bench.field_of(sphere) for sphere in (False, True)}


def our_brush(guides, view, path, radius, sphere):
    return comb(guides, view, path, radius, field=FIELDS[sphere])


def passes(brush, seed, strands):
    return [
        bench.passes_needed(target, sphere, brush, seed, strands)[0] for target in bench.TARGETS for sphere in FIELDS
    ]


@pytest.mark.parametrize("seed", [101, 202, 303])
def test_one_pass_reaches_the_styles_of_the_benchmark(seed):
    ours = passes(our_brush, seed, 120)
    assert sum(p == 1 for p in ours) >= 9, ours


def test_half_the_passes_of_a_plain_brush():
    ours, plain = passes(our_brush, 11, 50), passes(bench.plain_brush, 11, 50)
    assert 2 * sum(ours) <= sum(plain), (ours, plain)


def test_no_strand_is_below_the_skin_after_the_benchmark():
    for target in bench.TARGETS:
        _, _, guides = bench.passes_needed(target, True, our_brush, 7, 120)
        x = guides.points.astype(np.float64)
        between = np.concatenate([x[:, 1:] * t + x[:, :-1] * (1 - t) for t in (0.25, 0.5, 0.75, 1.0)], axis=1)
        assert bench.distance(between, True).min() > -1e-4


def test_hair_follows_a_drag_across_it():
    guides = bench.hair(5, False, (0.1, 0.9), False, 200)
    radius = 0.3
    way = np.stack([np.full(61, 0.5), np.linspace(-0.3, 0.3, 61)], axis=1)
    under = np.abs(guides.points[:, 0, 1] + 0.3) < 0.1
    after = comb(
        guides, bench.orthographic(False), bench.to_pixels(way), radius * bench.PIXELS, field=FIELDS[False])

    def crossing(points):
        """Where strands cross x = 0.5."""
        x = points.astype(np.float64)
        return np.array([np.interp(0.5, row[:, 0], row[:, 1]) for row in x])

    follow = (crossing(after.points) - crossing(guides.points))[under] / 0.6
    assert 0.8 < np.median(follow) < 1.25


def test_aligned_hair_slips_through_the_ring():
    guides = bench.hair(5, False, (0.1, 0.9), False, 200)
    lanes = [np.stack([np.linspace(-0.5, 1.6, 80), np.full(80, y)], axis=1) for y in np.arange(-0.96, 0.97, 0.24)]
    v = bench.orthographic(False)

    def run(g):
        for lane in lanes:
            g = comb(g, v, bench.to_pixels(lane), 0.3 * bench.PIXELS, field=FIELDS[False])
        return g

    combed = run(run(guides))
    again = run(combed)
    motion = np.linalg.norm(again.points.astype(np.float64) - combed.points, axis=-1)
    assert np.sqrt((motion**2).mean()) < 0.004
    assert np.linalg.norm(combed.points - guides.points, axis=-1).max() > 0.05  # the first time it did comb


def test_lengths_after_a_thousand_strokes_far_from_the_origin():
    guides = bench.hair(3, False, (0.8, 0.8), True, 20)
    small = guides.points.astype(np.float64) * 0.02 + [1.7, 0.9, -1.1]  # 2 cm of hair on a horse
    guides = guides.replace(points=freeze(small.astype(np.float32)))
    m = np.eye(4)
    m[:3, :3] *= 40.0
    m[:3, 3] = -40.0 * np.array([1.71, 0.9, -1.1])
    m[2] *= -0.01
    v = View(m, 400, 400)
    start = segment_lengths(guides)
    rng = np.random.default_rng(0)
    g = guides
    for _ in range(1000):
        path = rng.uniform(60, 340, 2) + np.cumsum(rng.normal(0, 15, (3, 2)), axis=0)
        g = comb(g, v, path, rng.uniform(30, 120))
    assert (g.points != guides.points).any(axis=(1, 2)).all()
    assert np.abs(segment_lengths(g) / start - 1).max() < 1e-4
    assert np.abs(segment_lengths(g).sum(1) / start.sum(1) - 1).max() < 3e-5


strokes = st.tuples(
    st.integers(0, 2**31), st.floats(5, 150), st.floats(0, 1), st.floats(0, 2), st.floats(0, 1), st.floats(0, 1.2),
    st.booleans(),
)


@settings(max_examples=60, deadline=None)
@given(strokes)
def test_what_is_kept_whatever_the_stroke(stroke):
    seed, radius, grip, lay, tip_first, lift, orthographic = stroke
    rng = np.random.default_rng(seed)
    before = mixed(seed)
    v = view(tuple(rng.normal(size=3)), orthographic)
    path = rng.uniform(50, 350, 2) + np.cumsum(rng.normal(0, 40, (5, 2)), axis=0)
    options = {
        "field": ball().field, "grip": grip, "lay": lay, "tip_first": tip_first, "lift": lift,
        "strength": float(rng.random()),
    }
    after = comb(before, v, path, radius, **options)
    stays(before, after)
    assert np.abs(segment_lengths(after) / segment_lengths(before) - 1).max() < 1e-5
    assert np.array_equal(after.points, comb(before, v, path, radius, **options).points)
    assert after.hold is before.hold
    assert after.frozen is before.frozen


def test_threads_give_the_same_bits():
    workers = Workers(3)
    g = fur(60)
    path = np.array([[100.0, 150.0], [260.0, 220.0]])
    kw = {"field": ball().field}
    split = comb(g, view(), path, 90, ranges=lambda n, call: workers.ranges(n, call, 1), **kw)
    workers.close()
    assert np.array_equal(split.points, comb(g, view(), path, 90, **kw).points)


def test_nothing_reached_is_the_same_object():
    g = fur()
    assert comb(g, view(), [[-500, -500], [-400, -500]], 20) is g
    assert comb(g, view(), [[200, 200], [200, 200]], 90) is g
    assert comb(g, view(), [[100, 200], [300, 200]], 90, strength=0.0) is g
    assert comb(g, view(), [[100, 200], [300, 200]], 90, mask=np.zeros(len(g))) is g
    with pytest.raises(UserError, match="finite"):
        comb(g, view(), [[100, np.nan], [300, 200]], 90)


def test_a_mask_spares_the_far_side_and_one_side_of_a_parting():
    g, v = fur(), view()
    path = [[120, 150], [280, 230]]
    front = facing(g, v, 0.0)
    after = comb(g, v, path, 120, mask=front)
    moved = (after.points != g.points).any(axis=(1, 2))
    assert moved.any()
    assert not moved[~front].any()
    left = side_of_line(g, v, [[200, 50], [200, 350]]) > 0
    moved = (comb(g, v, path, 120, mask=left).points != g.points).any(axis=(1, 2))
    assert moved.any()
    assert not moved[~left].any()


def test_the_grip_moves_the_contact_with_the_pointer_in_perspective():
    g = fur()
    v = view(orthographic=False)
    pixels, _ = v.pixels(g.points)
    normal_on_screen = pixels[:, -1] - pixels[:, 0]
    row = int(np.argmax(np.where(facing(g, v, 0.1), np.linalg.norm(normal_on_screen, axis=1), 0)))  # seen from the side
    middle = pixels[row, 6]
    across = np.array([-normal_on_screen[row, 1], normal_on_screen[row, 0]])
    across *= 12 / np.linalg.norm(across)
    steps = middle + np.linspace(0, 1, 20)[:, None] * across
    after = comb(g, v, steps, 25, lay=0.0, strength=1.0, grip=1.1)
    moved, _ = v.pixels(after.points[row])
    motion = (moved[6] - middle) @ across / (across @ across)
    assert 0.75 < motion < 1.1


@pytest.mark.parametrize("bump", [0.0, 0.12])
def test_neither_points_nor_segments_enter_a_bumpy_skin(bump):
    context = ball(bump)
    g = fur(60, 0.4, bump)
    rng = np.random.default_rng(4)
    for _ in range(60):
        path = rng.uniform(80, 320, 2) + np.cumsum(rng.normal(0, 30, (4, 2)), axis=0)
        g = comb(g, view(tuple(rng.normal(size=3)), bool(rng.integers(2))), path, rng.uniform(20, 100),
                 field=context.field)
    x = g.points.astype(np.float64)
    samples = np.concatenate([x[:, 1:] * t + x[:, :-1] * (1 - t) for t in np.linspace(0.1, 1.0, 10)], axis=1)
    assert (np.linalg.norm(x, axis=-1) < 1.25).mean() > 0.3  # strokes did press hair against the skin
    assert radial_depth(context, samples).max() < 0.02 * context.field.cell


def test_without_a_field_the_same_strokes_do_enter():
    context = ball(0.12)
    g = fur(60, 0.4, 0.12)
    rng = np.random.default_rng(4)
    for _ in range(20):
        path = rng.uniform(80, 320, 2) + np.cumsum(rng.normal(0, 30, (4, 2)), axis=0)
        g = comb(g, view(tuple(rng.normal(size=3))), path, 80)
    assert radial_depth(context, g.points[:, 1:]).max() > 0.05


def test_combing_against_the_hair_bends_no_joint_beyond_the_limit():
    guides = bench.hair(5, False, (0.1, 0.9), False, 200)
    lanes = [np.stack([np.linspace(1.6, -1.6, 80), np.full(80, y)], axis=1) for y in np.arange(-0.96, 0.97, 0.24)]
    worst = {}
    for limit in (0.6, np.pi):
        g = guides
        for lane in lanes:
            g = comb(g, bench.orthographic(False), bench.to_pixels(lane), 60, max_bend=limit)
        q = np.diff(g.points.astype(np.float64), axis=1)
        q /= np.linalg.norm(q, axis=-1, keepdims=True)
        worst[limit] = np.arccos(np.clip((q[:, 1:] * q[:, :-1]).sum(-1), -1, 1)).max()
    assert worst[0.6] < 0.61
    assert worst[np.pi] > 1.2


def test_long_dabs_and_short_ones_agree():
    g = bench.hair(5, False, (0.8, 0.8), True, 100)
    v = bench.orthographic(True)
    way = bench.to_pixels(np.array([[-1.6, 0.35], [2.4, 0.35]]))
    once = comb(g, v, way, 70, field=FIELDS[False])
    dabs = bench.resampled(way, 0.03 * 70)
    many = comb(g, v, dabs, 70, field=FIELDS[False])
    rms = np.sqrt(((once.points.astype(np.float64) - many.points) ** 2).sum(-1).mean())
    assert rms < 0.03


def test_lift_lays_hair_at_an_angle_off_the_skin():
    g = bench.hair(5, False, (0.8, 0.8), True, 100)
    lanes = [np.stack([np.linspace(-1.4, 1.9, 80), np.full(80, y)], axis=1) for y in np.arange(-0.8, 0.81, 0.32)]
    low, high = g, g
    for lane in lanes:
        way = bench.to_pixels(lane)
        low = comb(low, bench.orthographic(False), way, 80, field=FIELDS[False])
        high = comb(high, bench.orthographic(False), way, 80, field=FIELDS[False], lift=0.5)
    rise = [np.arcsin((x[:, -1, 2] - x[:, 5, 2]) / np.linalg.norm(x[:, -1] - x[:, 5], axis=-1))
            for x in (low.points.astype(np.float64), high.points.astype(np.float64))]
    assert np.median(rise[0]) < 0.1
    assert abs(np.median(rise[1]) - 0.5) < 0.1


def test_tip_first_leaves_the_base():
    g = bench.hair(5, False, (0.1, 0.9), False, 100)
    way = bench.to_pixels(np.stack([np.full(40, 0.5), np.linspace(-1.2, 1.2, 40)], axis=1))
    plain = comb(g, bench.orthographic(False), way, 60)
    tips = comb(g, bench.orthographic(False), way, 60, tip_first=1.0)
    base = [np.linalg.norm(a.points[:, 6].astype(np.float64) - g.points[:, 6], axis=-1).mean() for a in (plain, tips)]
    assert base[1] < 0.75 * base[0]


def test_may_change_is_what_moves():
    before = mixed(12)
    g = before
    for x in range(40, 400, 40):
        g = comb(g, view(), [[x, 20], [x, 380]], 60)
    moved = (g.points != before.points).any(axis=(1, 2))
    assert not moved[~may_change(before)].any()
    assert moved[may_change(before)].mean() > 0.9


def test_nothing_enters_the_skin_of_a_real_animal():
    folder = os.environ.get("FILOPLUME_DATA")
    if folder is None:
        pytest.skip("FILOPLUME_DATA is not set")
    cat = trimesh.load(Path(folder, "meshes/odedstein_A/cat/cat-low-resolution.obj"), force="mesh")
    points = (cat.vertices / cat.extents.max()).astype(np.float32)
    context = skin_context(mesh_of(points, cat.faces), Evaluator())
    size = context.skin.diagonal
    g = plant_scatter(no_guides(16), context.skin, 600, seed=1, length=0.05 * size, field=context.field)
    start = segment_lengths(g)
    rng = np.random.default_rng(0)
    for _ in range(60):
        camera = frame_points(points, rng.normal(size=3), orthographic=bool(rng.integers(2)))
        v = View(clip_from_world(camera, 400, 400), 400, 400)
        path = rng.uniform(80, 320, 2) + np.cumsum(rng.normal(0, 25, (4, 2)), axis=0)
        g = comb(g, v, path, rng.uniform(10, 70), field=context.field, mask=facing(g, v))
    x = g.points.astype(np.float64)
    samples = np.concatenate([x[:, 1:] * t + x[:, :-1] * (1 - t) for t in (0.25, 0.5, 0.75, 1.0)], axis=1)
    true = signed_distances(
        build_signed_skin(points, context.skin.triangles.vertices), samples.reshape(-1, 3).astype(np.float32))
    assert true.min() > -0.02 * context.field.cell
    assert np.median(true) < 0.02 * size  # the coat does lie down
    assert np.abs(segment_lengths(g) / start - 1).max() < 1e-4


def test_the_falloff_shapes_the_pull_across_the_ring():
    guides, seen = fur(), view()
    pulled = {}
    for shape in ("smooth", "flat", "linear", "sharp", "constant"):
        after = comb(guides, seen, [(180.0, 200.0), (230.0, 200.0)], 90.0, lay=0.0, shape=shape)
        stays(guides, after)
        pulled[shape] = float(np.abs(after.points - guides.points).sum())
    assert pulled["sharp"] < pulled["linear"] < pulled["constant"]
    assert pulled["smooth"] < pulled["flat"] < pulled["constant"]
    same = comb(guides, seen, [(180.0, 200.0), (230.0, 200.0)], 90.0, lay=0.0)
    assert np.array_equal(same.points, comb(guides, seen, [(180.0, 200.0), (230.0, 200.0)], 90.0, lay=0.0,
                                            shape="flat", flat=0.15).points)
