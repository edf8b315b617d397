"""Writes the sample of the present file format: ``python -m tests.write_baseline``, once for every new version.

A sample is never written again: what it holds is what people's files of that version hold.
"""

from pathlib import Path

from core.formats.project import write_project
from core.formats.upgrade import FORMAT
from tests.documents import animated_document, small_workspace

BASELINES = Path(__file__).parents[1] / "resources" / "baselines"


def main() -> None:
    path = BASELINES / f"format_{FORMAT}.filo"
    if path.exists():
        raise SystemExit(f"{path} is there already; raise FORMAT in core/formats/upgrade.py first")
    write_project(path, animated_document(), small_workspace())


if __name__ == "__main__":
    main()
