"""Layouts and uploads: every hair arrives, and changed rows alone are uploaded."""

from __future__ import annotations

import numpy as np
import pytest

from core.camera import project
from tests.viewport.scenes import camera, hairs
from viewport.renderer import Renderer
from viewport.scene import Coat, GuideLines, Scene
from viewport.strand_textures import StrandTextures

W, H = 160, 120


def grid(count: int) -> Coat:
    side = int(np.ceil(np.sqrt(count)))
    i = np.arange(count)
    roots = np.stack([(i % side) / side - 0.5, (i // side) / side - 0.5, 0.0 * i], 1)
    return hairs(roots, roots + np.array([0.0, 0.02, 0.0]), points=16)


@pytest.mark.parametrize("count", [1, 255, 256, 257, 1000])
def test_points_come_back_from_the_card(ctx, count):
    for points in (grid(count).points, np.ascontiguousarray(grid(count).points.transpose(0, 2, 1))):
        textures = StrandTextures(ctx, points)
        for _ in textures.upload(points):
            pass
        raw = np.frombuffer(textures.points.read(), np.float32).reshape(-1, 3 * textures.per_strand)
        assert np.array_equal(raw[:count], points.reshape(count, -1))
        textures.release()


def test_the_last_of_many_hairs_is_drawn_at_its_place(draw):
    coat = grid(1000)
    far = coat.points.copy()
    far[-1, 0] += 0.6
    alpha = draw(Scene(coats=(coat._replace(points=far),)), camera(), W, H)[..., 3]
    x, y = project(camera(), far[-1, :, 8].astype(float), W, H).xy
    assert alpha[round(y) - 1 : round(y) + 2, round(x) - 1 : round(x) + 2].max() > 0.1


def test_both_layouts_draw_the_same(draw):
    coat = grid(300)
    turned = coat._replace(points=np.ascontiguousarray(coat.points.transpose(0, 2, 1)))
    assert np.array_equal(draw(Scene(coats=(coat,)), camera(), W, H), draw(Scene(coats=(turned,)), camera(), W, H))


def test_known_arrays_are_not_uploaded_again_and_named_rows_are(ctx):
    renderer = Renderer(ctx, shadow_side=64)
    target = ctx.framebuffer([ctx.renderbuffer((W, H), 3)])
    coat = grid(1000)
    scene = Scene(coats=(coat,))

    def picture() -> bytes:
        renderer.draw(scene, camera(), target, (W, H))
        return bytes(renderer.coats[0].textures.points.read())

    before = picture()
    first = renderer.coats[0]
    coat.points[300:302] += 0.25  # as an evaluator does, in place
    assert picture() == before
    renderer.rows_changed(coat.points, np.arange(300, 302))
    after = np.frombuffer(picture(), np.float32).reshape(-1, 48)[:1000]
    assert np.array_equal(after, coat.points.reshape(1000, -1))
    scene = Scene(coats=(coat._replace(points=coat.points + np.float32(0.1)),))
    picture()
    assert renderer.coats[0] is first, "an array of the same size takes over the buffers"
    renderer.release()
    target.release()


def test_guides_wear_the_colour_of_their_state(draw):
    points = grid(2).points
    points[:, 1] += np.array([[-0.3], [0.3]], np.float32)
    lines = GuideLines(points, np.array([0, 2], np.uint8), pixels=4.0)
    image = draw(Scene(guides=(lines,)), camera(), W, H)
    for i in (0, 1):
        x, y = project(camera(), points[i, :, 8].astype(float), W, H).xy
        pixel = image[round(y), round(x)]
        np.testing.assert_allclose(pixel[:3] / pixel[3], lines.colors[lines.states[i]], atol=0.01)
        assert pixel[3] == pytest.approx(lines.opacity if i == 0 else 1.0, abs=0.02)


def test_strands_of_an_impossible_shape_are_refused(ctx):
    with pytest.raises(ValueError, match="shape"):
        StrandTextures(ctx, np.zeros((4, 5, 6), np.float32))
    with pytest.raises(ValueError, match="points"):
        StrandTextures(ctx, np.zeros((4, 3, 1), np.float32))
