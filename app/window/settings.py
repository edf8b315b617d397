"""Preferences: one typed record in the settings folder, written as a whole, put aside when it is broken."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, TypeVar

import msgspec
import platformdirs

from core.errors import UserError
from core.field import field
from core.formats.atomic import atomic_write
from core.history import DEFAULT_BUDGET
from core.record import Record, number
from tools.pen import PenSettings

FILE = "settings.json"
LARGEST = 1 << 20  # bytes; nobody's settings are larger
MOST_RECENT = 12

T = TypeVar("T")


class Settings(Record):
    """What the artist prefers, on this machine, for every document.

    unit : of lengths in panels; "document" shows that of the document. plugin_folder : of a studio's own tools, beside
    those of the environment, or "". recent : files opened last, newest first. geometry, panels : the window's place
    and how its panels are docked, base64 of Qt's own bytes, or "".
    """

    theme: Annotated[Literal["dark", "light"], field(
        "Theme", "Colours of the window: dark and neutral for judging pictures, or light.",
        choices=("dark", "light"))] = "dark"
    text_size: Annotated[int, field(
        "Text size", "Height of the window's text in pixels; icons and rows grow with it.", "px", (10, 20), (10, 20), 1)
    ] = 12
    keymap: Annotated[Literal["blender", "maya", "houdini"], field(
        "Keymap", "Hotkeys and camera gestures like those of the program you know best.",
        choices=("blender", "maya", "houdini"))] = "blender"
    orbit: Annotated[Literal["turntable", "trackball"], field(
        "Turning", "Turntable keeps up up while you turn; trackball rolls the view like a ball under your hand.",
        choices=("turntable", "trackball"))] = "turntable"
    unit: Annotated[Literal["document", "m", "cm", "mm", "in", "ft"], field(
        "Units shown", "Unit of lengths in panels; the document itself stays in metres.",
        choices=("document", "m", "cm", "mm", "in", "ft"))] = "document"
    history_mb: Annotated[int, field(
        "Undo, MB", "Megabytes kept for undo; the oldest steps are forgotten beyond it.", "", (128, 4096),
        (16, 65536), 128)] = DEFAULT_BUDGET >> 20
    frames_mb: Annotated[int, field(
        "Frames, MB", "Megabytes of frames of plates held in memory, as shown and as tracked.",
        "", (512, 16384), (64, 262144), 256)] = 2048
    density_ms: Annotated[float, field(
        "Picture, ms", "Milliseconds a picture may take while your hand moves; more shows more hair.", "",
        (10, 60), (5, 500), 1)] = 28.0
    pen: PenSettings = PenSettings()
    plugin_folder: str = ""
    recent: tuple[str, ...] = ()
    geometry: str = ""
    panels: str = ""

    def __post_init__(self) -> None:
        number(self, "text_size", least=10, most=20)
        number(self, "history_mb", least=16, most=65536)
        number(self, "frames_mb", least=64, most=262144)
        number(self, "density_ms", least=5.0, most=500.0)

    def opened(self, path: str | os.PathLike[str]) -> Settings:
        """These settings with a file as the newest of the recent ones."""
        name = str(Path(path).resolve())
        changed: Settings = self.replace(recent=(name, *(r for r in self.recent if r != name))[:MOST_RECENT])
        return changed


class LoadedSettings(NamedTuple):
    """`trouble` says in words what was wrong with the file and where it was put aside, or is None."""

    settings: Settings
    trouble: str | None


def settings_folder() -> Path:
    """Where preferences of this person lie: FILOPLUME_SETTINGS, else the settings folder of the platform."""
    set_by_hand = os.environ.get("FILOPLUME_SETTINGS")
    return Path(set_by_hand) if set_by_hand else platformdirs.user_config_path("filoplume")


def load_settings(folder: Path | None = None) -> LoadedSettings:
    """The preferences; those of a new installation when there are none, or when they cannot be read. Never raises."""
    return LoadedSettings(*read_strictly((folder or settings_folder()) / FILE, Settings))


def save_settings(settings: Settings, folder: Path | None = None) -> None:
    """Write the preferences as a whole; UserError when the disk refuses."""
    write_whole((folder or settings_folder()) / FILE, settings)


def write_whole(path: Path, record: Record) -> None:
    """Write a record as JSON, making its folder; UserError when the disk refuses."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"The folder {path.parent} cannot be made ({error.strerror}): make room for it.") from error
    with atomic_write(path) as temp:
        temp.write_bytes(msgspec.json.format(msgspec.json.encode(record)))


def read_strictly(path: Path, kind: type[T], check: Callable[[T], Any] | None = None) -> tuple[T, str | None]:
    """Read a record of preferences; a fresh one when the file is missing or broken. Never raises.

    A broken file is renamed to the same name with ".broken" at the end and named in the second value, one sentence.
    """
    try:
        if path.stat().st_size > LARGEST:
            raise ValueError("it is far too large")
        record = msgspec.json.decode(path.read_bytes(), type=kind)
        if check is not None:
            check(record)
    except FileNotFoundError:
        return kind(), None
    except OSError as error:
        return kind(), f"{path} could not be read ({error.strerror}); the usual settings are used."
    except (ValueError, RecursionError) as error:  # msgspec's errors are ValueErrors
        aside = path.with_name(path.name + ".broken")
        try:
            os.replace(path, aside)
        except OSError:
            return kind(), f"{path} is broken ({error}); the usual settings are used."
        return kind(), f"{path.name} was broken ({error}); it is now {aside} and the usual settings are used."
    return record, None
