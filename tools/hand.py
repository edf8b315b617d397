"""The hand: one stroke at a time, from pointers to a named step.

A press makes a stroke of the active tool (and its mirror image with symmetry), every batch of samples makes new guides
that are shown as a preview, and the release is one step of history. Esc, an error or another tool puts the old value
back. Pose, symmetry and what is respected are dealt with here, so that tools are only about hair.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec
import numpy as np

from core.camera import clip_from_world
from core.document import find_groom, find_mesh, with_groom
from core.errors import UserError
from core.groom.groom import Groom
from core.groom.guides import Guides
from core.groom.region import View
from core.mesh.surface import rest_from_posed, strands_on_deformed
from core.overlay import Circle, Overlays
from core.posed import skin_at
from core.record import freeze
from core.workspace import Respect
from tools.pen import Pen, PenSettings
from tools.tool import BrushParams, Ground, Pointer, Sight, Stroke, Tool, ring_radius

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

    pen : settings of the pen. recorded : called with every finished stroke; what records macros sets it.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.pen = PenSettings()
        self.recorded: Callable[[StrokeRecord], None] | None = None
        self._pen = Pen(self.pen)
        self._tool: Tool[Any] | None = None
        self._strokes: list[tuple[Stroke, Ground]] = []
        self._guides: Guides | None = None
        self._batches: list[tuple[Pointer, ...]] = []
        self._record: StrokeRecord | None = None
        self._ground: tuple[tuple[Any, ...], tuple[Ground, ...]] | None = None

    @property
    def stroking(self) -> bool:
        """True between press and release."""
        return self._tool is not None

    def press(self, sight: Sight, pointer: Pointer, tool: Tool[Any] | None = None) -> None:
        """Begin a stroke of `tool`, by default the active one or what held keys turn it into.

        Raises
        ------
        UserError
            It cannot begin (no groom, a locked mesh, nothing to edit): the message says what to do.
        """
        self.cancel()
        tool = self.tool_for(pointer) if tool is None else tool
        grounds = self._grounds(sight, tool)
        self._pen = Pen(self.pen)
        (first,) = self._pen.filtered((pointer,))
        self._strokes = [(tool.begin(ground, first), ground) for ground in grounds]
        self._tool, self._guides = tool, grounds[0].guides
        self._batches = []
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
        tool = self._tool
        try:
            guides = self._guides
            for stroke, _ in self._strokes:
                assert guides is not None
                guides = stroke.finish(guides)
            assert guides is not None
            document = self._document(guides)
        except BaseException:
            self.cancel()
            raise
        record = self._record
        batches = tuple(self._batches)
        self._drop()
        self.session.commit(tool.step, document)
        if self.recorded is not None and record is not None:
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
            found = tool.hover(grounds[0], pointer)
            for ground in grounds[1:]:
                found += _ghost(tool, grounds[0], ground, pointer)
        except UserError:
            return ()
        for stroke, _ in self._strokes[:1]:
            found += stroke.overlays()
        return found

    def tool_for(self, pointer: Pointer) -> Tool[Any]:
        """The active tool, or what held keys turn it into."""
        tool = self.session.tool
        other = tool.with_shift if pointer.shift else tool.with_ctrl if pointer.ctrl else ""
        return self.session.tool_named(other) if other and other in self.session.tools else tool

    def _extend(self, pointers: tuple[Pointer, ...]) -> None:
        try:
            guides = self._guides
            for stroke, _ in self._strokes:
                assert guides is not None
                guides = stroke.extend(guides, pointers)
            assert guides is not None
            self._batches.append(pointers)
            if guides is not self._guides:
                self._guides = guides
                self.session.preview(self._document(guides))
        except BaseException:
            self.cancel()
            raise

    def _grounds(self, sight: Sight, tool: Tool[Any]) -> tuple[Ground, ...]:
        """What strokes would work on, one for each side of symmetry; the same objects while nothing changed."""
        session, workspace = self.session, self.session.workspace
        document = session.history.current
        if not document.grooms:
            raise UserError("There is no groom to work on; open a mesh and add a groom to it first.")
        groom = document.grooms[0] if workspace.groom is None else find_groom(document, workspace.groom)
        item = find_mesh(document, groom.mesh_id)
        if item.locked:
            raise UserError(f"{item.name} is locked; unlock it in the scene panel to edit its hair.")
        key = (groom, item, workspace.frame, workspace.respect, sight.camera, sight.width, sight.height, type(tool))
        if self._ground is not None and all(a is b or a == b for a, b in zip(self._ground[0], key, strict=True)):
            return self._ground[1]
        frame, evaluator = workspace.frame, session.evaluator
        skin, rest = skin_at(item, frame, evaluator), skin_at(item, None, evaluator)
        guides = _respected(groom.guides, workspace.respect, tool)
        if not tool.at_rest and skin is not rest:
            carried = strands_on_deformed(item.mesh, guides.roots, guides.points, skin.points, skin.normals)
            guides = guides.replace(points=freeze(carried))
        matrix = clip_from_world(sight.camera, sight.width, sight.height)
        sides = (matrix, matrix @ MIRROR) if workspace.respect.symmetry else (matrix,)
        grounds = tuple(
            Ground(
                sight, View(side, sight.width, sight.height), item, frame, skin, rest, groom, guides, evaluator,
                groom.guides.next_id,
            )
            for side in sides
        )
        self._ground = (key, grounds)
        return grounds

    def _document(self, guides: Guides) -> Any:
        """The document with these guides in place of those at press."""
        assert self._tool is not None
        ground = self._strokes[0][1]
        document = self.session.history.current
        if guides is ground.guides:
            return document
        before = ground.groom.guides
        if not self._tool.at_rest and ground.skin is not ground.rest:
            guides = _at_rest(guides, ground)
        respect = self.session.workspace.respect
        guides = _restored(before, guides, respect, self._tool)
        groom: Groom = ground.groom.replace(guides=guides)
        return with_groom(document, groom)

    def _drop(self) -> None:
        self._tool, self._guides, self._record = None, None, None
        self._strokes, self._batches = [], []


def _respected(guides: Guides, respect: Respect, tool: Tool[Any]) -> Guides:
    """Guides with hold and selection taken off where they are not to be heeded."""
    if not respect.hairspray and tool.edits not in ("hold", "selection") and guides.hold.any():
        guides = guides.replace(hold=np.zeros_like(guides.hold))
    if not respect.selection and tool.edits != "selection" and guides.selected.any():
        guides = guides.replace(selected=np.zeros_like(guides.selected))
    return guides


def _restored(before: Guides, guides: Guides, respect: Respect, tool: Tool[Any]) -> Guides:
    """Hold and selection that were taken off, put back on the guides that are still there."""
    hold = not respect.hairspray and tool.edits not in ("hold", "selection") and before.hold.any()
    selected = not respect.selection and tool.edits != "selection" and before.selected.any()
    if not (hold or selected):
        return guides
    changes: dict[str, Any] = {}
    order = np.argsort(before.ids, kind="stable")
    place = np.minimum(np.searchsorted(before.ids, guides.ids, sorter=order), len(order) - 1)
    row = order[place]
    there = before.ids[row] == guides.ids
    if hold and before.hold.shape[1] == guides.hold.shape[1]:
        changes["hold"] = np.where(there[:, None], before.hold[row], guides.hold)
    if selected:
        changes["selected"] = np.where(there, before.selected[row], guides.selected)
    return guides.replace(**changes)


def _at_rest(guides: Guides, ground: Ground) -> Guides:
    """Guides of the pose carried back to rest; those that were not touched keep their bits."""
    before = ground.groom.guides
    if guides.points is ground.guides.points:
        return guides.replace(points=before.points)
    points = rest_from_posed(ground.rest.mesh, guides.roots, guides.points, ground.skin.points, ground.skin.normals)
    if guides.ids is before.ids or np.array_equal(guides.ids, before.ids):
        same = (guides.points == ground.guides.points).all(axis=(1, 2))
        points[same] = before.points[same]
    return guides.replace(points=freeze(points))


def _ghost(tool: Tool[Any], ground: Ground, mirrored: Ground, pointer: Pointer) -> Overlays:
    """A fainter ring where the stroke works on the other side."""
    hit = ground.hit(pointer)
    if hit is None or not isinstance(tool.params, BrushParams):
        return ()
    pixels, w = ground.view.pixels(hit.point * [-1.0, 1.0, 1.0])
    if w <= 0.0:
        return ()
    return (Circle(float(pixels[0]), float(pixels[1]), ring_radius(tool.params, mirrored, pointer), "faint"),)
