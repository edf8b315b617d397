"""Several scenes side by side through one view: each in its own part of the screen, in its own colours."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

from core.camera import frame_points
from core.overlay import Circle
from core.workspace import ViewOptions
from tests.viewport.scenes import quad
from viewport.drawables.mesh import map_colors
from viewport.legend import Legend, ramp_image
from viewport.panes import Pane, Panes, corner_of, grid_of, pane_at, size_of
from viewport.scene import Scene, Surface
from viewport.view import View3D

W, H = 160, 120
BARE = ViewOptions(grid=False, axes=False, hud=False)


@pytest.fixture
def panes(ctx: moderngl.Context) -> Iterator[Panes]:
    view = View3D(ctx, shadow_side=64)
    made = Panes(view)
    yield made
    made.release()
    view.release()


def colored(share: float, ramp: str = "map") -> Scene:
    surface: Surface = quad()
    values = np.full(len(surface.points), share, np.float32)
    return Scene((surface._replace(values=values, ramp=ramp),))  # type: ignore[arg-type]


def picture(panes: Panes, ctx: moderngl.Context, whole: tuple[int, int], overlays: tuple = ()) -> np.ndarray:
    texture = ctx.texture(whole, 4)
    target = ctx.framebuffer([texture])
    panes.present(target, whole, overlays)
    pixels = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(whole[1], whole[0], 3)[::-1]
    target.release()
    texture.release()
    return pixels.astype(int)


def test_the_grid_follows_the_longer_side() -> None:
    assert grid_of(2, (800, 600)) == (2, 1)
    assert grid_of(2, (600, 800)) == (1, 2)
    assert grid_of(4, (600, 800)) == (2, 2)
    assert size_of(4, (601, 800)) == (300, 400)
    assert corner_of(3, 4, (600, 800)) == (300, 400)
    for number in range(4):
        x, y = corner_of(number, 4, (600, 800))
        assert pane_at(x, y, 4, (600, 800)) == number
    assert pane_at(-50.0, 5000.0, 4, (600, 800)) == 2


@pytest.mark.parametrize("finished", [False, True])
def test_each_pane_shows_its_own_scene(ctx: moderngl.Context, panes: Panes, finished: bool) -> None:
    whole = 2 * W, H
    camera = frame_points(quad().points, (0.0, 0.0, -1.0), W / H)
    shown = (Pane(colored(0.0), "low"), Pane(colored(1.0), "high", Legend("Height", ("0", "1 cm", "2 cm"))))
    assert panes.begin(shown, camera, (W, H), BARE)
    assert not panes.begin(shown, camera, (W, H), BARE)
    panes.draw_interactive(0)
    if finished:
        assert list(panes.refine())[-1] == 1.0
    found = picture(panes, ctx, whole)
    low, high = found[H // 2, W // 2], found[H // 2, W + W // 2]
    assert low[2] > low[1]  # the violet end of the map
    assert high[1] > 2 * high[2]  # the yellow one
    again = picture(panes, ctx, whole)
    assert np.array_equal(found, again)


def test_marks_are_drawn_over_every_pane_at_the_same_place(ctx: moderngl.Context, panes: Panes) -> None:
    whole = 2 * W, H
    camera = frame_points(quad().points, (0.0, 0.0, -1.0), W / H)
    panes.begin((Pane(colored(0.5)), Pane(colored(0.5))), camera, (W, H), BARE)
    panes.draw_interactive(0)
    plain = picture(panes, ctx, whole)
    marked = picture(panes, ctx, whole, (Circle(40.0, 70.0, 9.0, "plain", 3.0),))
    changed = np.abs(marked - plain).sum(axis=2) > 30
    assert changed[:, : W - 4].any()
    assert np.array_equal(changed[:, 4 : W - 4], changed[:, W + 4 : -4])


def test_one_pane_is_the_usual_view_and_several_give_their_memory_back(ctx: moderngl.Context, panes: Panes) -> None:
    camera = frame_points(quad().points, (0.0, 0.0, -1.0), W / H)
    panes.begin((Pane(colored(0.5)), Pane(colored(0.5))), camera, (W // 2, H), BARE)
    panes.draw_interactive(0)
    assert len(panes.pictures) == 2
    assert panes.begin((Pane(colored(0.5)),), camera, (W, H), BARE)
    panes.draw_interactive(0)
    assert not panes.pictures
    assert picture(panes, ctx, (W, H))[H // 2, W // 2].sum() > 100


def test_signed_colours_are_grey_amid_blue_and_orange(ctx: moderngl.Context, panes: Panes) -> None:
    camera = frame_points(quad().points, (0.0, 0.0, -1.0), W / H)
    seen = []
    for share in (0.0, 0.5, 1.0):
        panes.begin((Pane(colored(share, "signed")),), camera, (W, H), BARE)
        panes.draw_interactive(0)
        seen.append(picture(panes, ctx, (W, H))[H // 2, W // 2])
    assert seen[0][2] > seen[0][0] + 40
    assert np.ptp(seen[1]) < 12
    assert seen[2][0] > seen[2][2] + 40


def test_the_legend_has_the_colours_of_the_map() -> None:
    assert ramp_image(map_colors())[0, 0].tolist() == [68, 1, 84]  # the ends of viridis
    assert ramp_image(map_colors())[0, -1].tolist() == [253, 231, 37]
