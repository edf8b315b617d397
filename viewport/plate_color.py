"""The colours of a plate on the screen: as the film's own OpenColorIO configuration has them, or a built-in one."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.image.mix import to_float

BUILT_IN = "cg-config-v2.1.0_aces-v1.3_ocio-v2.3"
LINEAR = "scene_linear"  # the role of what floating pixels hold when nobody says


class PlateColors:
    """Turns frames into what a screen shows; used from one thread at a time. The configuration is read when needed.

    Whole numbers without a colour space are shown as they are, for pictures of that kind are made for the screen.
    """

    def __init__(self, file: str | None = None) -> None:
        self._file = os.environ.get("OCIO", "") if file is None else file
        self._config: Any = None
        self._processors: dict[str, Any] = {}

    def display(self, pixels: NDArray[Any], color_space: str = "") -> NDArray[np.uint8]:
        """A frame (H, W, 1 or 3) as (H, W, 3) uint8, sRGB.

        Raises
        ------
        UserError
            The configuration cannot be read, or does not know the colour space.
        """
        whole = pixels.dtype.kind == "u"
        if whole and not color_space:
            shown = pixels if pixels.dtype == np.uint8 else (pixels >> 8).astype(np.uint8)
        else:
            light = np.ascontiguousarray(_three(to_float(pixels)), np.float32)
            self._processor(color_space or LINEAR).applyRGB(light)
            shown = np.round(np.clip(light, 0.0, 1.0) * 255.0).astype(np.uint8)
        return np.ascontiguousarray(_three(shown))

    def _processor(self, color_space: str) -> Any:
        if color_space not in self._processors:
            import PyOpenColorIO as ocio  # loaded only where a plate needs it

            try:
                if self._config is None:
                    self._config = (
                        ocio.Config.CreateFromFile(self._file) if self._file
                        else ocio.Config.CreateFromBuiltinConfig(BUILT_IN))
                config = self._config
                display = config.getDefaultDisplay()
                view = ocio.DisplayViewTransform(
                    src=color_space, display=display, view=config.getDefaultView(display))
                self._processors[color_space] = config.getProcessor(view).getDefaultCPUProcessor()
            except (ocio.Exception, ocio.ExceptionMissingFile) as error:
                raise UserError(
                    f"The colours of the plate cannot be shown ({' '.join(str(error).split())[:160].rstrip('.')}); "
                    "look at the OCIO variable and at the plate's colour space.") from None
        return self._processors[color_space]


def color_spaces(file: str | None = None) -> tuple[str, ...]:
    """Names of the colour spaces of the configuration (``$OCIO`` by default, else the built-in one).

    Raises
    ------
    UserError
        The configuration cannot be read.
    """
    import PyOpenColorIO as ocio  # as above

    name = os.environ.get("OCIO", "") if file is None else file
    try:
        config = ocio.Config.CreateFromFile(name) if name else ocio.Config.CreateFromBuiltinConfig(BUILT_IN)
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        raise UserError(f"The colour configuration cannot be read ({' '.join(str(error).split())[:160]}); "
                        "look at the OCIO variable.") from None
    return tuple(space.getName() for space in config.getColorSpaces())


def _three(pixels: NDArray[Any]) -> NDArray[Any]:
    return np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels
