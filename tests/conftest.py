"""What every test has of its own: a home for journals and preferences. And how many workers share the suite."""

from __future__ import annotations

import os
import shutil

import pytest

MOST_WORKERS = 4  # each holds kernels, an animal and a display of its own: about a gigabyte


def pytest_xdist_auto_num_workers() -> int:
    """One worker for each core; one alone where windows of all workers would fight for the focus of one display."""
    if os.environ.get("DISPLAY") and shutil.which("Xvfb") is None:
        return 1
    return min(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1, MOST_WORKERS)


LONGEST = (
    "test_manual.py", "test_pictures.py", "test_cli.py", "test_start.py", "test_crash.py", "test_pose_command.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first, so that no worker is left with one of them at the end."""
    items.sort(key=lambda item: item.path.name not in LONGEST)


@pytest.fixture(scope="session", autouse=True)
def own_home(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Nothing that a test leaves is found by another worker, or by the person whose machine it is."""
    home = tmp_path_factory.mktemp("home")
    os.environ["FILOPLUME_STATE"] = str(home / "journals")
    os.environ["FILOPLUME_SETTINGS"] = str(home / "settings")
