"""The whole vocabulary of tools: what a hand sends, what a tool sees, and what a tool is.

A tool is a class in a file of its own. It turns pixels into the arguments of kernels in core, which do the work:
``begin`` makes a throw-away stroke at press, whose ``extend`` returns new guides for every batch of pointers. A tool
never draws: it returns :mod:`core.overlay` values. It never sees the document, undo, symmetry, the pose or what is
respected: those belong to :class:`tools.hand.Hand`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Generic, Literal, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from core.camera import Camera, pixel_scale
from core.document import MeshObject
from core.errors import UserError
from core.evaluator import Evaluator
from core.falloff import SHAPES
from core.field import field
from core.groom.groom import Groom
from core.groom.guides import Guides
from core.groom.region import View
from core.mesh.bvh import cast_rays
from core.mesh.distance_field import DistanceField
from core.mesh.skin import Skin
from core.overlay import Circle, Overlays
from core.posed import field_at
from core.record import Record

Edits = Literal["shape", "hold", "selection", "nothing"]


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
    seed : of this stroke, for everything random in it.
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
    seed: int

    @property
    def field(self) -> DistanceField:
        """What to collide with in the pose shown (made at the first asking)."""
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
        x = 2.0 * (pointer.x + 0.5) / self.view.width - 1.0
        y = 1.0 - 2.0 * (pointer.y + 0.5) / self.view.height
        ends = np.linalg.solve(self.view.clip_from_object, np.array([[x, y, -1.0, 1.0], [x, y, 1.0, 1.0]]).T).T
        near, far = ends[:, :3] / ends[:, 3:]
        away = far - near
        return near, away / max(float(np.linalg.norm(away)), 1e-300)

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


class BrushParams(Record):
    """What every brush with a ring has."""

    size: Annotated[float, field(
        "Size", "Radius of the ring, in pixels of the screen or along the skin.", "px", (8, 300), (1, 4000))] = 70.0
    world: Annotated[bool, field(
        "Size in world", "Keeps the ring the same size on the skin when you zoom; off keeps it in pixels.")] = False
    strength: Annotated[float, field(
        "Strength", "How much one pass of the brush does, from nothing at 0 to all at 1.", "", (0, 1), (0, 1))] = 0.6
    falloff: Annotated[str, field(
        "Falloff", "How the brush fades from the middle of its ring to the rim.", choices=SHAPES)] = "smooth"
    pressure_size: Annotated[bool, field(
        "Pen sizes", "Pressing the pen harder makes the ring larger, up to its full size.")] = False
    pressure_strength: Annotated[bool, field(
        "Pen strength", "Pressing the pen harder makes the brush stronger, up to its full strength.")] = True


P = TypeVar("P", bound=Record)


class Tool(Generic[P]):
    """Base of every tool. Its class attributes describe it; fields of ``Params`` are described by core.field.

    name, label, icon : id, words, file in resources/icons without suffix. order : place in the shelf; tools of one
        tens stand together.
    tooltip : what it does and when, one teaching sentence. hint : what mouse and keys do now, for the status line.
    step : name of the undo step. edits : what it changes; of the other things it is spared what is not respected.
    at_rest : works on the animal at rest (planting), not in the pose shown.
    with_shift, with_ctrl : names of the tools that held keys turn it into, or "".
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
    with_shift: ClassVar[str] = ""
    with_ctrl: ClassVar[str] = ""
    Params: ClassVar[type[Record]]

    def __init__(self, params: P) -> None:
        self.params = params

    def begin(self, ground: Ground, pointer: Pointer) -> Stroke:
        """A new stroke at press. UserError when it cannot begin, in words that say what to do."""
        raise NotImplementedError

    def hover(self, ground: Ground, pointer: Pointer) -> Overlays:
        """What to draw over the picture at the pointer: the ring of brushes, nothing for others."""
        return ring_overlays(self.params, ground, pointer) if isinstance(self.params, BrushParams) else ()


WORLD_PIXELS = 1000.0  # a size in the world is given as pixels at this many pixels per diagonal of the skin


def ring_radius(params: BrushParams, ground: Ground, pointer: Pointer) -> float:
    """Radius of the ring in pixels at a pointer, the pen's pressure included."""
    radius = params.size
    if params.world:
        hit = ground.hit(pointer)
        metres = params.size / WORLD_PIXELS * ground.rest.diagonal
        radius = metres * ground.pixels_per_metre(None if hit is None else hit.point)
    return radius * (max(pointer.pressure, 0.05) if params.pressure_size else 1.0)


def ring_strength(params: BrushParams, pointer: Pointer) -> float:
    """Strength 0 .. 1 at a pointer, the pen's pressure included."""
    return params.strength * (pointer.pressure if params.pressure_strength else 1.0)


def ring_overlays(params: BrushParams, ground: Ground, pointer: Pointer) -> Overlays:
    """The ring at the pointer, and within it where the brush has half its weight."""
    radius = ring_radius(params, ground, pointer)
    half = {"smooth": 0.5, "flat": 0.6, "linear": 0.5, "sharp": 0.3, "constant": 1.0}.get(params.falloff, 0.5)
    return (Circle(pointer.x, pointer.y, radius), Circle(pointer.x, pointer.y, half * radius, "faint", 1.0))


def nothing_to_do() -> UserError:
    """The same words everywhere for a groom without guides."""
    return UserError("This groom has no guides yet; plant some first (the Plant or Scatter tool).")
