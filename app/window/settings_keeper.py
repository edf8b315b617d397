"""Keeps preferences on disk as they change, away from the thread of the window: a disk may take its time."""

from __future__ import annotations

from pathlib import Path

from app.window.desk import Desk
from app.window.jobs import Cancelled
from app.window.settings import Settings, save_settings


class SettingsKeeper:
    """Writes one record after another; what changes meanwhile is written once, as it is then.

    folder : where preferences are kept; None for the usual one. Used on the thread of the window.
    """

    def __init__(self, desk: Desk, folder: Path | None) -> None:
        self._desk, self._folder = desk, folder
        self._wanted: Settings | None = None  # not on disk yet
        self._writing = False

    def keep(self, settings: Settings) -> None:
        """Begin to write these preferences; the desk says when that cannot be done."""
        self._wanted = settings
        if not self._writing:
            self._write(settings)

    def close(self) -> None:
        """Write what is not on disk yet, now: after this desk's jobs have ended."""
        if self._wanted is not None:
            self._desk.attempt(save_settings, self._wanted, self._folder)
            self._wanted = None

    def _write(self, settings: Settings) -> None:
        self._writing = True
        self._desk.jobs.start(
            "Keep the preferences", lambda progress, cancelled: save_settings(settings, self._folder),
            lambda nothing: self._written(settings), self._refused)

    def _written(self, settings: Settings) -> None:
        self._writing = False
        if self._wanted is settings:
            self._wanted = None
        elif self._wanted is not None:
            self._write(self._wanted)

    def _refused(self, error: Exception) -> None:
        self._writing = False
        if not isinstance(error, Cancelled):
            self._wanted = None  # until something changes again
            raise error
