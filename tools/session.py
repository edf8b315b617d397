"""The headless application: one document with its workspace, its history, an evaluator and an autosave."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from core.document import Document, MeshObject
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.plumages import Plumages
from core.formats.arrays import ArrayHashes
from core.formats.journal import Journal, remove_journal, state_folder
from core.formats.project import read_project, write_project
from core.formats.recovery import abandoned, recover, recover_newest
from core.groom.groom import Groom
from core.history import DEFAULT_BUDGET, History
from core.workspace import Workspace
from tools.groom.actions import ACTIONS, act
from tools.hand import Hand
from tools.macro import Macro
from tools.pose.actions import ACTIONS as POSE_ACTIONS
from tools.pose.actions import scene_of
from tools.registry import Registry
from tools.tool import Tool

Listener = Callable[[Document, Document], None]


class Session:
    """What a hand, a script and a test drive alike. Used from one thread.

    document : the value shown, which during a stroke is a preview.
    workspace : frame, cameras, panels, tool; change it with :meth:`set_workspace`, undo leaves it alone.
    changed : called with the old and the new value after every change of `document`; the one listener there is.
    plumages : how its coats of feathers lie, for whoever shows or picks them.
    tools : the tools there are. hand : makes their strokes. recording : the macro that is recorded, or None.
    """

    def __init__(
        self,
        document: Document | None = None,
        workspace: Workspace | None = None,
        *,
        path: Path | None = None,
        journal: Journal | None = None,
        evaluator: Evaluator | None = None,
        history_bytes: int = DEFAULT_BUDGET,
        hashes: ArrayHashes | None = None,
        name: str = "New",
        tools: Registry | None = None,
    ) -> None:
        self.history: History[Document] = History(document or Document(), name, history_bytes)
        self.workspace = workspace or Workspace()
        self.evaluator = evaluator or Evaluator()
        self.plumages = Plumages(self.evaluator)
        self.path = path
        self.changed: Listener | None = None
        self._document = self.history.current
        self._saved: Document | None = self.history.current
        self._hashes = hashes or ArrayHashes()
        self._journal = journal
        self.tools = tools if tools is not None else Registry()
        self.hand = Hand(self)
        self.recording: Macro | None = None
        self._tool: tuple[str, Any, Tool[Any]] | None = None

    @classmethod
    def open(cls, path: str | os.PathLike[str], journal: Journal | None = None) -> Session:
        """A session on a project file; UserError when it cannot be opened."""
        hashes = ArrayHashes()
        document, workspace = read_project(path, hashes)
        return cls(document, workspace, path=Path(path), journal=journal, hashes=hashes, name="Open")

    @classmethod
    def recover(cls, folder: Path | None = None, token: str | None = None) -> Session | None:
        """A session on the newest work a killed program left behind, or None when there is none. Never raises.

        Parameters
        ----------
        folder : of the journals; None for the usual one.
        token : of the journal to recover (see :func:`core.formats.recovery.abandoned`); None for the newest.

        The old journal is removed only when the state is safe in the new session's own.
        """
        folder = folder or state_folder()
        state = recover_newest(folder) if token is None else recover(folder, token)
        if state is None:
            return None
        path = None if state.project is None else Path(state.project)
        session = cls(state.document, state.workspace, path=path, journal=Journal(folder), name=f"Recover {state.name}")
        session._saved = state.document if state.saved else None
        if session._journal is not None:
            number = session._journal.commit(state.document, state.workspace, state.name, path, state.saved)
            if session._journal.flush() >= number:
                remove_journal(folder, state.token)
        return session

    @staticmethod
    def tidy(folder: Path | None = None) -> None:
        """Remove journals of killed programs whose newest state is in a project file already."""
        folder = folder or state_folder()
        for token in abandoned(folder):
            state = recover(folder, token)
            if state is not None and state.saved:
                remove_journal(folder, token)

    @property
    def document(self) -> Document:
        """The value shown."""
        return self._document

    @property
    def saved(self) -> bool:
        """True when the committed value is the one in the project file (or untouched since it was opened or made)."""
        return self.history.current is self._saved

    @property
    def autosave_error(self) -> UserError | None:
        """Why autosaving does not work at present, or None."""
        return None if self._journal is None else self._journal.error

    @property
    def autosaved(self) -> float | None:
        """When the work was last safe in the journal, in seconds of ``time.monotonic``; None before that."""
        return None if self._journal is None else self._journal.written

    @property
    def stroking(self) -> bool:
        """True while a stroke goes on: a good time to do nothing else."""
        return self.hand.stroking

    @property
    def tool(self) -> Tool[Any]:
        """The active tool of the active craft, with the parameters of the workspace."""
        craft = self.workspace.craft if self.workspace.craft in self.tools.crafts else "groom"  # of a file to come
        names = [kind.name for kind in self.tools.of(craft)]
        wanted = self.workspace.tool, self.tools.crafts[craft].first
        return self.tool_named(next(name for name in (*wanted, *names) if name in names))

    @property
    def waits(self) -> bool:
        """True when strokes begin only once what they collide with is there (see :class:`tools.hand.Hand`)."""
        return self.hand.waits

    @property
    def mesh(self) -> MeshObject:
        """The mesh that the pose craft works on: the first with a rig where none is chosen or the chosen one is gone.

        UserError when there is none with a rig.
        """
        document, wanted = self.history.current, self.workspace.mesh
        found = next((item for item in document.meshes if item.id == wanted), None) or next(
            (item for item in document.meshes if item.rig is not None), None)
        if found is None:
            raise UserError("There is no mesh with a rig to pose; import one with a skeleton or blend shapes first.")
        return found

    @property
    def groom(self) -> Groom:
        """The groom that tools and actions edit: the first where none is chosen or undo took the chosen one away.

        UserError when there is none.
        """
        grooms, wanted = self.history.current.grooms, self.workspace.groom
        if not grooms:
            raise UserError("There is no groom to work on; open a mesh and add a groom to it first.")
        return next((groom for groom in grooms if groom.id == wanted), grooms[0])

    def tool_named(self, name: str) -> Tool[Any]:
        """A tool with the parameters the workspace has for it."""
        params = self.workspace.params.get(name)
        if name != self.workspace.tool:
            return self.tools.make(name, params)
        if self._tool is None or self._tool[0] != name or self._tool[1] is not params:
            self._tool = (name, params, self.tools.make(name, params))
        return self._tool[2]

    def set_workspace(self, **changes: Any) -> None:
        """Replace fields of the workspace. Another tool, groom, mesh or frame gives up the stroke that goes on."""
        if self.stroking and changes.keys() & {"craft", "tool", "groom", "mesh", "frame", "respect"}:
            self.hand.cancel()
        self.workspace = self.workspace.replace(**changes)

    def choose(self, name: str, **params: Any) -> None:
        """Make a tool (and its craft) the active one, with some of its parameters changed.

        Raises
        ------
        UserError
            There is no such tool, or a parameter is not as it should be.
        """
        self.remember(name, params)
        self.set_workspace(tool=name, craft=self.tools.tools[name].craft)

    def set_craft(self, name: str) -> None:
        """Make a craft the active one, with the first of its tools; UserError when there is no such craft."""
        if name not in self.tools.crafts:
            raise UserError(f"There is no craft named {name!r}; choose one of {', '.join(self.tools.crafts)}.")
        if name != self.workspace.craft:
            self.set_workspace(craft=name, tool=self.tools.crafts[name].first)

    def remember(self, name: str, params: Mapping[str, Any]) -> None:
        """Change some parameters of a tool without taking it into the hand (errors as of :meth:`choose`)."""
        wanted = {**self.workspace.params.get(name, {}), **params}
        self.tools.make(name, wanted)
        self.set_workspace(params={**self.workspace.params, name: wanted})

    def preview(self, document: Document) -> None:
        """Show a value without a step: what a stroke looks like while it goes on."""
        self._show(document)

    def cancel(self) -> None:
        """Put the last committed value back."""
        self._show(self.history.current)

    def commit(self, name: str, document: Document) -> None:
        """Make a value the current one, as one named step."""
        if document is not self.history.current:
            self.history.commit(name, document)
            self._write_journal(name)
        self._show(document)

    def edit(self, name: str, function: Callable[..., Document], /, *args: Any, **parameters: Any) -> None:
        """Commit ``function(document, *args, **parameters)`` of the last committed document as one named step.

        When it raises, the document is as before.
        """
        self.hand.cancel()
        self.cancel()
        before = self.history.current
        self.commit(name, function(before, *args, **parameters))
        if self.recording is not None and self.history.current is not before:
            self.recording.edited(name, function, args, parameters)

    def act(self, name: str, /, **params: Any) -> None:
        """Do an action to the active groom (``tools.groom.actions``) or mesh (``tools.pose.actions``), as one step.

        Raises
        ------
        UserError
            There is no such action, no groom or rig, it is locked or hidden, or there is nothing to do it to.
        """
        if name in POSE_ACTIONS:
            self._act_on_mesh(name, params)
            return
        if name not in ACTIONS:
            raise UserError(
                f"There is no action named {name!r}; choose one of {', '.join([*ACTIONS, *POSE_ACTIONS])}.")
        action = ACTIONS[name]
        record = action.make(params)
        self.hand.cancel()
        self.cancel()
        document, respect, groom = self.history.current, self.workspace.respect, self.groom
        done = act(document, groom, action, record, respect, self.evaluator)
        self.commit(action.step, done)
        if done is not document and self.recording is not None:
            self.recording.acted(name, params, groom.id, respect)

    def _act_on_mesh(self, name: str, params: dict[str, Any]) -> None:
        action = POSE_ACTIONS[name]
        record = action.make(params)
        self.hand.cancel()
        self.cancel()
        scene = scene_of(self.history.current, self.mesh.id, self.workspace.frame)
        self.edit(action.step, action.edit, scene.item.id, *action.arguments(scene, record))

    def undo(self) -> None:
        """Go back one step (a preview is given up first)."""
        name = self.history.undo_name
        self._go(self.history.undo, f"Undo {name}")

    def redo(self) -> None:
        """Go forward one step."""
        name = self.history.redo_name
        self._go(self.history.redo, f"Redo {name}")

    def jump(self, place: int) -> None:
        """Go to a step by its place in ``history.names``."""
        self._go(lambda: self.history.jump(place), "Jump")

    def save(self, path: str | os.PathLike[str] | None = None) -> None:
        """Save the committed value to `path`, or to the file it came from.

        Raises
        ------
        UserError
            No name yet, or it could not be saved; the earlier file is untouched.
        """
        target = Path(path) if path is not None else self.path
        if target is None:
            raise UserError("This document has no file yet: give a name to save under.")
        write_project(target, self.history.current, self.workspace, self._hashes)
        self.path, self._saved = target, self.history.current
        self._write_journal("Save")

    def record(self) -> Macro:
        """Begin a macro: strokes, actions and edits from now on, until :meth:`stop_recording`. An earlier one ends."""
        self.recording = Macro()
        self.hand.recorded = self.recording.stroked
        return self.recording

    def stop_recording(self) -> Macro | None:
        """End the macro that is recorded and return it; None when there is none."""
        ended, self.recording, self.hand.recorded = self.recording, None, None
        return ended

    def close(self, discard: bool = False) -> None:
        """End the session. Unsaved work stays recoverable unless `discard`."""
        if self._journal is not None:
            self._journal.close(remove=discard or self.saved)
        self.history.close()
        self.evaluator.close()

    def _go(self, move: Callable[[], Document], name: str) -> None:
        self.hand.cancel()
        before, place = self.history.current, self.history.cursor
        document = move()
        if self.recording is not None:
            self.recording.moved(self.history.cursor - place)
        if document is not before:
            self._write_journal(name)
        self._show(document)

    def _show(self, document: Document) -> None:
        old, self._document = self._document, document
        if old is not document and self.changed is not None:
            self.changed(old, document)

    def _write_journal(self, name: str) -> None:
        if self._journal is not None:
            self._journal.commit(self.history.current, self.workspace, name, self.path, self.saved)
