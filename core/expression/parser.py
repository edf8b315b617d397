"""From source to instructions: a tokenizer and a Pratt parser that writes postfix code as it goes."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterator
from typing import NamedTuple

from core.errors import UserError
from core.expression.functions import COMPARISONS, FUNCTIONS

MAX_SOURCE = 4000  # characters
MAX_INSTRUCTIONS = 500
MAX_DEPTH = 50  # of nesting: brackets, signs, powers, branches
MAX_NUMBER = 1e30

CONSTANTS = {"pi": 3.141592653589793, "tau": 6.283185307179586}
WORDS = ("and", "or", "not", "if", "else")

_TOKEN = re.compile(
    r"(?P<space>[ \t\r\n]+)"
    r"|(?P<number>(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z][A-Za-z0-9_]*)"
    r"|(?P<mark>\*\*|<=|>=|==|!=|[-+*/%<>(),])"
)

# How tightly each infix operator binds its left side.
_BINDING = {
    "if": 10, "or": 20, "and": 30, **dict.fromkeys(COMPARISONS, 50),
    "+": 60, "-": 60, "*": 70, "/": 70, "%": 70, "**": 90
}
_NOT, _SIGN = 40, 80


class ExpressionError(UserError, ValueError):
    """A fault in an expression. ``str`` is one sentence with the column; ``caret`` shows the place in two lines.

    It is a ValueError as well, so that decoding a document adds the path of the offending field.

    column : 1-based, counted in the whole source.
    """

    def __init__(self, message: str, source: str, column: int) -> None:
        super().__init__(f"Column {column} of the expression: {message}")
        self.message, self.source, self.column = message, source, column

    @property
    def caret(self) -> str:
        """The source on one line (a window of it when long) and a ``^`` under the column."""
        at = self.column - 1
        first = max(0, at - 40)
        line = re.sub(r"[^ -~]", " ", self.source[first:first + 76])
        return f"{line}\n{' ' * (at - first)}^"


class Token(NamedTuple):
    kind: str  # "number", "name", "mark" or "end"
    text: str
    column: int


class Instruction(NamedTuple):
    """Push a number or a name's column, or take `arity` operands off the stack and push one result.

    kind : "number", "name", "call" (a function), "operator" or "compare" (`text` holds the comparisons, spaced).
    """

    kind: str
    text: str
    column: int
    arity: int = 0
    number: float = 0.0


class Program(NamedTuple):
    """A parsed expression: postfix `code` and its `source`."""

    source: str
    code: tuple[Instruction, ...]


def parse(source: str, names: Collection[str] | None = None) -> Program:
    """Parse an expression.

    Parameters
    ----------
    names : the names it may use; None allows any (they are then checked on evaluation).

    Raises
    ------
    ExpressionError
        With the column: on a fault of syntax, an unknown name or function, or when a budget is passed
        (MAX_SOURCE characters, MAX_INSTRUCTIONS, MAX_DEPTH of nesting).
    """
    if len(source) > MAX_SOURCE:
        raise ExpressionError(f"it is longer than {MAX_SOURCE} characters; make it shorter.", source, MAX_SOURCE + 1)
    parser = _Parser(source, names)
    parser.expression(0, 1)
    token = parser.token
    if token.kind != "end":
        raise ExpressionError(f"expected an operator before {token.text!r}.", source, token.column)
    return Program(source, tuple(parser.code))


def names_used(expression: Program | str) -> frozenset[str]:
    """The names it reads (``frame`` among them when it changes over time), without constants and functions."""
    program = parse(expression) if isinstance(expression, str) else expression
    return frozenset(step.text for step in program.code if step.kind == "name")


def _tokens(source: str) -> Iterator[Token]:
    at = 0
    while at < len(source):
        match = _TOKEN.match(source, at)
        if match is None:
            shown = ascii(source[at])
            hint = " (write == to compare)" if source[at] == "=" else ""
            raise ExpressionError(f"{shown} has no meaning here{hint}.", source, at + 1)
        kind = str(match.lastgroup)
        if kind != "space":
            yield Token(kind, match.group(), at + 1)
        at = match.end()
        if kind == "number" and at < len(source) and (source[at].isalnum() or source[at] in "._"):
            raise ExpressionError(f"a number cannot be followed by {source[at]!a}.", source, at + 1)
    yield Token("end", "the end", len(source) + 1)


class _Parser:
    """Parsing in progress. Each method leaves the code for one value behind."""

    def __init__(self, source: str, names: Collection[str] | None) -> None:
        self.source, self.names = source, names
        self.code: list[Instruction] = []
        self._rest = _tokens(source)
        self.token = next(self._rest)

    def fail(self, message: str, token: Token) -> ExpressionError:
        return ExpressionError(message, self.source, token.column)

    def advance(self) -> Token:
        token = self.token
        if token.kind != "end":
            self.token = next(self._rest)
        return token

    def expect(self, text: str) -> None:
        if self.token.kind == "end" and text == ")":
            raise self.fail("a bracket is not closed: add ')'.", self.token)
        if self.token.text != text or self.token.kind == "end":
            raise self.fail(f"expected {text!r}, found {self.shown(self.token)}.", self.token)
        self.advance()

    def shown(self, token: Token) -> str:
        return token.text if token.kind == "end" else repr(token.text)

    def emit(self, kind: str, token: Token, text: str, arity: int = 0, number: float = 0.0) -> None:
        if len(self.code) >= MAX_INSTRUCTIONS:
            raise self.fail(f"more than {MAX_INSTRUCTIONS} operations; make the expression simpler.", token)
        self.code.append(Instruction(kind, text, token.column, arity, number))

    def expression(self, binding: int, depth: int) -> None:
        """One value and every infix operator after it that binds tighter than `binding`."""
        if depth > MAX_DEPTH:
            raise self.fail(f"nested more than {MAX_DEPTH} deep; make the expression simpler.", self.token)
        self.prefix(depth)
        while True:
            token = self.token
            power = _BINDING.get(token.text, 0) if token.kind != "end" else 0
            if power <= binding:
                return
            if token.text in COMPARISONS:
                self.comparisons(depth)
                continue
            self.advance()
            if token.text == "if":
                self.expression(_BINDING["if"], depth + 1)
                self.expect("else")
                self.expression(_BINDING["if"] - 1, depth + 1)  # to the right: a if c else (b if d else e)
                self.emit("operator", token, "if", 3)
            elif token.text == "**":
                self.expression(_SIGN - 1, depth + 1)  # to the right, and 2 ** -1 is allowed
                self.emit("operator", token, "**", 2)
            else:
                self.expression(power, depth + 1)
                self.emit("operator", token, token.text, 2)

    def comparisons(self, depth: int) -> None:
        first, marks = self.token, []
        while self.token.kind == "mark" and self.token.text in COMPARISONS:
            marks.append(self.advance().text)
            self.expression(_BINDING["<"], depth + 1)
        self.emit("compare", first, " ".join(marks), len(marks) + 1)

    def prefix(self, depth: int) -> None:
        token = self.advance()
        if token.kind == "number":
            number = float(token.text)
            if number > MAX_NUMBER:
                raise self.fail(f"numbers may reach {MAX_NUMBER:g} at most.", token)
            self.emit("number", token, token.text, 0, number)
        elif token.text in ("-", "+"):
            self.expression(_SIGN, depth + 1)
            if token.text == "-":
                self.emit("operator", token, "negative", 1)
        elif token.text == "not":
            self.expression(_NOT, depth + 1)
            self.emit("operator", token, "not", 1)
        elif token.text == "(":
            self.expression(0, depth + 1)
            self.expect(")")
        elif token.kind == "name" and token.text not in WORDS:
            if self.token.text == "(":
                self.call(token, depth)
            else:
                self.name(token)
        else:
            raise self.fail(f"expected a number, a name or a bracket, found {self.shown(token)}.", token)

    def name(self, token: Token) -> None:
        if token.text in CONSTANTS:
            self.emit("number", token, token.text, 0, CONSTANTS[token.text])
            return
        if token.text in FUNCTIONS:
            raise self.fail(f"{token.text} is a function: write {FUNCTIONS[token.text].help}.", token)
        if self.names is not None and token.text not in self.names:
            raise unknown_name(token.text, self.names, self.source, token.column)
        self.emit("name", token, token.text)

    def call(self, token: Token, depth: int) -> None:
        function = FUNCTIONS.get(token.text)
        if function is None:
            raise self.fail(f"there is no function {token.text!r}{_nearest(token.text, FUNCTIONS)}.", token)
        self.advance()
        count = 0
        while self.token.text != ")" and self.token.kind != "end":
            if count:
                self.expect(",")
            if count == function.most:
                raise self.fail(f"too many arguments: {function.help}.", self.token)
            self.expression(0, depth + 1)
            count += 1
        if count < function.fewest:
            raise self.fail(f"too few arguments: {function.help}.", self.token)
        self.expect(")")
        self.emit("call", token, token.text, count)


def unknown_name(name: str, known: Collection[str], source: str, column: int) -> ExpressionError:
    """The error for a name nobody offers, with the nearest one that is."""
    return ExpressionError(f"there is no value named {name!r}{_nearest(name, known)}.", source, column)


def _nearest(word: str, known: Collection[str]) -> str:
    close = difflib.get_close_matches(word, sorted(known), 1)
    return f"; did you mean {close[0]!r}" if close else ""


