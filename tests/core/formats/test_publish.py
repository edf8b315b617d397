"""Publishing: whole versions under numbers of their own, or nothing."""

import json
import multiprocessing
import os
import stat
from concurrent.futures import ProcessPoolExecutor, wait

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


def publish_number(folder, number):
    return publish(folder, one_file(str(number)), {"k": number}).name


def test_many_processes_at_once_all_succeed_and_latest_always_names_a_whole_version(tmp_path):
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        made = [pool.submit(publish_number, tmp_path, k) for k in range(40)]
        while wait(made, timeout=0.001).not_done:
            if (tmp_path / LATEST).is_symlink():
                seen = json.loads((tmp_path / LATEST / MANIFEST).read_text())
                assert list(seen["files"]) == ["coat.txt"]
        names = [one.result() for one in made]
    assert versions(tmp_path) == list(range(1, 41))
    assert sorted(names) == [f"v{n:03d}" for n in range(1, 41)]
    for k, name in enumerate(names):
        assert (tmp_path / name / "coat.txt").read_text() == str(k)
        assert json.loads((tmp_path / name / MANIFEST).read_text())["version"] == int(name[1:])
    assert os.readlink(tmp_path / LATEST) == "v040"
    assert {path.name for path in tmp_path.iterdir()} == {LATEST, *names}


def test_what_fails_leaves_nothing_behind(tmp_path):
    publish(tmp_path, one_file("one"), {})

    def fill(folder):
        (folder / "half").write_text("x")
        raise OSError(28, "No space left on device")

    with pytest.raises(UserError, match="Nothing was published"):
        publish(tmp_path, fill, {})
    assert sorted(path.name for path in tmp_path.iterdir()) == [LATEST, "v001"]
    assert os.readlink(tmp_path / LATEST) == "v001"
