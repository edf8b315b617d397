"""Whole-file replacement: the old file or the new one, never less."""

import errno
import os
import resource
import signal
import subprocess
import sys
import textwrap

import pytest

from core.errors import UserError
from core.formats.atomic import atomic_write
from tests.core.formats.failing_disk import Disk, failing

OLD, NEW = b"the old file" * 1000, b"the new one!" * 2000


def _write(path, data=NEW, keep=False):
    with atomic_write(path, keep_previous=keep) as temp, open(temp, "wb") as file:
        file.write(data)


@pytest.fixture
def target(tmp_path):
    path = tmp_path / "fur.usdc"
    path.write_bytes(OLD)
    return path


def _leftovers(folder):
    return [p.name for p in folder.iterdir() if ".part" in p.name]


def test_a_file_is_made_and_replaced(tmp_path):
    path = tmp_path / "a.filo"
    _write(path, b"one")
    _write(path, b"two", keep=True)
    _write(path, b"three", keep=True)
    assert path.read_bytes() == b"three"
    assert (tmp_path / "a.filo1").read_bytes() == b"two"
    assert sorted(os.listdir(tmp_path)) == ["a.filo", "a.filo1"]


def test_the_temporary_file_lies_beside_with_the_same_suffix(target):
    with atomic_write(target) as temp:
        assert temp.parent == target.parent
        assert temp.suffix == ".usdc"
        assert temp.exists()
        assert target.read_bytes() == OLD
        temp.write_bytes(NEW)
    assert target.read_bytes() == NEW


def test_permissions_stay_and_a_new_file_gets_the_usual_ones(target, tmp_path):
    target.chmod(0o640)
    _write(target)
    assert target.stat().st_mode & 0o777 == 0o640
    old = os.umask(0o022)
    try:
        _write(tmp_path / "new.bin")
    finally:
        os.umask(old)
    assert (tmp_path / "new.bin").stat().st_mode & 0o777 == 0o644


def test_a_symbolic_link_stays_one(target, tmp_path):
    link = tmp_path / "link.usdc"
    link.symlink_to(target)
    _write(link)
    assert link.is_symlink()
    assert target.read_bytes() == NEW


@pytest.mark.parametrize("exception", [ValueError("bad"), KeyboardInterrupt(), SystemExit(1), UserError("no")])
def test_an_exception_of_the_body_leaves_the_old_file(target, exception):
    def body():
        with atomic_write(target) as temp:
            temp.write_bytes(NEW[:100])
            raise exception

    with pytest.raises(type(exception)):
        body()
    assert target.read_bytes() == OLD
    assert _leftovers(target.parent) == []


def test_an_exporter_that_removes_its_file_leaves_the_old_one(target):
    with pytest.raises(UserError, match="could not be saved"), atomic_write(target) as temp:
        temp.unlink()
    assert target.read_bytes() == OLD


@pytest.mark.parametrize("keep", [False, True])
@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EIO, errno.EACCES, errno.EROFS])
def test_every_operation_may_fail(target, monkeypatch, error, keep):
    with failing(Disk(target.parent), monkeypatch) as disk:
        _write(target, keep=keep)
    assert disk.count >= 5
    late = []
    for k in range(1, disk.count + 1):
        target.write_bytes(OLD)
        message = None
        with failing(Disk(target.parent, k, error), monkeypatch):
            try:
                _write(target, keep=keep)
            except UserError as failure:
                message = str(failure)
        late.append(message is not None and "not confirm" in message)
        assert target.read_bytes() == (OLD if message and not late[-1] else NEW)
        if message is not None:
            assert "save" in message
            assert message.endswith(".")
            assert str(target) in message
        assert {p.name for p in target.parent.iterdir()} <= {"fur.usdc", "fur.usdc1"}
        previous = target.with_name("fur.usdc1")
        assert not previous.exists() or previous.read_bytes() == OLD
        previous.unlink(missing_ok=True)
    assert late[-1]  # only what comes after the rename may be too late to take back
    assert not any(late[:-2])


