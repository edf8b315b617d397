"""What a hand does to a curve."""

import pytest

from core.curve import Curve, Key, curve_at
from core.curve_edit import handle_of, key_at, moved_keys, with_handle, with_key, with_tangents, without_keys
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
