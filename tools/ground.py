"""What a hand sends, and what a stroke works on: pointers, how the artist looks, and the ground under them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from core.groom.region import View


class Pointer(NamedTuple):
    """One sample of mouse or pen. `x`, `y`: pixels of the framebuffer, centre of the top left one at (0, 0).

    pressure : 0 .. 1, 1 for a mouse. tilt_x, tilt_y : radians from upright. time : seconds.
    """

    x: float
    y: float
    pressure: float = 1.0
    tilt_x: float = 0.0
    tilt_y: float = 0.0
    eraser: bool = False
    shift: bool = False
    ctrl: bool = False
    alt: bool = False
    time: float = 0.0


class Sight(NamedTuple):
    """How the artist looks: a camera and the size of the picture in pixels."""

    camera: Camera
    width: int
    height: int


class Hit(NamedTuple):
    """Where a pointer meets the skin: triangle, barycentric (3,) float32, point and normal (3,) of the pose shown."""

    triangle: int
    barycentric: NDArray[np.float32]
    point: NDArray[np.float64]
    normal: NDArray[np.float64]


@dataclass(frozen=True)
class Ground:
    """What a stroke works on, as every craft knows it: how the artist looks, and at which side of symmetry.

    view : on the mirrored side of symmetry it may be reflected, so that tools need not know.
    unit : of length, what numbers are shown in (core.units.METRES_PER_UNIT).
    mirrored : the other side of symmetry, for the few things a stroke does only once.
    """

    sight: Sight
    view: View
    unit: str = "m"
    mirrored: bool = False

    @property
    def size(self) -> float:
        """Metres, of what is worked on: rings that keep their size in the world are measured by it."""
        return 1.0

    def hit(self, pointer: Pointer) -> Hit | None:
        """Where the pointer meets a skin; None beside it, or where a craft has none."""
        return None

    def begun(self, pointer: Pointer) -> Self:
        """The ground of a stroke that begins at a pointer, where that makes a difference."""
        return self

    def opposite(self, hit: Hit) -> NDArray[np.float64]:
        """The point (3,) on the other side of symmetry."""
        return hit.point * [-1.0, 1.0, 1.0]

    def pixels_per_metre(self, point: NDArray[np.float64] | None = None) -> float:
        """Pixels a metre across the view covers at a point (3,) of the object; at its middle when None."""
        return 1.0

    def ray(self, pointer: Pointer) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Origin (3,) and unit direction (3,) in object space of the line of sight through a pointer."""
        origins, directions = self.rays(np.array([[pointer.x, pointer.y]]))
        return origins[0], directions[0]

    def rays(self, pixels: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Origins (N, 3) and unit directions (N, 3) in object space of the lines of sight through pixels (N, 2)."""
        x = 2.0 * (pixels[:, 0] + 0.5) / self.view.width - 1.0
        y = 1.0 - 2.0 * (pixels[:, 1] + 0.5) / self.view.height
        ones = np.ones_like(x)
        ends = np.stack([np.stack([x, y, -ones, ones]), np.stack([x, y, ones, ones])])
        near, far = (clip.T for clip in np.linalg.solve(self.view.clip_from_object, ends))
        near, far = near[:, :3] / near[:, 3:], far[:, :3] / far[:, 3:]
        away = far - near
        return near, away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-300)
