"""The files opened last, as a list to choose from; those that are gone are marked."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMenu, QWidget

from app.window.desk import Desk
from app.window.icons import icon
from core.formats.mesh_file import READ_SUFFIXES

SHORTEST_FOLDER = 40  # characters of a folder that a menu shows


class RecentFile(NamedTuple):
    """One of them. there : it could be found a moment ago."""

    path: Path
    there: bool

    @property
    def icon(self) -> str:
        """Of a mesh or a project."""
        return "mesh" if self.path.suffix.lower() in READ_SUFFIXES else "groom"


def look_up(paths: Iterable[str]) -> list[RecentFile]:
    """Which of these files are there. Slow when a disk of the network is gone: call it in a job."""
    return [RecentFile(path, _there(path)) for path in map(Path, paths)]


def short_folder(path: Path) -> str:
    """The folder of a file, home as ~, its middle left out when it is long."""
    folder = str(path.parent)
    home = str(Path.home())
    if folder == home or folder.startswith(home + "/"):
        folder = "~" + folder[len(home):]
    if len(folder) <= SHORTEST_FOLDER:
        return folder
    half = SHORTEST_FOLDER // 2
    return f"{folder[:half - 1]}…{folder[-half:]}"


class RecentMenu(QMenu):
    """A menu of recent files: names, folders, and which are missing. `choose` gets the path."""

    def __init__(
        self, desk: Desk, paths: Iterable[str], choose: Callable[[Path], object], parent: QWidget | None = None
    ) -> None:
        super().__init__("Open recent", parent)
        self._choose = choose
        self._rows: list[tuple[Path, QAction]] = []
        self.setToolTipsVisible(True)
        for path in map(Path, paths):
            action = self.addAction(f"{path.name}\t{short_folder(path)}".replace("&", "&&"))
            action.setToolTip(str(path))
            action.triggered.connect(lambda checked=False, path=path: self._choose(path))
            self._rows.append((path, action))
        if not self._rows:
            self.addAction("No file was opened yet").setEnabled(False)
            return
        names = [str(path) for path, _ in self._rows]
        desk.jobs.start("Look for recent files", lambda progress, cancelled: look_up(names), self._mark,
                        lambda error: None, self)

    def _mark(self, files: list[RecentFile]) -> None:
        for file, (_, action) in zip(files, self._rows, strict=True):
            action.setIcon(icon(file.icon if file.there else "warning"))
            action.setEnabled(file.there)
            if not file.there:
                action.setText(f"{file.path.name} (missing)\t{short_folder(file.path)}".replace("&", "&&"))


def _there(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
