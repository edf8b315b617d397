"""A studio's own tools in the real program: found, or left out and named when broken, none when safe."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.window.settings import Settings, save_settings
from tests.window.conftest import OFFSCREEN
from tests.window.test_start import start

pytestmark = pytest.mark.skipif(OFFSCREEN is not None, reason=str(OFFSCREEN))

GOOD = '''
from tools.brush import BrushStroke
from tools.ring import BrushParams
from tools.tool import Tool


class FluffParams(BrushParams):
    pass


class FluffStroke(BrushStroke):
    def brush(self, guides):
        return guides


class Fluff(Tool[FluffParams]):
    name = "studio_fluff"
    label = "Fluff"
    order = 99
    icon = "puff"
    tooltip = "Does nothing at all to hair, which is what this test needs."
    hint = "Drag: nothing"
    step = "Fluff"
    Params = FluffParams

    def begin(self, ground, pointer):
        return FluffStroke(self.params, ground)
'''
ASK = """
import json
found = window.commands.find("broken_tool")
open({said!r}, "w").write(json.dumps({{
    "tools": [tool.name for tool in session.tools],
    "bar": window.plugins.sentence.text() if window.plugins.isVisible() else "",
    "found": [[c.label, window.commands.reason(c.name)] for c in found[:1]],
}}))
"""


@pytest.mark.parametrize("safe", [False, True])
def test_plugins_of_the_preferences_and_a_broken_one(home: Path, safe: bool) -> None:
    folder = home / "plugins"
    folder.mkdir()
    (folder / "fluff.py").write_text(GOOD)
    (folder / "broken_tool.py").write_text("1 / 0\n")
    nowhere = GOOD.replace("order = 99", "").replace("studio_fluff", "nowhere")
    (folder / "unplaced.py").write_text(nowhere)
    save_settings(Settings(plugin_folder=str(folder)), home / "settings")
    script = home / "ask.py"
    script.write_text(ASK.format(said=str(home / "said")))
    done = start(home, *(["--safe"] if safe else []), "--screenshot", home / "a.png", "--after", script)
    assert done.returncode == 0, done.stderr
    said = json.loads((home / "said").read_text())
    assert ("studio_fluff" in said["tools"]) is not safe
    assert "comb" in said["tools"]
    if safe:
        assert said["bar"] == ""
        assert said["found"] == []
    else:
        assert "broken_tool.py" in said["bar"]
        assert "unplaced.py" in said["bar"]
        assert "nowhere" not in said["tools"]
        assert "division by zero" in said["bar"]
        assert said["found"] == [["broken_tool.py left out", "ZeroDivisionError: division by zero"]]
