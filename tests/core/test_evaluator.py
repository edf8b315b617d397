"""The identity memo."""

import gc
import threading
import weakref

import numpy as np
import pytest

from core.evaluator import Evaluator
from core.record import freeze
from tests.documents import grid_mesh


@pytest.fixture
def evaluator():
    evaluator = Evaluator(budget=1 << 20)
    yield evaluator
    evaluator.close()


def _array(n, value=0.0):
    return freeze(np.full(n, value))


def test_the_same_inputs_are_computed_once(evaluator):
    calls = []

    def double(array, factor=2.0):
        calls.append(1)
        return array * factor

    a = _array(10, 3.0)
    first = evaluator.get(double, a)
    assert evaluator.get(double, a) is first
    assert evaluator.get(double, a, factor=3.0)[0] == 9.0
    assert evaluator.get(double, _array(10, 3.0)) is not first  # equal, but another object
    assert len(calls) == 3


def test_parameters_of_other_types_are_other_parameters(evaluator):
    a = _array(1)
    assert [evaluator.get(_kind_of, a, x=value) for value in (1, 1.0, True)] == ["int", "float", "bool"]
    assert evaluator.get(_kind_of, None, x="one") == "str"  # an input may be left out


def _kind_of(_, x):
    return type(x).__name__


def _bytes_of(array):
    return array.tobytes()


def test_an_address_used_again_is_not_mistaken(evaluator):
    for i in range(2000):  # CPython gives the same address again and again
        assert evaluator.get(_bytes_of, _array(4, float(i))) == np.full(4, float(i)).tobytes()


def test_entries_die_with_their_inputs(evaluator):
    mesh = grid_mesh(2)
    value = evaluator.get(lambda m: [np.zeros(100)], mesh)
    assert len(evaluator) == 1
    assert evaluator.bytes >= 800
    alive = weakref.ref(mesh)
    del mesh, value
    gc.collect()
    assert alive() is None
    assert len(evaluator) == 0
    assert evaluator.bytes == 0


def test_the_least_recently_used_goes_when_the_budget_is_passed(evaluator):
    calls = []

    def make(array):
        calls.append(array[0])
        return np.zeros(300_000, np.uint8)

    a, b, c, d = (_array(1, float(i)) for i in range(4))
    for key in (a, b, c):
        evaluator.get(make, key)
    evaluator.get(make, a)  # now b is the oldest
    evaluator.get(make, d)
    assert evaluator.bytes <= 1 << 20
    calls.clear()
    for key in (a, c, d, b):
        evaluator.get(make, key)
    assert calls == [1.0]


def test_a_value_larger_than_the_budget_is_given_but_not_kept(evaluator):
    a = _array(1)
    assert evaluator.get(lambda _: np.zeros(1 << 21, np.uint8), a).nbytes == 1 << 21
    assert len(evaluator) == 0


def test_writable_inputs_are_refused(evaluator):
    base = np.zeros((4, 4))
    view = base[:2]
    view.flags.writeable = False  # the base can still be written to
    for array in (base, view):
        with pytest.raises(ValueError, match="written to"):
            evaluator.get(_bytes_of, array)
    with pytest.raises(TypeError, match="named parameter"):
        evaluator.get(_bytes_of, (1, 2))


def test_threads_get_one_and_the_same_right_value(evaluator):
    inputs = [_array(8, float(i)) for i in range(20)]
    wrong = []
    start = threading.Barrier(4)

    def work(seed):
        rng = np.random.default_rng(seed)
        start.wait()
        for i in rng.integers(0, 20, 5000):
            array = inputs[i]
            if evaluator.get(_bytes_of, array) != array.tobytes():
                wrong.append(i)
            if rng.random() < 0.02:
                inputs[i] = _array(8, float(rng.integers(0, 100)))

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_an_exception_is_not_remembered(evaluator):
    a = _array(1)
    calls = []

    def fail_once(_):
        calls.append(1)
        if len(calls) == 1:
            raise ValueError("once")
        return 5

    with pytest.raises(ValueError, match="once"):
        evaluator.get(fail_once, a)
    assert evaluator.get(fail_once, a) == 5
