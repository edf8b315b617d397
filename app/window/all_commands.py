"""The whole table of commands, from the modules that own them."""

from __future__ import annotations

from app.window.commands import Command
from app.window.feather_coats import FEATHER_COATS
from app.window.files.file_commands import EDIT, FILE, MACRO
from app.window.match.commands import MATCH, PLATE_FILES
from app.window.match.model_commands import MODEL, MODEL_FILES
from app.window.plugin_bar import trouble_commands
from app.window.pose.look import POSE_LOOK
from app.window.scene_commands import SCENE
from app.window.timeline.curve_commands import CURVES
from app.window.tool_commands import ACTION_COMMANDS, HAND, tool_commands
from app.window.view_commands import FRAME, VIEW
from app.window.window_commands import WINDOW
from tools.registry import Registry


def all_commands(registry: Registry) -> tuple[Command, ...]:
    """Every command there is, in the order of the menus; those of the tools come from `registry`."""
    return (
        *FILE, *PLATE_FILES, *MODEL_FILES, *EDIT, *SCENE, *FEATHER_COATS, *VIEW, *POSE_LOOK, *FRAME, *CURVES,
        *tool_commands(registry), *HAND, *ACTION_COMMANDS, *MATCH, *MODEL, *MACRO, *WINDOW, *trouble_commands(registry),
    )
