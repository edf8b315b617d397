"""Programs from the files in resources/shaders."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import moderngl
import numpy as np

from core.errors import UserError

FOLDER = Path(__file__).resolve().parent.parent / "resources" / "shaders"


def source(*names: str) -> str:
    """The text of the named files joined under one version line.

    Raises
    ------
    UserError
        When a file is missing from the installation.
    """
    parts = ["#version 330 core\n"]
    for name in names:
        try:
            parts.append((FOLDER / name).read_text(encoding="utf-8"))
        except OSError as error:
            raise UserError(f"The shader {name} is missing; install Filoplume again.") from error
    return "\n".join(parts)


def program(ctx: moderngl.Context, vertex: tuple[str, ...], fragment: tuple[str, ...]) -> moderngl.Program:
    """Compile and link files: common parts first, the one with ``main`` last."""
    return ctx.program(vertex_shader=source(*vertex), fragment_shader=source(*fragment))


def set_uniforms(prog: moderngl.Program, values: dict[str, Any]) -> None:
    """Set the uniforms that the program has (a compiler drops unused ones); 4x4 arrays are row-major as in core."""
    for name, value in values.items():
        member = prog.get(name, None)
        if not isinstance(member, moderngl.Uniform):
            continue
        if isinstance(value, np.ndarray) and value.shape == (4, 4):
            member.write(np.ascontiguousarray(value.T, dtype=np.float32).tobytes())
        elif isinstance(value, np.ndarray):
            member.value = tuple(float(x) for x in value)
        else:
            member.value = value
