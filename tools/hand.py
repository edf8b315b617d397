"""The hand: one stroke at a time, from pointers to a named step.

A press makes a stroke of the active tool (and its mirror image with symmetry), every batch of samples makes new matter
that is shown as a preview, and the release is one step of history. Esc, an error or another tool puts the old value
back. What the matter is, and what becomes of it, the craft of the tool knows (:mod:`tools.craft`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from threading import Thread
from typing import Any, NamedTuple, Protocol

import msgspec

from core.document import Document
from core.errors import UserError
from core.overlay import Circle, Overlays
from tools.craft import Craft, Work
from tools.ground import Ground, Pointer, Sight
from tools.pen import Pen, PenSettings
from tools.registry import Registry
from tools.ring import RingParams, ring_radius
from tools.tool import NamesStep, Picks, Stroke, Tool


class Owner(Work, Protocol):
    """The session a hand belongs to.

    tools : there are. tool : in the hand. A stroke is shown by `preview` while it goes on, made a named step by
    `commit`, or given up by `cancel`; `remember` keeps parameters that it picked.
    """

    @property
    def tools(self) -> Registry: ...
    @property
    def tool(self) -> Tool[Any]: ...
    def set_workspace(self, **changes: Any) -> None: ...
    def preview(self, document: Document) -> None: ...
    def commit(self, name: str, document: Document) -> None: ...
    def cancel(self) -> None: ...
    def remember(self, name: str, params: Mapping[str, Any]) -> None: ...


class StrokeRecord(NamedTuple):
    """Everything a stroke was made of: replayed, it gives the same bits.

    place : fields of the workspace it was made in, as its craft named them.
    """

    tool: str
    params: dict[str, Any]
    place: dict[str, Any]
    sight: Sight
    batches: tuple[tuple[Pointer, ...], ...]


class Hand:
    """What presses, drags and releases do to the session's document. Used from one thread.

    waits : a stroke begins only when what it collides with is there, which may take a few tenths of a second after
        the frame was changed. Otherwise it begins at once, goes through the skin until that is there (another thread
        makes it), and is then made again from its samples: the document comes out the same.
    pen : settings of the pen. recorded : called with every finished stroke; what records macros sets it.
    """

    def __init__(self, session: Owner) -> None:
        self.session = session
        self.waits = True
        self.pen = PenSettings()
        self.recorded: Callable[[StrokeRecord], None] | None = None
        self._crafts: dict[str, Craft[Any, Any]] = {}
        self._pen = Pen(self.pen)
        self._tool: Tool[Any] | None = None
        self._strokes: list[tuple[Stroke[Any], Ground]] = []
        self._matter: Any = None
        self._batches: list[tuple[Pointer, ...]] = []
        self._record: StrokeRecord | None = None
        self._bare = False  # the stroke goes without something slow that is not there yet

    @property
    def stroking(self) -> bool:
        """True between press and release."""
        return self._tool is not None

    def craft(self, name: str) -> Craft[Any, Any]:
        """This hand's craft of that name."""
        if name not in self._crafts:
            self._crafts[name] = self.session.tools.crafts[name]()
        return self._crafts[name]

    def press(self, sight: Sight, pointer: Pointer, tool: Tool[Any] | None = None) -> None:
        """Begin a stroke of `tool`, by default the active one or what held keys turn it into.

        Raises
        ------
        UserError
            It cannot begin (no groom, a lock, nothing to edit): the message says what to do.
        """
        self.cancel()
        tool = self.tool_for(pointer) if tool is None else tool
        craft, grounds = self.craft(tool.craft), self._grounds(sight, tool)
        self._pen = Pen(self.pen)
        (first,) = self._pen.filtered((pointer,))
        self._bare = not craft.ready(tool, grounds[0])  # asked first: what gets ready meanwhile, begin may have missed
        grounds = tuple(ground.begun(first) for ground in grounds)
        self._strokes = [(tool.begin(ground, first), ground) for ground in grounds]
        self._tool, self._matter = tool, craft.matter(tool, grounds[0])
        self._batches = []
        work = self.preparation() if self._bare else None
        if work is not None:
            Thread(target=work, name="skin for the hand", daemon=True).start()
        place = craft.place(self.session, grounds[0])
        self._record = StrokeRecord(tool.name, msgspec.to_builtins(tool.params), place, sight, ())
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
                self.craft(tool.craft).wait(self._strokes[0][1])
                self._make_again()
            for stroke, _ in self._strokes:
                self._matter = stroke.finish(self._matter)
            document = self._document(self.craft(tool.craft).document)
        except BaseException:
            self.cancel()
            raise
        record, strokes = self._record, self._strokes
        batches = tuple(self._batches)
        changed = document is not self.session.history.current
        self._drop()
        named = next((stroke.step for stroke, _ in strokes[:1] if isinstance(stroke, NamesStep)), None)
        self.session.commit(named or tool.step, document)
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
        session.set_workspace(**record.place)
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
        return self.craft(self.session.tool.craft).preparation(self.session)

    def _grounds(self, sight: Sight, tool: Tool[Any]) -> tuple[Any, ...]:
        return self.craft(tool.craft).grounds(self.session, sight, tool)

    def _extend(self, pointers: tuple[Pointer, ...]) -> None:
        assert self._tool is not None
        craft = self.craft(self._tool.craft)
        try:
            before = self._matter
            if self._bare and self._batches and craft.ready(self._tool, self._strokes[0][1]):
                self._make_again()
            self._apply(pointers)
            if self._matter is not before:
                self.session.preview(self._document(craft.shown))
        except BaseException:
            self.cancel()
            raise

    def _apply(self, pointers: tuple[Pointer, ...]) -> None:
        for stroke, _ in self._strokes:
            self._matter = stroke.extend(self._matter, pointers)
        self._batches.append(pointers)

    def _make_again(self) -> None:
        """The stroke from its beginning, now that what it went without is there."""
        assert self._tool is not None
        self._bare = False
        grounds, batches = [ground for _, ground in self._strokes], self._batches
        self._strokes = [(self._tool.begin(ground, batches[0][0]), ground) for ground in grounds]
        self._matter, self._batches = self.craft(self._tool.craft).matter(self._tool, grounds[0]), []
        for batch in batches:
            self._apply(batch)

    def _document(self, made: Callable[..., Document]) -> Document:
        """The document with the matter of now in place of that at press."""
        return made(self.session.history.current, self._tool, self._strokes[0][1], self._matter)

    def _drop(self) -> None:
        self._tool, self._matter, self._record = None, None, None
        self._strokes, self._batches, self._bare = [], [], False


def _ghost(tool: Tool[Any], ground: Ground, pointer: Pointer) -> Overlays:
    """A fainter ring where the stroke works on the other side."""
    hit = ground.hit(pointer) if isinstance(tool.params, RingParams) else None
    if hit is None:
        return ()
    _, near = ground.view.pixels(hit.point)
    place, far = ground.view.pixels(ground.opposite(hit))
    if far <= 0.0:
        return ()
    radius = ring_radius(tool.params, ground, pointer) * float(near / far)
    return (Circle(float(place[0]), float(place[1]), radius, "faint"),)
