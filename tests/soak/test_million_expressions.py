"""A million generated inputs neither crash nor hang: each gives finite numbers or a sentence with a column."""

import os
import random
import time
import warnings

import numpy as np

from core.errors import UserError
from core.expression import ExpressionError, evaluate, parse
from tests.expression_inputs import NAMES, any_input, check_fault

INPUTS = int(os.environ.get("FILOPLUME_SOAK_INPUTS", "1000000"))


def test_a_million_expressions():
    rng = random.Random(2001)
    values = np.random.default_rng(2001)
    fields = {name: values.normal(size=7) * 10.0 ** values.integers(-3, 9) for name in NAMES}
    fields["v"] = np.array([0.0, -0.0, 1.0, np.nan, np.inf, -np.inf, 1e308])
    accepted, refused, slowest = 0, 0, (0.0, "")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(INPUTS):
            source = any_input(rng)
            start = time.perf_counter()
            try:
                result = evaluate(parse(source, NAMES), fields)
            except ExpressionError as error:
                refused += 1
                check_fault(error, source)
            except UserError:
                refused += 1
            else:
                accepted += 1
                assert result.shape in ((), (7,))
                assert np.isfinite(result).all(), source
                assert np.abs(result).max() <= 1e30
            slowest = max(slowest, (time.perf_counter() - start, source))
    assert accepted > INPUTS // 4
    assert refused > INPUTS // 5
    assert slowest[0] < 10.0, slowest
