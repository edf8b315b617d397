"""Crafts: what the strokes of a set of tools change, where they find it, and how it becomes a document again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, Protocol, TypeVar

from core.document import Document, MeshObject
from core.evaluator import Evaluator
from core.feather.coat.plumages import Plumages
from core.groom.groom import Groom
from core.history import History
from core.workspace import Workspace
from tools.ground import Ground, Sight
from tools.tool import Tool

G = TypeVar("G", bound=Ground)
V = TypeVar("V")


class Work(Protocol):
    """What a craft sees of a session.

    history : its current document is the one to edit. workspace : the frame, what is respected, what is active.
    evaluator : remembers what is made of the document. plumages : how its coats of feathers lie.
    groom, mesh : worked on; UserError when there is none.
    waits : a stroke begins only when what it collides with is there.
    """

    @property
    def history(self) -> History[Document]: ...
    @property
    def workspace(self) -> Workspace: ...
    @property
    def evaluator(self) -> Evaluator: ...
    @property
    def plumages(self) -> Plumages: ...
    @property
    def groom(self) -> Groom: ...
    @property
    def mesh(self) -> MeshObject: ...
    @property
    def waits(self) -> bool: ...


class Craft(Protocol[G, V]):
    """What a hand must know of a craft. A hand has one of its own, which may remember the grounds it made last.

    name, label : id and words. first : the tool in the hand before another was chosen.
    edits : what its tools can say they change. matter : what a stroke changes (guides, vertices, a pose).
    """

    name: ClassVar[str]
    label: ClassVar[str]
    first: ClassVar[str]
    edits: ClassVar[tuple[str, ...]]

    def grounds(self, session: Work, sight: Sight, tool: Tool[Any]) -> tuple[G, ...]:
        """What strokes would work on, one for each side of symmetry; the same objects while nothing changed.

        Raises
        ------
        UserError
            There is nothing to edit, or a lock keeps tools off; it says what to do.
        """
        ...

    def matter(self, tool: Tool[Any], ground: G) -> V:
        """What the first sample of a stroke changes."""
        ...

    def shown(self, document: Document, tool: Tool[Any], ground: G, matter: V) -> Document:
        """The document with that matter in place of what it was at press, while the stroke goes on."""
        ...

    def document(self, document: Document, tool: Tool[Any], ground: G, matter: V) -> Document:
        """As :meth:`shown`, at release."""
        ...

    def place(self, session: Work, ground: G) -> dict[str, Any]:
        """Fields of the workspace that a replay needs to find the same ground."""
        ...

    def ready(self, tool: Tool[Any], ground: G) -> bool:
        """False when a stroke would begin without something slow, and must be made again when that is there."""
        ...

    def wait(self, ground: G) -> None:
        """Make what :meth:`ready` asks for."""
        ...

    def preparation(self, session: Work) -> Callable[[], object] | None:
        """What a press now would wait for, to be called on any thread; None when nothing is. Handed out once."""
        ...
