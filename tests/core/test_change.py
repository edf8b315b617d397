"""Differences of trees, there and back."""

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from core.change import Splice, Swap, Walk, change_bytes, difference
from core.document import free_id, with_groom
from core.leaves import array_bytes, leaves, same_bits
from core.value import constant
from tests.documents import small_document, stroked


def _walk(value, change, forward):
    walk = Walk(value)
    walk.step(change, forward)
    return walk.value()


def _edits():
    base = small_document(guides=20)
    groom, guides = base.grooms[0], base.grooms[0].guides
    second = groom.replace(id=2, name="mane")
    keep = np.arange(20) != 5
    fewer = guides.replace(
        ids=guides.ids[keep], roots=guides.roots.take(keep), points=guides.points[keep], hold=guides.hold[keep],
        selected=guides.selected[keep], frozen=guides.frozen[keep],
    )
    two = with_groom(base, second)
    return [
        base,
        stroked(base, 1),
        stroked(base, 2, share=1.0),
        with_groom(base, groom.replace(coat=groom.coat.replace(frizz=constant(0.25)))),
        with_groom(base, groom.replace(coat=groom.coat.replace(density_map=None), maps=())),
        with_groom(base, groom.replace(guides=fewer)),
        two,
        two.replace(grooms=two.grooms[1:]),
        two.replace(grooms=two.grooms[::-1]),
        base.replace(meshes=(*base.meshes, base.meshes[0].replace(id=free_id(base.meshes)))),
        base.replace(fps=-0.0 + 25.0, unit="cm"),
        small_document(guides=0),
    ]


EDITS = _edits()


@given(st.lists(st.sampled_from(range(len(EDITS))), min_size=2, max_size=6))
def test_a_chain_of_changes_leads_both_ways_to_the_bit(path):
    states = [EDITS[i] for i in path]
    changes = [difference(a, b) for a, b in itertools.pairwise(states)]
    forward, backward = Walk(states[0]), Walk(states[-1])
    for change in changes:
        forward.step(change, True)
    for change in reversed(changes):
        backward.step(change, False)
    assert same_bits(forward.value(), states[-1])
    assert same_bits(backward.value(), states[0])


def test_what_a_step_leaves_alone_stays_the_same_object():
    old = EDITS[0]
    new = stroked(old, 3)
    back = _walk(new, difference(old, new), False)
    assert back.meshes is new.meshes
    assert back.grooms[0].coat is old.grooms[0].coat
    assert back.grooms[0].guides.roots is old.grooms[0].guides.roots
    assert back.grooms[0].guides.points is not new.grooms[0].guides.points


def test_values_come_back_read_only_and_sources_are_untouched():
    old = EDITS[0]
    new = stroked(old, 4)
    before = new.grooms[0].guides.points.tobytes()
    back = _walk(new, difference(old, new), False)
    assert not any(array.flags.writeable for _, array in leaves(back))
    assert new.grooms[0].guides.points.tobytes() == before


def test_a_change_keeps_only_the_rows_that_changed():
    old = small_document(guides=1000, side=10, points=16)
    new = stroked(old, 5, share=0.05)
    points = old.grooms[0].guides.points
    assert change_bytes(difference(old, new)) < 0.06 * points.nbytes + 1000


def test_one_row_more_or_less_does_not_keep_the_whole_array():
    old = np.arange(30_000, dtype=np.float32).reshape(-1, 3)
    new = np.delete(old, [5000], axis=0)
    change = difference(old, new)
    assert isinstance(change, Splice)
    assert change_bytes(change) == 12
    assert _walk(old, change, True).tobytes() == new.tobytes()
    assert _walk(new, change, False).tobytes() == old.tobytes()


def test_arrays_of_nothing_in_common_are_kept_whole():
    old, new = np.zeros((8, 3), np.float32), np.ones((6, 3), np.float32)
    assert isinstance(difference(old, new), Swap)
    assert isinstance(difference(old, old.astype(np.float64)), Swap)


def test_shared_arrays_are_counted_once():
    document = EDITS[6]  # two grooms with the same guides
    assert array_bytes(document, EDITS[0]) == array_bytes(EDITS[0])
