"""Commands of the hand: every tool of the registry, what brushes share, and what all tools respect."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from app.window.ask_text import ask_text
from app.window.commands import CRAFT_SCOPES, Command, Window
from core.falloff import SHAPES
from core.field import fields_of
from tools.groom.actions import ACTIONS, Action
from tools.pose.actions import ACTIONS as POSE_ACTIONS
from tools.pose.actions import PoseAction
from tools.registry import Registry
from tools.tool import Tool

if TYPE_CHECKING:
    from app.window.desk import Desk

LARGER = 1.15  # one press of the key
STRONGER = 0.05
_CHOOSE = "tools.session.Session.choose"
_RESPECT = "core.workspace.Respect"


def _needs(field: str) -> Callable[[Desk], str | None]:
    def enabled(desk: Desk) -> str | None:
        tool = desk.session.tool
        return None if hasattr(tool.params, field) else f"{tool.label} has no {field}: choose a tool that has one."

    return enabled


def _change(field: str, change: Callable[[Any], Any]) -> Callable[[Window], None]:
    """A run that changes one setting of the active tool."""

    def run(window: Window) -> None:
        tool = window.desk.session.tool
        window.desk.choose(tool.name, **{field: change(getattr(tool.params, field))})

    return run


def _next_falloff(shape: str) -> str:
    places = list(SHAPES)
    return places[(places.index(shape) + 1) % len(places)] if shape in places else places[0]


def _respects(field: str) -> Callable[[Window], None]:
    def run(window: Window) -> None:
        respect = window.desk.session.workspace.respect
        window.desk.set_workspace(respect=respect.replace(**{field: not getattr(respect, field)}))

    return run


def _is_respected(field: str) -> Callable[[Desk], bool]:
    return lambda desk: bool(getattr(desk.session.workspace.respect, field))


def _choose(name: str) -> Callable[[Window], None]:
    return lambda window: window.desk.choose(name)


def _is_chosen(name: str) -> Callable[[Desk], bool]:
    return lambda desk: desk.session.tool.name == name


def tool_command(tool: type[Tool[Any]]) -> Command:
    """The command that takes a tool into the hand."""
    return Command(
        f"tool.{tool.name}", tool.label, tool.tooltip, _choose(tool.name), _CHOOSE, checked=_is_chosen(tool.name),
        icon=tool.icon, scope=tool.craft if tool.craft in CRAFT_SCOPES else "groom", words=f"tool brush {tool.craft}")


def tool_commands(registry: Registry) -> tuple[Command, ...]:
    """A command for every tool there is."""
    return tuple(tool_command(tool) for tool in registry)


def _act(name: str) -> Callable[[Window], None]:
    return lambda window: window.desk.session.act(name)


def _needs_guides(desk: Desk) -> str | None:
    groom = desk.groom
    if groom is None:
        return "There is no groom yet: import a mesh and groom it first."
    return None if len(groom.guides) else "This groom has no guides yet: plant some first."


def action_command(action: Action) -> Command:
    """The command that does an action to the groom with its usual settings."""
    return Command(
        f"groom.{action.name}", action.label, action.tooltip, _act(action.name), "tools.session.Session.act",
        "document", action.step, _needs_guides, icon=action.icon, scope="groom", words="action guides hair")


def _needs_rig(desk: Desk) -> str | None:
    return None if desk.posed is not None else "There is no rig yet: open a mesh with a skeleton or blend shapes first."


def _act_or_ask(action: PoseAction) -> Callable[[Window], object]:
    if action.asks is None:
        return _act(action.name)
    if action.asks == "file":
        return lambda window: window.import_sculpt()
    asked = action.asks
    label = fields_of(action.Params)[asked].label

    def run(window: Window) -> None:
        desk = window.desk
        ask_text(window, action.label, label, lambda text: desk.attempt(desk.session.act, action.name, **{asked: text}))

    return run


def pose_action_command(action: PoseAction) -> Command:
    """The command that does an action to the mesh with a rig, with its usual settings; a file it asks for."""
    dots = "" if action.asks is None else "\N{HORIZONTAL ELLIPSIS}"
    return Command(
        f"pose.{action.name}", f"{action.label}{dots}", action.tooltip, _act_or_ask(action),
        f"{action.edit.__module__}.{action.edit.__name__}", "document", action.step, _needs_rig, icon=action.icon,
        scope="pose", words="action rig pose")


ACTION_COMMANDS: tuple[Command, ...] = (
    *(action_command(action) for action in ACTIONS.values()),
    *(pose_action_command(action) for action in POSE_ACTIONS.values()),
)

HAND: tuple[Command, ...] = (
    Command(
        "tool.larger", "Larger brush", "Makes the ring of the brush 15 percent larger, in pixels or on the skin.",
        _change("size", lambda v: min(v * LARGER, 4000.0)), _CHOOSE, enabled=_needs("size"), scope="viewport",
        repeats=True, words="size radius bigger increase"),
    Command(
        "tool.smaller", "Smaller brush", "Makes the ring of the brush 13 percent smaller, in pixels or on the skin.",
        _change("size", lambda v: max(v / LARGER, 1.0)), _CHOOSE, enabled=_needs("size"), scope="viewport",
        repeats=True, words="size radius decrease"),
    Command(
        "tool.stronger", "Stronger brush", "Adds 0.05 to the strength of the brush, at most to 1.",
        _change("strength", lambda v: min(v + STRONGER, 1.0)), _CHOOSE, enabled=_needs("strength"), scope="viewport",
        repeats=True, words="strength more increase"),
    Command(
        "tool.weaker", "Weaker brush", "Takes 0.05 from the strength of the brush, at least to 0.",
        _change("strength", lambda v: max(v - STRONGER, 0.0)), _CHOOSE, enabled=_needs("strength"), scope="viewport",
        repeats=True, words="strength less decrease"),
    Command(
        "tool.falloff", "Next falloff", "Goes through the ways the brush fades from its middle to its rim.",
        _change("falloff", _next_falloff), _CHOOSE, enabled=_needs("falloff"), scope="viewport",
        words="cycle shape soft hard"),
    Command(
        "tool.world_size", "Brush size on the skin",
        "Keeps the ring the same size on the skin when you zoom; off keeps it in pixels.",
        _change("world", lambda on: not on), _CHOOSE, enabled=_needs("size"), scope="viewport",
        checked=lambda desk: bool(getattr(desk.session.tool.params, "world", False)), words="units screen pixels"),
    Command(
        "tool.symmetry", "Symmetry X", "Makes every stroke on the other side of the animal too, across its X = 0.",
        _respects("symmetry"), _RESPECT, checked=_is_respected("symmetry"), icon="symmetry", scope="viewport",
        words="mirror both sides"),
    Command(
        "tool.respect_hairspray", "Respect hairspray", "Lets sprayed hair hold its shape under every tool.",
        _respects("hairspray"), _RESPECT, checked=_is_respected("hairspray"), icon="hairspray", words="hold lock"),
    Command(
        "tool.respect_selection", "Respect the selection", "Lets tools edit only selected guides while there are any.",
        _respects("selection"), _RESPECT, checked=_is_respected("selection"), icon="select", words="mask only"),
)

# commands around the hand in the order of radial.DIRECTIONS: up, right, down, left, then from the upper right on round;
# what stands in one direction stands there for every tool of its kind, so that the hand can learn it
RADIAL = (
    "tool.comb", "tool.smooth", "tool.length", "tool.select", "edit.redo", "tool.plant", "tool.hairspray", "edit.undo")
_SELECTING = (
    "groom.select_all", "groom.select_more", "groom.select_none", "groom.select_inverse", "edit.redo",
    "groom.freeze_selected", "groom.delete_selected", "edit.undo")
RADIALS = {"select": _SELECTING, "lasso": _SELECTING, "islands": _SELECTING}


def radial_names(tool: str) -> tuple[str, ...]:
    """Commands of the radial menu while a tool is in the hand, at most eight."""
    return RADIALS.get(tool, RADIAL)
