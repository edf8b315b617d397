"""Macros: what was done, written as a Python script that does it again to the same bits on the same document."""

from __future__ import annotations

import math
import os
import runpy
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from core.errors import UserError
from core.formats.atomic import atomic_write
from core.record import Record
from core.workspace import Respect
from tools.hand import StrokeRecord

MOST_NUMBERS = 64  # of an array that is written into a script


class ActionRecord(NamedTuple):
    """An action and what it was done to."""

    name: str
    params: dict[str, Any]
    groom: int
    respect: Respect


class EditRecord(NamedTuple):
    """A call of :meth:`tools.session.Session.edit`."""

    name: str
    function: Callable[..., Any]
    args: tuple[Any, ...]
    parameters: Mapping[str, Any]


Step = StrokeRecord | ActionRecord | EditRecord


class Macro:
    """A recording. What is undone while it goes on is not part of it, what is redone is again."""

    def __init__(self) -> None:
        self._steps: list[Step] = []
        self._place = 0  # how many of them are done at present; less than none when more was undone

    @property
    def steps(self) -> tuple[Step, ...]:
        """What was done, as far as it was not undone.

        Raises
        ------
        UserError
            More was undone than was recorded: the steps do not begin where the recording did.
        """
        if self._place < 0:
            raise UserError("You went back to before the recording began; redo that, or record the macro again.")
        return tuple(self._steps[: self._place])

    def stroked(self, record: StrokeRecord) -> None:
        """A stroke was finished."""
        self._add(record)

    def acted(self, name: str, params: dict[str, Any], groom: int, respect: Respect) -> None:
        """An action was done."""
        self._add(ActionRecord(name, params, groom, respect))

    def edited(
        self, name: str, function: Callable[..., Any], args: tuple[Any, ...], parameters: Mapping[str, Any]
    ) -> None:
        """The document was edited."""
        self._add(EditRecord(name, function, args, parameters))

    def moved(self, steps: int) -> None:
        """Undo (negative) or redo went over so many steps."""
        self._place += steps

    def script(self) -> str:
        """The script. What only this program run knows (a function of a console) stands in it as a comment."""
        writer = _Writer()
        lines = []
        for step in self.steps:
            try:
                lines += writer.lines(step)
            except _CannotBeWritten as reason:
                name = step.name if isinstance(step, ActionRecord | EditRecord) else step.tool
                lines.append(f"# left out, {reason}: {name}")
        body = "\n".join(f"    {line}" for line in lines) or "    pass"
        return _SCRIPT.format(imports=writer.imports(), sights=writer.sights(), body=body)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the script; UserError when that fails, an earlier file is untouched then."""
        text = self.script()
        with atomic_write(path) as temporary:
            temporary.write_text(text, encoding="utf-8")

    def _add(self, step: Step) -> None:
        if self._place >= 0:
            del self._steps[self._place :]
            self._steps.append(step)
            self._place += 1


def play(path: str | os.PathLike[str], session: object) -> None:
    """Do in a session (a ``tools.session.Session``) what a saved macro says.

    It is a program: only play macros you trust.

    Raises
    ------
    UserError
        It cannot be read or is no macro, or a step of it cannot be done here.
    """
    try:
        found = runpy.run_path(os.fspath(path), run_name="filoplume_macro")
        replay = found["replay"]
    except (OSError, SyntaxError, ImportError, KeyError, ValueError) as error:
        raise UserError(f"{Path(path).name} is no macro that can be played ({error}).") from error
    replay(session)


_SCRIPT = '''"""A macro recorded in Filoplume: filoplume run SCRIPT.py PROJECT.filo [RESULT.filo]"""

import sys

{imports}
{sights}

def replay(session):
{body}


if __name__ == "__main__":
    if len(sys.argv) < 2:
        raise SystemExit("say which project: filoplume run SCRIPT.py PROJECT.filo [RESULT.filo]")
    session = Session.open(sys.argv[1])
    replay(session)
    session.save(sys.argv[2] if len(sys.argv) > 2 else None)
    session.close()
'''


class _CannotBeWritten(Exception):
    """Why a value has no place in a script."""


class _Writer:
    """Values as Python source that makes them again to the bit."""

    def __init__(self) -> None:
        self._imports: set[tuple[str, str]] = {("tools.session", "Session")}
        self._numpy = False
        self._sights: dict[str, str] = {}

    def imports(self) -> str:
        lines = ["import numpy", ""] if self._numpy else []
        modules: dict[str, list[str]] = {}
        for module, name in sorted(self._imports):
            modules.setdefault(module, []).append(name)
        return "\n".join(lines + [f"from {module} import {', '.join(names)}" for module, names in modules.items()])

    def sights(self) -> str:
        return "".join(f"\n{name} = {source}" for source, name in self._sights.items()) + "\n"

    def lines(self, step: Step) -> list[str]:
        if isinstance(step, StrokeRecord):
            sight = self.value(step.sight)
            name = self._sights.setdefault(sight, f"SIGHT_{len(self._sights) + 1}")
            rest = [f"{field}={self.value(getattr(step, field))}" for field in ("tool", "params", "place")]
            batches = [f"    ({self._items(batch)})," for batch in step.batches]
            return [
                f"session.hand.replay({self._named(StrokeRecord)}({', '.join(rest)}, sight={name}, batches=(", *batches,
                ")))",
            ]
        if isinstance(step, ActionRecord):
            params = "".join(f", {name}={self.value(value)}" for name, value in step.params.items())
            respect = self.value(step.respect)
            return [
                f"session.set_workspace(groom={step.groom}, respect={respect})",
                f"session.act({step.name!r}{params})",
            ]
        module, name = getattr(step.function, "__module__", ""), getattr(step.function, "__qualname__", "")
        if module.split(".")[0] not in ("core", "tools") or getattr(sys.modules.get(module), name, None) is None:
            raise _CannotBeWritten("it is no function of the program's own")
        arguments = [self.value(v) for v in step.args] + [f"{k}={self.value(v)}" for k, v in step.parameters.items()]
        self._imports.add((module, name))
        return [f"session.edit({', '.join([repr(step.name), name, *arguments])})"]

    def value(self, value: Any) -> str:
        """Source of a value; _CannotBeWritten for what is not made of numbers, words, records and small arrays."""
        if value is None or isinstance(value, bool | str):
            return repr(value)
        if isinstance(value, int | np.integer):
            return repr(int(value))
        if isinstance(value, float | np.floating):
            if not math.isfinite(value):
                raise _CannotBeWritten("it has a number that is not finite")
            return repr(float(value))
        if isinstance(value, Path):
            self._imports.add(("pathlib", "Path"))
            return f"Path({os.fspath(value)!r})"
        if isinstance(value, np.ndarray):
            return self._array(value)
        if isinstance(value, Record):
            fields = [(f.encode_name, f.default) for f in msgspec.structs.fields(type(value))]
            return f"{self._named(type(value))}({self._changed(value, fields)})"
        if isinstance(value, tuple) and hasattr(value, "_fields"):
            defaults = type(value)._field_defaults  # type: ignore[attr-defined]
            fields = [(name, defaults.get(name, msgspec.NODEFAULT)) for name in value._fields]
            return f"{self._named(type(value))}({self._changed(value, fields)})"
        if isinstance(value, tuple):
            return f"({self._items(value)})"
        if isinstance(value, list):
            return f"[{', '.join(map(self.value, value))}]"
        if isinstance(value, Mapping):
            return "{" + ", ".join(f"{self.value(k)}: {self.value(v)}" for k, v in value.items()) + "}"
        raise _CannotBeWritten(f"a {type(value).__name__} cannot be written down")

    def _items(self, values: tuple[Any, ...]) -> str:
        return ", ".join(map(self.value, values)) + ("," if len(values) == 1 else "")

    def _changed(self, value: Any, fields: list[tuple[str, Any]]) -> str:
        """Arguments for the fields that are not as they are by default."""
        said = [(name, getattr(value, name), default) for name, default in fields]
        return ", ".join(
            f"{name}={self.value(have)}" for name, have, default in said
            if not (have is default or (type(have) is type(default) and not isinstance(have, np.ndarray | Record)
                                        and have == default))
        )

    def _array(self, array: np.ndarray) -> str:
        if array.size > MOST_NUMBERS or array.dtype.kind not in "fiub":
            raise _CannotBeWritten("it has an array too large for a script")
        self._numpy = True
        return f"numpy.array({self.value(array.tolist())}, numpy.{array.dtype.name})"

    def _named(self, kind: type) -> str:
        self._imports.add((kind.__module__, kind.__name__))
        return kind.__name__
