"""Marks and words over a picture, against geometry."""

from __future__ import annotations

import gc

import moderngl
import numpy as np
import pytest

from core.camera import Camera, look_at
from core.overlay import Circle, Fill, Label, Marker, Polyline
from viewport.context import collect
from viewport.hud import KEPT_WORDS, ScreenImages, plain_text
from viewport.overlay_drawing import HALO_WIDTH, TONES, MarkDrawing, Words, axes_marks, labels, marks

W, H = 240, 160
WHITE = {**TONES, "plain": (255, 255, 255)}


@pytest.fixture
def drawn(ctx):
    """drawn(rows) -> (H, W) float, green of marks in white over black without their halos, top row first."""
    color = ctx.texture((W, H), 4)
    target = ctx.framebuffer([color])
    drawing = MarkDrawing(ctx)

    def call(overlays, halo=False):
        rows = marks(overlays, WHITE)
        target.use()
        target.clear()
        drawing.draw(rows if halo else rows[rows[:, -1] == 1.0], (W, H))
        return np.frombuffer(target.read(components=4), np.uint8).reshape(H, W, 4)[::-1, :, 1] / 255.0

    yield call
    for thing in (drawing, target, color):
        thing.release()


@pytest.mark.parametrize(("radius", "width"), [(40.0, 1.5), (62.3, 4.0), (5.0, 1.0)])
def test_a_circle_covers_its_ring(drawn, radius, width):
    x, y = 121.3, 78.6
    image = drawn([Circle(x, y, radius, "plain", width)])
    rows, columns = np.mgrid[:H, :W]
    away = np.abs(np.hypot(columns - x, rows - y) - radius)
    assert image.sum() == pytest.approx(2.0 * np.pi * radius * width, rel=0.02)
    assert (image[away > 0.5 * width + 0.75] == 0.0).all()
    assert (image[away < 0.5 * width - 0.55] > 0.99).all()


def test_a_line_covers_its_length_and_a_dashed_one_part_of_it(drawn):
    points = np.array([[20.0, 30.0], [200.0, 30.0], [200.0, 130.0]])
    length = 280.0
    full = drawn([Polyline(points, "plain", 2.0)])
    assert full.sum() == pytest.approx(2.0 * length, rel=0.02)
    assert full[30, 110] > 0.95
    assert full[80, 200] > 0.95
    assert full[80, 110] == 0.0
    dashed = drawn([Polyline(points, "plain", 2.0, dashed=True)])
    assert dashed.sum() == pytest.approx(2.0 * length * 6.0 / 11.0, rel=0.1)
    closed = drawn([Polyline(points, "plain", 2.0, closed=True)])
    assert closed.sum() == pytest.approx(2.0 * (length + np.hypot(180.0, 100.0)), rel=0.02)
    assert closed[80, 110] > 0.9


def test_a_marker_is_a_cross_of_its_size(drawn):
    image = drawn([Marker(100.0, 60.0, 21.0, "plain")])
    lit_rows, lit_columns = np.nonzero(image > 0.3)
    assert (lit_rows.min(), lit_rows.max()) == (50, 70)
    assert (lit_columns.min(), lit_columns.max()) == (90, 110)
    assert image[55, 95] == 0.0


def test_lines_wear_a_dark_edge_and_tones_their_colours():
    rows = marks([Circle(1.0, 2.0, 3.0, "accent", 2.0)])
    assert len(rows) == 2
    assert rows[0, 5] == rows[1, 5] + HALO_WIDTH
    np.testing.assert_allclose(rows[1, 8:11] * 255.0, TONES["accent"], atol=0.01)
    assert rows[0, 8:11].max() < 0.1


def test_what_cannot_be_drawn_is_left_out(drawn):
    nothing = np.zeros((0, 2))
    overlays = [Polyline(nothing), Polyline(np.array([[np.nan, 1.0], [5.0, 5.0]])), Label(1, 2, "words")]
    assert len(marks(overlays)) == 0
    assert drawn(overlays).max() == 0.0
    assert drawn([Polyline(np.array([[60.0, 70.0]]), "plain", 3.0)])[70, 60] > 0.9, "a single point is a dot"


