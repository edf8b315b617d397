"""What expressions compute. Truths: core.random, Python's math, closed forms, and properties of noise."""

import math

import numpy as np
import pytest

from core.errors import UserError
from core.expression import ExpressionError, evaluate, parse
from core.expression.functions import FUNCTIONS
from core.expression.program import cost
from core.random import rand, rand1

IDS = np.array([0, 1, 2, 77, 2**31 - 1, 123456], np.int32)


def test_rand_is_the_one_of_the_program():
    assert np.array_equal(evaluate("rand(id, 7)", {"id": IDS}), rand(IDS, 7))
    assert np.array_equal(evaluate("rand(id)", {"id": IDS}), rand(IDS, 0))
    assert [float(x) for x in evaluate("rand(id, 5)", {"id": IDS})] == [rand1(int(i), 5) for i in IDS]
    seeds = np.arange(6)
    assert np.array_equal(evaluate("rand(id, s)", {"id": IDS, "s": seeds}), [rand(i, int(s)) for i, s in zip(IDS,
        seeds)])
    assert np.array_equal(evaluate("rand(-3, -1)"), rand(-3, -1))
    assert np.array_equal(evaluate("rand(id + 0.75, 7)", {"id": IDS}), rand(IDS, 7))


def test_seeds_are_independent():
    ids = np.arange(20_000)
    a, b = evaluate("rand(id, 1)", {"id": ids}), evaluate("rand(id, 2)", {"id": ids})
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.03
    assert np.allclose(np.histogram(a, 10, (0, 1))[0], 2000, atol=200)


@pytest.mark.parametrize("name", ["sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "floor", "ceil",
                                  "degrees", "radians", "abs", "round"])
def test_as_in_python(name):
    x = np.array([0.1, 0.5, 0.75, 0.999])
    truth = {"abs": abs, "round": round}.get(name) or getattr(math, name)
    assert np.allclose(evaluate(f"{name}(x)", {"x": x}), [truth(v) for v in x])


def test_shaping():
    x = np.linspace(-2, 2, 9)
    fields = {"x": x}
    assert np.array_equal(evaluate("clamp(x, -1, 1)", fields), np.clip(x, -1, 1))
    assert np.allclose(evaluate("fit(x, -1, 1, 10, 20)", fields), 15 + 5 * np.clip(x, -1, 1))
    assert np.allclose(evaluate("fit(x, 1, -1, 10, 20)", fields), 15 - 5 * np.clip(x, -1, 1))
    assert np.array_equal(evaluate("fit(x, 1, 1, 10, 20)", fields), np.full(9, 10))
    assert np.array_equal(evaluate("mix(2, 4, x)", fields), 2 + 2 * x)
    assert np.array_equal(evaluate("lerp(2, 4, x)", fields), 2 + 2 * x)
    assert np.array_equal(evaluate("step(0, x)", fields), (x >= 0).astype(float))
    assert np.array_equal(evaluate("sign(x)", fields), np.sign(x))
    assert np.allclose(evaluate("frac(x)", fields), x - np.floor(x))
    s = np.clip((x + 1) / 2, 0, 1)
    assert np.allclose(evaluate("smoothstep(-1, 1, x)", fields), s * s * (3 - 2 * s))
    assert np.array_equal(evaluate("max(x, 0, 1) + min(x, 0)", fields), np.maximum(x, 1) + np.minimum(x, 0))
    assert np.allclose(evaluate("atan2(x, 1)", fields), np.arctan2(x, 1))


def test_noise_is_zero_on_the_lattice_smooth_between_and_bounded():
    x = np.linspace(-20, 20, 40_001)
    for source in (
        "noise(x)", "noise(x, 3)", "noise(x, 0.3, 0.6)", "noise(x, 0.3, 0.6, 9)", "fbm(x)", "fbm(x, 0.3, 0.6, 5, 2)",
    ):
        n = evaluate(source, {"x": x})
        assert np.abs(n).max() <= 1
        assert np.ptp(n) > 0.8
        assert np.abs(np.diff(n)).max() < 0.03  # no jump at a cell's border
        assert np.abs(np.diff(n, 2)).max() < 2e-4  # nor a kink
    whole = np.arange(-50.0, 50.0)
    assert np.abs(evaluate("noise(x)", {"x": whole})).max() < 1e-12
    assert np.abs(evaluate("noise(x, 3, -4)", {"x": whole})).max() < 1e-12
    assert not np.allclose(evaluate("noise(x, 1)", {"x": x}), evaluate("noise(x, 2)", {"x": x}), atol=0.1)
    assert np.array_equal(evaluate("fbm(x, 1)", {"x": x}), evaluate("noise(x)", {"x": x}))
    two = (evaluate("noise(x)", {"x": x}) + 0.5 * evaluate("noise(x * 2, 1)", {"x": x})) / 1.5
    assert np.allclose(evaluate("fbm(x, 2)", {"x": x}), two)
    assert abs(evaluate("noise(x)", {"x": x}).mean()) < 0.1


