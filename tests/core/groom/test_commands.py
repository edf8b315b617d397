from __future__ import annotations

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from core.evaluator import Evaluator
from core.groom.collide import lowest_distances
from core.groom.commands import COMMANDS, skin_context
from core.groom.rows import no_guides
from core.mesh.surface import root_positions
from tests.core.groom.small_grooms import ball, fur


def bits(guides):
    roots = guides.roots
    return [a.tobytes() for a in (
        guides.ids, guides.points, guides.hold, guides.selected, guides.frozen, roots.faces, roots.corners,
        roots.weights, roots.uvs, roots.frames)] + [guides.next_id]


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_is_a_function_of_its_seed_and_leaves_its_input_alone(name):
    command, g = COMMANDS[name], fur(24)
    assert command.name == name
    before = bits(g)
    for seed in range(6):
        assert bits(command.run(g, ball(), seed)) == bits(command.run(g, ball(), seed))
    assert bits(g) == before
    empty = command.run(no_guides(), ball(), 3)
    assert len(empty) == 0 or name.startswith("plant")


def test_most_commands_change_something():
    x = fur(60).points.copy()
    x[::8] = 2 * x[::8, :1] - x[::8]  # some point into the skin
    g = fur(60).replace(points=x, selected=np.arange(60) % 2 == 0, frozen=np.arange(60) % 7 == 1)
    g = COMMANDS["spray"].run(g, ball(), 1)
    idle = [n for n, c in COMMANDS.items() if all(bits(c.run(g, ball(), seed)) == bits(g) for seed in range(20))]
    assert idle == []


class Groomer(RuleBasedStateMachine):
    """Any commands in any order leave a sound groom whose history can be walked back to the bit."""

    @initialize(bump=st.sampled_from([0.0, 0.12]))
    def start(self, bump):
        self.context = ball(bump)
        self.history = [fur(24, 0.4, bump)]
        self.seen = [bits(self.history[0])]

    @rule(name=st.sampled_from(sorted(COMMANDS)), seed=st.integers(0, 2**31 - 1))
    def edit(self, name, seed):
        self.history.append(COMMANDS[name].run(self.history[-1], self.context, seed))
        self.seen.append(bits(self.history[-1]))

    @invariant()
    def sound(self):
        g = self.history[-1]
        assert np.isfinite(g.points).all()
        assert (np.diff(g.ids) > 0).all()
        assert np.allclose(root_positions(self.context.skin.mesh, g.roots), g.points[:, 0], atol=1e-6)
        assert g.hold.min(initial=0) >= 0
        assert g.hold.max(initial=0) <= 1
        assert not (g.selected & g.frozen).any()

    def teardown(self):
        assert [bits(g) for g in getattr(self, "history", [])] == getattr(self, "seen", [])


TestGroomer = Groomer.TestCase
TestGroomer.settings = settings(max_examples=15, stateful_step_count=20, deadline=None)


def test_a_context_without_a_field_lets_hair_in():
    context = skin_context(ball().skin.mesh, Evaluator(), collide=False)
    g = fur(60)
    free, held = g, g
    for seed in range(12):
        free, held = (COMMANDS["comb"].run(x, c, seed) for x, c in ((free, context), (held, ball())))
    assert lowest_distances(free.points, ball().field).min() < -0.01
    assert lowest_distances(held.points, ball().field).min() > -1e-3
