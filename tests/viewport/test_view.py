"""The interactive view: moving pictures, refinement, and what is copied to the window."""

from __future__ import annotations

import gc

import moderngl
import numpy as np
import pytest

from core.camera import project
from core.overlay import Circle
from core.workspace import Reference, ViewOptions
from tests.viewport.scenes import FLAT, ball, camera, hairs, quad
from viewport.context import collect
from viewport.renderer import Renderer
from viewport.scene import Coat, GuideLines, Look, Scene
from viewport.view import COATED_OPACITY, COATED_PIXELS, FINISHED_SAMPLES, View3D

W, H = 200, 150
BARE = ViewOptions(grid=False, axes=False, hud=False)
WIDE = FLAT._replace(root_width=0.04, tip_width=0.04)


@pytest.fixture
def view(ctx):
    made = View3D(ctx, shadow_side=256)
    yield made
    made.release()


@pytest.fixture
def present(ctx, view):
    """present(overlays, hud, size) -> (H, W, 3) int, what the window shows."""

    def call(overlays=(), hud=(), size=(W, H), of=(W, H)):
        color = ctx.texture(of, 4)
        target = ctx.framebuffer([color])
        target.clear(1.0, 0.0, 1.0, 1.0)
        view.present(target, size, overlays, hud)
        raw = np.frombuffer(target.read(viewport=(0, 0, *size), components=3, alignment=1), np.uint8)
        target.release()
        color.release()
        return raw.reshape(size[1], size[0], 3)[::-1].astype(int)

    return call


def moving(view, present, scene, cam, options=BARE, count=3000):
    view.begin(scene, cam, (W, H), options)
    view.draw_interactive(count)
    return present()


def refined(view):
    parts = list(view.refine())
    assert parts == sorted(parts)
    assert parts[-1] == 1.0
    return parts


@pytest.mark.parametrize("orthographic", [False, True])
def test_hair_is_where_it_projects_and_nowhere_else(view, present, orthographic):
    cam = camera((0.5, 0.6, 3.0), orthographic=orthographic, height=2.0)
    roots, tips = [[-0.5, -0.3, 0.1], [0.2, 0.4, -0.3]], [[-0.1, 0.3, 0.2], [0.6, -0.2, 0.1]]
    coat = hairs(roots, tips, look=WIDE)
    image, empty = moving(view, present, Scene(coats=(coat,)), cam), moving(view, present, Scene(), cam)
    differs = np.abs(image - empty).max(axis=2) > 1
    away = np.full((H, W), np.inf)
    y, x = np.mgrid[:H, :W]
    for hair in coat.points:
        a, b = project(cam, hair[:, [0, -1]].T.astype(float), W, H).xy
        t = np.clip(((x - a[0]) * (b[0] - a[0]) + (y - a[1]) * (b[1] - a[1])) / ((b - a) @ (b - a)), 0, 1)
        away = np.minimum(away, np.hypot(x - a[0] - t * (b[0] - a[0]), y - a[1] - t * (b[1] - a[1])))
        inner = project(cam, hair[:, 3].astype(float), W, H).xy
        assert differs[round(inner[1]), round(inner[0])]
    assert differs[away < 0.5].mean() > 0.95
    assert not differs[away > 8.0].any()


def turned(degrees, eye=4.0):
    angle = np.radians(degrees)
    return camera((eye * np.sin(angle), 0.0, eye * np.cos(angle)))


@pytest.mark.parametrize("finished", [False, True])
def test_a_turning_view_keeps_its_light_a_while_and_looks_as_if_it_had_not(ctx, view, present, finished):
    skin, coat = ball(6000, look=FLAT._replace(root_width=0.012, tip_width=0.004))
    scene = Scene((skin,), (coat,))
    moving(view, present, scene, turned(0.0), count=6000)
    if finished:
        refined(view)
        there = present()
        first = moving(view, present, scene, turned(0.0), count=6000)
        assert first.mean() == pytest.approx(there.mean(), rel=0.02)
    for degrees in (1.0, 3.5, 8.0, 60.0):
        image = moving(view, present, scene, turned(degrees), count=6000)
        fresh = View3D(ctx, shadow_side=256)
        fresh.begin(scene, turned(degrees), (W, H), BARE)
        fresh.draw_interactive(6000)
        color = ctx.texture((W, H), 4)
        target = ctx.framebuffer([color])
        fresh.present(target, (W, H))
        own = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(H, W, 3)[::-1].astype(int)
        fresh.release()
        target.release()
        color.release()
        assert image.mean() == pytest.approx(own.mean(), rel=0.01)
        assert np.abs(image - own).mean() < 2.0
        if degrees >= 8.0:
            assert np.array_equal(image, own), "the light was drawn anew"


