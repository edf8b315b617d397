"""The colours of a plate on the screen: as the film's own OpenColorIO configuration has them, or a built-in one."""

from __future__ import annotations

import os
import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.image.mix import to_float
from core.workspace import PlateLook

BUILT_IN = "cg-config-v2.1.0_aces-v1.3_ocio-v2.3"
BETWEEN = " / "  # of a display and its view
PLAIN = PlateLook()
LINEAR = "scene_linear"  # the role of what floating pixels hold when nobody says


class PlateColors:
    """Turns frames into what a screen shows; from any thread. The configuration is read when needed.

    Whole numbers without a colour space are shown as they are, for pictures of that kind are made for the screen.
    """

    def __init__(self, file: str | None = None) -> None:
        self._file = os.environ.get("OCIO", "") if file is None else file
        self._config: Any = None
        self._processors: dict[tuple[str, str, float], Any] = {}
        self._lock = threading.Lock()

    def display(
        self, pixels: NDArray[Any], color_space: str = "", look: PlateLook = PLAIN
    ) -> NDArray[np.uint8]:
        """A frame (H, W, 1 or 3) as (H, W, 3) uint8, sRGB, or as the display and view of `look` have it.

        Raises
        ------
        UserError
            The configuration cannot be read, or does not know the colour space.
        """
        whole = pixels.dtype.kind == "u"
        if whole and not color_space and (look.exposure or look.gamma != 1.0):
            light = _decoded(_three(to_float(pixels))) * np.float32(2.0**look.exposure)
            shown = np.round(255.0 * _encoded(np.clip(light, 0.0, 1.0)) ** (1.0 / look.gamma)).astype(np.uint8)
        elif whole and not color_space:
            shown = pixels if pixels.dtype == np.uint8 else (pixels >> 8).astype(np.uint8)
        else:
            light = np.ascontiguousarray(_three(to_float(pixels)), np.float32)
            with self._lock:
                processor = self._processor(color_space or LINEAR, look.display, look.exposure)
            processor.applyRGB(light)
            shown = np.round(np.clip(light, 0.0, 1.0) ** (1.0 / look.gamma) * 255.0).astype(np.uint8)
        return np.ascontiguousarray(_three(shown))

    def _processor(self, color_space: str, shown_on: str, exposure: float) -> Any:
        key = color_space, shown_on, exposure
        if key not in self._processors:
            import PyOpenColorIO as ocio  # loaded only where a plate needs it

            try:
                if self._config is None:
                    self._config = (
                        ocio.Config.CreateFromFile(self._file) if self._file
                        else ocio.Config.CreateFromBuiltinConfig(BUILT_IN))
                config = self._config
                display, _, view = shown_on.partition(BETWEEN)
                display = display or config.getDefaultDisplay()
                steps = ocio.GroupTransform()
                source = color_space
                if exposure:  # stops are factors of light, whatever the files hold
                    steps.appendTransform(ocio.ColorSpaceTransform(src=color_space, dst=LINEAR))
                    steps.appendTransform(ocio.MatrixTransform.Scale([2.0**exposure] * 3 + [1.0]))
                    source = LINEAR
                steps.appendTransform(ocio.DisplayViewTransform(
                    src=source, display=display, view=view or config.getDefaultView(display)))
                self._processors[key] = config.getProcessor(steps).getDefaultCPUProcessor()
            except (ocio.Exception, ocio.ExceptionMissingFile) as error:
                raise UserError(
                    f"The colours of the plate cannot be shown ({' '.join(str(error).split())[:160].rstrip('.')}); "
                    "look at the OCIO variable and at the plate's colour space.") from None
        return self._processors[key]


def color_spaces(file: str | None = None) -> tuple[str, ...]:
    """Names of the colour spaces of the configuration (``$OCIO`` by default, else the built-in one).

    Raises
    ------
    UserError
        The configuration cannot be read.
    """
    config = _config_of(os.environ.get("OCIO", "") if file is None else file)
    return tuple(space.getName() for space in config.getColorSpaces())


def displays(file: str | None = None) -> tuple[str, ...]:
    """What plates may be shown on, "Display / View", by the configuration; the first is that of nobody's choice.

    Raises
    ------
    UserError
        The configuration cannot be read.
    """
    config = _config_of(os.environ.get("OCIO", "") if file is None else file)
    return tuple(
        f"{display}{BETWEEN}{view}" for display in config.getDisplays() for view in config.getViews(display))


def _config_of(name: str) -> Any:
    import PyOpenColorIO as ocio  # as above

    try:
        return ocio.Config.CreateFromFile(name) if name else ocio.Config.CreateFromBuiltinConfig(BUILT_IN)
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        raise UserError(f"The colour configuration cannot be read ({' '.join(str(error).split())[:160]}); "
                        "look at the OCIO variable.") from None


def _decoded(shown: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _encoded(light: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1.0 / 2.4) - 0.055).astype(np.float32)


def _three(pixels: NDArray[Any]) -> NDArray[Any]:
    return np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels
