"""What a hand does to a curve."""

import math

import numpy as np
import pytest

from core.curve import Curve, Key, curve_at
from core.curve_edit import (
    handle_of,
    key_at,
    moved_keys,
    pasted_keys,
    scaled_keys,
    set_keys,
    snapped_keys,
    with_handle,
    with_key,
    with_tangents,
    without_keys,
)
from core.errors import UserError

CURVE = Curve(keys=(Key(frame=0.0, value=0.0), Key(frame=10.0, value=1.0, leave="linear"), Key(frame=20.0, value=0.0)))


def test_a_key_without_a_value_does_not_move_the_curve_there() -> None:
    made = with_key(CURVE, 14.0)
    assert key_at(made, 14.0) == 2
    assert float(curve_at(made, 14.0)) == float(curve_at(CURVE, 14.0))


def test_a_key_that_is_there_keeps_its_tangents() -> None:
    made = with_key(CURVE, 10.0, 3.0)
    assert len(made.keys) == 3
    assert (made.keys[1].value, made.keys[1].leave) == (3.0, "linear")


def test_the_last_key_leaves_none() -> None:
    assert without_keys(CURVE, {0, 1, 2}) is None
    left = without_keys(CURVE, {1})
    assert left is not None
    assert [key.frame for key in left.keys] == [0.0, 20.0]


def test_moved_keys_are_found_again_after_passing_others() -> None:
    made, places = moved_keys(CURVE, {0}, 15.0, 1.0)
    assert [key.frame for key in made.keys] == [10.0, 15.0, 20.0]
    assert places == {1}
    assert made.keys[1].value == 1.0
    with pytest.raises(UserError, match="on one frame"):
        moved_keys(CURVE, {0}, 10.0, 0.0)


def test_a_handle_turns_the_other_one_along_unless_broken() -> None:
    turned = with_handle(CURVE, 1, "leave", (3.0, 6.0)).keys[1]
    assert turned.arrive_handle[1] / turned.arrive_handle[0] == pytest.approx(2.0)
    broken = with_handle(CURVE, 1, "leave", (3.0, 6.0), broken=True).keys[1]
    assert broken.arrive == "smooth"
    assert with_handle(CURVE, 1, "leave", (-3.0, 1.0)).keys[1].leave_handle == (0.0, 1.0)


@pytest.mark.parametrize("kind", ["smooth", "linear"])
def test_handles_made_free_where_they_are_shown_do_not_change_the_curve(kind: str) -> None:
    curve = with_tangents(CURVE, range(3), kind)  # type: ignore[arg-type]
    freed = curve
    for side in ("arrive", "leave"):
        freed = with_handle(freed, 1, side, handle_of(curve, 1, side), broken=True)  # type: ignore[arg-type]
    frames = [1.0, 5.0, 9.0, 11.0, 15.0, 19.0]
    assert curve_at(freed, frames) == pytest.approx(curve_at(curve, frames), abs=2e-3)


def test_a_free_handle_turns_alone_and_an_aligned_one_takes_the_other_along() -> None:
    free = with_tangents(CURVE, {1}, "free")
    turned = with_handle(free, 1, "leave", (3.0, 6.0)).keys[1]
    assert turned.arrive_handle == free.keys[1].arrive_handle
    aligned = with_handle(with_tangents(CURVE, {1}, "aligned"), 1, "arrive", (-2.0, 1.0)).keys[1]
    assert aligned.leave_handle[1] / aligned.leave_handle[0] == pytest.approx(-0.5)
    assert (aligned.arrive, aligned.leave) == ("aligned", "aligned")
    broken = with_handle(with_tangents(CURVE, {1}, "aligned"), 1, "arrive", (-2.0, 1.0), broken=True).keys[1]
    assert (broken.arrive, broken.leave) == ("free", "free")


def test_free_tangents_leave_the_curve_as_it_is_and_aligned_ones_have_one_slope() -> None:
    curve = with_tangents(CURVE, range(3), "linear")
    frames = np.linspace(0.0, 20.0, 41)
    assert curve_at(with_tangents(curve, range(3), "free"), frames) == pytest.approx(curve_at(curve, frames), abs=1e-12)
    uneven = curve.replace(keys=(*curve.keys[:2], Key(frame=14.0, value=0.0)))
    key = with_tangents(uneven, {1}, "aligned").keys[1]
    assert key.leave_handle[1] / key.leave_handle[0] == pytest.approx(key.arrive_handle[1] / key.arrive_handle[0])


@pytest.mark.parametrize("factors", [(2.0, 0.5), (-1.0, 1.0), (1.0, -2.0), (-0.5, 3.0)])
def test_scaled_keys_scale_the_whole_curve(factors: tuple[float, float]) -> None:
    curve = with_tangents(CURVE, range(3), "free")
    curve = with_handle(curve, 1, "leave", (4.0, 0.7))
    made, places = scaled_keys(curve, range(3), (5.0, 0.25), factors)
    assert places == {0, 1, 2}
    frames = np.linspace(0.0, 20.0, 41)
    there = 5.0 + (frames - 5.0) * factors[0]
    assert curve_at(made, there) == pytest.approx(0.25 + (curve_at(curve, frames) - 0.25) * factors[1], abs=1e-9)
    with pytest.raises(UserError, match="on one frame"):
        scaled_keys(curve, range(3), (5.0, 0.0), (0.0, 1.0))


def test_keys_are_set_snapped_and_pasted() -> None:
    made, places = set_keys(CURVE, {0, 1}, frame=3.0, value=0.5)
    assert ([key.frame for key in made.keys], places) == ([3.0, 13.0, 20.0], {0, 1})
    assert [key.value for key in made.keys] == [0.5, 0.5, 0.0]
    with pytest.raises(UserError, match="cannot go as far"):
        set_keys(CURVE, {0}, frame=1e12)
    rough = Curve(keys=tuple(Key(frame=f, value=f) for f in (0.2, 0.9, 1.2, 5.0, 7.6)))
    made, places = snapped_keys(rough, {0, 1, 2, 4})
    assert [(key.frame, key.value) for key in made.keys] == [(0.0, 0.2), (1.0, 0.9), (5.0, 5.0), (8.0, 7.6)]
    assert places == {0, 1, 3}
    made, places = pasted_keys(CURVE, [Key(frame=10.0005, value=9.0), Key(frame=12.0, value=8.0)])
    assert ([key.value for key in made.keys], places) == ([0.0, 9.0, 8.0, 0.0], {1, 2})
    assert pasted_keys(None, [Key(frame=1.0, value=2.0)])[0].keys[0].value == 2.0


def test_a_great_many_keys_are_snapped_and_turned_in_one_pass() -> None:
    many = Curve(keys=tuple(Key(frame=0.7 * i, value=math.sin(0.1 * i)) for i in range(20_000)))
    snapped, places = snapped_keys(with_tangents(many, range(20_000), "aligned"), range(20_000))
    assert len(places) == len(snapped.keys) < 20_000
    assert all(key.frame == round(key.frame) for key in snapped.keys)
