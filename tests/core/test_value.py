"""Values decode strictly, evaluate to what their parts say, and know what they depend on."""

import msgspec
import numpy as np
import pytest

from core.curve import Curve, Key, curve_at
from core.errors import UserError
from core.expression import ExpressionError
from core.field import Field
from core.value import Constant, Formula, Value, constant, evaluate, evaluate_within, formula, names_used

CURVE = Curve(keys=(Key(frame=1001.0, value=0.0), Key(frame=1010.0, value=1.0)))


def test_constant_curve_expression_and_map():
    fields = {"u": np.array([0.0, 0.5, 1.0]), "mask": np.array([0.0, 1.0, 0.5], np.float32)}
    assert evaluate(constant(0.25)) == 0.25
    assert evaluate(constant(0.25)).shape == ()
    assert evaluate(Value(base=CURVE), 1004.5) == curve_at(CURVE, 1004.5)
    assert np.array_equal(evaluate(formula("u * frame"), 2.5, fields), [0, 1.25, 2.5])
    assert np.array_equal(evaluate(constant(4, "mask"), 0, fields), [0, 4, 2])
    assert np.array_equal(evaluate(formula("u + 1", "mask"), 0, fields), [0, 1.5, 1])
    assert np.array_equal(evaluate(Value(base=CURVE, map="mask"), 1010.0, fields), [0, 1, 0.5])


def test_names_used():
    assert names_used(constant(1)) == frozenset()
    assert names_used(constant(1, "mask")) == {"mask"}
    assert names_used(formula("sin(frame) + u", "mask")) == {"frame", "u", "mask"}
    assert names_used(Value(base=CURVE)) == {"frame"}
    still = Curve(keys=(Key(frame=1.0, value=3.0), Key(frame=9.0, value=3.0)))
    assert names_used(Value(base=still)) == frozenset()


@pytest.mark.parametrize("value", [constant(0.1, "m"), formula("rand(id, 3) < 0.5"), Value(base=CURVE)])
def test_round_trip(value):
    data = msgspec.json.encode(value)
    again = msgspec.json.decode(data, type=Value)
    assert msgspec.json.encode(again) == data
    fields = {"id": 4, "m": 2.0}
    assert evaluate(again, 1003.0, fields) == evaluate(value, 1003.0, fields)


@pytest.mark.parametrize(("data", "words"), [
    ('{"base": {"type": "constant", "number": 1e999}}', "base"),
    ('{"base": {"type": "constant", "number": null}}', "base.number"),
    ('{"base": {"type": "constant", "number": "1"}}', "base.number"),
    ('{"base": {"type": "python", "source": "1"}}', "python"),
    ('{"base": {"type": "expression", "source": "u.__class__"}}', "olumn 2"),
    ('{"base": {"type": "curve", "keys": []}}', "1 to"),
    ('{"base": {"type": "curve", "keys": [{"frame": 1, "value": 2, "leave": "wavy"}]}}', "keys[0]"),
    ('{"base": {"type": "constant", "number": 1}, "extra": 1}', "extra"),
    ('{"base": {"type": "constant", "number": 1}, "map": 3}', "map"),
])
def test_decoding_is_strict_and_says_where(data, words):
    with pytest.raises(msgspec.ValidationError) as caught:
        msgspec.json.decode(data, type=Value)
    assert words in str(caught.value)


def test_refusals():
    with pytest.raises(ValueError):
        Constant(number=float("nan"))
    with pytest.raises(UserError, match="olumn 3"):
        Formula(source="1 $ 2")
    with pytest.raises(UserError, match="no map named 'mane'"):
        evaluate(constant(1, "mane"), 0, {"u": 1})
    with pytest.raises(UserError, match="as many values"):
        evaluate(formula("u", "m"), 0, {"u": np.zeros(3), "m": np.zeros(4)})


def test_result_is_always_finite():
    fields = {"m": np.array([np.nan, np.inf, 1e300])}
    assert np.array_equal(evaluate(constant(1e20, "m"), 0, fields), [0, 1e30, 1e30])
    assert np.isfinite(evaluate(constant(1e300))).all()


def test_a_described_value_is_held_in_its_range_and_its_faults_name_the_field():
    known = Field("Clump", "Only for this test, from nothing to all.", hard=(0.0, 1.0))
    assert evaluate_within(formula("frame"), known, 7.0) == 1.0
    assert evaluate_within(formula("-frame"), known, 7.0) == 0.0
    assert isinstance(evaluate_within(constant(0.25), known), float)
    column = evaluate_within(formula("u * 2"), known, 0.0, {"u": np.array([-1.0, 0.25, 3.0])})
    assert column.dtype == np.float32
    assert column.tolist() == [0.0, 0.5, 1.0]
    with pytest.raises(UserError, match="Clump: Column 5 of the expression: there is no value named 'w'"):
        evaluate_within(formula("1 + w"), known)
    with pytest.raises(UserError, match=r"Clump: Column 4 of the expression: [^\n]+$"):
        formula("1 +", label="Clump")
    with pytest.raises(ExpressionError):
        formula("1 +")
