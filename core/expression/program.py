"""Running a parsed expression over numpy columns, within a budget."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.errors import UserError
from core.expression.functions import COMPARISONS, FUNCTIONS, OPERATORS
from core.expression.parser import MAX_NUMBER, Instruction, Program, parse, unknown_name

Array = NDArray[np.float64]

# Work units, about a nanosecond each. A count rather than a clock, so that a file behaves the same on every machine.
MAX_COST = 20_000_000_000
_SLICE = 32_768  # values computed at a time: temporaries stay in the cache and memory is bounded


def evaluate(expression: Program | str, fields: Mapping[str, ArrayLike] | None = None) -> Array:
    """Evaluate an expression over columns.

    Parameters
    ----------
    expression : parsed, or source.
    fields : what each name stands for: numbers or arrays that broadcast against each other.

    Returns
    -------
    float64 array of the broadcast shape of the fields it uses (shape () when it uses only numbers); always finite and
    within 1e30 (the rules are in the package's docstring).

    Raises
    ------
    ExpressionError
        On a name that `fields` does not have.
    UserError
        When columns do not fit together, or operations times rows pass MAX_COST.
    """
    program = parse(expression) if isinstance(expression, str) else expression
    columns = _columns(program, fields or {})
    try:
        shape = np.broadcast_shapes(*(column.shape for column in columns.values()))
    except ValueError:
        sizes = ", ".join(f"{name} {column.shape}" for name, column in columns.items())
        raise UserError(f"The values of the expression {program.source[:60]!r} differ in size: {sizes}.") from None
    if cost(program) * prod(shape) > MAX_COST:
        raise UserError(
            f"The expression {program.source[:60]!r} is too expensive for {prod(shape):,} values; make it simpler."
        )
    with np.errstate(all="ignore"):
        if prod(shape) <= _SLICE or not shape:
            return np.array(np.broadcast_to(_run(program.code, columns), shape))
        out = np.empty(shape)
        rows = max(1, _SLICE // max(1, prod(shape[1:])))
        for first in range(0, shape[0], rows):
            part = {
                name: column[first:first + rows] if column.ndim == len(shape) and column.shape[0] > 1 else column
                for name, column in columns.items()
            }
            out[first:first + rows] = _run(program.code, part)
        return out


def cost(program: Program) -> int:
    """Work units of the program for one row."""
    total = 0
    for step in program.code:
        if step.kind == "call":
            total += FUNCTIONS[step.text].cost
        elif step.kind == "operator":
            total += OPERATORS[step.text].cost
        else:
            total += max(1, step.arity)
    return total


def hold(values: ArrayLike) -> Array:
    """Values as finite float64: NaN becomes 0, what is beyond 1e30 is held there."""
    held = np.clip(np.asarray(values, np.float64), -MAX_NUMBER, MAX_NUMBER)
    return np.where(np.isnan(held), 0.0, held) if np.isnan(np.sum(held)) else np.asarray(held)


def _columns(program: Program, fields: Mapping[str, ArrayLike]) -> dict[str, Array]:
    columns = {}
    for step in program.code:
        if step.kind == "name" and step.text not in columns:
            if step.text not in fields:
                raise unknown_name(step.text, fields.keys(), program.source, step.column)
            columns[step.text] = np.asarray(fields[step.text], np.float64)
    return columns


def _run(code: tuple[Instruction, ...], columns: Mapping[str, Array]) -> Array:
    stack: list[Array] = []
    for step in code:
        if step.kind == "number":
            stack.append(np.asarray(step.number))
            continue
        if step.kind == "name":
            stack.append(hold(columns[step.text]))
            continue
        operands = stack[-step.arity:]
        del stack[-step.arity:]
        if step.kind == "compare":
            result: Array = np.ones(())
            for mark, a, b in zip(step.text.split(), operands, operands[1:], strict=False):
                result = result * COMPARISONS[mark](a, b)
        else:
            table = FUNCTIONS if step.kind == "call" else OPERATORS
            result = table[step.text].call(*operands)
        stack.append(hold(result))
    return stack.pop()
