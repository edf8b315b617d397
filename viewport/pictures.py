"""Images of files for backgrounds and references, kept while they are shown."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import moderngl
import numpy as np
from numpy.typing import NDArray

from viewport.backdrop import picture_texture

LARGEST_SIDE = 8192  # larger images are shown smaller


def read_image(path: str) -> NDArray[np.uint8] | None:
    """An image file as (H, W, 3 or 4) uint8 sRGB, or None when it cannot be read."""
    try:
        data = np.frombuffer(Path(path).read_bytes(), np.uint8)
    except (OSError, ValueError):
        return None
    try:
        image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if len(data) else None
    except cv2.error:
        return None
    if image is None:
        return None
    if image.dtype == np.uint16:
        image = (image // 257).astype(np.uint8)
    if image.dtype != np.uint8:
        image = (np.clip(np.nan_to_num(image.astype(np.float32)), 0.0, 1.0) * 255.0).astype(np.uint8)
    if image.ndim == 2:
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), np.uint8)
    code = cv2.COLOR_BGRA2RGBA if image.shape[2] == 4 else cv2.COLOR_BGR2RGB
    return np.asarray(cv2.cvtColor(image, code), np.uint8)


class Pictures:
    """Pixels and textures of image files by path."""

    def __init__(self, ctx: moderngl.Context, read: Callable[[str], NDArray[np.uint8] | None] = read_image) -> None:
        self.ctx = ctx
        self.read = read
        self._pixels: dict[str, NDArray[np.uint8] | None] = {}
        self._textures: dict[str, moderngl.Texture] = {}

    @property
    def unreadable(self) -> list[str]:
        """Names of the files that could not be read."""
        return [Path(path).name for path, image in self._pixels.items() if image is None]

    def pixels(self, path: str | None) -> NDArray[np.uint8] | None:
        """The image; None without a path and when it cannot be read. The same array as long as it is kept."""
        if path is None:
            return None
        if path not in self._pixels:
            image = self.read(path)
            if image is not None and max(image.shape[:2]) > LARGEST_SIDE:
                scale = LARGEST_SIDE / max(image.shape[:2])
                image = np.asarray(cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), np.uint8)
            self._pixels[path] = image
        return self._pixels[path]

    def texture(self, path: str) -> moderngl.Texture | None:
        """The image on the graphics card."""
        image = self.pixels(path)
        if image is None:
            return None
        if path not in self._textures:
            self._textures[path] = picture_texture(self.ctx, image)
        return self._textures[path]

    def keep(self, paths: set[str | None]) -> None:
        """Forget all other images; a file that could not be read is tried again when it is wanted again."""
        for path in [path for path in self._pixels if path not in paths]:
            del self._pixels[path]
            if path in self._textures:
                self._textures.pop(path).release()

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        self.keep(set())
