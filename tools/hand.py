"""The hand: one stroke at a time, from pointers to a named step.

A press makes a stroke of the active tool (and its mirror image with symmetry), every batch of samples makes new guides
that are shown as a preview, and the release is one step of history. Esc, an error or another tool puts the old value
back. Pose, symmetry and what is respected are dealt with here, so that tools are only about hair.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Thread
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec
import numpy as np

from core.camera import clip_from_world
from core.document import Document, mesh_to_edit, with_groom
from core.errors import UserError
from core.groom.groom import Groom
from core.groom.guides import Guides
from core.groom.region import View
from core.overlay import Circle, Overlays
from core.posed import field_at, field_known, skin_at
from core.workspace import Respect
from tools.pen import Pen, PenSettings
from tools.pose import BackToRest, in_pose
from tools.respect import respected, restored
from tools.ring import RingParams, ring_radius
from tools.tool import Ground, Picks, Pointer, Sight, Stroke, Tool

if TYPE_CHECKING:
    from tools.session import Session

MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])  # across the object's own X = 0 plane


class StrokeRecord(NamedTuple):
    """Everything a stroke was made of: replayed, it gives the same bits."""

    tool: str
    params: dict[str, Any]
    groom: int
    frame: float
    respect: Respect
    sight: Sight
    batches: tuple[tuple[Pointer, ...], ...]


class Hand:
    """What presses, drags and releases do to the session's document. Used from one thread.

    waits : a stroke begins only when what it collides with is there, which may take a few tenths of a second after
        the frame was changed. Otherwise it begins at once, goes through the skin until that is there (another thread
        makes it), and is then made again from its samples: the document comes out the same.
    pen : settings of the pen. recorded : called with every finished stroke; what records macros sets it.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.waits = True
        self.pen = PenSettings()
        self.recorded: Callable[[StrokeRecord], None] | None = None
        self._pen = Pen(self.pen)
        self._tool: Tool[Any] | None = None
        self._strokes: list[tuple[Stroke, Ground]] = []
        self._guides: Guides | None = None
        self._batches: list[tuple[Pointer, ...]] = []
        self._record: StrokeRecord | None = None
        self._back: BackToRest | None = None
        self._ground: tuple[tuple[Any, ...], tuple[Ground, ...]] | None = None
        self._bare = False  # the stroke does not collide yet
        self._prepared: tuple[Any, ...] | None = None  # what was last handed out to be prepared

    @property
    def stroking(self) -> bool:
        """True between press and release."""
        return self._tool is not None

    def press(self, sight: Sight, pointer: Pointer, tool: Tool[Any] | None = None) -> None:
        """Begin a stroke of `tool`, by default the active one or what held keys turn it into.

        Raises
        ------
        UserError
            It cannot begin (no groom, a lock, nothing to edit): the message says what to do.
        """
        self.cancel()
        tool = self.tool_for(pointer) if tool is None else tool
        grounds = self._grounds(sight, tool)
        self._pen = Pen(self.pen)
        (first,) = self._pen.filtered((pointer,))
        self._strokes = [(tool.begin(ground, first), ground) for ground in grounds]
        self._tool, self._guides = tool, grounds[0].guides
        self._batches = []
        self._bare = tool.edits == "shape" and grounds[0].field is None
        work = self.preparation() if self._bare else None
        if work is not None:
            Thread(target=work, name="skin for the hand", daemon=True).start()
        workspace = self.session.workspace
        self._record = StrokeRecord(
            tool.name, msgspec.to_builtins(tool.params), grounds[0].groom.id, workspace.frame, workspace.respect,
            sight, (),
        )
        self._extend((first,))

    def move(self, pointers: tuple[Pointer, ...]) -> None:
        """Go on with the stroke; all samples since the last picture come together. Nothing when there is none."""
        if self._tool is not None and pointers:
            self._extend(self._pen.filtered(pointers))

    def release(self, pointer: Pointer | None = None) -> None:
        """End the stroke as one named step."""
        if self._tool is None:
            return
        if pointer is not None:
            self.move((pointer,))
        behind = self._pen.caught_up()
        if behind:  # a stroke ends where the hand lets go
            self._extend(behind)
        tool = self._tool
        try:
            if self._bare:
                field_at(self._strokes[0][1].item, self._strokes[0][1].frame, self.session.evaluator)
                self._make_again()
            guides = self._guides
            for stroke, _ in self._strokes:
                assert guides is not None
                guides = stroke.finish(guides)
            assert guides is not None
            document = self._document(guides)
        except BaseException:
            self.cancel()
            raise
        record, strokes = self._record, self._strokes
        batches = tuple(self._batches)
        changed = document is not self.session.history.current
        self._drop()
        self.session.commit(tool.step, document)
        for stroke, _ in strokes[:1]:
            if isinstance(stroke, Picks) and stroke.picked:
                self.session.remember(tool.name, stroke.picked)
        if changed and self.recorded is not None and record is not None:
            self.recorded(record._replace(batches=batches))

    def cancel(self) -> None:
        """Give the stroke up: the document is as it was before the press."""
        if self._tool is not None:
            self._drop()
            self.session.cancel()

    def stroke(self, sight: Sight, pointers: tuple[Pointer, ...]) -> None:
        """A whole stroke in one call: the first sample presses, the last one releases."""
        if not pointers:
            raise UserError("A stroke needs at least one place.")
        self.press(sight, pointers[0])
        for pointer in pointers[1:]:
            self.move((pointer,))
        self.release()

    def replay(self, record: StrokeRecord) -> None:
        """Make a recorded stroke again: the same bits on the same document."""
        session = self.session
        session.set_workspace(groom=record.groom, frame=record.frame, respect=record.respect)
        tool = session.tools.make(record.tool, record.params)
        settings, self.pen = self.pen, PenSettings(spikes=False, smoothing=0.0)  # they are filtered already
        try:
            first, *rest = record.batches
            self.press(record.sight, first[0], tool)
            for batch in rest:
                self.move(batch)
            self.release()
        finally:
            self.pen = settings

    def hover(self, sight: Sight, pointer: Pointer) -> Overlays:
        """What to draw at the pointer: the ring, its mirror ghost, what the tool or its stroke shows."""
        try:
            tool = self._tool or self.tool_for(pointer)
            grounds = self._grounds(sight, tool) if self._tool is None else tuple(g for _, g in self._strokes)
            # amidst a stroke its own overlays speak; only the ring goes with them
            alone = self._tool is None or isinstance(tool.params, RingParams)
            found = tool.hover(grounds[0], pointer) if alone else ()
            if len(grounds) > 1:
                found += _ghost(tool, grounds[0], pointer)
        except UserError:
            return ()
        for stroke, _ in self._strokes[:1]:
            found += stroke.overlays()
        return found

    def tool_for(self, pointer: Pointer) -> Tool[Any]:
        """The active tool, or what the eraser end of the pen or held keys turn it into."""
        session, tool = self.session, self.session.tool
        turn = (
            tool.with_eraser if pointer.eraser else tool.with_shift if pointer.shift
            else tool.with_ctrl if pointer.ctrl else None
        )
        if turn is None or turn.tool not in session.tools:
            return tool
        params = dict(session.workspace.params.get(turn.tool, {}))
        if isinstance(tool.params, RingParams) and issubclass(session.tools.tools[turn.tool].Params, RingParams):
            params |= {name: getattr(tool.params, name) for name in RingParams.__struct_fields__}
        return session.tools.make(turn.tool, {**params, **turn.params})

    def preparation(self) -> Callable[[], object] | None:
        """What a press at the present frame would wait for, to be called on any thread; None when nothing is.

        The same is handed out once.
        """
        session, frame, evaluator = self.session, self.session.workspace.frame, self.session.evaluator
        try:
            item = mesh_to_edit(session.history.current, session.groom)
        except UserError:
            return None
        frames = [at for at in (frame, None) if not field_known(item, at, evaluator)]
        key = item.mesh, item.rig, item.correctives, frame
        same = self._prepared is not None and all(a is b or a == b for a, b in zip(self._prepared, key, strict=True))
        if not frames or same:
            return None
        self._prepared = key
        return lambda: [field_at(item, at, evaluator) for at in frames]

    def _extend(self, pointers: tuple[Pointer, ...]) -> None:
        try:
            before = self._guides
            if self._bare and self._strokes[0][1].field is not None:
                self._make_again()
            self._apply(pointers)
            if self._guides is not before:
                assert self._guides is not None
                self.session.preview(self._document(self._guides))
        except BaseException:
            self.cancel()
            raise

    def _apply(self, pointers: tuple[Pointer, ...]) -> None:
        guides = self._guides
        for stroke, _ in self._strokes:
            assert guides is not None
            guides = stroke.extend(guides, pointers)
        self._batches.append(pointers)
        self._guides = guides

    def _make_again(self) -> None:
        """The stroke from its beginning, now that there is something to collide with."""
        assert self._tool is not None
        self._bare = False
        grounds, batches = [ground for _, ground in self._strokes], self._batches
        self._strokes = [(self._tool.begin(ground, batches[0][0]), ground) for ground in grounds]
        self._guides, self._batches = grounds[0].guides, []
        for batch in batches:
            self._apply(batch)

    def _grounds(self, sight: Sight, tool: Tool[Any]) -> tuple[Ground, ...]:
        """What strokes would work on, one for each side of symmetry; the same objects while nothing changed."""
        session, workspace = self.session, self.session.workspace
        document = session.history.current
        groom = session.groom
        item = mesh_to_edit(document, groom)
        key = (
            groom, item, workspace.frame, workspace.respect, sight.camera, sight.width, sight.height, document.unit,
            tool.at_rest, tool.edits, self.waits,
        )
        if self._ground is not None and all(a is b or a == b for a, b in zip(self._ground[0], key, strict=True)):
            return self._ground[1]
        frame, evaluator = workspace.frame, session.evaluator
        skin, rest = skin_at(item, frame, evaluator), skin_at(item, None, evaluator)
        guides = respected(groom.guides, workspace.respect, tool.edits)
        if not tool.at_rest and skin is not rest:
            guides = in_pose(guides, skin)
        matrix = clip_from_world(sight.camera, sight.width, sight.height)
        sides = (matrix, matrix @ MIRROR) if workspace.respect.symmetry else (matrix,)
        grounds = tuple(
            Ground(
                sight, View(side, sight.width, sight.height), item, frame, skin, rest, groom, guides, evaluator,
                document.unit, tool.at_rest, side is not matrix, self.waits,
            )
            for side in sides
        )
        self._ground = (key, grounds)
        return grounds

    def _document(self, guides: Guides) -> Document:
        """The document with these guides in place of those at press."""
        assert self._tool is not None
        ground = self._strokes[0][1]
        document = self.session.history.current
        if guides is ground.guides:
            return document
        before = ground.groom.guides
        if not self._tool.at_rest and ground.skin is not ground.rest:
            if self._back is None:
                self._back = BackToRest(ground.guides, before, ground.skin)
            guides = self._back(guides)
        guides = restored(before, guides, self.session.workspace.respect, self._tool.edits)
        groom: Groom = ground.groom.replace(guides=guides)
        return with_groom(document, groom)

    def _drop(self) -> None:
        self._tool, self._guides, self._record, self._back = None, None, None, None
        self._strokes, self._batches, self._bare = [], [], False


def _ghost(tool: Tool[Any], ground: Ground, pointer: Pointer) -> Overlays:
    """A fainter ring where the stroke works on the other side."""
    if not isinstance(tool.params, RingParams):
        return ()
    hit = ground.hit(pointer)
    if hit is None:
        return ()
    _, near = ground.view.pixels(hit.point)
    place, far = ground.view.pixels(hit.point * [-1.0, 1.0, 1.0])
    if far <= 0.0:
        return ()
    radius = ring_radius(tool.params, ground, pointer) * float(near / far)
    return (Circle(float(place[0]), float(place[1]), radius, "faint"),)
