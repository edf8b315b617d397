"""What leaves the program: a hidden groom does not."""

from pathlib import Path

import pytest

from app.deliver import deliver, exported_groom
from app.files import convert
from core.errors import UserError
from core.formats.project import read_project, write_project
from tests.documents import small_document
from tools.document_edits import set_groom_hidden


def test_the_first_groom_that_is_shown_is_exported(tmp_path: Path) -> None:
    document = small_document()
    second = document.replace(grooms=(*document.grooms, document.grooms[0].replace(id=9, name="trim")))
    assert exported_groom(second) is second.grooms[0]
    hidden = set_groom_hidden(second, second.grooms[0].id, True)
    assert exported_groom(hidden).id == 9
    nothing = set_groom_hidden(hidden, 9, True)
    project = tmp_path / "bald.filo"
    deliver(project, nothing, {})
    assert [g.hidden for g in read_project(project).document.grooms] == [True, True]  # a project keeps all of it
    with pytest.raises(UserError, match="is hidden; show the one to export"):
        convert(project, tmp_path / "bald.hair", None, None, lambda note: None)
    assert not (tmp_path / "bald.hair").exists()
    write_project(project, hidden)
    assert convert(project, tmp_path / "trim.hair", None, None, lambda note: None)["guides"] > 0
    assert (tmp_path / "trim.hair").exists()
