"""Inputs for the expression parser: valid sources, sources with one fault, and soup."""

from __future__ import annotations

import random
import string

from core.expression import ExpressionError
from core.expression.functions import FUNCTIONS

NAMES = ("id", "u", "v", "t", "frame", "curl_map")
INFIX = ("+", "-", "*", "/", "%", "**", "<", "<=", ">", ">=", "==", "!=", "and", "or")
NUMBERS = ("0", "1", "2", "0.5", "3.25", ".1", "7.", "1e3", "2E-3", "1e30", "1e-300", "123456789", "0.1e+2", "pi",
    "tau")
PIECES = (*NAMES, *INFIX, *NUMBERS, *FUNCTIONS, "(", ")", ",", "not", "if", "else", " ", "\t", "\n", ".", "[", "]",
    "'", "__")
HOSTILE = ("\x00", "\u0660", "\u00b2", "\u037e", "\u2028", "\U0001f98a", "\ud800", "\\", "`", "@", ":=", "lambda",
    "->", "=", "{", "}", "#", ";", "~", "|", "&", "^")


def valid(rng: random.Random, depth: int) -> str:
    """A source the grammar accepts (unless it passes a budget)."""
    kind = rng.randrange(10) if depth > 0 else 0
    if kind <= 1:
        return rng.choice(NAMES) if rng.random() < 0.5 else rng.choice(NUMBERS)
    if kind <= 5:
        a, b = valid(rng, depth - 1), valid(rng, depth - 1)
        source = f"{a} {rng.choice(INFIX)} {b}"
        return f"({source})" if rng.random() < 0.5 else source
    if kind == 6:
        return f"{rng.choice(('-', '+', '--', '-+-'))}{valid(rng, depth - 1)}"
    if kind == 7:
        a, c, b = (valid(rng, depth - 1) for _ in range(3))
        return f"({a} if {c} else {b})"
    if kind == 8:
        return f"(not {valid(rng, depth - 1)})"
    name = rng.choice(list(FUNCTIONS))
    function = FUNCTIONS[name]
    count = rng.randint(function.fewest, min(function.most, function.fewest + 3))
    return f"{name}({', '.join(valid(rng, depth - 1) for _ in range(count))})"


def faulty(rng: random.Random, depth: int) -> str:
    """A valid source with a few characters removed, doubled, exchanged or put in."""
    text = list(valid(rng, depth))
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(text) + 1)
        change = rng.randrange(4)
        if change == 0 and at < len(text):
            del text[at]
        elif change == 1 and at < len(text):
            text.insert(at, text[at])
        elif change == 2:
            text.insert(at, rng.choice(PIECES))
        else:
            text.insert(at, rng.choice(HOSTILE))
    return "".join(text)


def soup(rng: random.Random) -> str:
    """Pieces of the language, arbitrary characters or bytes in any order, sometimes much repeated."""
    kind = rng.randrange(4)
    if kind == 0:
        return "".join(rng.choice(PIECES) for _ in range(rng.randint(0, 60)))
    if kind == 1:
        return bytes(rng.randrange(256) for _ in range(rng.randint(0, 60))).decode("latin-1")
    if kind == 2:
        return "".join(rng.choice(string.printable) for _ in range(rng.randint(0, 60)))
    return rng.choice((*PIECES, *HOSTILE)) * rng.choice((1, 49, 50, 51, 500, 5000))


def any_input(rng: random.Random) -> str:
    kind = rng.random()
    if kind < 0.5:
        return valid(rng, rng.randint(0, 5))
    return faulty(rng, rng.randint(0, 5)) if kind < 0.75 else soup(rng)


def check_fault(error: ExpressionError, source: str) -> None:
    """An error names a column of the source, in one printable sentence, and its caret stands under the line."""
    assert 1 <= error.column <= len(source) + 1
    assert str(error).isprintable()
    line, mark = error.caret.split("\n")
    assert mark.index("^") <= len(line)
