"""Colours of plates: what OpenColorIO itself says, and nothing at all for pictures made for a screen."""

import numpy as np
import PyOpenColorIO as ocio
import pytest

from core.errors import UserError
from core.workspace import PlateLook
from viewport.plate_color import BUILT_IN, PlateColors, displays


def test_pictures_of_whole_numbers_stay_as_they_are():
    colors = PlateColors("")
    pixels = np.random.default_rng(1).integers(0, 256, (4, 5, 3), np.uint8)
    assert (colors.display(pixels) == pixels).all()
    wide = pixels.astype(np.uint16) * 257
    assert (colors.display(wide) == pixels).all()
    grey = colors.display(pixels[:, :, :1])
    assert (grey == pixels[:, :, :1]).all()
    assert grey.shape == (4, 5, 3)


def test_light_is_shown_as_the_configuration_says():
    light = np.array([[[0.0, 0.18, 1.0], [4.0, -0.1, np.nan]]], np.float16)
    shown = PlateColors("").display(light)
    config = ocio.Config.CreateFromBuiltinConfig(BUILT_IN)
    display = config.getDefaultDisplay()
    view = ocio.DisplayViewTransform(src="scene_linear", display=display, view=config.getDefaultView(display))
    processor = config.getProcessor(view).getDefaultCPUProcessor()
    for place, pixel in enumerate(([0.0, np.float16(0.18), 1.0], [4.0, np.float16(-0.1), 0.0])):
        truth = np.clip(processor.applyRGB([float(v) for v in pixel]), 0.0, 1.0) * 255.0
        assert np.abs(shown[0, place] - truth).max() <= 1.0


def test_what_the_configuration_does_not_know_is_said(tmp_path):
    with pytest.raises(UserError, match="colour space"):
        PlateColors("").display(np.zeros((2, 2, 3), np.float32), "no such space")
    with pytest.raises(UserError, match="OCIO"):
        PlateColors(str(tmp_path / "gone.ocio")).display(np.zeros((2, 2, 3), np.float32))


def test_stops_are_factors_of_light_and_a_view_is_chosen():
    light = np.array([[[0.02, 0.09, 0.18]]], np.float32)
    colors = PlateColors("")
    brighter = colors.display(light, look=PlateLook(exposure=1.0))
    assert (brighter == colors.display(2.0 * light)).all()
    whole = np.array([[[40, 90, 150]]], np.uint8)
    lifted = colors.display(whole, look=PlateLook(exposure=1.0)).astype(float) / 255.0
    told = 2.0 * ((whole / 255.0 + 0.055) / 1.055) ** 2.4  # IEC 61966-2-1
    np.testing.assert_allclose(lifted, np.where(told < 1.0, 1.055 * told ** (1 / 2.4) - 0.055, 1.0), atol=0.004)
    np.testing.assert_allclose(
        colors.display(whole, look=PlateLook(gamma=2.0)) / 255.0, np.sqrt(whole / 255.0), atol=0.004)
    names = displays("")
    assert names
    first, *others = (colors.display(light, look=PlateLook(display=name)) for name in names)
    assert (first == colors.display(light)).all()
    assert any((other != first).any() for other in others)
    with pytest.raises(UserError, match="colours of the plate cannot be shown"):
        colors.display(light, look=PlateLook(display="nothing / none"))
