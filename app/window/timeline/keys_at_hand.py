"""The keys at hand: which curves are shown, which of their keys are selected, and what is done to those."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING, NamedTuple

from PySide6.QtCore import QObject, Signal

from core.curve import Curve, Key, Tangent
from core.curve_edit import pasted_keys, set_keys, snapped_keys, with_key, with_tangents, without_keys
from core.document import Document
from core.errors import UserError
from core.value import Constant
from tools.keyed import Keyed, keyed_values, set_bases

if TYPE_CHECKING:
    from app.window.desk import Desk

Selected = Mapping[str, frozenset[int]]  # places of keys by address of their value
Changed = tuple[Curve, frozenset[int]]


class Clip(NamedTuple):
    """Copied keys: of the value at an address."""

    address: str
    keys: tuple[Key, ...]


class KeysAtHand(QObject):
    """One for each desk; curve panel, dope row and commands work on it. Every change of the document is a named step.

    changed : curves, selection or what is shown is another.
    shown : "all" or "selected" keys are to be brought into view.
    snaps : keys that are dragged land on whole frames. normalized : every curve fills the height.
    """

    changed = Signal()
    shown = Signal(str)

    def __init__(self, desk: Desk) -> None:
        super().__init__(desk)
        self._desk = desk
        self.snaps, self.normalized = True, False
        self.all: tuple[Keyed, ...] = ()
        self.selected: dict[str, frozenset[int]] = {}
        self._chosen: frozenset[str] = frozenset()
        self._clip: tuple[Clip, ...] = ()
        desk.changed.connect(self._document_changed)
        desk.stroke_ended.connect(self._read)
        desk.session_replaced.connect(self._forget)
        self._read()

    @property
    def curves(self) -> tuple[Keyed, ...]:
        """The curves that are shown: the chosen ones, or all."""
        chosen = [keyed for keyed in self.all if keyed.address in self._chosen]
        return tuple(chosen) or self.all

    @property
    def chosen(self) -> frozenset[str]:
        """Addresses of the curves chosen in the list; none shows all."""
        return self._chosen

    @property
    def count(self) -> int:
        """How many keys are selected."""
        return sum(map(len, self.selected.values()))

    def choose(self, addresses: Collection[str]) -> None:
        """Show some curves only, or all when there is none; keys of others are no longer selected."""
        self._chosen = frozenset(addresses)
        shown = {keyed.address for keyed in self.curves}
        self.selected = {address: places for address, places in self.selected.items() if address in shown}
        self.changed.emit()

    def select(self, selected: Selected) -> None:
        """Select just these keys."""
        self.selected = {address: places for address, places in selected.items() if places}
        self.changed.emit()

    def select_all(self) -> None:
        """Every key of the curves that are shown."""
        self.select({keyed.address: frozenset(range(len(keyed.curve.keys))) for keyed in self.curves})

    def switch(self, name: str) -> None:
        """Turn `snaps` or `normalized` on or off."""
        setattr(self, name, not getattr(self, name))
        self.changed.emit()

    # -- edits -----------------------------------------------------------------------------------------------

    def preview(self, curves: Mapping[str, Curve], selected: Selected) -> None:
        """Show what a drag makes of curves, without a step."""
        session = self._desk.session
        self.selected = dict(selected)
        self._desk.attempt(lambda: session.preview(set_bases(session.history.current, curves)))

    def commit(self, step: str, bases: Mapping[str, Curve | Constant], selected: Selected) -> None:
        """Make changed curves a named step; the very curves there were give the preview up."""
        current = {keyed.address: keyed.curve for keyed in keyed_values(self._desk.session.history.current)}
        changed = {address: base for address, base in bases.items() if base is not current.get(address)}
        kept, self.selected = self.selected, {address: places for address, places in selected.items() if places}
        if not changed:
            self._desk.session.cancel()
        elif not self._desk.edit(step, set_bases, changed):
            self.selected = kept
            self._desk.session.cancel()
        self._read()

    def insert(self) -> None:
        """A key on the frame of the timeline, in every curve that is shown, with the value the curve has there."""
        frame = self._desk.workspace.frame
        made = {keyed.address: with_key(keyed.curve, frame) for keyed in self.curves}
        self.commit("Insert keys", made, {address: _on(curve, frame) for address, curve in made.items()})

    def delete(self) -> None:
        """Take the selected keys away; the last one of a curve leaves its number behind."""
        bases: dict[str, Curve | Constant] = {}
        for address, curve, places in self._selection():
            left = without_keys(curve, places)
            bases[address] = Constant(number=curve.keys[min(places)].value) if left is None else left
        self.commit("Delete keys", bases, {})

    def copy(self) -> None:
        """Remember the selected keys."""
        self._clip = tuple(Clip(address, tuple(curve.keys[i] for i in sorted(places)))
                           for address, curve, places in self._selection())
        count = sum(len(clip.keys) for clip in self._clip)
        self._desk.said.emit(f"{count} {'key is' if count == 1 else 'keys are'} copied.")

    def paste(self) -> None:
        """Put the copied keys in, the first of them on the frame of the timeline.

        Each goes into the curve it came from where that is shown; keys of one curve go into whatever is shown.
        """
        shown = {keyed.address: keyed.curve for keyed in self.curves}
        clips = [clip for clip in self._clip if clip.address in shown]
        if not clips and len(self._clip) == 1:
            clips = [Clip(address, self._clip[0].keys) for address in shown]
        if not clips:
            raise UserError("The curves these keys were copied from are not shown; choose them in the list.")
        ahead = self._desk.workspace.frame - min(key.frame for clip in clips for key in clip.keys)
        made = {clip.address: pasted_keys(shown[clip.address], [
            key.replace(frame=key.frame + ahead) for key in clip.keys]) for clip in clips}
        self._take("Paste keys", made)

    def turn(self, kind: Tangent) -> None:
        """Give the selected keys tangents of one kind."""
        made = {address: with_tangents(curve, places, kind) for address, curve, places in self._selection()}
        self.commit("Tangents", made, self.selected)

    def snap(self) -> None:
        """Put the selected keys on whole frames."""
        self._each("Snap keys", snapped_keys)

    def set_frame(self, frame: float) -> None:
        """Move the selected keys, so that the first of them stands on a frame."""
        first = min(curve.keys[min(places)].frame for _, curve, places in self._selection())
        self._each("Move keys", lambda curve, places: set_keys(
            curve, places, curve.keys[min(places)].frame + frame - first))

    def set_values(self, values: Mapping[str, float]) -> None:
        """Put the selected keys of some curves on a value each."""
        self._take("Set keys", {address: set_keys(curve, places, value=values[address])
                                for address, curve, places in self._selection() if address in values})

    def go(self, direction: int) -> None:
        """Go to the next (1) or the previous (-1) frame that has a key."""
        frames = sorted({key.frame for keyed in self.curves for key in keyed.curve.keys}, reverse=direction < 0)
        here = self._desk.workspace.frame
        further = [frame for frame in frames if (frame - here) * direction > 1e-3]
        if further:
            self._desk.set_workspace(frame=further[0])

    # -- reasons ---------------------------------------------------------------------------------------------

    def needs_curves(self) -> str | None:
        """Why nothing can be done when there is no curve."""
        return None if self.all else "No value has keys yet; the diamond beside a number of the coat sets one."

    def needs_selection(self) -> str | None:
        """Why nothing can be done when no key is selected."""
        return self.needs_curves() or (None if self.count else "Select keys in the curves or below the timeline first.")

    def needs_clip(self) -> str | None:
        """Why nothing can be pasted."""
        return self.needs_curves() or (None if self._clip else "Copy keys first; then they can be pasted.")

    # -- the document ----------------------------------------------------------------------------------------

    def _selection(self) -> list[tuple[str, Curve, frozenset[int]]]:
        return [(keyed.address, keyed.curve, self.selected[keyed.address])
                for keyed in self.all if self.selected.get(keyed.address)]

    def _each(self, step: str, change: Callable[[Curve, frozenset[int]], Changed]) -> None:
        self._take(step, {address: change(curve, places) for address, curve, places in self._selection()})

    def _take(self, step: str, made: Mapping[str, Changed]) -> None:
        self.commit(step, {address: curve for address, (curve, _) in made.items()},
                    {address: places for address, (_, places) in made.items()})

    def _document_changed(self, old: Document, new: Document) -> None:
        if not self._desk.session.stroking:
            self._read()

    def _forget(self) -> None:
        self.selected, self._chosen = {}, frozenset()
        self._read()

    def _read(self) -> None:
        self.all = keyed_values(self._desk.document)
        counts = {keyed.address: len(keyed.curve.keys) for keyed in self.all}
        self._chosen &= counts.keys()
        left = {address: frozenset(i for i in places if i < counts.get(address, 0))
                for address, places in self.selected.items()}
        self.selected = {address: places for address, places in left.items() if places}
        self.changed.emit()


def _on(curve: Curve, frame: float) -> frozenset[int]:
    return frozenset(i for i, key in enumerate(curve.keys) if abs(key.frame - frame) < 1e-3)
