"""A graphics context without a window, through EGL."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import moderngl

from core.errors import UserError


def standalone_context() -> moderngl.Context:
    """Create an OpenGL 3.3 core context that needs no display, current on this thread.

    Objects that Python has dropped are released by :func:`collect` while the context is current.

    Raises
    ------
    UserError
        When no EGL library or no driver with OpenGL 3.3 is found.
    """
    settings: dict[str, Any] = {"require": 330, "standalone": True, "backend": "egl"}
    try:
        context = moderngl.create_context(**settings)
    except Exception as error:  # glcontext raises bare Exceptions
        raise UserError(
            "Pictures need OpenGL 3.3 through EGL, and none was found; install the packages libegl1 and "
            f"libgl1-mesa-dri (or a graphics driver). ({error})"
        ) from error
    context.gc_mode = "context_gc"
    return context


@contextmanager
def temporary_context() -> Iterator[moderngl.Context]:
    """A standalone context for one block; everything made in it is released at the end, errors included."""
    context = standalone_context()
    try:
        yield context
    finally:
        end(context)


def end(context: moderngl.Context) -> None:
    """Release a standalone context with all that Python has dropped in it.

    A released context stays the current one of its thread (moderngl 5.12), and a window that is made there afterwards
    ends the program: so the thread lets go of it first.
    """
    collect(context)
    context.__exit__(None, None, None)
    context.release()


def collect(context: moderngl.Context) -> int:
    """Release what Python dropped without releasing; returns how many objects that were. The context must be current.

    ``Context.gc()`` fails on objects that were released by hand, which wait in the same list (moderngl 5.12, 5.13).
    """
    count = 0
    while context.objects:
        thing = context.objects.popleft()
        if not isinstance(thing, moderngl.InvalidObject):
            thing.release()
            count += 1
    return count
