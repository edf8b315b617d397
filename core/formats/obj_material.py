"""A picture on an OBJ file: the material library beside it that names the picture."""

from __future__ import annotations

from pathlib import Path

from core.formats.atomic import atomic_write


def add_material(path: Path, picture: str) -> Path:
    """Put the picture of that name, in the same folder, on everything of an OBJ file; gives the library's path."""
    library = path.with_suffix(".mtl")
    with atomic_write(library) as beside:
        beside.write_text(f"newmtl photographs\nKd 1 1 1\nmap_Kd {picture}\n", encoding="utf-8", newline="\n")
    words = path.read_text(encoding="utf-8")
    with atomic_write(path) as beside:
        beside.write_text(f"mtllib {library.name}\nusemtl photographs\n{words}", encoding="utf-8", newline="\n")
    return library
