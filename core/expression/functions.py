"""What an expression may call: the whole list. Every function takes and gives float64 arrays that broadcast.

Results need not be finite: the caller holds them within bounds.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.expression.noise import MAX_OCTAVES, fractal_noise
from core.falloff import smoothstep as smoothstep_of
from core.random import rand as random_of

Array = NDArray[np.float64]


class Function(NamedTuple):
    """One allowed function: how to call it, how many arguments (`fewest` .. `most`), work per row, and its help."""

    call: Callable[..., Array]
    fewest: int
    most: int
    help: str
    cost: int = 1


def divide(a: Array, b: Array) -> Array:
    """a / b, 0 where b is 0."""
    return np.where(b == 0.0, 0.0, a / np.where(b == 0.0, 1.0, b))


def modulo(a: Array, b: Array) -> Array:
    """Remainder with the sign of b (as Python's), 0 where b is 0."""
    return np.where(b == 0.0, 0.0, np.mod(a, np.where(b == 0.0, 1.0, b)))


def power(a: Array, b: Array) -> Array:
    """a ** b, 0 where there is no real answer (0 to a negative power, a negative number to a fraction)."""
    return np.where((a == 0.0) & (b < 0.0), 0.0, np.power(a, b))


def logarithm(x: Array) -> Array:
    """Natural logarithm, 0 where x <= 0."""
    return np.log(np.where(x > 0.0, x, 1.0))


def fit(x: Array, old_low: Array, old_high: Array, low: Array, high: Array) -> Array:
    """x moved from one range to another and held inside it; `low` where the old range is empty."""
    fraction = np.clip(divide(x - old_low, old_high - old_low), 0.0, 1.0)
    return low + fraction * (high - low)


def mix(a: Array, b: Array, fraction: Array) -> Array:
    """a at 0, b at 1, beyond both outside."""
    return a * (1.0 - fraction) + b * fraction


def clamp(x: Array, low: Array, high: Array) -> Array:
    """x held between low and high; high wins where they are crossed."""
    return np.minimum(np.maximum(x, low), high)


def _key(x: Array) -> NDArray[np.int64]:
    """Whole numbers of any size as 32-bit keys, negative ones wrapped as in two's complement."""
    return np.mod(np.floor(x), 4294967296.0).astype(np.int64)


def rand(key: Array, seed: Array | None = None) -> Array:
    """The same number in 0 .. 1 as ``core.random.rand`` gives for this id and seed (fractions are dropped)."""
    return random_of(_key(key), _key(seed) if seed is not None else 0)


def noise(x: Array, *rest: Array) -> Array:
    """Gradient noise -1 .. 1: noise(x), noise(x, seed), noise(x, y, z), noise(x, y, z, seed)."""
    one, zero = np.ones(()), np.zeros(())
    if len(rest) < 2:
        return _fractal(1, x, zero, zero, one, rest[0] if rest else zero)
    return _fractal(3, x, rest[0], rest[1], one, rest[2] if len(rest) > 2 else zero)


def fbm(x: Array, *rest: Array) -> Array:
    """Noise in 4 or `octaves` octaves, -1 .. 1: fbm(x), fbm(x, octaves), fbm(x, y, z[, octaves[, seed]])."""
    four, zero = np.full((), 4.0), np.zeros(())
    if len(rest) < 2:
        return _fractal(1, x, zero, zero, rest[0] if rest else four, zero)
    return _fractal(3, x, rest[0], rest[1], rest[2] if len(rest) > 2 else four, rest[3] if len(rest) > 3 else zero)


def _fractal(dimensions: int, x: Array, y: Array, z: Array, octaves: Array, seed: Array) -> Array:
    columns = np.broadcast_arrays(x, y, z, octaves, seed)
    shape = columns[0].shape
    flat = [np.ascontiguousarray(c, np.float64).reshape(-1) for c in columns]
    px, py, pz = (np.clip(c, -1e15, 1e15) for c in flat[:3])  # beyond it the lattice cannot be counted
    out = np.empty(len(flat[0]))
    fractal_noise(dimensions, px, py, pz, flat[3].copy(), _key(flat[4]).astype(np.uint32), out)
    return out.reshape(shape)


def _step(edge: Array, x: Array) -> Array:
    return np.asarray(x >= edge, np.float64)


def _choose(a: Array, condition: Array, b: Array) -> Array:
    return np.where(condition != 0.0, a, b)


def _fold(call: Callable[[Array, Array], Array]) -> Callable[..., Array]:
    def folded(first: Array, *rest: Array) -> Array:
        for other in rest:
            first = call(first, other)
        return first

    return folded


FUNCTIONS: dict[str, Function] = {
    "abs": Function(np.abs, 1, 1, "abs(x)"),
    "floor": Function(np.floor, 1, 1, "floor(x)"),
    "ceil": Function(np.ceil, 1, 1, "ceil(x)"),
    "round": Function(np.rint, 1, 1, "round(x), halves to even"),
    "frac": Function(lambda x: x - np.floor(x), 1, 1, "frac(x) = x - floor(x)"),
    "sign": Function(np.sign, 1, 1, "sign(x): -1, 0 or 1"),
    "sqrt": Function(np.sqrt, 1, 1, "sqrt(x)", 2),
    "pow": Function(power, 2, 2, "pow(x, y) = x ** y", 20),
    "exp": Function(np.exp, 1, 1, "exp(x)", 5),
    "log": Function(logarithm, 1, 1, "log(x), natural", 5),
    "sin": Function(np.sin, 1, 1, "sin(radians)", 10),
    "cos": Function(np.cos, 1, 1, "cos(radians)", 10),
    "tan": Function(np.tan, 1, 1, "tan(radians)", 10),
    "asin": Function(np.arcsin, 1, 1, "asin(x) in radians", 10),
    "acos": Function(np.arccos, 1, 1, "acos(x) in radians", 10),
    "atan": Function(np.arctan, 1, 1, "atan(x) in radians", 10),
    "atan2": Function(np.arctan2, 2, 2, "atan2(y, x) in radians", 15),
    "degrees": Function(np.degrees, 1, 1, "degrees(radians)"),
    "radians": Function(np.radians, 1, 1, "radians(degrees)"),
    "min": Function(_fold(np.minimum), 2, 16, "min(a, b, ...)", 4),
    "max": Function(_fold(np.maximum), 2, 16, "max(a, b, ...)", 4),
    "clamp": Function(clamp, 3, 3, "clamp(x, low, high)", 2),
    "mix": Function(mix, 3, 3, "mix(a, b, fraction)", 4),
    "lerp": Function(mix, 3, 3, "lerp(a, b, fraction)", 4),
    "step": Function(_step, 2, 2, "step(edge, x): 1 from the edge on"),
    "smoothstep": Function(smoothstep_of, 3, 3, "smoothstep(low, high, x)", 10),
    "fit": Function(fit, 5, 5, "fit(x, old low, old high, new low, new high)", 10),
    "rand": Function(rand, 1, 2, "rand(id, seed): 0 .. 1", 20),
    "noise": Function(noise, 1, 4, "noise(x[, seed]) or noise(x, y, z[, seed]): -1 .. 1", 80),
    "fbm": Function(fbm, 1, 5, "fbm(x[, octaves]) or fbm(x, y, z[, octaves[, seed]]): -1 .. 1", 80 * MAX_OCTAVES),
}


def _compare(call: Callable[[Array, Array], NDArray[np.bool_]]) -> Callable[..., Array]:
    return lambda a, b: call(a, b).astype(np.float64)


COMPARISONS: dict[str, Callable[..., Array]] = {
    "<": _compare(np.less), "<=": _compare(np.less_equal), ">": _compare(np.greater),
    ">=": _compare(np.greater_equal), "==": _compare(np.equal), "!=": _compare(np.not_equal),
}

OPERATORS: dict[str, Function] = {
    "+": Function(np.add, 2, 2, "a + b"),
    "-": Function(np.subtract, 2, 2, "a - b"),
    "*": Function(np.multiply, 2, 2, "a * b"),
    "/": Function(divide, 2, 2, "a / b", 3),
    "%": Function(modulo, 2, 2, "a % b", 10),
    "**": Function(power, 2, 2, "a ** b", 20),
    "negative": Function(np.negative, 1, 1, "-a"),
    "not": Function(lambda a: (a == 0.0).astype(np.float64), 1, 1, "not a"),
    "and": Function(lambda a, b: ((a != 0.0) & (b != 0.0)).astype(np.float64), 2, 2, "a and b", 2),
    "or": Function(lambda a, b: ((a != 0.0) | (b != 0.0)).astype(np.float64), 2, 2, "a or b", 2),
    "if": Function(_choose, 3, 3, "a if c else b", 2),
}
