"""Colours of plates: what OpenColorIO itself says, and nothing at all for pictures made for a screen."""

import numpy as np
import PyOpenColorIO as ocio
import pytest

from core.errors import UserError
from viewport.plate_color import BUILT_IN, PlateColors


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
