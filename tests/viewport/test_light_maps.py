"""Shadow: the far side of the light, under other hair, behind skin."""

from __future__ import annotations

import numpy as np
import pytest

from tests.viewport.scenes import FLAT, ball, camera, hairs, quad
from viewport.drawables.strands import ABSORPTION
from viewport.light_maps import light_frame
from viewport.outline import Outline
from viewport.scene import Lights, Scene, bounding_points, point_arrays

W, H = 160, 160
KEY_ONLY = {
    "fill_color": (0.0, 0.0, 0.0), "rim_color": (0.0, 0.0, 0.0), "sky_color": (0.0, 0.0, 0.0),
    "ground_color": (0.0, 0.0, 0.0),
}
FROM_LEFT = Lights(key=(-1.0, 0.3, 0.2), follow_camera=False, **KEY_ONLY)


def brightness(image: np.ndarray) -> float:
    return float(image[..., :3].sum() / max(image[..., 3].sum(), 1e-9))


def test_the_side_away_from_the_light_is_darker(draw):
    skin, coat = ball()
    image = draw(Scene(surfaces=(skin,), coats=(coat,), lights=FROM_LEFT), camera(), W, H)
    left, right = brightness(image[:, : W // 2]), brightness(image[:, W // 2 :])
    assert left > 3.0 * right
    turned = FROM_LEFT._replace(key=(1.0, 0.3, 0.2))
    mirrored = draw(Scene(surfaces=(skin,), coats=(coat,), lights=turned), camera(), W, H)
    assert brightness(mirrored[:, W // 2 :]) > 3.0 * brightness(mirrored[:, : W // 2])


def test_lights_follow_the_camera_unless_told_otherwise(draw):
    skin, coat = ball()
    scene = Scene(surfaces=(skin,), coats=(coat,), lights=Lights(key=(-1.0, 0.2, 0.3)))
    for eye in ((0.0, 0.0, 4.0), (0.0, 0.0, -4.0)):
        image = draw(scene, camera(eye), W, H)
        assert brightness(image[:, : W // 2]) > 1.3 * brightness(image[:, W // 2 :])
    fixed = scene._replace(lights=scene.lights._replace(follow_camera=False))
    image = draw(fixed, camera((0.0, 0.0, -4.0)), W, H)
    assert brightness(image[:, : W // 2]) < brightness(image[:, W // 2 :])


def test_skin_between_light_and_hair_takes_the_light(draw):
    roots = np.stack([np.linspace(-0.4, 0.4, 30), np.full(30, -0.3), np.zeros(30)], 1)
    coat = hairs(roots, roots + np.array([0.0, 0.6, 0.0]))
    lights = Lights(key=(0.0, 0.0, -1.0), follow_camera=False, **KEY_ONLY)
    open_sky = draw(Scene(coats=(coat,), lights=lights), camera(), W, H)
    shaded = draw(Scene(surfaces=(quad(z=-0.5),), coats=(coat,), lights=lights), camera(), W, H)
    where = open_sky[..., 3] > 0.5
    assert open_sky[where][:, :3].sum() > 0.0
    assert shaded[where][:, :3].sum() < 0.05 * open_sky[where][:, :3].sum()


def test_light_through_a_curtain_of_hair_follows_beers_law(draw):
    """Skin behind an even curtain that covers c of the area is lit by exp(-c * absorption) of the open light."""
    x = np.linspace(-1.5, 1.5, 1500)
    roots = np.stack([x, np.full(1500, -1.5), np.zeros(1500)], 1)
    lights = Lights(key=(0.0, 0.0, 1.0), follow_camera=False, **KEY_ONLY)
    below = camera(eye=(3.0, 0.0, -0.4), target=(0.0, 0.0, -0.9))  # sees the skin without looking through the curtain
    seen = []
    for cover in (1e-6, 0.5, 1.0, 2.0):
        look = FLAT._replace(root_width=cover * 3.0 / 1500, tip_width=cover * 3.0 / 1500)
        curtain = hairs(roots, roots + np.array([0.0, 3.0, 0.0]), look=look)
        image = draw(Scene(surfaces=(quad(z=-0.9, half=0.5),), coats=(curtain,), lights=lights), below, W, H)
        skin = image[H // 2 - 1 : H // 2 + 2, W // 2 - 15 : W // 2 + 16, 1]
        seen.append(skin.mean())
    np.testing.assert_allclose(np.array(seen) / seen[0], np.exp(-ABSORPTION * np.array([0, 0.5, 1, 2])), rtol=0.04)


def test_roots_inside_a_coat_are_darker_for_its_own_shadow(draw):
    skin, coat = ball(count=12000, length=0.3, look=FLAT._replace(root=(0.3,) * 3, tip=(0.0,) * 3, gloss=0.0))
    lights = Lights(key=(0.0, 0.0, 1.0), follow_camera=False, **KEY_ONLY)
    deep, open_ = (
        draw(Scene(surfaces=(skin,), coats=(coat._replace(look=coat.look._replace(depth=depth)),), lights=lights),
             camera(), W, H) for depth in (1.0, 0.0)
    )
    assert brightness(deep) < 0.85 * brightness(open_)


@pytest.mark.parametrize("toward", [(0, 1, 0), (0.3, 0.2, -1), (-1, 0, 0)])
def test_the_light_sees_the_whole_scene(toward):
    skin, coat = ball(count=200)
    scene = Scene(surfaces=(skin,), coats=(coat,))
    matrix, size = light_frame(Outline().of(scene), np.asarray(toward, float))
    for points in map(bounding_points, point_arrays(scene)):
        q = points @ matrix[:3, :3].T + matrix[:3, 3]
        assert np.abs(q).max() <= 1.0
    # nearer to the light is a smaller depth, one unit of which is the size of the box
    step = matrix[:3, :3] @ (np.asarray(toward) / np.linalg.norm(toward))
    np.testing.assert_allclose(step, [0, 0, -2.0 / size[2]], atol=1e-9)
