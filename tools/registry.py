"""The tools there are: those of the house and those of a studio's own folders. A broken file is named and left out."""

from __future__ import annotations

import importlib
import importlib.util
import os
import pkgutil
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import msgspec

from core.errors import UserError
from core.field import fields_of
from tools.feather.craft import FeatherCraft
from tools.groom.craft import GroomCraft
from tools.match.craft import MatchCraft
from tools.pose.craft import PoseCraft
from tools.tool import Tool

CRAFTS = (GroomCraft, FeatherCraft, PoseCraft, MatchCraft)  # their tools are in the folders of their names
PLUGINS = "FILOPLUME_PLUGINS"  # folders of a studio's own tools, separated as in PATH


class Trouble(NamedTuple):
    """A tool file that was left out, and why."""

    file: str
    reason: str


class Registry:
    """Tools by name, in the order of the shelf, and the crafts they belong to.

    Parameters
    ----------
    folders : of Python files with tools of a studio; those of the environment variable by default, none for a safe
        start. They are programs: only name folders you trust.
    """

    def __init__(self, folders: tuple[Path, ...] | None = None) -> None:
        self.tools: dict[str, type[Tool[Any]]] = {}
        self.troubles: list[Trouble] = []
        self.crafts: dict[str, type[Any]] = {kind.name: kind for kind in CRAFTS}
        for craft in CRAFTS:
            package = importlib.import_module(f"tools.{craft.name}")
            for found in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
                self._add(f"{found.name}.py", lambda name=found.name: importlib.import_module(name))
        for folder in _plugin_folders() if folders is None else folders:
            if not folder.is_dir():
                self.troubles.append(Trouble(str(folder), "there is no such folder"))
            for file in sorted(folder.glob("*.py")):
                self._add(str(file), lambda file=file: _loaded(file))
        self.tools = dict(sorted(self.tools.items(), key=lambda item: (item[1].order, item[0])))

    def __iter__(self) -> Iterator[type[Tool[Any]]]:
        return iter(self.tools.values())

    def __contains__(self, name: str) -> bool:
        return name in self.tools

    def of(self, craft: str) -> tuple[type[Tool[Any]], ...]:
        """The tools of a craft, in the order of its shelf."""
        return tuple(kind for kind in self if kind.craft == craft)

    def make(self, name: str, params: dict[str, Any] | None = None) -> Tool[Any]:
        """The tool of that name with parameters from plain JSON values (a preset, a workspace).

        Raises
        ------
        UserError
            There is no such tool, or a parameter is not as it should be (the message names it).
        """
        if name not in self.tools:
            raise UserError(f"There is no tool named {name!r}; choose one of {', '.join(self.tools)}.")
        kind = self.tools[name]
        try:
            return kind(msgspec.convert(params or {}, kind.Params))
        except msgspec.ValidationError as error:
            raise UserError(f"The settings of the tool {kind.label} cannot be used: {error}.") from error

    def _add(self, file: str, load: Any) -> None:
        try:
            module: ModuleType = load()
            found = [
                thing for thing in vars(module).values()
                if isinstance(thing, type) and issubclass(thing, Tool) and thing.__module__ == module.__name__
                and hasattr(thing, "name")
            ]
            for kind in found:
                _check(kind)
                if kind.name in self.tools:
                    raise ValueError(f"a tool named {kind.name!r} exists already")
            self.tools |= {kind.name: kind for kind in found}
        except Exception as error:  # whatever a plug-in does wrong, the start goes on
            self.troubles.append(Trouble(file, f"{type(error).__name__}: {error}"))


def _check(kind: type[Tool[Any]]) -> None:
    for word in ("name", "label", "icon", "tooltip", "hint", "step"):
        if not isinstance(getattr(kind, word, None), str) or not getattr(kind, word):
            raise ValueError(f"the tool {kind.__name__} needs a {word}")
    if not isinstance(getattr(kind, "order", None), int):
        raise ValueError(f"the tool {kind.__name__} needs an order, a whole number that places it on the shelf")
    edits = {craft.name: craft.edits for craft in CRAFTS}
    if kind.edits not in edits.get(kind.craft, ()):
        raise ValueError(f"the tool {kind.__name__} edits {kind.edits!r}, which the craft {kind.craft!r} does not know")
    if len(kind.tooltip.split()) < 8:
        raise ValueError(f"the tooltip of {kind.name} says too little")
    fields_of(kind.Params)
    kind(kind.Params())


def _plugin_folders() -> tuple[Path, ...]:
    return tuple(Path(part) for part in os.environ.get(PLUGINS, "").split(os.pathsep) if part)


def _loaded(file: Path) -> ModuleType:
    name = f"filoplume_plugin_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ImportError("it cannot be loaded as Python")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # records look their own module up by name
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module
