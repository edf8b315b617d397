"""The desk: the one session of a window, and the few signals by which its panels hear of changes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Signal

from app.window.jobs import Jobs
from app.window.timeline.keys_at_hand import KeysAtHand
from core.document import Document, MeshObject
from core.errors import UserError
from core.groom.groom import Groom
from core.pose.refusal import Refusal
from core.workspace import Workspace
from tools.session import Session


class Desk(QObject):
    """What lies on the desk: a session, whose every change goes out by a signal. Lives on the thread of the window.

    changed : the document shown is another value (old, new); during a stroke many times a second.
    workspace_changed : frame, camera, tool, panels ... (old, new).
    stroke_ended : after the release or the end of a stroke; panels that were silent during it look again.
    session_replaced : another document was opened; everything is to be read anew.
    keys : of the curves, which are selected.
    said : a sentence for the status line. failed : an error in words, with a longer text to copy (or "").
    refused : poses cannot be told apart (a ``core.pose.refusal.Refusal``); it is said by `failed` as well.
    """

    changed = Signal(object, object)
    workspace_changed = Signal(object, object)
    stroke_ended = Signal()
    session_replaced = Signal()
    said = Signal(str)
    failed = Signal(str, str)
    refused = Signal(object)

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.jobs = Jobs(self, self)
        self._listen(session)
        self.keys = KeysAtHand(self)

    def replace_session(self, session: Session, discard: bool = False) -> None:
        """Put another session on the desk; the old one is closed."""
        old = self.session
        old.changed = None
        self.session = session
        self._listen(session)
        old.close(discard)
        self.session_replaced.emit()

    @property
    def document(self) -> Document:
        """The value shown."""
        return self.session.document

    @property
    def workspace(self) -> Workspace:
        """Where the artist is."""
        return self.session.workspace

    @property
    def groom(self) -> Groom | None:
        """The groom that tools edit, or None."""
        grooms = self.document.grooms
        return next((groom for groom in grooms if groom.id == self.workspace.groom), grooms[0] if grooms else None)

    @property
    def posed(self) -> MeshObject | None:
        """The mesh that the pose craft works on, as it is shown, or None."""
        rigged = [item for item in self.document.meshes if item.rig is not None]
        return next((item for item in rigged if item.id == self.workspace.mesh), rigged[0] if rigged else None)

    def set_craft(self, name: str) -> None:
        """Make a craft the active one, with its tools and panels."""
        old = self.session.workspace
        if self.attempt(self.session.set_craft, name) is not FAILED and self.session.workspace is not old:
            self.workspace_changed.emit(old, self.session.workspace)

    def set_workspace(self, **changes: Any) -> None:
        """Replace fields of the workspace; panels hear of it when anything is another value."""
        old = self.session.workspace
        changes = {name: value for name, value in changes.items() if getattr(old, name) is not value}
        if changes:
            self.session.set_workspace(**changes)
            self.workspace_changed.emit(old, self.session.workspace)

    def choose(self, tool: str, **params: Any) -> None:
        """Make a tool the active one, with some of its parameters changed."""
        old = self.session.workspace
        if self.attempt(self.session.choose, tool, **params) is not FAILED:
            self.workspace_changed.emit(old, self.session.workspace)

    def edit(self, step: str, function: Callable[..., Document], /, *args: Any, **parameters: Any) -> bool:
        """One named step of history; False when it could not be made (the reason is said)."""
        return self.attempt(self.session.edit, step, function, *args, **parameters) is not FAILED

    def attempt(self, function: Callable[..., Any], /, *args: Any, **parameters: Any) -> Any:
        """Call something that may raise a UserError; :data:`FAILED`, with the reason said, when it does."""
        try:
            return function(*args, **parameters)
        except UserError as error:
            self.error(error)
            return FAILED

    def error(self, error: Exception, details: str = "") -> None:
        """Say what went wrong; the details, or what the error notes beside its words, can be copied."""
        self.failed.emit(str(error), details or "\n".join(getattr(error, "__notes__", ())))
        if isinstance(error, Refusal):
            self.refused.emit(error)

    def end_stroke(self, cancel: bool = False) -> None:
        """Release (or give up) the stroke that goes on, and let panels look again."""
        hand, old = self.session.hand, self.session.workspace
        if hand.stroking:
            self.attempt(hand.cancel if cancel else hand.release)
            if self.session.workspace is not old:  # a stroke may pick something, as the clone tool its source
                self.workspace_changed.emit(old, self.session.workspace)
            self.stroke_ended.emit()

    def _listen(self, session: Session) -> None:
        session.changed = self.changed.emit
        session.hand.waits = False


FAILED = object()
