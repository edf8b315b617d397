"""Publishing: whole versions under numbers of their own, or nothing."""

import json
import os
import stat
from concurrent.futures import ThreadPoolExecutor

import pytest

from core.errors import UserError
from core.formats.publish import LATEST, MANIFEST, digest, publish, versions


def one_file(words):
    return lambda folder: (folder / "coat.txt").write_text(words, encoding="utf-8") and None


def test_versions_are_numbered_sealed_and_described(tmp_path):
    first = publish(tmp_path / "shot", one_file("one"), {"note": "first"})
    second = publish(tmp_path / "shot", one_file("two"), {"note": "second"})
    assert [first.name, second.name] == ["v001", "v002"]
    told = json.loads((second / MANIFEST).read_text())
    assert (told["version"], told["note"]) == (2, "second")
    assert told["files"]["coat.txt"] == {"sha256": digest(second / "coat.txt"), "bytes": 3}
    for path in (first, first / "coat.txt", first / MANIFEST):
        assert not path.stat().st_mode & (stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH)
    assert os.readlink(tmp_path / "shot" / LATEST) == "v002"
    assert (first / "coat.txt").read_text() == "one"


def test_many_at_once_all_succeed(tmp_path):
    with ThreadPoolExecutor(8) as pool:
        made = list(pool.map(lambda k: publish(tmp_path, one_file(str(k)), {"k": k}), range(12)))
    assert versions(tmp_path) == list(range(1, 13))
    assert sorted(path.name for path in made) == [f"v{n:03d}" for n in range(1, 13)]
    for k, path in enumerate(made):
        assert (path / "coat.txt").read_text() == str(k)
        assert json.loads((path / MANIFEST).read_text())["version"] == int(path.name[1:])
    assert os.readlink(tmp_path / LATEST) == "v012"
    assert {path.name for path in tmp_path.iterdir()} == {LATEST, *(f"v{n:03d}" for n in range(1, 13))}


def test_what_fails_leaves_nothing_behind(tmp_path):
    publish(tmp_path, one_file("one"), {})

    def fill(folder):
        (folder / "half").write_text("x")
        raise OSError(28, "No space left on device")

    with pytest.raises(UserError, match="Nothing was published"):
        publish(tmp_path, fill, {})
    assert sorted(path.name for path in tmp_path.iterdir()) == [LATEST, "v001"]
    assert os.readlink(tmp_path / LATEST) == "v001"
