"""The whole vocabulary of tools: what a hand sends, what a tool sees, and what a tool is.

A tool is a class in a file of its own. It turns pixels into the arguments of kernels in core, which do the work:
``begin`` makes a throw-away stroke at press, whose ``extend`` returns new matter (guides, vertices, weights, a pose)
for every batch of pointers. A tool never draws: it returns :mod:`core.overlay` values. It never sees the document,
undo, symmetry or what is respected: those belong to :class:`tools.hand.Hand` and the tool's :class:`tools.craft.Craft`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, Generic, NamedTuple, Protocol, Self, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from core.groom.region import View
from core.overlay import Overlays
from core.record import Record
from tools.ring import RingParams, ring_overlays


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


V = TypeVar("V")


class Stroke(Protocol[V]):
    """One press, drag and release. `matter` is the newest, in the space in which the craft gave it at press."""

    def extend(self, matter: V, pointers: tuple[Pointer, ...], /) -> V:
        """The matter after these samples (the press itself comes as the first batch, of one)."""
        ...

    def finish(self, matter: V, /) -> V:
        """The matter at release."""
        ...

    def overlays(self) -> Overlays:
        """What to draw over the picture while the stroke goes on (beside the ring)."""
        ...


@runtime_checkable
class Picks(Protocol):
    """A stroke that leaves something in the settings of its tool (a strand picked to be cloned).

    picked : fields of the tool's params and their new values; looked at after the release, outside undo.
    """

    picked: dict[str, Any]


@runtime_checkable
class NamesStep(Protocol):
    """A stroke that may turn out to be something else than its tool says (a click that only picks a joint).

    step : name of the undo step, looked at after the release; None for that of the tool.
    """

    @property
    def step(self) -> str | None: ...


class Turn(NamedTuple):
    """What held keys or the eraser end of the pen turn a tool into: another tool (or the same), some settings changed.

    A ring keeps its size through it.
    """

    tool: str
    params: Mapping[str, Any] = MappingProxyType({})


P = TypeVar("P", bound=Record)


class Tool(Generic[P]):
    """Base of every tool. Its class attributes describe it; fields of ``Params`` are described by core.field.

    name, label, icon : id, words, file in resources/icons without suffix. order : place in the shelf; tools of one
        tens stand together.
    tooltip : what it does and when, one teaching sentence. hint : what mouse and keys do now, for the status line.
    step : name of the undo step. craft : the name of its craft. edits : what it changes, one of ``Craft.edits``.
    at_rest : works on the animal at rest (planting), not in the pose shown.
    with_shift, with_ctrl, with_eraser : what held keys or the eraser end of a pen turn it into, or None. Strokes never
        look at these keys themselves.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    icon: ClassVar[str]
    order: ClassVar[int]
    tooltip: ClassVar[str]
    hint: ClassVar[str]
    step: ClassVar[str]
    craft: ClassVar[str] = "groom"
    edits: ClassVar[str] = "shape"
    at_rest: ClassVar[bool] = False
    with_shift: ClassVar[Turn | None] = None
    with_ctrl: ClassVar[Turn | None] = None
    with_eraser: ClassVar[Turn | None] = None
    Params: ClassVar[type[Record]]

    def __init__(self, params: P) -> None:
        self.params = params

    def begin(self, ground: Any, pointer: Pointer) -> Stroke[Any]:
        """A new stroke at press, on a ground of the tool's craft. UserError when it cannot begin says what to do."""
        raise NotImplementedError

    def hover(self, ground: Any, pointer: Pointer) -> Overlays:
        """What to draw over the picture at the pointer: the ring of brushes, nothing for others.

        Tools without a ring are not asked while a stroke goes on.
        """
        return ring_overlays(self.params, ground, pointer) if isinstance(self.params, RingParams) else ()
