"""Every registered command, in any order, can be undone and redone, saved, opened and recovered to the bit."""

import inspect
import itertools
import shutil
import tempfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, note, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

import core.document
from core.document import Document, MeshObject, find_groom, free_id, with_groom, with_mesh, without_groom, without_mesh
from core.errors import UserError
from core.evaluator import Evaluator
from core.formats.journal import SUFFIXES, Journal
from core.formats.project import read_project
from core.formats.recovery import recover_files
from core.groom.commands import COMMANDS, skin_context
from core.groom.groom import Coat, Groom, Map
from core.groom.guides import Guides
from core.groom.plant import plant_scatter
from core.history import History
from core.leaves import same_bits
from core.mesh.mesh import Mesh
from core.mesh.roots import Roots
from core.value import constant, formula
from tools.session import Session

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


DOCUMENT_COMMANDS = {
    "with_groom": _put_groom, "with_mesh": _put_mesh, "without_groom": _drop_groom, "without_mesh": _drop_mesh,
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


class Commands(RuleBasedStateMachine):
    """A session against a plain list of states."""

    @initialize()
    def start(self):
        self.folder = Path(tempfile.mkdtemp(prefix="filoplume-test-"))
        self.journal = Journal(self.folder, patience=5.0)
        self.session = Session(START, journal=self.journal, evaluator=Evaluator())
        self.session.history._keep = 2
        self.states, self.cursor = [START], 0

    def _edited(self, name, function, *args):
        before = self.session.document
        try:
            self.session.edit(name, function, *args)
        except UserError as refusal:  # a command may have nothing to do here, and says so
            note(str(refusal))
            assert self.session.document is before
        if self.session.document is not before:
            self.cursor += 1
            self.states[self.cursor :] = [self.session.document]

    @rule(name=st.sampled_from(sorted(COMMANDS)), seed=SEEDS, data=st.data())
    def kernel(self, name, seed, data):
        groom = _some_groom(self.session.document, data.draw)
        self._edited(COMMANDS[name].label, kernel, groom.id, name, seed)

    @rule(name=st.sampled_from(sorted(DOCUMENT_COMMANDS)), data=st.data())
    def document_command(self, name, data):
        self._edited(name, DOCUMENT_COMMANDS[name], data.draw)

    @rule(name=st.sampled_from(sorted(COMMANDS)), seed=SEEDS)
    def preview_and_cancel(self, name, seed):
        before = self.session.document
        try:
            self.session.preview(kernel(before, before.grooms[0].id, name, seed))
        except UserError as refusal:
            note(str(refusal))
        self.session.cancel()
        assert self.session.document is before

    @rule()
    def undo(self):
        self.cursor = max(0, self.cursor - 1)
        self.session.undo()

    @rule()
    def redo(self):
        self.cursor = min(len(self.states) - 1, self.cursor + 1)
        self.session.redo()

    @rule(data=st.data())
    def jump(self, data):
        self.cursor = data.draw(st.integers(0, len(self.states) - 1))
        self.session.jump(self.cursor)

    @rule()
    def save_and_open(self):
        self.session.save(self.folder / "a.filo")
        assert same_bits(read_project(self.folder / "a.filo").document, self.session.document)

    @rule()
    def replay_the_journal(self):
        if self.journal.flush():
            assert self.journal.error is None
            files = [self.folder / (self.journal.token + suffix) for suffix in SUFFIXES]
            assert same_bits(recover_files(files).document, self.session.document)

    @invariant()
    def agrees(self):
        if hasattr(self, "session"):
            assert self.session.document is self.session.history.current
            assert same_bits(self.session.document, self.states[self.cursor])

    def teardown(self):
        if hasattr(self, "session"):
            self.session.history.flush()
            while self.session.history.cursor:
                self.session.undo()
            assert same_bits(self.session.document, START)
            while self.session.history.redo_name is not None:
                self.session.redo()
            assert same_bits(self.session.document, self.states[-1])
            self.session.close(discard=True)
            shutil.rmtree(self.folder)


TestCommands = Commands.TestCase
TestCommands.settings = settings(
    max_examples=25, stateful_step_count=25, deadline=None, suppress_health_check=list(HealthCheck)
)
