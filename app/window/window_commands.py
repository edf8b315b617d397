"""Commands of the window itself: panels, theme, dialogs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING

from app.window.commands import Command, Window
from tools.registry import CRAFTS

if TYPE_CHECKING:
    from app.window.desk import Desk

# name of a panel in Workspace.panels -> its title and what it is for
PANELS = {
    "shelf": ("Tools", "Shows or hides the shelf of tools at the left of the window."),
    "scene": ("Scene", "Shows or hides the list of meshes and grooms at the right."),
    "tool": ("Tool settings", "Shows or hides the settings of the tool in your hand."),
    "respect": ("Respect", "Shows or hides what tools heed: hairspray, selection and symmetry."),
    "controls": ("Controls", "Shows or hides the sliders of joints and dials that pose the rig."),
    "poses": ("Poses", "Shows or hides sculpted poses, their layers and how far each of them reaches."),
    "library": ("Pose library", "Shows or hides the poses that are kept by name for later."),
    "rig": ("Rig", "Shows or hides the abstract controls and the constraints of the rig."),
    "pose_map": ("Pose map", "Shows or hides the map of pose space beside the model."),
    "feather": ("Feather", "Shows or hides the editor of one feather beside the coat that wears it."),
    "plate": ("Plates", "Shows or hides the list of plates, with film, crop, colours and what tracking sees."),
    "tracks": ("Tracks", "Shows or hides the list of tracks, the worst first, with their curves."),
    "solve": ("Solve", "Shows or hides the solved camera: how good it is, what may be wrong, what to mend."),
    "model": ("Photomodel", "Shows or hides the model of photographs: its points, the worst first, and what is known."),
    "space": ("Solved scene", "Shows or hides the solved camera in space beside the plate, with its path and points."),
    "beside": ("Plate beside", "Shows or hides another plate or photograph beside the one in view, in step with it."),
    "dope": ("Dope sheet", "Shows or hides all tracks over the timeline: where each is seen, how well, and its keys."),
    "coat": ("Coat", "Shows or hides the settings of the hair grown from the guides."),
    "maps": ("Maps", "Shows or hides the painted maps and the 2-D view of the UVs."),
    "history": ("History", "Shows or hides the list of steps that undo goes through."),
    "curves": ("Curves", "Shows or hides the curves of keyed values over the timeline, to be edited together."),
    "timeline": ("Timeline", "Shows or hides frames and playback at the bottom of the window."),
}
_GROWN = ("groom", "feather")
# panels that belong to some crafts; the others are those of all
PANEL_CRAFTS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("coat", "maps", "feather"), _GROWN),
    **dict.fromkeys(("controls", "poses", "library", "rig", "pose_map"), ("pose",)),
    **dict.fromkeys(("tracks", "solve", "plate", "space", "model", "beside", "dope"), ("match",)),
}
LEFT_OUT = {"match": ("scene", "respect")}  # of a craft in which they say nothing
AT_FIRST_HIDDEN = ("curves", "feather", "space", "beside", "dope")
PUT_AWAY = "-"  # before the name of a panel in Workspace.panels that was hidden by hand
TEXT_SIZES = (10, 11, 12, 13, 14, 16, 18, 20)  # pixels
_SETTINGS = "app.window.settings.save_settings"
_WORKSPACE = "core.workspace.Workspace"


def _toggle(panel: str) -> Callable[[Window], None]:
    return lambda window: window.toggle_panel(panel)


def _visible(panel: str) -> Callable[[Desk], bool]:
    return lambda desk: panel in shown_panels(desk.session.workspace.panels)


def shown_panels(panels: Sequence[str]) -> tuple[str, ...]:
    """The panels a workspace shows. One it says nothing of is new since it was saved, and shown as at first."""
    return tuple(name for name in PANELS
                 if name in panels or (PUT_AWAY + name not in panels and name not in AT_FIRST_HIDDEN))


def written_panels(shown: Collection[str]) -> tuple[str, ...]:
    """How a workspace says which panels it shows, so that it says something of every one there is."""
    return tuple(name if name in shown else PUT_AWAY + name for name in PANELS)


def _theme(window: Window) -> None:
    window.change_settings(theme="light" if window.settings.theme == "dark" else "dark")


def _text(direction: int) -> Callable[[Window], None]:
    def run(window: Window) -> None:
        size = window.settings.text_size
        further = [s for s in TEXT_SIZES[::direction] if (s - size) * direction > 0]
        if further:
            window.change_settings(text_size=further[0])

    return run


def _craft(name: str) -> Command:
    label = next(craft.label for craft in CRAFTS if craft.name == name)
    return Command(
        f"window.craft_{name}", f"{label} craft", f"Shows the tools and panels of {label} over the same document.",
        lambda w: w.desk.set_craft(name), "tools.session.Session.set_craft",
        checked=lambda desk: desk.session.tool.craft == name, words="craft mode switch workspace")


WINDOW: tuple[Command, ...] = (
    *(_craft(craft.name) for craft in CRAFTS),
    *(
        Command(
            f"window.{name}", f"{label} panel", tooltip, _toggle(name), _WORKSPACE, checked=_visible(name),
            words="show hide dock")
        for name, (label, tooltip) in PANELS.items()
    ),
    Command(
        "window.palette", "Find a command…", "Finds any command by words, shows its hotkey and runs it.",
        lambda w: w.show_palette(), "app.window.commands.Commands.find", "window", icon="search",
        words="search palette help"),
    Command(
        "window.theme", "Dark / light theme", "Switches between the dark and the light colours of the window.",
        _theme, _SETTINGS, "settings", words="colour appearance"),
    Command(
        "window.text_larger", "Larger text", "Makes all text of the window one step larger, in pixels.",
        _text(1), _SETTINGS, "settings", words="font size bigger zoom"),
    Command(
        "window.text_smaller", "Smaller text", "Makes all text of the window one step smaller, in pixels.",
        _text(-1), _SETTINGS, "settings", words="font size"),
    Command(
        "window.preferences", "Preferences…", "Theme, text, pen, units, memory for undo and where autosaves lie.",
        lambda w: w.show_preferences(), _SETTINGS, "window", icon="preferences", words="settings options pen"),
    Command(
        "window.keymap", "Hotkeys…", "Shows every hotkey, and lets you press another one for a command.",
        lambda w: w.show_keymap_editor(), "app.window.keymap.Keymap.assigned", "window", icon="keyboard",
        words="keymap shortcuts keys blender maya houdini"),
    Command(
        "window.console", "Python console", "Types Python at the open document; what it edits can be undone.",
        lambda w: w.show_console(), "app.commands.run.command", "window", icon="console", words="script code terminal"),
    Command(
        "window.reset_layout", "Reset the layout", "Puts every panel back where it is in a new installation.",
        lambda w: w.reset_layout(), _WORKSPACE, icon="reset", words="panels docks default"),
    Command(
        "window.float_view", "Float / dock the view",
        "Puts the view into a window of its own, for a second screen; again brings it back.",
        lambda w: w.toggle_floating_view(), _WORKSPACE, "window", icon="panel",
        words="detach second monitor screen"),
    Command(
        "window.full_screen", "Full screen", "Fills the whole screen with the window; again brings the frame back.",
        lambda w: w.toggle_full_screen(), _WORKSPACE, "window", icon="fullscreen", words="maximize"),
    Command(
        "window.safe_mode", "Restart without plug-ins",
        "Saves your state for recovery and starts again without a studio's own tools.",
        lambda w: w.restart_safe(), "tools.registry.Registry", "window", words="safe mode plugins broken"),
)