def test_all_guides_are_back_when_the_view_stands_still(view, present):
    rng = np.random.default_rng(2)
    roots = np.stack([*rng.uniform(-1.0, 1.0, (2, 2000)), np.zeros(2000)], axis=1)
    up = np.linspace(0.0, 0.05, 8)[None, :, None] * [0.0, 1.0, 0.0]
    lines = GuideLines((roots[:, None] + up).astype(np.float32), np.zeros(2000, np.uint8))
    scene = Scene(guides=(lines,))
    still = moving(view, present, scene, camera())
    moving(view, present, scene, turned(3.0))
    passing = moving(view, present, scene, camera())
    view.draw_interactive(3000)
    after = present()
    assert np.array_equal(after, still)
    assert (passing != still).any(axis=2).mean() > 0.02
    moving(view, present, scene, turned(2.0))
    view.begin(scene, camera(), (W, H), BARE)
    refined(view)
    finished = present()
    view.draw_interactive(3000)  # nothing has moved: the finished picture, whatever was drawn before
    assert np.array_equal(present(), finished)


def test_skin_hides_hair_behind_it_in_a_moving_picture(view, present):
    cam = camera()
    skin = quad(half=0.5)._replace(covered=False)
    behind = hairs([-0.9, 0.0, -0.4], [0.9, 0.0, -0.4], look=WIDE)
    image = moving(view, present, Scene((skin,), (behind,)), cam)
    alone = moving(view, present, Scene((skin,)), cam)
    differs = np.abs(image - alone).max(axis=2) > 3
    edge = project(cam, np.array([[0.5, 0.0, 0.0], [0.9, 0.0, -0.4]]), W, H).xy[:, 0]
    assert differs[H // 2, round(edge[0]) + 3 : round(edge[1]) - 3].all()
    assert not differs[:, W // 2 - 20 : W // 2 + 20].any()


def test_all_hairs_by_rank_draw_the_picture_of_all_hairs(view, present):
    _, coat = ball(2000, look=Look(root_width=0.02, tip_width=0.002))
    order = np.random.default_rng(4).permutation(2000).astype(np.int32)
    by_rank = moving(view, present, Scene(coats=(coat._replace(order=order),)), camera(), count=2000)
    by_row = moving(view, present, Scene(coats=(coat,)), camera(), count=9999)
    assert np.abs(by_rank - by_row).mean() < 0.05, "but for hairs at the very same depth"
    few = moving(view, present, Scene(coats=(coat._replace(order=order[:100]),)), camera(), count=2000)
    assert np.abs(few - by_row).mean() > 2.0


def test_a_sparse_coat_looks_like_the_coat_from_afar(view, present):
    skin, coat = ball(20_000, look=FLAT._replace(root_width=0.012, tip_width=0.004))
    scene = Scene((skin,), (coat._replace(order=np.random.default_rng(1).permutation(20_000).astype(np.int32)),))
    full, sparse = (moving(view, present, scene, camera(), count=n) for n in (20_000, 2000))
    middle = np.s_[H // 2 - 30 : H // 2 + 30, W // 2 - 30 : W // 2 + 30]
    assert sparse[middle].mean() == pytest.approx(full[middle].mean(), rel=0.35)


def test_named_rows_are_drawn_anew_and_change_only_their_pixels(view, present):
    roots = np.stack([np.linspace(-0.8, 0.8, 9), np.full(9, -0.2), np.zeros(9)], 1)
    coat = hairs(roots, roots + np.array([0.0, 0.4, 0.0]), look=WIDE)
    scene, cam = Scene(coats=(coat,)), camera()
    before = moving(view, present, scene, cam)
    coat.points[6, 1] += 0.25
    view.draw_interactive(3000)
    assert np.array_equal(present(), before), "nobody said so"
    view.rows_changed(coat.points, np.array([6]))
    view.draw_interactive(3000)
    changed = np.abs(present() - before).max(axis=2) > 0
    x = project(cam, coat.points[6, :, 0].astype(float), W, H).xy[0]
    columns = np.flatnonzero(changed.any(axis=0))
    assert columns.min() > x - 8
    assert columns.max() < x + 8
    assert changed.sum() > 20


def test_the_refined_picture_is_that_of_the_renderer_to_the_bit(ctx, view, present):
    skin, coat = ball(3000, look=Look(root_width=0.02, tip_width=0.002))
    guides = GuideLines(coat.points[:50], np.zeros(50, np.uint8))
    scene = Scene((skin,), (coat,), (guides,))
    moving(view, present, scene, camera())
    parts = refined(view)
    assert len(parts) > 2
    assert view.picture_changed
    fine = present()
    assert not view.picture_changed
    renderer = Renderer(ctx, shadow_side=256)
    target = ctx.framebuffer([ctx.renderbuffer((W, H), 4)])
    discreet = guides._replace(pixels=COATED_PIXELS, opacity=COATED_OPACITY)  # over a coat
    renderer.draw(scene._replace(guides=(discreet,)), camera(), target, (W, H), FINISHED_SAMPLES)
    expected = np.frombuffer(target.read(alignment=1), np.uint8).reshape(H, W, 3)[::-1]
    assert np.array_equal(fine, expected)
    renderer.release()
    target.release()


def test_rows_named_in_a_stroke_are_in_the_refined_picture(view, present):
    _, coat = ball(2000)
    scene = Scene(coats=(coat,))
    moving(view, present, scene, camera())
    refined(view)
    rows = np.flatnonzero(coat.normals[:, 0] > 0.5)
    coat.points[rows, 1] += 0.4
    view.rows_changed(coat.points, rows)
    view.draw_interactive(2000)
    refined(view)
    stroked = present()
    fresh = coat._replace(points=coat.points.copy())
    moving(view, present, Scene(coats=(fresh,)), camera())
    refined(view)
    assert np.array_equal(stroked, present())


def test_a_change_ends_the_refinement_and_the_pointer_does_not(view, present):
    _, coat = ball(2000)
    scene = Scene(coats=(coat,))

    def started():
        moving(view, present, scene, camera())
        refining = view.refine()
        assert next(refining) < 1.0
        return refining

    refining = started()
    assert not view.begin(Scene(coats=(coat._replace(),)), camera(), (W, H), BARE), "the same arrays"
    present([Circle(50, 50, 20)], ["words"])
    assert next(refining, None) is not None
    for change in (
        lambda: view.begin(scene, camera((0.1, 0.0, 4.0)), (W, H), BARE),
        lambda: view.begin(scene, camera(), (W + 1, H), BARE),
        lambda: view.begin(Scene(coats=(coat._replace(points=coat.points.copy()),)), camera(), (W, H), BARE),
        lambda: view.begin(scene, camera(), (W, H), ViewOptions(grid=True)),
        lambda: view.rows_changed(coat.points, np.array([3])),
        lambda: view.draw_interactive(1000),
    ):
        refining = started()
        change()
        assert next(refining, None) is None


def test_an_abandoned_refinement_leaves_the_next_one_whole(view, present):
    skin, coat = ball(2000)
    scene = Scene((skin,), (coat,))
    moving(view, present, scene, camera())
    refined(view)
    expected = present()
    for stop in (1, 2, 4, 8):
        moving(view, present, Scene((skin,), (coat._replace(points=coat.points + np.float32(0.2)),)), camera())
        for _, _ in zip(range(stop), view.refine(), strict=False):
            present()
        moving(view, present, scene, camera())
        refined(view)
        assert np.array_equal(present(), expected)


def test_the_picture_is_copied_whatever_size_the_framebuffer_claims(view, present):
    _, coat = ball(500)
    image = moving(view, present, Scene(coats=(coat,)), camera())
    assert np.array_equal(present(of=(W + 60, H + 10)), image)


def test_overlays_and_words_lie_over_the_picture_and_go_again(view, present):
    clean = moving(view, present, Scene(), camera(), BARE.replace(hud=True))
    marked = present([Circle(100.0, 80.0, 30.0, "accent", 3.0)], ["a line", ("trouble", "trouble")])
    assert np.abs(marked[80, 130] - clean[80, 130]).max() > 60
    assert np.abs(marked[80, 100] - clean[80, 100]).max() <= 1
    assert np.abs(marked[:45, :80] - clean[:45, :80]).max() > 100
    assert np.array_equal(present(), clean)


def test_hair_and_guides_can_be_hidden(view, present):
    coat = hairs([[-0.5, -0.3, 0.0]], [[-0.5, 0.3, 0.0]], look=WIDE)
    guides = GuideLines(hairs([[0.5, -0.3, 0.0]], [[0.5, 0.3, 0.0]]).points, np.zeros(1, np.uint8), pixels=4.0)
    scene, cam = Scene(coats=(coat,), guides=(guides,)), camera()
    xs = [round(project(cam, np.array([x, 0.0, 0.0]), W, H).xy[0]) for x in (-0.5, 0.5)]
    empty = moving(view, present, Scene(), cam)
    for hair, lines in ((True, True), (True, False), (False, True), (False, False)):
        image = moving(view, present, scene, cam, BARE.replace(hair=hair, guides=lines))
        assert [np.abs(image[H // 2, x] - empty[H // 2, x]).max() > 10 for x in xs] == [hair, lines]
        refined(view)
        assert [np.abs(present()[H // 2, x] - empty[H // 2, x]).max() > 10 for x in xs] == [hair, lines]


def test_a_plate_is_letterboxed_and_references_are_pinned(ctx):
    images = {
        "plate": np.tile(np.array([200, 40, 30], np.uint8), (50, 100, 1)),
        "note": np.tile(np.array([20, 230, 40, 255], np.uint8), (10, 20, 1)),
    }
    view = View3D(ctx, image=images.get, shadow_side=64)
    note = Reference(path="note", x=0.5, y=0.1, width=0.2, opacity=0.5)
    options = BARE.replace(background="plate", references=(note, Reference(path="missing")), hud=True)
    target = ctx.framebuffer([ctx.texture((W, H), 4)])
    view.begin(Scene(), camera(), (W, H), options)
    for finish in (False, True):
        view.draw_interactive(0)
        if finish:
            refined(view)
        view.present(target, (W, H))
        image = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(H, W, 3)[::-1].astype(int)
        assert np.abs(image[75, 20] - [200, 40, 30]).max() <= 2
        assert np.abs(image[H - 10, 100] - [200, 40, 30]).max() > 20, "the plate is twice as wide as tall: bars"
        assert np.abs(image[25, 120] - [110, 135, 35]).max() <= 40
        assert image[25, 120, 1] > 120, "a reference at half its opacity"
        assert image[25, 80, 1] < 70
    assert view.pictures.unreadable == ["missing"]
    view.begin(Scene(), camera(), (W, H), BARE)
    assert view.pictures.unreadable == []
    view.release()
    target.release()


def alive() -> int:
    kinds = (
        moderngl.Texture, moderngl.Buffer, moderngl.Framebuffer, moderngl.Renderbuffer, moderngl.VertexArray,
        moderngl.Program,
    )  # fmt: skip
    gc.collect()
    # type() and not isinstance(), which asks what dead proxies of others stood for
    return sum(type(o) in kinds and not isinstance(o.mglo, moderngl.InvalidObject) for o in gc.get_objects())


def test_two_hundred_scenes_leave_nothing_behind(ctx, view, present):
    skin, coat = ball(300)
    guides = GuideLines(coat.points[:40], np.zeros(40, np.uint8), normals=coat.normals[:40])
    counts = []
    for turn in range(200):
        n = 100 + turn % 7
        part = Coat(coat.points[:n].copy(), coat.ids[:n], coat.normals[:n], coat.look)
        scene = Scene((skin._replace(points=skin.points.copy(), ghost=turn % 3 == 0),), (part,), (guides,))
        options = ViewOptions(wire=turn % 2 == 0, shading=("shaded", "matcap", "wire", "lines")[turn % 4])
        view.begin(scene, camera((0.01 * turn, 0.0, 4.0)), (64 + turn % 3, 48), options)
        view.draw_interactive(50)
        if turn % 20 == 19:
            list(view.refine())
        present(size=(64, 48), of=(80, 60), hud=[f"{turn % 10} words"])
        if turn % 60 == 59:
            counts.append(alive())
    assert len(set(counts)) == 1, counts
    view.release()
    gc.collect()
    assert collect(ctx) == 0, "something was dropped without being released"
    assert alive() == 0
