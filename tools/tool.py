"""The whole vocabulary of tools: what a hand sends, what a tool sees, and what a tool is.

A tool is a class in a file of its own. It turns pixels into the arguments of kernels in core, which do the work:
``begin`` makes a throw-away stroke at press, whose ``extend`` returns new guides for every batch of pointers. A tool
never draws: it returns :mod:`core.overlay` values. It never sees the document, undo, symmetry, the pose or what is
respected: those belong to :class:`tools.hand.Hand`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, Generic, NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from core.camera import Camera, pixel_scale
from core.document import MeshObject
from core.errors import UserError
from core.evaluator import Evaluator
from core.groom.groom import Groom
from core.groom.guides import Guides
from core.groom.region import View
from core.mesh.bvh import cast_rays
from core.mesh.distance_field import DistanceField
from core.mesh.skin import Skin
from core.overlay import Overlays
from core.posed import field_at, field_known
from core.record import Record
from tools.pose import in_pose
from tools.respect import Edits
from tools.ring import RingParams, ring_overlays
from tools.screen import Screen


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
    """What a stroke works on. On the mirrored side of symmetry `view` is reflected, so that tools need not know.

    skin : in the pose shown at `frame`. rest : at rest, where roots are planted.
    guides : at press, in the pose shown (at rest for tools with ``at_rest``), with what is not respected taken off.
    unit : of length, what numbers are shown in (core.document.METRES_PER_UNIT).
    at_rest : the tool works at rest, whatever pose is shown.
    mirrored : the other side of symmetry, for the few things a stroke does only once.
    waits : see :attr:`field`.
    """

    sight: Sight
    view: View
    item: MeshObject
    frame: float
    skin: Skin
    rest: Skin
    groom: Groom
    guides: Guides
    evaluator: Evaluator
    unit: str = "m"
    at_rest: bool = False
    mirrored: bool = False
    waits: bool = True

    @property
    def seed(self) -> int:
        """Of this stroke, for everything random in it."""
        return self.groom.guides.next_id

    @cached_property
    def shown(self) -> Guides:
        """The guides at press in the pose shown, for tools that work at rest too."""
        return in_pose(self.guides, self.skin) if self.at_rest and self.skin is not self.rest else self.guides

    @cached_property
    def screen(self) -> Screen:
        """Where the guides at press are on the screen (made at the first asking)."""
        return Screen(self.view, self.shown)

    @property
    def field(self) -> DistanceField | None:
        """What to collide with in the pose shown, made at the first asking.

        None while it is made elsewhere and nobody waits for it: the hand makes the stroke again when it is there.
        """
        if not self.waits and not field_known(self.item, self.frame, self.evaluator):
            return None
        return field_at(self.item, self.frame, self.evaluator)

    @property
    def rest_field(self) -> DistanceField:
        """What to collide with at rest."""
        return field_at(self.item, None, self.evaluator)

    def hit(self, pointer: Pointer) -> Hit | None:
        """Where the pointer meets the skin, or None."""
        origin, direction = self.ray(pointer)
        distance, triangle, barycentric = cast_rays(
            self.skin.bvh, origin[None].astype(np.float32), direction[None].astype(np.float32))
        if triangle[0] < 0:
            return None
        corners = self.skin.triangles.vertices[triangle[0]]
        normal = barycentric[0].astype(np.float64) @ self.skin.normals[corners]
        return Hit(
            int(triangle[0]), barycentric[0], origin + float(distance[0]) * direction,
            normal / max(float(np.linalg.norm(normal)), 1e-12),
        )

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

    def pixels_per_metre(self, point: NDArray[np.float64] | None = None) -> float:
        """Pixels a metre across the view covers at a point (3,) of the object; at the middle of the skin when None."""
        camera = self.sight.camera
        scale = pixel_scale(camera, self.sight.height)
        if camera.orthographic:
            return scale
        at = 0.5 * (self.skin.points.min(axis=0) + self.skin.points.max(axis=0)) if point is None else point
        _, w = self.view.pixels(np.asarray(at, np.float64))
        return scale / max(float(w), 1e-9)


class Stroke(Protocol):
    """One press, drag and release. `guides` are the newest ones, in the space that ``Ground.guides`` has."""

    def extend(self, guides: Guides, pointers: tuple[Pointer, ...]) -> Guides:
        """Guides after these samples (the press itself comes as the first batch, of one)."""
        ...

    def finish(self, guides: Guides) -> Guides:
        """Guides at release."""
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
    step : name of the undo step. edits : what it changes; of the other things it is spared what is not respected.
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
    edits: ClassVar[Edits] = "shape"
    at_rest: ClassVar[bool] = False
    with_shift: ClassVar[Turn | None] = None
    with_ctrl: ClassVar[Turn | None] = None
    with_eraser: ClassVar[Turn | None] = None
    Params: ClassVar[type[Record]]

    def __init__(self, params: P) -> None:
        self.params = params

    def begin(self, ground: Ground, pointer: Pointer) -> Stroke:
        """A new stroke at press. UserError when it cannot begin, in words that say what to do."""
        raise NotImplementedError

    def hover(self, ground: Ground, pointer: Pointer) -> Overlays:
        """What to draw over the picture at the pointer: the ring of brushes, nothing for others.

        Tools without a ring are not asked while a stroke goes on.
        """
        return ring_overlays(self.params, ground, pointer) if isinstance(self.params, RingParams) else ()


def nothing_to_do() -> UserError:
    """The same words everywhere for a groom without guides."""
    return UserError("This groom has no guides yet; plant some first (the Plant or Scatter tool).")
