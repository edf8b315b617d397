"""Windows of tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from pytestqt.qtbot import QtBot

from tests.documents import small_document
from tests.window.host import Host


@pytest.fixture
def host(qtbot: QtBot) -> Iterator[Host]:
    """A window with a small document in it, shown."""
    host = Host(small_document())
    host.resize(900, 600)
    with qtbot.waitExposed(host):
        host.show()
    yield host
    host.close()
    host.desk.session.close(discard=True)
    host.deleteLater()
