"""The grammar against Python's own, with which it shares precedence and meaning where both have a sentence."""

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.errors import UserError
from core.expression import ExpressionError, evaluate, names_used, parse
from core.expression.parser import MAX_DEPTH, MAX_INSTRUCTIONS, MAX_SOURCE
from tests.expression_inputs import NAMES, any_input, check_fault

FIELDS = {"u": 0.25, "v": -3.5, "t": 2.0, "frame": 1001.0}

numbers = st.one_of(st.integers(0, 30).map(str), st.floats(0.01, 50).map(lambda x: f"{x:.4g}"),
    st.sampled_from(list(FIELDS)))


def extend(inner):
    pairs = st.tuples(inner, st.sampled_from(["+", "-", "*", "/", "%"]), inner).map(" ".join)
    compared = st.tuples(inner, st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), inner).map(
        lambda p: "(1 if " + " ".join(p) + " else 0)")
    chains = st.tuples(inner, inner, inner).map(lambda p: f"({p[0]} < {p[1]} <= {p[2]}) * 1")
    chosen = st.tuples(inner, inner, inner).map(lambda p: f"({p[0]} if {p[1]} > 1 else {p[2]})")
    logic = st.tuples(inner, inner, inner).map(lambda p: f"(2 if not {p[0]} < 1 and {p[1]} > 3 or {p[2]} else 5)")
    signed = st.tuples(st.sampled_from(["-", "+", "- -"]), inner).map("".join)
    powers = st.tuples(st.sampled_from(["2", "(-2)", "-1.5", "3"]), st.sampled_from(["2", "-2", "3", "2 ** 2",
        "-1 ** 2"])).map(
        " ** ".join)
    calls = st.tuples(st.sampled_from(["sin", "cos", "atan", "floor", "abs"]), inner).map(lambda p: f"{p[0]}({p[1]})")
    return st.one_of(pairs, compared, chains, chosen, logic, signed, powers, calls, inner.map(lambda s: f"({s})"))


PYTHON = {"sin": math.sin, "cos": math.cos, "atan": math.atan, "floor": math.floor, "abs": abs, "__builtins__": {}}


