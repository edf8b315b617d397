"""The renderer as a whole: skin at its place, background, tiles, cancelling, repeating, nothing left behind."""

from __future__ import annotations

import gc
import os
from pathlib import Path

import numpy as np
import pytest

from core.camera import project
from tests.viewport.scenes import FLAT, ball, camera, hairs
from viewport.context import collect
from viewport.picture import render
from viewport.renderer import Renderer
from viewport.scene import Coat, GuideLines, Look, Scene, Surface

W, H = 200, 150


def test_a_triangle_covers_the_pixels_its_projection_says(draw):
    cam = camera(eye=(0.6, 0.9, 3.0))
    points = np.array([[-0.8, -0.5, 0.2], [0.7, -0.3, -0.3], [0.1, 0.8, 0.4]], np.float32)
    normals = np.tile(np.array([0, 0, 1], np.float32), (3, 1))
    image = draw(Scene(surfaces=(Surface(points, normals, np.array([[0, 1, 2]], np.int32)),)), cam, W, H)
    corners = project(cam, points.astype(float), W, H).xy
    y, x = np.mgrid[:H, :W]
    inside = np.full((H, W), np.inf)  # distance from the nearest edge, positive inside
    for i in range(3):
        (ax, ay), (bx, by) = corners[i], corners[(i + 1) % 3]
        inside = np.minimum(inside, ((by - ay) * (x - ax) - (bx - ax) * (y - ay)) / np.hypot(bx - ax, by - ay))
    clear = np.abs(inside) > 0.05
    assert np.count_nonzero(inside > 0) > 1000
    assert np.array_equal(image[..., 3][clear] > 0.5, inside[clear] > 0)


def test_an_empty_scene_is_its_background(ctx):
    empty_coat = Coat(np.zeros((0, 3, 16), np.float32), np.zeros(0, np.int32), np.zeros((0, 3), np.float32))
    empty_guides = GuideLines(np.zeros((0, 4, 3), np.float32), np.zeros(0, np.uint8))
    nothing = np.zeros((0, 3), np.float32)
    empty_mesh = Surface(nothing, nothing, np.zeros((0, 3), np.int32))
    for scene in (Scene(), Scene(surfaces=(empty_mesh,), coats=(empty_coat,), guides=(empty_guides,))):
        image = render(scene, camera(), 64, 256, 1, ctx=ctx).astype(int)
        assert np.abs(image[0] - [0x3A, 0x3B, 0x3F]).max() <= 1
        assert np.abs(image[-1] - [0x1F, 0x20, 0x23]).max() <= 1
        assert np.abs(image - image[:, :1]).max() <= 1


def test_the_same_picture_twice_is_the_same_to_the_bit(ctx):
    skin, coat = ball(look=Look(root_width=0.01, tip_width=0.001))
    scene = Scene(surfaces=(skin,), coats=(coat,))
    assert np.array_equal(render(scene, camera(), W, H, 2, ctx=ctx), render(scene, camera(), W, H, 2, ctx=ctx))


def test_tiles_join_without_a_seam(ctx):
    skin, coat = ball(look=Look(root_width=0.02, tip_width=0.005))
    scene, target, images = Scene(surfaces=(skin,), coats=(coat,)), ctx.framebuffer([ctx.texture((W, H), 4)]), []
    for largest in (4096, 130):
        renderer = Renderer(ctx, largest_tile=largest)
        renderer.draw(scene, camera(), target, (W, H), 2)
        assert renderer.tile is not None
        images.append(np.frombuffer(target.read(components=3), np.uint8).astype(int))
        renderer.release()
    whole, tiled = images
    assert whole.std() > 20
    assert np.abs(whole - tiled).max() <= 12  # a depth test may fall the other way
    assert np.abs(whole - tiled).mean() < 0.02
    target.release()


