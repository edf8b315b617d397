"""Meshes in every manner, ghosts and the ground."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from core.camera import frame_points, project
from core.feather.levels import feather_mesh
from core.feather.presets import preset_values
from core.workspace import SHADINGS, ViewOptions
from tests.viewport.scenes import ball, camera, quad
from viewport.drawables import feathers
from viewport.drawables.grid import ground_axes
from viewport.drawables.mesh import map_colors, triangle_edges
from viewport.renderer import Renderer
from viewport.scene import Scene
from viewport.solids import PLAIN, Solids, lit_uniforms

W, H = 200, 150
BARE = ViewOptions(grid=False, axes=False)
SIDES = np.array([[0, 1], [1, 2], [2, 3], [3, 0]], np.int32)


@pytest.fixture
def picture(ctx):
    """picture(scene, camera, options) -> (H, W, 3) int of a finished picture, top row first."""
    renderer = Renderer(ctx, shadow_side=128)
    color = ctx.texture((W, H), 4)
    target = ctx.framebuffer([color])

    def call(scene, cam, options=BARE, samples=1):
        renderer.draw(scene, cam, target, (W, H), samples, options=options)
        return np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(H, W, 3)[::-1].astype(int)

    yield call
    for thing in (renderer, target, color):
        thing.release()


def pixel(cam, point):
    x, y = project(cam, np.asarray(point, float), W, H).xy
    return round(float(y)), round(float(x))


@pytest.mark.parametrize("shading", ["wire", "lines"])
def test_a_wire_shows_edges_of_polygons_without_the_diagonal(picture, shading):
    cam = camera()
    options = BARE.replace(shading=shading)
    skin = quad()
    side, middle, off = pixel(cam, (1.0, 0.3, 0.0)), pixel(cam, (0.4, 0.4, 0.0)), pixel(cam, (-0.4, 0.5, 0.0))
    for edges, diagonal in ((SIDES, False), (None, True)):
        image = picture(Scene((skin._replace(edges=edges),)), cam, options)
        near = image[side[0] - 1 : side[0] + 2, side[1] - 1 : side[1] + 2]
        assert np.abs(near - image[off]).max() > 40
        near = image[middle[0] - 1 : middle[0] + 2, middle[1] - 1 : middle[1] + 2]
        assert (np.abs(near - image[off]).max() > 40) == diagonal


def test_hidden_lines_are_hidden_and_those_of_a_wire_are_not(picture):
    cam = camera()
    back, front = quad(z=-0.5, half=0.5)._replace(edges=SIDES), quad(z=0.5)._replace(edges=SIDES)
    y, x = pixel(cam, (0.5, 0.1, -0.5))
    for shading, seen in (("wire", True), ("lines", False)):
        image = picture(Scene((back, front)), cam, BARE.replace(shading=shading))
        assert (np.abs(image[y, x - 2 : x + 3] - image[y, x - 8]).max() > 40) == seen


def test_a_wire_may_lie_over_shaded_skin(picture):
    cam = camera()
    scene = Scene((quad()._replace(edges=SIDES),))
    plain, wired = picture(scene, cam), picture(scene, cam, BARE.replace(wire=True))
    differs = np.abs(plain - wired).max(axis=2) > 8
    assert differs[pixel(cam, (1.0, 0.3, 0.0))[0]].any()
    assert not differs[pixel(cam, (0.4, 0.4, 0.0))]
    assert differs.mean() < 0.05


def test_every_shading_draws_skin_at_its_place_and_clay_follows_the_view(picture):
    skin, _ = ball(1)
    images = {}
    for shading in SHADINGS:
        images[shading] = picture(Scene((skin,)), camera(), BARE.replace(shading=shading))
        empty = picture(Scene(), camera())
        assert np.abs(images[shading] - empty).max(axis=2)[H // 2 - 20 : H // 2 + 20, W // 2].max() > 10
    turned = picture(Scene((skin,)), camera((4.0, 0.0, 0.0)), BARE.replace(shading="matcap"))
    assert np.abs(turned - images["matcap"]).mean() < 0.5, "a ball of clay looks the same from all sides"
    assert images["matcap"][40, 85].sum() > images["matcap"][110, 115].sum() + 100


def test_a_map_is_shown_in_even_steps_of_colour(picture):
    cam = camera()
    skin = quad()
    values = np.array([0.0, 1.0, 1.0, 0.0], np.float32)
    image = picture(Scene((skin._replace(values=values),)), cam)
    left, right = image[pixel(cam, (-0.95, 0.0, 0.0))], image[pixel(cam, (0.95, 0.0, 0.0))]
    assert left[2] > left[1] + 20, "violet where it is 0"
    assert right[0] > right[2] + 60, "yellow where it is 1"
    row = image[H // 2, pixel(cam, (-0.9, 0, 0))[1] : pixel(cam, (0.9, 0, 0))[1]]
    lightness = cv2.cvtColor(row[None].astype(np.uint8), cv2.COLOR_RGB2LAB)[0, :, 0].astype(int)
    assert np.diff(lightness).min() >= -2, "lighter means more everywhere"
    assert map_colors().shape == (256, 4)


def test_a_ghost_lets_through_what_is_behind_it_and_casts_no_shadow(picture):
    cam = camera()
    behind = quad(z=-0.5, half=0.4, color=(0.9, 0.05, 0.05))
    ghost = quad(z=0.5, half=0.8, color=(0.1, 0.3, 0.9))._replace(ghost=True)
    alone, both = picture(Scene((behind,)), cam), picture(Scene((behind, ghost)), cam)
    middle, beside = pixel(cam, (0.0, 0.0, 0.0)), pixel(cam, (0.6, 0.6, 0.5))
    assert 3 < np.abs(both[middle] - alone[middle]).max() < 80
    assert abs(both[middle][0] - alone[middle][0]) < 12, "no shadow falls on the red behind it"
    assert both[beside][2] > alone[beside][2] + 3


def test_the_grid_has_lines_on_the_ground_and_hides_behind_things(picture):
    cam = camera((3.0, 2.0, 4.0))
    scene = Scene((quad(z=0.0, half=0.3),))
    bare, grid = picture(scene, cam, samples=2), picture(scene, cam, BARE.replace(grid=True), samples=2)
    gained = np.abs(grid - bare).max(axis=2)
    on_axes = [(-0.9, 0.0, 0.0), (1.3, 0.0, 0.0), (0.0, 0.0, -1.3), (0.0, 0.0, 1.1)]
    for point in on_axes:
        y, x = pixel(cam, point)
        assert gained[y - 1 : y + 2, x - 1 : x + 2].max() > 10
    small = quad(z=0.0, half=1e-3)  # so that the ground lies in the same place
    free = np.abs(picture(Scene((small,)), cam, BARE.replace(grid=True), 2) - picture(Scene((small,)), cam, samples=2))
    corners = np.array([[-0.28, -0.28, 0.0], [0.28, -0.28, 0.0], [0.28, 0.28, 0.0], [-0.28, 0.28, 0.0]])
    inside = np.zeros((H, W), np.uint8)
    cv2.fillConvexPoly(inside, np.rint(project(cam, corners, W, H).xy).astype(np.int32), 1)
    upper = inside.astype(bool) & (np.arange(H)[:, None] < pixel(cam, (0.0, 0.05, 0.0))[0])
    assert free.max(axis=2)[upper].max() > 3, "there are lines behind it"
    assert gained[upper].max() <= 1
    red, blue = grid[pixel(cam, on_axes[0])], grid[pixel(cam, on_axes[2])]
    assert red[0] > red[2] + 8
    assert blue[2] > blue[0] + 8
    horizon = pixel(cam, (-3000.0, 0.0, -4000.0))[0]
    assert gained[: max(horizon, 1)].max() <= 1


def test_the_grid_adapts_its_step_and_faces_orthographic_views(picture):
    for distance in (0.02, 1.0, 50.0, 3000.0):
        cam = camera((0.5 * distance, 0.5 * distance, distance))
        cam = cam.replace(near=1e-3 * distance, far=100.0 * distance)
        skin = quad()
        scene = Scene((skin._replace(points=skin.points * np.float32(1e-4 * distance)),))
        bare, grid = picture(scene, cam), picture(scene, cam, BARE.replace(grid=True))
        lines = np.abs(grid - bare).max(axis=2) > 2
        assert 0.03 < lines[H // 2 :].mean() < 0.7, "neither none nor a carpet"
    for eye, axes in (((0, 0, 5), "xy"), ((5, 0, 0), "zy"), ((3, 4, 5), "xz")):
        found = ground_axes(camera(eye, orthographic=True))
        assert "".join("xyz"[int(np.argmax(axis))] for axis in found) == axes


@pytest.fixture
def both_ways(ctx):
    """both_ways(scene, camera, draw(solids, target, uniforms, quick), **uniforms) -> finely and quickly, (H, W, 4)."""
    things = [Renderer(ctx, shadow_side=256), ctx.texture((W, H), 4, dtype="f4"), ctx.depth_renderbuffer((W, H))]
    renderer, color, depth = things
    target = ctx.framebuffer([color], depth)

    def call(scene, cam, draw, **uniforms):
        steps, images = renderer.prepare(scene, cam, (W, H)), []
        while True:
            try:
                next(steps)
            except StopIteration as end:
                lit = lit_uniforms(scene, cam, end.value.uniforms | uniforms)
                break
        assert isinstance(renderer.solids, Solids)
        renderer.solids.upload(scene, quick=True)
        for quick in (False, True):
            target.clear(depth=1.0)
            renderer.light_maps.bind()
            draw(renderer.solids, target, lit, quick)
            images.append(np.frombuffer(color.read(), np.float32).reshape(H, W, 4).copy())
        return images

    yield call
    for thing in (target, *things):
        thing.release()


def test_quick_light_at_the_vertices_is_that_of_every_sample(both_ways):
    skin, _ = ball(1)
    skin = skin._replace(color=(0.4, 0.35, 0.3), covered=False)
    scene = Scene((skin,))
    fine, quick = both_ways(
        scene, camera(), lambda solids, target, lit, quick: solids.fill(scene, target, lit, PLAIN, quick))
    assert np.array_equal(fine[..., 3] > 0.5, quick[..., 3] > 0.5)
    lit = fine[..., 3] > 0
    assert np.abs(fine - quick)[lit].mean() < 0.03 * fine[lit].mean()


@pytest.mark.parametrize("pictured", [False, True])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_feathers_lit_at_their_vertices_look_like_those_lit_at_every_sample(both_ways, pictured, side):
    mesh = feather_mesh(preset_values("goldfinch-breast"), 0, "vane")
    if pictured:  # brown, with a bar across
        photograph = np.full((16, 8, 4), (150, 110, 60, 255), np.uint8)
        photograph[6:9, :, :3] = 40
        low, high = mesh.flat.min(axis=0), mesh.flat.max(axis=0)
        mesh = mesh._replace(picture=photograph, corner=tuple(low), extent=tuple(high - low))
    scene = Scene(feathers=(mesh,), quick_feathers=(mesh,))

    def draw(solids, target, lit, quick):
        for _ in solids.plumage(target, lit, quick):
            pass

    fine, quick = both_ways(scene, frame_points(mesh.points, (0.3, 0.2, side), W / H), draw, to_display=True)
    covered = (fine[..., 3] > 0.5) & (quick[..., 3] > 0.5)
    assert covered.sum() > 2000
    assert np.array_equal(fine[..., 3] > 0.5, quick[..., 3] > 0.5)
    assert np.abs(fine - quick)[covered].mean() < (0.06 if pictured else 0.03)
    assert np.ptp(quick[covered][:, 0]) > 0.2


def test_edges_of_triangles_are_found_once():
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    assert triangle_edges(triangles).tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    assert triangle_edges(np.zeros((0, 3), np.int32)).shape == (0, 2)


def test_feathers_are_drawn_a_few_triangles_at_a_time_and_look_the_same(ctx, monkeypatch):
    mesh = feather_mesh(preset_values("goldfinch-breast"), 0, "vane")
    scene, cam = Scene(feathers=(mesh,)), frame_points(mesh.points, (0.3, 0.2, -1.0), W / H)
    target = ctx.framebuffer([ctx.texture((W, H), 4)])
    renderer, images, counts = Renderer(ctx, shadow_side=128), [], []
    renderer.draw(scene, cam, target, (W, H))  # the first picture also makes room
    for at_once in (1 << 20, len(mesh.triangles) // 7):
        monkeypatch.setattr(feathers, "AT_ONCE", at_once)
        counts.append(sum(1 for _ in renderer.steps(scene, cam, target, (W, H))))
        images.append(target.read(components=3, alignment=1))
    renderer.release()
    assert np.ptp(np.frombuffer(images[0], np.uint8)) > 50
    assert images[0] == images[1]
    assert counts[1] >= counts[0] + 2 * 6  # the map of shadows and the picture