@pytest.mark.parametrize(("source", "truth"), [
    ("1 / 0", 0), ("0 / 0", 0), ("5 % 0", 0), ("0 ** -1", 0), ("sqrt(-1)", 0), ("log(0)", 0), ("log(-1)", 0),
    ("asin(2)", 0),
    ("(-1) ** 0.5", 0), ("exp(1000)", 1e30), ("-exp(1000)", -1e30), ("1e30 * 10", 1e30), ("x + 0", 0), ("big", 1e30),
    ("1 / 0 if 0 else 7", 7), ("0 ** 0", 1), ("tan(pi / 2) < 1e30", 1), ("noise(1e30, 1e30, 1e30) < 2", 1),
    ("rand(1e30, -1e30) < 1", 1), ("fbm(0.5, 1e30) < 2", 1),
])
def test_always_finite(source, truth):
    assert evaluate(source, {"x": np.nan, "big": np.inf}) == truth


def test_columns_broadcast_and_slices_agree():
    rows = 100_003  # more than one slice, and not a multiple of it
    u = np.random.default_rng(1).random(rows)
    source = "mix(u, v, 0.5) + rand(id, 3) if u > 0.3 else noise(u * 5)"
    fields = {"u": u, "v": np.array([2.0]), "id": np.arange(rows)}
    whole = evaluate(source, fields)
    pieces = [evaluate(source, {"u": u[i:j], "v": 2.0, "id": np.arange(i, j)}) for i, j in ((0, 777), (777, rows))]
    assert np.array_equal(whole, np.concatenate([np.broadcast_to(p, (j,)) for p, j in zip(pieces, (777, rows - 777))]))
    along = evaluate("u * t", {"u": u[:4000, None], "t": np.linspace(0, 1, 16)})
    assert np.allclose(along, u[:4000, None] * np.linspace(0, 1, 16))
    assert evaluate("1 + 1").shape == ()
    assert evaluate("u", {"u": np.zeros((0,))}).shape == (0,)
    assert evaluate("u + v", {"u": np.zeros((0, 16)), "v": 1}).shape == (0, 16)


def test_fields_are_neither_changed_nor_handed_out():
    u = np.ones(5)
    u.flags.writeable = False
    out = evaluate("u", {"u": u})
    out[0] = 9
    assert u[0] == 1
    evaluate("-u + u * u", {"u": u})


def test_refusals():
    with pytest.raises(ExpressionError, match=r"olumn 5 .*curls.*did you mean 'curl'"):
        evaluate("u + curls", {"u": 1, "curl": 2})
    with pytest.raises(UserError, match="differ in size"):
        evaluate("u + v", {"u": np.zeros(3), "v": np.zeros(4)})
    many = {"u": np.broadcast_to(np.float64(0.5), (10_000_000,))}
    heavy = " + ".join(["fbm(u, 1, 2, 8)"] * 60)
    with pytest.raises(UserError, match="too expensive"):
        evaluate(heavy, many)
    assert cost(parse(heavy)) > 30_000


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_takes_columns_and_has_help(name):
    function = FUNCTIONS[name]
    assert name in function.help
    for count in range(function.fewest, min(function.most, 6) + 1):
        arguments = ", ".join(["x"] * count)
        got = evaluate(f"{name}({arguments})", {"x": np.array([0.2, 0.7, -0.4])})
        assert got.shape == (3,)
        single = [float(evaluate(f"{name}({arguments})", {"x": v})) for v in (0.2, 0.7, -0.4)]
        assert np.allclose(got, single)
