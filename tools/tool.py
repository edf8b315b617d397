"""What a tool is, and the stroke it makes of what a hand sends (:mod:`tools.ground`).

A tool is a class in a file of its own. It turns pixels into the arguments of kernels in core, which do the work:
``begin`` makes a throw-away stroke at press, whose ``extend`` returns new matter (guides, vertices, weights, a pose)
for every batch of pointers. A tool never draws: it returns :mod:`core.overlay` values. It never sees the document,
undo, symmetry or what is respected: those belong to :class:`tools.hand.Hand` and the tool's :class:`tools.craft.Craft`.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Generic, NamedTuple, Protocol, TypeVar, runtime_checkable

from core.overlay import Overlays
from core.record import Record
from tools.ground import Pointer
from tools.ring import RingParams, ring_overlays

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
