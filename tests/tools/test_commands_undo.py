"""Every registered command, in any order, can be undone and redone, saved, opened and recovered to the bit."""

import inspect
import itertools

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import rule

import core.document
from core.document import (
    Document,
    MeshObject,
    find_groom,
    free_id,
    with_feathers,
    with_groom,
    with_mesh,
    without_groom,
    without_mesh,
)
from core.evaluator import Evaluator
from core.feather.coat.coat import FeatherCoat
from core.groom.commands import COMMANDS, skin_context
from core.groom.groom import Coat, Groom, Map
from core.groom.guides import Guides
from core.groom.plant import plant_scatter
from core.history import History
from core.leaves import same_bits
from core.mesh.mesh import Mesh
from core.mesh.roots import Roots
from core.value import constant, formula
from tests.tools.undo_machine import UndoMachine

SEEDS = st.integers(0, 2**31 - 1)


def ball() -> Mesh:
    """A closed mesh, mirror-symmetric, of 320 triangles."""
    shape = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    count = len(shape.faces)
    return Mesh(
        points=shape.vertices.astype(np.float32), counts=np.full(count, 3, np.int32),
        corners=shape.faces.ravel().astype(np.int32), parts=np.zeros(count, np.int32), part_names=("ball",),
    )


EVALUATOR = Evaluator()
MESH = ball()
CONTEXT = skin_context(MESH, EVALUATOR)


def no_guides() -> Guides:
    empty = Roots(
        faces=np.zeros(0, np.int32), corners=np.zeros((0, 3), np.int32), weights=np.zeros((0, 3), np.float32),
        uvs=np.zeros((0, 2), np.float32), frames=np.zeros((0, 3, 3), np.float32),
    )
    return Guides(
        ids=np.zeros(0, np.int32), roots=empty, points=np.zeros((0, 8, 3), np.float32),
        hold=np.zeros((0, 8), np.float32), selected=np.zeros(0, np.bool_), frozen=np.zeros(0, np.bool_), next_id=0,
    )


def start_document() -> Document:
    guides = plant_scatter(no_guides(), CONTEXT.skin, 40, seed=1)
    groom = Groom(id=1, name="coat", mesh_id=1, guides=guides)
    return Document(meshes=(MeshObject(id=1, name="ball", mesh=MESH),), grooms=(groom,))


START = start_document()


# How each function of the document is called: a hypothesis strategy of what to do to a given document.
def _some_groom(document, draw):
    return find_groom(document, draw(st.sampled_from([g.id for g in document.grooms])))


def _put_groom(document, draw):
    groom = _some_groom(document, draw)
    what = draw(st.sampled_from(["coat", "map", "copy", "rename", "length"]))
    if what == "coat":
        frizz = constant(draw(st.floats(0, 1)))
        coat = Coat(count=draw(st.integers(0, 1000)), frizz=frizz, seed=draw(st.integers(0, 2**32 - 1)))
        return with_groom(document, groom.replace(coat=coat))
    if what == "map":
        values = np.full(len(MESH.points), draw(st.floats(0, 1, width=32)), np.float32)
        painted = Map(name=f"m{len(groom.maps)}", values=values)
        return with_groom(document, groom.replace(maps=(*groom.maps, painted)))
    if what == "copy":
        return with_groom(document, groom.replace(id=free_id(document.grooms)))
    if what == "length":
        length = draw(st.sampled_from([constant(0.5), formula("0.5 + 0.5 * rand(id, 1)")]))
        return with_groom(document, groom.replace(coat=groom.coat.replace(length=length)))
    return with_groom(document, groom.replace(name=draw(st.sampled_from(["mane", "Mähne", "鬃毛"]))))


def _put_mesh(document, draw):
    item = document.meshes[0]
    if draw(st.booleans()):
        return with_mesh(document, item.replace(hidden=not item.hidden))
    return with_mesh(document, item.replace(id=free_id(document.meshes), name="another"))


def _drop_groom(document, draw):
    if len(document.grooms) < 2:
        return document
    return without_groom(document, draw(st.sampled_from([g.id for g in document.grooms[1:]])))


def _drop_mesh(document, draw):
    if len(document.meshes) < 2:
        return document
    return without_mesh(document, draw(st.sampled_from([m.id for m in document.meshes[1:]])))


def _put_feathers(document, draw):
    coat_id = draw(st.sampled_from([*(c.id for c in document.feathers), free_id(document.feathers)]))
    keys = draw(st.sampled_from([None, *document.grooms]))
    mesh_id = document.meshes[0].id if keys is None else keys.mesh_id
    coat = FeatherCoat(
        id=coat_id, name="down", mesh_id=mesh_id, keys_id=None if keys is None else keys.id,
        overlap=draw(st.floats(1.0, 8.0)))
    return with_feathers(document, coat)


DOCUMENT_COMMANDS = {
    "with_groom": _put_groom, "with_mesh": _put_mesh, "without_groom": _drop_groom, "without_mesh": _drop_mesh,
    "with_feathers": _put_feathers,
}  # fmt: skip


def kernel(document: Document, groom_id: int, name: str, seed: int) -> Document:
    groom = find_groom(document, groom_id)
    return with_groom(document, groom.replace(guides=COMMANDS[name].run(groom.guides, CONTEXT, seed)))


def test_every_function_that_makes_a_document_has_a_strategy():
    makers = {
        name for name, function in inspect.getmembers(core.document, inspect.isfunction)
        if inspect.signature(function).return_annotation in ("Document", Document) and not name.startswith("_")
    }  # fmt: skip
    assert makers == set(DOCUMENT_COMMANDS)


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_a_command_is_undone_from_packed_steps(name):
    states, history = [START], History(START, keep=0)
    for seed in range(4):
        states.append(kernel(states[-1], 1, name, seed))
        assert states[-2].grooms[0].guides.points.flags.writeable is False
        history.commit(COMMANDS[name].label, states[-1])
        history.flush()
    steps = [states[0]] + [b for a, b in itertools.pairwise(states) if b is not a]
    assert len(history.names) == len(steps)
    for place in [*range(len(steps) - 1, -1, -1), *range(len(steps))]:
        assert same_bits(history.jump(place), steps[place])
        history.flush()
    history.close()


class Commands(UndoMachine):
    """Kernels and functions of the document."""

    first = START

    @rule(name=st.sampled_from(sorted(COMMANDS)), seed=SEEDS, data=st.data())
    def kernel(self, name, seed, data):
        groom = _some_groom(self.session.document, data.draw)
        self.done(self.session.edit, COMMANDS[name].label, kernel, groom.id, name, seed)

    @rule(name=st.sampled_from(sorted(DOCUMENT_COMMANDS)), data=st.data())
    def document_command(self, name, data):
        self.done(self.session.edit, name, DOCUMENT_COMMANDS[name], data.draw)

    @rule(name=st.sampled_from(sorted(COMMANDS)), seed=SEEDS)
    def preview_and_cancel(self, name, seed):
        self.shown_and_cancelled(kernel, self.session.document.grooms[0].id, name, seed)


TestCommands = Commands.TestCase
TestCommands.settings = settings(
    max_examples=25, stateful_step_count=25, deadline=None, suppress_health_check=list(HealthCheck)
)
