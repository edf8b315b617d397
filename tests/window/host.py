"""A small window for tests: a desk, the whole table of commands, a keymap. It keeps settings in memory."""

from __future__ import annotations

from typing import Any

from PySide6.QtWidgets import QMainWindow

from app.window import keymap as keymaps
from app.window.all_commands import all_commands
from app.window.commands import Commands
from app.window.desk import Desk
from app.window.settings import Settings
from core.camera import Camera
from core.document import Document
from tools.session import Session


class Host(QMainWindow):
    """What commands need that have no widget of their own."""

    def __init__(self, document: Document | None = None) -> None:
        super().__init__()
        self.desk = Desk(Session(document), self)
        self.commands = Commands(self)  # type: ignore[arg-type] # only what the tests run
        self.commands.add(all_commands(self.desk.session.tools))
        self.settings = Settings()
        self.keymap = keymaps.preset("blender")
        self.said: list[str] = []
        self.failed: list[str] = []
        self.desk.said.connect(self.said.append)
        self.desk.failed.connect(lambda sentence, details: self.failed.append(sentence))
        self.palettes = 0

    def change_settings(self, **changes: Any) -> None:
        self.settings = self.settings.replace(**changes)

    def look(self, camera: Camera) -> None:
        self.desk.set_workspace(cameras=(camera, *self.desk.workspace.cameras[1:]))

    def show_palette(self) -> None:
        self.palettes += 1

    def new_document(self) -> None:
        self.desk.replace_session(Session())