@settings(max_examples=600, deadline=None)
@given(st.recursive(numbers, extend, max_leaves=12))
def test_means_what_python_means(source):
    try:
        truth = float(eval(source, PYTHON, FIELDS))
    except (ZeroDivisionError, OverflowError):
        return  # our own rule, tested elsewhere
    if abs(truth) > 1e12:
        return
    assert evaluate(source, FIELDS) == pytest.approx(truth, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(("source", "truth"), [
    ("-2 ** 2", -4), ("2 ** 3 ** 2", 512), ("2 ** -1", 0.5), ("-2 ** -2", -0.25), ("10 - 4 - 3", 3), ("24 / 4 / 2", 3),
    ("7 % 4 * 2", 6), ("-7 % 3", 2), ("1 < 2 < 3", 1), ("3 > 2 > 2", 0), ("1 == 1 == 1", 1), ("not 1 == 2", 1),
    ("not not 5", 1), ("1 or 0 and 0", 1), ("2 and 3", 1), ("0 or 0", 0), ("1 if 0 else 2 if 0 else 3", 3),
    ("(1 if 1 else 2) + 1", 2), ("1 + 1 if 0 else 4", 4), ("1e3", 1000), (".5", 0.5), ("5.", 5), ("2E-2", 0.02),
    ("pi * 2 - tau", 0), (" \t\n1 ", 1), ("min(3, 1, 2)", 1), ("min(\n1,\n2)", 1), ("+-+1", -1), ("1<2", 1),
    ("u if frame >= 1001 else v", 0.25), ("2*-3", -6), ("not 0 + 1", 0), ("1 - -1", 2),
])
def test_examples(source, truth):
    assert evaluate(source, FIELDS) == truth


@pytest.mark.parametrize(("source", "column", "words"), [
    ("1 + 0.8*sin(u*20", 17, "a bracket is not closed"), ("(1 + 2", 7, "a bracket is not closed"),
    ("", 1, "the end"), ("1 +", 4, "the end"), ("1 + * 2", 5, "'*'"), ("(1", 3, "')'"), ("1)", 2, "operator"),
    ("1 2", 3, "operator"), ("foo(1)", 1, "no function 'foo'"), ("2 + sinn(1)", 5, "did you mean 'sin'"),
    ("1 + lenght", 5, "no value named 'lenght'"), ("u.real", 2, "'.'"), ("u[0]", 2, "'['"), ("'a'", 1, "meaning"),
    ("a = 1", 3, "=="), ("sin(1, 2)", 8, "too many"), ("fit(1, 2)", 9, "too few"), ("sin()", 5, "too few"),
    ("sin", 1, "is a function"), ("2x", 2, "number"), ("0x10", 2, "number"), ("1_000", 2, "number"), ("1j", 2,
    "number"),
    ("1..real", 3, "number"), ("1e999", 1, "1e+30"), ("2e30", 1, "1e+30"), ("1 if 2", 7, "'else'"), ("if 1 else 2",
    1, "'if'"),
    ("1 < ", 5, "the end"), ("not", 4, "the end"), ("sin(,)", 5, "','"), ("max(1,)", 7, "')'"), ("_u", 1, "'_'"),
    ("u ++", 5, "the end"), ("u // 2", 4, "'/'"), ("u ** ", 6, "the end"), ("\u0661 + 1", 1, "meaning"), ("pi(2)", 1,
    "no function"),
    ("u(2)", 1, "no function"), ("lambda: 1", 7, "':'"), ("1 and", 6, "the end"), ("u & v", 3, "'&'"),
])
def test_faults_name_their_column(source, column, words):
    with pytest.raises(ExpressionError) as caught:
        parse(source, ("u", "v", "length", "a"))
    error = caught.value
    assert (error.column, words in str(error)) == (column, True), str(error)
    assert f"olumn {column} " in str(error)
    assert error.caret.split("\n")[1] == " " * (column - 1) + "^"
    assert isinstance(error, UserError)


def test_caret_of_a_long_source_shows_the_place():
    source = "1 + " * 100 + "$"
    with pytest.raises(ExpressionError) as caught:
        parse(source)
    line, mark = caught.value.caret.split("\n")
    assert line[mark.index("^")] == "$"
    assert len(line) <= 80


def test_names_used():
    assert names_used("u + sin(frame) * (density_map if v else pi) + u") == {"u", "frame", "v", "density_map"}
    assert names_used("1 + tau") == frozenset()


@pytest.mark.parametrize("source", [
    "(" * 200_000, "-" * 3000 + "1", "not " * 900 + "1", "2**" * 900 + "2", "1 if 1 else " * 300 + "1",
    "sin(" * 500 + "1" + ")" * 500, "(" * (MAX_DEPTH + 1) + "1" + ")" * (MAX_DEPTH + 1), "1+" * 1999 + "1",
    "a" * (MAX_SOURCE + 1), "max(" + "1," * 16 + "1)", "9" * 4000, " " * 4001, "1 < " * 600 + "1",
])
def test_budgets(source):
    with pytest.raises(ExpressionError):
        parse(source)


def test_within_the_budgets():
    deep = MAX_DEPTH - 1
    assert evaluate("(" * deep + "1" + ")" * deep) == 1
    terms = (MAX_INSTRUCTIONS + 1) // 2
    assert evaluate("+".join(["1"] * terms)) == terms
    assert evaluate("-" * deep + "1") == (1 if deep % 2 == 0 else -1)


@settings(max_examples=400, deadline=None)
@given(st.integers(0, 2**32))
def test_generated_inputs_give_finite_numbers_or_a_column(seed):
    source = any_input(random.Random(seed))
    fields = dict.fromkeys(NAMES, np.array([0.0, -1.5, np.nan, np.inf, 1e308]))
    try:
        result = evaluate(parse(source, NAMES), fields)
    except ExpressionError as error:
        check_fault(error, source)
    else:
        assert np.isfinite(result).all()
        assert np.abs(result).max() <= 1e30


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=80))
def test_any_text(source):
    try:
        parse(source, NAMES)
    except ExpressionError as error:
        check_fault(error, source)