def test_the_contents_are_on_the_disk_before_the_name_and_the_name_before_the_end(target, monkeypatch):
    """Power may go at any moment: what is renamed must have been synced, and the folder after it."""
    with failing(Disk(target.parent), monkeypatch) as disk:
        _write(target)
    renamed = disk.calls.index("replace")
    assert "fsync" in disk.calls[disk.calls.index("write") : renamed]
    assert "write" not in disk.calls[renamed:]
    assert disk.calls[-1] == "fsync"


@pytest.mark.parametrize(
    ("error", "advice"),
    [(errno.ENOSPC, "free some space"), (errno.EROFS, "another folder"), (errno.EIO, "another folder")],
)
def test_the_message_says_what_to_do(target, monkeypatch, error, advice):
    with failing(Disk(target.parent, 3, error), monkeypatch), pytest.raises(UserError, match=advice) as failure:
        _write(target)
    assert "The earlier file is as it was." in str(failure.value)


def test_a_disk_without_hard_links_keeps_the_previous_by_copying(target, monkeypatch):
    def no_links(*_):
        raise OSError(errno.EPERM, "not permitted")

    monkeypatch.setattr(os, "link", no_links)
    _write(target, keep=True)
    assert target.read_bytes() == NEW
    assert target.with_name("fur.usdc1").read_bytes() == OLD


def test_a_missing_folder_and_an_odd_target_are_named(tmp_path):
    with pytest.raises(UserError, match="does not exist: create it"):
        _write(tmp_path / "none" / "a.filo")
    with pytest.raises(UserError, match="not an ordinary file"):
        _write(tmp_path)
    with pytest.raises(UserError, match="not an ordinary file"):
        _write("/dev/full")
    assert os.path.exists("/dev/full")
    with pytest.raises(UserError, match="could not be saved"):
        _write("/proc/filoplume.filo")  # a folder nobody may write to, not even root


def test_a_full_disk_for_real(tmp_path):
    """RLIMIT_FSIZE makes the kernel itself refuse the write in the middle of the file."""
    target = tmp_path / "fur.filo"
    target.write_bytes(OLD)
    script = textwrap.dedent(
        """
        import resource, signal, sys
        from core.errors import UserError
        from core.formats.atomic import atomic_write
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))
        try:
            with atomic_write(sys.argv[1], keep_previous=True) as temp, open(temp, "wb") as file:
                file.write(bytes(20000))
        except UserError as error:
            sys.exit(str(error))
        """
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(target)], capture_output=True, text=True, env={**os.environ}, check=False
    )
    assert "free some space" in done.stderr
    assert target.read_bytes() == OLD
    assert _leftovers(tmp_path) == []
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] != 5000


def test_what_a_killed_process_left_is_removed_by_the_next_save(target):
    script = textwrap.dedent(
        """
        import os, signal, sys
        from core.formats.atomic import atomic_write
        with atomic_write(sys.argv[1]) as temp:
            temp.write_bytes(bytes(100))
            os.kill(os.getpid(), signal.SIGKILL)
        """
    )
    done = subprocess.run([sys.executable, "-c", script, str(target)], env={**os.environ}, check=False)
    assert done.returncode == -signal.SIGKILL
    assert len(_leftovers(target.parent)) == 1
    assert target.read_bytes() == OLD
    with atomic_write(target) as temp:  # of a living process: must stay
        temp.write_bytes(b"slow one")
        _write(target)
        assert temp.exists()
    assert _leftovers(target.parent) == []


def test_long_and_foreign_names(tmp_path):
    for name in ("g" * 240 + ".filo", "Gefieder – 羽毛 🪶.filo", "no suffix", ".hidden"):
        _write(tmp_path / name)
        assert (tmp_path / name).read_bytes() == NEW
