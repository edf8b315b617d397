"""Undo, redo, jump, packing and the byte budget."""

import gc
import weakref

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from core.history import History
from core.leaves import array_bytes, same_bits
from core.value import constant
from tests.documents import small_document, stroked


@pytest.fixture
def strokes():
    """A hundred states and the history that went through them."""
    states = [small_document(guides=200)]
    history = History(states[0], "Open", keep=5)
    for i in range(99):
        states.append(stroked(states[-1], i, share=0.05))
        history.commit(f"Comb {i}", states[-1])
    history.flush()
    yield states, history
    history.close()


def test_undo_all_and_redo_all_to_the_bit(strokes):
    states, history = strokes
    for i in range(98, -1, -1):
        assert same_bits(history.undo(), states[i])
    assert history.undo() is history.current  # nothing left
    for i in range(1, 100):
        assert same_bits(history.redo(), states[i])
    assert history.redo() is history.current


def test_jump_anywhere_to_the_bit(strokes):
    states, history = strokes
    for place in (0, 99, 50, 3, 97, 12, 13, 60, 0, 99):
        assert same_bits(history.jump(place), states[place])
        assert history.cursor == place
        if place % 3 == 0:
            history.flush()
    for place in (-1, 100):
        with pytest.raises(IndexError):
            history.jump(place)


def test_old_steps_are_packed_and_near_ones_are_the_values_themselves(strokes):
    states, history = strokes
    whole = array_bytes(*states)
    assert history.bytes < 0.4 * whole
    assert [history.jump(i) is states[i] for i in (98, 97, 96, 95)] == [True] * 4
    far = weakref.ref(states[40])
    del states[40]
    gc.collect()
    assert far() is None


def test_unchanged_parts_are_the_same_objects_after_an_old_undo(strokes):
    states, history = strokes
    old = history.jump(2)
    assert old.meshes is states[0].meshes
    assert old.grooms[0].guides.roots is states[0].grooms[0].guides.roots


def test_a_commit_forgets_what_could_be_redone(strokes):
    states, history = strokes
    history.jump(30)
    other = stroked(history.current, 12345)
    history.commit("Other", other)
    history.flush()
    assert history.names[-2:] == ("Comb 29", "Other")
    assert history.undo_name == "Other"
    assert history.redo_name is None
    assert same_bits(history.undo(), states[30])
    assert history.redo_name == "Other"
    assert same_bits(history.jump(0), states[0])
    assert same_bits(history.jump(31), other)


def test_the_current_value_again_is_no_step(strokes):
    _, history = strokes
    history.commit("Nothing", history.current)
    assert len(history.names) == 100


def test_the_budget_forgets_the_oldest_steps_and_never_the_current_one():
    state = small_document(guides=500, points=16)
    budget = 3 * array_bytes(state)
    history = History(state, budget=budget, keep=3)
    states = [state]
    for i in range(120):
        states.append(stroked(states[-1], i, share=0.3))
        history.commit(f"Comb {i}", states[-1])
    history.flush()
    assert history.bytes <= budget
    names = history.names
    assert 3 < len(names) < 121
    assert names[-1] == "Comb 119"
    assert same_bits(history.jump(0), states[-len(names)])
    history.flush()
    assert history.names == names  # looking back forgets nothing
    assert same_bits(history.jump(len(names) - 1), states[-1])
    history.close()

    tiny = History(state, keep=3)
    tiny.budget = 1
    tiny.commit("Comb", states[1])
    tiny.flush()
    assert tiny.names == ("Comb",)
    assert tiny.current is states[1]
    tiny.close()


def test_a_large_prefix_of_undone_steps_is_given_up_from_the_far_end_first():
    state = small_document(guides=500, points=16)
    history = History(state, budget=3 * array_bytes(state), keep=2)
    for i in range(12):
        history.commit(f"Comb {i}", stroked(history.current, i, share=0.2))
    history.jump(0)
    history.flush()
    assert history.cursor == 0
    assert history.bytes <= 3 * array_bytes(state)
    history.close()


class HistoryMachine(RuleBasedStateMachine):
    """The history against a plain list of states."""

    @initialize(keep=st.integers(1, 4))
    def start(self, keep):
        self.states = [small_document(guides=20)]
        self.cursor = 0
        self.history = History(self.states[0], keep=keep)

    @rule(seed=st.integers(0, 2**31), share=st.floats(0.05, 1.0))
    def stroke(self, seed, share):
        self._commit(stroked(self.states[self.cursor], seed, share))

    @precondition(lambda self: len(self.states[self.cursor].grooms[0].guides) > 2)
    @rule(data=st.data())
    def delete(self, data):
        groom = self.states[self.cursor].grooms[0]
        guides = groom.guides
        keep = np.ones(len(guides), np.bool_)
        keep[data.draw(st.integers(0, len(guides) - 1))] = False
        fewer = guides.replace(
            ids=guides.ids[keep], roots=guides.roots.take(keep), points=guides.points[keep], hold=guides.hold[keep],
            selected=guides.selected[keep], frozen=guides.frozen[keep],
        )
        self._commit(self.states[self.cursor].replace(grooms=(groom.replace(guides=fewer),)))

    @rule(frizz=st.floats(0, 1))
    def coat(self, frizz):
        groom = self.states[self.cursor].grooms[0]
        coat = groom.coat.replace(frizz=constant(frizz))
        self._commit(self.states[self.cursor].replace(grooms=(groom.replace(coat=coat),)))

    def _commit(self, state):
        self.history.commit("Step", state)
        self.cursor += 1
        self.states[self.cursor :] = [state]

    @rule()
    def undo(self):
        self.cursor = max(0, self.cursor - 1)
        self.history.undo()

    @rule()
    def redo(self):
        self.cursor = min(len(self.states) - 1, self.cursor + 1)
        self.history.redo()

    @rule(data=st.data())
    def jump(self, data):
        self.cursor = data.draw(st.integers(0, len(self.states) - 1))
        self.history.jump(self.cursor)

    @rule()
    def settle(self):
        self.history.flush()

    @invariant()
    def agrees(self):
        if hasattr(self, "states"):
            assert self.history.cursor == self.cursor
            assert len(self.history.names) == len(self.states)
            assert same_bits(self.history.current, self.states[self.cursor])

    def teardown(self):
        if hasattr(self, "states"):
            for place in (0, len(self.states) - 1):
                assert same_bits(self.history.jump(place), self.states[place])
            self.history.close()


TestHistoryMachine = HistoryMachine.TestCase
TestHistoryMachine.settings = settings(max_examples=40, stateful_step_count=40, deadline=None)
