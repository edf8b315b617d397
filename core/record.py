"""Records: the frozen values every document is made of, whose leaves are read-only numpy arrays."""

from __future__ import annotations

import math
from typing import Any, dataclass_transform

import msgspec
import numpy as np
from numpy.typing import DTypeLike, NDArray


# the decorator only tells type checkers that subclasses are frozen too
@dataclass_transform(frozen_default=True, kw_only_default=True, eq_default=False)
class Record(
    msgspec.Struct, frozen=True, eq=False, weakref=True, kw_only=True, forbid_unknown_fields=True
):
    """Base of every record. Change one with ``replace``; compare with ``is``.

    A subclass that holds arrays checks them in ``__post_init__`` with :func:`column`.
    """

    def replace(self, **changes: Any) -> Any:
        """Return a copy with the named fields changed (``__post_init__`` runs again)."""
        return msgspec.structs.replace(self, **changes)


def freeze(array: NDArray[Any], dtype: DTypeLike | None = None) -> NDArray[Any]:
    """Return `array` as a read-only C-contiguous array, copying only when it must.

    An array that owns its memory is frozen in place: call this on the fresh result of a kernel and
    do not write to it afterwards. An array already read-only down to its last base comes back as itself.
    """
    out = np.ascontiguousarray(array, dtype)
    if is_frozen(out):
        return out
    if out.base is not None:
        out = out.copy()  # somebody else may still write through the base
    out.flags.writeable = False
    return out


def is_frozen(array: NDArray[Any]) -> bool:
    """True when neither `array` nor any array it is a view of can be written to."""
    link: object = array
    while isinstance(link, np.ndarray):
        if link.flags.writeable:
            return False
        link = link.base
    return True


def column(record: Record, name: str, dtype: DTypeLike, shape: tuple[int | None, ...]) -> None:
    """Check (and freeze) the array field `name` of `record`: dtype, dimensions, finite values.

    Parameters
    ----------
    shape : one entry per axis; None leaves that axis free.

    Raises
    ------
    ValueError
        The message names the field and says what was expected.
    """
    array = np.asarray(getattr(record, name))
    label = f"{type(record).__name__}.{name}"
    if array.dtype != np.dtype(dtype):
        raise ValueError(f"{label} must be {np.dtype(dtype)}, not {array.dtype}")
    if array.ndim != len(shape) or any(
        want is not None and have != want for have, want in zip(array.shape, shape, strict=True)
    ):
        wanted = ", ".join("any" if s is None else str(s) for s in shape)
        raise ValueError(f"{label} must have shape ({wanted}), not {array.shape}")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"{label} holds values that are not finite numbers")
    frozen = freeze(array if is_frozen(array) else array.copy())
    if frozen is not getattr(record, name):
        msgspec.structs.force_setattr(record, name, frozen)


def text(record: Record, *names: str, longest: int = 255) -> None:
    """Check text fields of `record`: 1 to `longest` printable characters.

    Raises
    ------
    ValueError
        The message names the field.
    """
    for name in names:
        value = getattr(record, name)
        if not (isinstance(value, str) and 0 < len(value) <= longest and value.isprintable()):
            raise ValueError(f"{type(record).__name__}.{name} must be 1 to {longest} printable characters")


def number(record: Record, *names: str, least: float = -math.inf, most: float = math.inf) -> None:
    """Check number fields (or tuples of numbers) of `record`: finite and within `least` .. `most`.

    Raises
    ------
    ValueError
        The message names the field and the limits.
    """
    for name in names:
        value = getattr(record, name)
        for v in value if isinstance(value, tuple) else (value,):
            if not (isinstance(v, int | float) and math.isfinite(v) and least <= v <= most):
                limits = f" from {least:g} to {most:g}" if math.isfinite(least) or math.isfinite(most) else ""
                raise ValueError(f"{type(record).__name__}.{name} must be a finite number{limits}, not {v!r}")
