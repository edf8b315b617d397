"""Commands: everything the program can do, by name. Menus, palette, keys, radial and buttons all run these."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

from numpy.typing import ArrayLike
from rapidfuzz import fuzz, process

from core.camera import Camera
from core.errors import UserError

if TYPE_CHECKING:
    from app.window.desk import Desk
    from app.window.match.view import PlateView
    from app.window.settings import Settings

# what a command changes; only changes of the document are undo steps
Touches = Literal["document", "history", "workspace", "file", "settings", "window"]
# where its hotkey works: the same key may mean different things over different parts of the window, and over the view
# in different crafts
Scope = Literal["everywhere", "viewport", "outliner", "curves", "groom", "feather", "pose", "match"]
CRAFT_SCOPES: tuple[Scope, ...] = ("groom", "feather", "pose", "match")

MOST_RECENT = 20


class Window(Protocol):
    """What commands ask of the main window, beside its desk. Whatever asks for a file name asks the artist itself."""

    desk: Desk
    commands: Commands

    @property
    def settings(self) -> Settings:
        """The preferences now."""
        ...

    @property
    def playing(self) -> bool:
        """True during playback."""
        ...

    @property
    def match(self) -> PlateView:
        """The plate in the view, and what follows tracks on it."""
        ...

    def new_document(self) -> None: ...
    def open_file(self, path: Path | None = None) -> None: ...
    def open_bare_bird(self) -> None: ...
    def show_recent(self) -> None: ...
    def save(self) -> None: ...
    def save_as(self) -> None: ...
    def save_copy(self) -> None: ...
    def import_mesh(self) -> None: ...
    def import_sculpt(self) -> None: ...
    def reload_mesh(self) -> None: ...
    def export_coat(self) -> None: ...
    def save_screenshot(self) -> None: ...
    def make_playblast(self) -> None: ...
    def close(self) -> bool: ...

    def look(self, camera: Camera) -> None: ...
    def look_from(self, side: str) -> None: ...
    def frame_all(self) -> None: ...
    def frame_selected(self) -> None: ...
    def view_of(self, points: ArrayLike, outward: ArrayLike) -> Camera: ...
    def toggle_projection(self) -> None: ...
    def toggle_gate(self) -> None: ...
    def choose_background(self) -> None: ...
    def camera_from_file(self) -> None: ...
    def pin_reference(self) -> None: ...
    def show_pictures(self) -> None: ...
    def scale_density(self, factor: float) -> None: ...
    def toggle_playback(self) -> None: ...

    def toggle_floating_view(self) -> None: ...
    def toggle_panel(self, name: str) -> None: ...
    def reset_layout(self) -> None: ...
    def toggle_full_screen(self) -> None: ...
    def restart_safe(self) -> None: ...
    def show_palette(self) -> None: ...
    def show_preferences(self) -> None: ...
    def show_keymap_editor(self) -> None: ...
    def show_console(self) -> None: ...
    def change_settings(self, **changes: Any) -> None: ...

    def save_macro(self) -> None: ...
    def play_macro(self) -> None: ...


def always(desk: Desk) -> str | None:
    """For commands that can always run."""
    return None


class Command(NamedTuple):
    """One thing the program can do.

    name : "edit.undo"; what stands before the dot is its category.
    label : words of menus and palette. tooltip : what, when, unit, in eight words or more.
    twin : dotted name of the function that does the same without a window.
    touches : what it changes. undo : name of the step it makes; given exactly when it touches the document.
    enabled : None when it can run now, else the reason in words.
    checked : for what is on or off, whether it is on now.
    icon : file in resources/icons without suffix, or None for its label. scope : where its hotkey works.
    words : further words the palette finds it by. repeats : runs again and again while its hotkey is held.
    """

    name: str
    label: str
    tooltip: str
    run: Callable[[Window], object]
    twin: str
    touches: Touches = "workspace"
    undo: str | None = None
    enabled: Callable[[Desk], str | None] = always
    checked: Callable[[Desk], bool] | None = None
    icon: str | None = None
    scope: Scope = "everywhere"
    words: str = ""
    repeats: bool = False

    @property
    def category(self) -> str:
        """What stands before the dot, as a word."""
        return self.name.split(".")[0].capitalize()


class Commands:
    """All commands of one window by name.

    recent : names of those last used, newest first. noted : called with the name of every command before it runs.
    """

    def __init__(self, window: Window) -> None:
        self._window = window
        self._table: dict[str, Command] = {}
        self._haystack: list[tuple[str, str]] = []
        self.recent: list[str] = []
        self.noted: Callable[[str], object] | None = None

    def __iter__(self) -> Iterator[Command]:
        return iter(self._table.values())

    def __len__(self) -> int:
        return len(self._table)

    def __contains__(self, name: object) -> bool:
        return name in self._table

    def __getitem__(self, name: str) -> Command:
        return self._table[name]

    @property
    def desk(self) -> Desk:
        """The desk commands work at."""
        return self._window.desk

    def add(self, table: Iterable[Command]) -> None:
        """Add commands; ValueError for a name that is taken."""
        for command in table:
            if command.name in self._table:
                raise ValueError(f"there are two commands {command.name}")
            self._table[command.name] = command
            self._haystack.append((command.label.lower().rstrip("…"), f"{command.category} {command.words}".lower()))

    def reason(self, name: str) -> str | None:
        """Why the command cannot run now, or None when it can."""
        return self._table[name].enabled(self._window.desk)

    def run(self, name: str) -> bool:
        """Run a command. False when it could not; the artist is told why."""
        command = self._table[name]
        if self.desk.session.stroking and command.touches in ("document", "history", "file"):
            self.desk.end_stroke()  # what the hand has made so far counts
        reason = command.enabled(self.desk)
        if reason is not None:
            self.desk.said.emit(reason)
            return False
        self.recent = [name, *(other for other in self.recent if other != name)][:MOST_RECENT]
        if self.noted is not None:
            self.noted(name)
        try:
            command.run(self._window)
        except UserError as error:
            self.desk.error(error)
            return False
        return True

    def find(self, words: str) -> list[Command]:
        """Commands by words in any order, whole, begun or mistyped, best first; without words the last used first."""
        commands = list(self._table.values())
        if not words.strip():
            order = {name: place for place, name in enumerate(self.recent)}
            return sorted(commands, key=lambda c: order.get(c.name, len(order)))
        scores = [0.0] * len(commands)
        for word in words.lower().replace("…", "").split():
            for place, score in enumerate(_scores(word, self._haystack)):
                scores[place] += score if score >= 70.0 else -200.0
        good = [(score, c) for score, c in zip(scores, commands, strict=True) if score > 0.0]
        fresh = {name: len(self.recent) - place for place, name in enumerate(self.recent)}
        good.sort(key=lambda pair: (
            -pair[0], self.reason(pair[1].name) is not None, -fresh.get(pair[1].name, 0), len(pair[1].label)))
        return [command for _, command in good]


def _scores(word: str, haystack: list[tuple[str, str]]) -> list[float]:
    """How well one typed word fits each label and its further words, 0 .. 130; from 70 on it fits."""
    fits = [max(_fit(word, label), 0.75 * _fit(word, others)) for label, others in haystack]
    if len(word) <= 4:  # a short word is found inside any text by chance
        return fits
    texts = [" ".join(both) for both in haystack]
    within = process.cdist([word], texts, scorer=fuzz.partial_ratio)[0] - 15.0
    known = sorted({known for text in texts for known in text.split()})
    alike = dict(zip(known, process.cdist([word], known, scorer=fuzz.ratio)[0] - 9.0, strict=True))
    return [
        max(fit, float(inside), *(float(alike[known]) for known in text.split()))
        for fit, inside, text in zip(fits, within, texts, strict=True)
    ]


def _fit(word: str, text: str) -> float:
    """130 for a whole word, 115 for the beginning of one (5 more at the beginning of the text), 95 within one."""
    padded, first = f" {text} ", 5.0 * text.startswith(word)
    if f" {word} " in padded:
        return 125.0 + first
    if f" {word}" in padded:
        return 110.0 + first
    return 95.0 if word in text else 0.0


def switch(name: str) -> Callable[[Window], None]:
    """A run that turns one of the view's options on or off."""

    def run(window: Window) -> None:
        view = window.desk.session.workspace.view
        window.desk.set_workspace(view=view.replace(**{name: not getattr(view, name)}))

    return run


def is_on(name: str) -> Callable[[Desk], bool]:
    """Whether one of the view's options is on."""
    return lambda desk: bool(getattr(desk.session.workspace.view, name))