def test_pictures_of_many_sizes_share_the_memory_they_are_painted_in(ctx):
    renderer = Renderer(ctx, shadow_side=64)
    target = ctx.framebuffer([ctx.texture((1700, 1100), 4)])

    def tile(width, height, samples):
        renderer.draw(Scene(), camera(), target, (width, height), samples)
        return renderer.tile

    first = tile(200, 120, 1)
    assert tile(100, 80, 2) is first, "a window paints with one sample and with four in turns"
    assert tile(250, 30, 1) is first
    large = tile(1700, 1100, 1)
    assert large is not first
    assert tile(900, 700, 1) is large
    assert tile(200, 120, 1).light.size == first.light.size, "memory of a large picture is not kept for small ones"
    renderer.release()
    assert renderer.tile is None
    target.release()


def test_more_samples_change_edges_only(ctx):
    skin, coat = ball(look=Look(root_width=0.02, tip_width=0.005))
    scene = Scene(surfaces=(skin,), coats=(coat,))
    one, three = (render(scene, camera(), W, H, n, ctx=ctx).astype(float) for n in (1, 3))
    assert abs(one.mean() - three.mean()) < 0.8
    assert 0.1 < np.abs(one - three).mean() < 8.0


def test_hair_behind_and_through_the_eye_does_no_harm(draw):
    look = FLAT._replace(root_width=0.01, tip_width=0.01)
    roots, tips = [[0.1, 0, 2.0], [0, 0, 6.0], [0, 0, 4.0]], [[0.1, 0, 7.0], [0, 1, 8.0], [0, 0, 4.0]]
    coat = hairs(roots, tips, look=look)
    image = draw(Scene(coats=(coat,)), camera(), W, H)
    assert np.isfinite(image).all()
    assert image[..., 3].mean() < 0.5


def test_degenerate_hair_and_skin_do_no_harm(draw):
    roots = np.array([[0.2, 0.1, 0.0], [-0.2, 0.0, 0.0], [0.0, 0.0, 0.0]])
    coat = hairs(roots, roots + np.array([[0, 0, 0], [0, 0, 0], [0, 0.4, 0]]), normals=np.zeros((3, 3)))
    flat = np.zeros((3, 3), np.float32)
    needle = Surface(flat, flat, np.array([[0, 1, 2], [0, 0, 0]], np.int32))
    image = draw(Scene(surfaces=(needle,), coats=(coat,)), camera(), W, H)
    assert np.isfinite(image).all()
    assert (image >= 0.0).all()
    assert image[..., 3].max() > 0.2


class Stop(Exception):
    pass


def test_progress_rises_to_one_and_an_exception_in_it_stops_the_drawing(ctx):
    skin, coat = ball()
    scene = Scene(surfaces=(skin,), coats=(coat,))
    told: list[float] = []
    full = render(scene, camera(), W, H, 1, told.append, ctx)
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert len(told) >= 4

    def stop(part: float) -> None:
        if part > 0.2:
            raise Stop

    renderer = Renderer(ctx)
    color = ctx.renderbuffer((W, H), 3)
    target = ctx.framebuffer([color])
    with pytest.raises(Stop):
        renderer.draw(scene, camera(), target, (W, H), 1, stop)
    renderer.draw(scene, camera(), target, (W, H), 1)
    again = np.frombuffer(target.read(alignment=1), np.uint8).reshape(H, W, 3)[::-1]
    assert np.array_equal(again, full)
    for thing in (renderer, target, color):
        thing.release()


def resident_megabytes() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def test_twenty_renderers_leave_nothing_behind(ctx):
    skin, coat = ball(count=300)
    guides = GuideLines(coat.points[:20], np.zeros(20, np.uint8))
    color = ctx.renderbuffer((W, H), 3)
    target = ctx.framebuffer([color])
    memory = 0.0
    for turn in range(20):
        renderer = Renderer(ctx, shadow_side=512)
        renderer.draw(Scene((skin,), (coat,), (guides,)), camera(), target, (W, H))
        other = coat._replace(points=coat.points[:100], ids=coat.ids[:100], normals=coat.normals[:100])
        renderer.draw(Scene((), (other,), ()), camera(), target, (W - 20, H))
        renderer.release()
        del renderer
        gc.collect()
        assert collect(ctx) == 0, "something was dropped without being released"
        if turn == 4:
            memory = resident_megabytes()
    assert resident_megabytes() - memory < 25.0  # leaking the maps of the light alone would be 60
    target.release()
    color.release()
