"""A session against a plain list of states: whatever is done is undone, redone, saved, opened and recovered to the bit.

A test inherits it, says where to start, and adds rules that call :meth:`UndoMachine.done`.
"""

import shutil
import tempfile
from pathlib import Path

from hypothesis import note
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from core.document import Document
from core.errors import UserError
from core.evaluator import Evaluator
from core.formats.journal import SUFFIXES, Journal
from core.formats.project import read_project
from core.formats.recovery import recover_files
from core.leaves import same_bits
from core.workspace import Workspace
from tools.session import Session


class UndoMachine(RuleBasedStateMachine):
    """The rules of every session: undo, redo, jump, save and open, replay of the journal."""

    first = Document()
    workspace = Workspace()

    @initialize()
    def start(self):
        self.folder = Path(tempfile.mkdtemp(prefix="filoplume-test-"))
        self.journal = Journal(self.folder, patience=5.0)
        self.session = Session(self.first, self.workspace, journal=self.journal, evaluator=Evaluator())
        self.session.history._keep = 2
        self.states, self.cursor = [self.first], 0

    def done(self, function, *args, **params):
        """Call something that makes at most one step, or refuses in words and then changes nothing."""
        before, steps = self.session.document, self.session.history.names
        try:
            function(*args, **params)
        except UserError as refusal:  # there may be nothing to do here
            note(str(refusal))
            assert self.session.document is before
            assert self.session.history.names == steps
        if self.session.document is not before:
            self.cursor += 1
            self.states[self.cursor :] = [self.session.document]

    def shown_and_cancelled(self, function, *args):
        """Show a value as a stroke does, and give it up."""
        before = self.session.document
        try:
            self.session.preview(function(before, *args))
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
            assert same_bits(self.session.document, self.first)
            while self.session.history.redo_name is not None:
                self.session.redo()
            assert same_bits(self.session.document, self.states[-1])
            self.session.close(discard=True)
            shutil.rmtree(self.folder)