def test_axes_point_where_the_world_axes_go():
    front = Camera(world_from_camera=look_at((0.0, 0.0, 5.0), (0.0, 0.0, 0.0)))
    rows, names = axes_marks(front, (W, H))
    tips = {name.words: np.array([name.x, name.y]) for name in names}
    middle = rows[0, :2]
    assert tips["X"][0] > middle[0] + 20.0
    assert abs(tips["X"][1] - middle[1]) < 1e-3
    assert tips["Y"][1] < middle[1] - 20.0, "up is up"
    assert np.linalg.norm(tips["Z"] - middle) < 12.0, "it points at the viewer"
    assert names[-1].words == "Z", "the nearest is drawn last"


def test_words_stand_at_their_place_and_are_made_once(ctx):
    asked = []

    def text(words, pixels, color):
        asked.append(words)
        image = np.zeros((10, 30, 4), np.uint8)
        image[..., :3], image[..., 3] = color, 255
        return image

    color = ctx.texture((W, H), 4)
    target = ctx.framebuffer([color])
    images = ScreenImages(ctx, text)
    lines = [Words(50.0, 40.0, "hello", (250, 10, 20)), Words(120.0, 100.0, "middle", (10, 250, 20), True)]
    for _ in range(3):
        target.use()
        target.clear()
        images.draw_words(lines, 12.0, (W, H))
    picture = np.frombuffer(target.read(components=4), np.uint8).reshape(H, W, 4)[::-1].astype(int)
    assert asked == ["hello", "middle"]
    red = picture[..., 0] > 200
    assert np.argwhere(red).min(axis=0).tolist() == [31, 50]
    assert np.argwhere(red).max(axis=0).tolist() == [40, 79]
    green = np.argwhere(picture[..., 1] > 200)
    np.testing.assert_allclose(green.mean(axis=0), [100.0, 120.0], atol=0.6)
    for number in range(KEPT_WORDS + 20):
        images.draw_words([Words(0.0, 20.0, str(number), (9, 9, 9))], 12.0, (W, H))
    assert len(images.words) == KEPT_WORDS
    gc.collect()
    assert collect(ctx) == 0, "words nobody shows any more are released"
    assert not any(isinstance(texture.mglo, moderngl.InvalidObject) for texture in images.words.values())
    for thing in (images, target, color):
        thing.release()


def test_letters_without_a_window_are_legible():
    image = plain_text("hairs 8,000", 12.0, (200, 210, 220))
    assert image.dtype == np.uint8
    assert image.shape[2] == 4
    assert 8 <= image.shape[0] <= 20
    assert 40 <= image.shape[1] <= 120
    assert (image[..., 3] > 100).mean() > 0.05
    assert plain_text("", 12.0, (1, 2, 3)).shape[1] >= 1
    assert [word.words for word in labels([Label(1, 2, "a"), Circle(0, 0, 1)])] == ["a"]


def test_a_fill_darkens_its_box_alone(ctx):
    color = ctx.texture((W, H), 4)
    target = ctx.framebuffer([color])
    drawing = MarkDrawing(ctx)
    target.use()
    target.clear(1.0, 1.0, 1.0, 1.0)
    drawing.draw(marks([Fill(19.5, 29.5, 99.5, 49.5, 0.6)]), (W, H))
    image = np.frombuffer(target.read(components=4), np.uint8).reshape(H, W, 4)[::-1, :, 1] / 255.0
    inside = np.zeros((H, W), bool)
    inside[30:50, 20:100] = True
    assert (image[~inside] == 1.0).all()
    np.testing.assert_allclose(image[inside], 0.4 + 0.6 * 0.02, atol=0.01)
    for thing in (drawing, target, color):
        thing.release()
