"""Records of pose spaces: which controls are read and how far a sculpt reaches, the poses, the sculpts.

A space reads some degrees of freedom of some controls (:class:`Dof`) and holds poses (:class:`PoseSample`). Rest is
always one of its centres, with no correction, and so are `anchors`: poses sculpted in layers below, where this one
must stay silent. A :class:`PoseLayer` is a space with the corrections of its vertices, in layers one upon the other.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, get_args

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.field import field
from core.pose.pose import REST, Pose, Vector
from core.record import Record, column, number, text

Kernel = Literal[
    "gaussian", "thin-plate", "multiquadric", "inverse-multiquadric", "wendland", "cubic", "linear", "shepard"
]
Way = Literal["pose-space", "linear", "combination", "interpolation"]
DofKind = Literal["swing", "twist", "swing-twist", "translation", "number"]
FALLOFFS = {"swing": 2, "twist": 1, "swing-twist": 3, "translation": 3, "number": 1}  # of a kind
REST_NAME = REST.name
Falloff = tuple[float, ...]


class Dof(Record):
    """Degrees of freedom of one control that a space reads.

    control : a joint, or an abstract control.
    kind : what is read of it. Swing is where `axis` points, twist the turn about it.
    axis, side : unit and perpendicular, in the space of the joint: what twists, and the first direction of swing
        (the second is axis x side).
    falloff : how far a pose reaches: radians, metres, or units of the number. One for all, or one for each axis:
        swing towards `side` and towards axis x side; then twist; translation x, y, z.
    rest : of a number, its value at rest.
    """

    control: str
    kind: DofKind = "swing-twist"
    axis: Vector = (1.0, 0.0, 0.0)
    side: Vector = (0.0, 1.0, 0.0)
    falloff: Falloff = (math.pi / 3,)
    rest: float = 0.0

    def __post_init__(self) -> None:
        text(self, "control")
        if self.kind not in FALLOFFS:
            raise ValueError(f"Dof.kind must be one of {', '.join(FALLOFFS)}, not {self.kind!r}")
        number(self, "axis", "side", "rest")
        axes = np.array([self.axis, self.side])
        if np.abs(axes @ axes.T - np.eye(2)).max() > 1e-6:
            raise ValueError(f"Dof.axis and side of {self.control!r} must have length 1 and be perpendicular")
        check_falloff(self.falloff, self.kind, f"Dof.falloff of {self.control!r}")


def check_falloff(falloff: Falloff, kind: str, label: str) -> None:
    """ValueError unless there is one falloff, or one for each axis of the kind, all above 0."""
    if len(falloff) not in (1, FALLOFFS[kind]) or not all(1e-9 <= f <= 1e9 for f in falloff):
        raise ValueError(f"{label} must be 1 or {FALLOFFS[kind]} numbers from 1e-9 to 1e9, not {falloff!r}")


class PoseSample(Record):
    """A pose somebody sculpted at.

    `falloffs` are its own, by control, in place of those of the space; of a joint that turns and moves, how it turns.
    """

    pose: Pose
    falloffs: dict[str, Falloff] = msgspec.field(default_factory=dict)

    @property
    def name(self) -> str:
        return self.pose.name


class PoseSpace(Record, kw_only=True):
    """How corrections are interpolated between poses.

    kernel_version : of the formulas in ``core.pose.kernels``; a later release never changes a rig made with this one.
    dofs : at least one; no two of the same control and kind.
    samples : the sculpted poses, of unique names, none named "rest".
    anchors : poses where the correction is held at nothing, as at rest.
    rest_falloffs : of the centres at rest and at anchors, by control.
    """

    kernel: Annotated[Kernel, field(
        "Kernel", "How a sculpt fades with distance from its pose; Gaussian stays local, thin plate reaches far.",
        choices=get_args(Kernel),
    )] = "gaussian"
    kernel_version: int = 1
    normalise: Annotated[Literal["none", "above-one", "always"], field(
        "Normalise", "Divides weights by their sum: never, only where the sum exceeds one, or always.",
        choices=("none", "above-one", "always"),
    )] = "none"
    affine: Annotated[bool, field(
        "Affine part", "Adds a plane through the poses, so that corrections go on in a straight line beyond them.",
    )] = False
    clamp: Annotated[bool, field(
        "Clamp", "Holds a pose outside the sculpted ones at their border, so that nothing is extrapolated.",
    )] = False
    smoothing: Annotated[float, field(
        "Smoothing", "Trades exactness at the poses for calm between them; the loss of every pose is shown.",
        soft=(0.0, 0.1), hard=(0.0, 1e3),
    )] = 0.0
    table: Annotated[int, field(
        "Table", "Looks the kernel up in a table of so many entries, for game engines; 0 computes it.",
        soft=(0, 4096), hard=(0, 1 << 16), step=1,
    )] = 0
    weighted: Annotated[int, field(
        "Weighted", "Measures distance by the skin weights of each vertex, in so many steps; 0 does not.",
        soft=(0, 8), hard=(0, 64), step=1,
    )] = 0
    dofs: tuple[Dof, ...]
    samples: tuple[PoseSample, ...] = ()
    anchors: tuple[Pose, ...] = ()
    rest_falloffs: dict[str, Falloff] = msgspec.field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.kernel not in get_args(Kernel):
            raise ValueError(f"PoseSpace.kernel {self.kernel!r} is not known")
        number(self, "kernel_version", least=1, most=1)
        number(self, "smoothing", least=0.0, most=1e3)
        number(self, "table", least=0, most=1 << 16)
        number(self, "weighted", least=0, most=64)
        if self.table == 1:
            raise ValueError("PoseSpace.table must be 0 or at least 2")
        if not self.dofs or len({(d.control, d.kind) for d in self.dofs}) != len(self.dofs):
            raise ValueError("PoseSpace.dofs must not be empty, nor name a control twice in the same way")
        names = [s.name for s in self.samples]
        if len({*names, REST_NAME}) != len(names) + 1:
            raise ValueError("PoseSpace.samples must have names of their own, other than 'rest'")
        for own in (self.rest_falloffs, *(s.falloffs for s in self.samples)):
            for control, falloff in own.items():
                if control not in self.controls:
                    raise ValueError(f"PoseSpace: a falloff is given for {control!r}, which the space does not read")
                for dof in self.dofs:
                    if dof.control == control:
                        check_falloff(falloff, dof.kind, f"PoseSpace: the falloff of {control!r}")

    @property
    def controls(self) -> tuple[str, ...]:
        """Names of the controls it reads, sorted."""
        return tuple(sorted({d.control for d in self.dofs}))


class PoseLayer(Record, kw_only=True):
    """The corrections of some vertices in one space, upon the layers below.

    kind : what turns a pose into weights: the pose space; or, to compare with, plain correctives, each by how far the
        pose has gone towards its own, all added up: "linear" by projection, "combination" by the product over the
        controls; or shape "interpolation", where the surfaces themselves are mixed and not the corrections.
    vertices : (n,) int32, unique; vertices that share a row of `moved` stand together.
    moved : (M, n) bool, the poses that are samples of the vertex; the others do not know of it.
    after : (n,) bool, True where the skin cannot be inverted well: the correction then is added after skinning,
        turned by the rotation of the skin there, and before skinning elsewhere.
    deltas : (M, n, 3) float32, metres, object space: the correction of every sample.
    targets : (M, n, 3) float32, object space: the sculpted surface, from which deltas are made again when a layer
        below is edited.
    """

    name: str = "layer"
    space: PoseSpace
    kind: Way = "pose-space"
    enabled: bool = True
    vertices: np.ndarray
    moved: np.ndarray
    after: np.ndarray
    deltas: np.ndarray
    targets: np.ndarray

    def __post_init__(self) -> None:
        text(self, "name")
        if self.kind not in get_args(Way):
            raise ValueError(f"PoseLayer.kind {self.kind!r} is not known")
        samples = len(self.space.samples)
        column(self, "vertices", np.int32, (None,))
        n = len(self.vertices)
        column(self, "moved", np.bool_, (samples, n))
        column(self, "after", np.bool_, (n,))
        column(self, "deltas", np.float32, (samples, n, 3))
        column(self, "targets", np.float32, (samples, n, 3))
        if n and (self.vertices.min() < 0 or not _differ(self.vertices)):
            raise ValueError("PoseLayer.vertices must be different vertices of the mesh")


class Correctives(Record):
    """Layers of corrections, each taken as a delta from those before it."""

    layers: tuple[PoseLayer, ...] = ()

    def __post_init__(self) -> None:
        names = [s.name for layer in self.layers for s in layer.space.samples]
        if len(set(names)) != len(names):
            raise ValueError("Correctives holds two poses of the same name")
        if len({layer.name for layer in self.layers}) != len(self.layers):
            raise ValueError("Correctives holds two layers of the same name")

    @property
    def vertex_count(self) -> int:
        """The least number of vertices a mesh must have for these."""
        return max((int(layer.vertices.max()) + 1 for layer in self.layers if len(layer.vertices)), default=0)


def _differ(vertices: NDArray[np.int32]) -> bool:
    """True when none comes twice; by marks where they are dense, a hundred times as fast as by sorting."""
    if int(vertices.max()) > 64 * len(vertices):
        return len(np.unique(vertices)) == len(vertices)
    marks = np.zeros(int(vertices.max()) + 1, np.bool_)
    marks[vertices] = True
    return int(np.count_nonzero(marks)) == len(vertices)
