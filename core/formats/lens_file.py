"""Lenses as files: those of 3DEqualizer (.txt, as its lens export writes them), our own (.json) and what a solve wrote
into USD. Ours is ``{"size": [w, h], "model": NAME, "numbers": [...]}``, the numbers of `core/match/lens.py`.

3DEqualizer measures in centimetres of the filmback, y up, its coordinates are over half the diagonal of the filmback
("3DE4 Radial - Standard, Degree 4", "3DE4 Anamorphic - Standard, Degree 4", Lens Distortion Plugin Kit).
"""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from core.errors import UserError
from core.formats.given_file import decoded_json
from core.match.lens import Array, model_named, model_of, start_lens
from core.match.lens_kernels import UNIT

FILM = 3.6  # centimetres across, of filmbacks that are written
LARGEST = 1 << 20
WRITTEN = (".json", ".txt")
RADIAL = "3DE4 Radial - Standard, Degree 4"
ANAMORPHIC = "3DE4 Anamorphic - Standard, Degree 4"
RADIAL_COLUMNS = {
    "Distortion - Degree 2": (1, 1), "U - Degree 2": (7, 1), "V - Degree 2": (8, -1),
    "Quartic Distortion - Degree 4": (2, 1), "U - Degree 4": (9, 1), "V - Degree 4": (10, -1),
}  # fmt: skip  # column, and its sign where y is up
ANAMORPHIC_COLUMNS = {
    "Cx02 - Degree 2": 1, "Cy02 - Degree 2": 2, "Cx22 - Degree 2": 7, "Cy22 - Degree 2": 8, "Cx04 - Degree 4": 9,
    "Cy04 - Degree 4": 10, "Cx24 - Degree 4": 11, "Cy24 - Degree 4": 12, "Cx44 - Degree 4": 13, "Cy44 - Degree 4": 14,
    "Squeeze-X": 16, "Squeeze-Y": 17,
}  # fmt: skip
PHI, BENDING, TURN = "Phi - Cylindric Direction", "B - Cylindric Bending", "Lens Rotation"


class _Lens(msgspec.Struct):
    size: tuple[int, int]
    model: str
    numbers: list[float]


def write_lens(path: Path, lens: Array, size: tuple[int, int], suffix: str) -> None:
    """Write a lens in the format of `suffix` to the (temporary) path given.

    Raises
    ------
    UserError
        3DEqualizer has no such model here.
    """
    if suffix.lower() == ".txt":
        path.write_text(lens_text(lens, size), encoding="utf-8")
    else:
        path.write_bytes(msgspec.json.encode(_Lens(size, model_of(lens).name, lens.tolist())))


def _own_lens(path: Path) -> tuple[Array, tuple[int, int]]:
    file = decoded_json(path, _Lens, "a lens", LARGEST)
    lens = np.array(file.numbers, np.float64)
    if len(lens) != model_named(file.model).columns or not np.isfinite(lens).all() or min(file.size) < 1:
        raise UserError(f"{path.name} does not hold the numbers of a lens of the model {file.model}.")
    return lens, file.size


def lens_text(lens: Array, size: tuple[int, int], name: str = "Filoplume") -> str:
    """A lens as 3DEqualizer has it.

    Raises
    ------
    UserError
        3DEqualizer has no such model here.
    """
    width, height = size
    pixel = FILM / width
    stretch = float(np.exp(lens[3]))
    film = (FILM, pixel * height / stretch)
    centre = ((lens[4] - 0.5 * (width - 1)) * pixel, -(lens[5] - 0.5 * (height - 1)) * pixel / stretch)
    unit = 0.5 * float(np.hypot(*film)) / pixel
    model = model_of(lens).name
    values: dict[str, float] = {}
    if model == "radial4":
        _check_unit(lens, unit)
        title = RADIAL
        values = {said: sign * float(lens[column]) for said, (column, sign) in RADIAL_COLUMNS.items()}
        size_of_bend = float(np.hypot(lens[11], lens[12]))
        values[PHI] = float(np.degrees(0.5 * np.arctan2(-lens[12], lens[11]))) if size_of_bend else 0.0
        values[BENDING] = float(np.expm1(2.0 * size_of_bend))
    elif model == "anamorphic4":
        _check_unit(lens, unit)
        title = ANAMORPHIC
        values = {said: float(lens[column]) for said, column in ANAMORPHIC_COLUMNS.items()}
        values[TURN] = float(-np.degrees(lens[15]))
    elif not lens[1:3].any() and model == "brown":
        title, values = RADIAL, dict.fromkeys((*RADIAL_COLUMNS, PHI, BENDING), 0.0)
    else:
        raise UserError(f"3DEqualizer has no lens of the model {model}; solve with --lens radial4 or anamorphic4.")
    numbers = (*film, float(np.exp(lens[0])) * pixel, film[0] / film[1], *centre, stretch)
    lines = [name, " ".join(f"{number:.15f}" for number in numbers), "DISTORTION_STATIC", title]
    for said, value in values.items():
        lines += [said, f"{value:.15f}", "0"]
    return "\n".join([*lines, "<end_of_file>"]) + "\n"


def lens_of_text(text: str, size: tuple[int, int], name: str) -> Array:
    """The lens (L,) of a file of 3DEqualizer, for a plate of `size` pixels.

    Raises
    ------
    UserError
        It is no such file, of a model that is not known, or its distortion changes over the shot.
    """
    lines = [line.strip() for line in text.splitlines()]
    try:
        wide, high, focal, _, x, y, stretch = (float(word) for word in lines[1].split())
        if not all(np.isfinite(v) for v in (wide, high, focal, x, y)) or min(wide, high, focal, stretch) <= 0.0:
            raise ValueError
        title = lines[3]
    except (IndexError, ValueError):
        raise UserError(f"{name} is no lens of 3DEqualizer: its second line should hold seven numbers.") from None
    if lines[2] != "DISTORTION_STATIC":
        raise UserError(f"{name}: its distortion changes over the shot, which is not read; export it as static.")
    if title not in (RADIAL, ANAMORPHIC):
        raise UserError(f"{name}: the model {title[:60]} is not known; there are {RADIAL} and {ANAMORPHIC}.")
    pixel = wide / size[0]
    lens = start_lens(focal / pixel, *size, "radial4" if title == RADIAL else "anamorphic4")
    lens[3], lens[4], lens[5] = np.log(stretch), lens[4] + x / pixel, lens[5] - y / pixel * stretch
    lens[UNIT] = 0.5 * float(np.hypot(wide, high)) / pixel

    def value(said: str) -> float:
        try:
            number = float(lines[lines.index(said, 4) + 1])
        except (ValueError, IndexError):
            raise UserError(f"{name}: there is no number for {said}.") from None
        if not abs(number) < 1e3:
            raise UserError(f"{name}: {said} is out of all bounds.")
        return number

    if title == RADIAL:
        for said, (column, sign) in RADIAL_COLUMNS.items():
            lens[column] = sign * value(said)
        angle, stretched = 2.0 * np.radians(value(PHI)), 0.5 * np.log1p(max(value(BENDING), -0.99))
        lens[11:13] = stretched * np.cos(angle), -stretched * np.sin(angle)
    else:
        for said, column in ANAMORPHIC_COLUMNS.items():
            lens[column] = value(said)
        lens[15] = -np.radians(value(TURN))
    return lens


def read_lens(path: Path, size: tuple[int, int] | None) -> tuple[Array, tuple[int, int]]:
    """The lens of a file, and the size of its plate: what the file says, else the one given.

    Raises
    ------
    UserError
        The file is missing, damaged, of an unknown kind, or does not say how large the plate is.
    """
    from core.formats.usd_solve import SUFFIXES, read_shot

    if not path.is_file():
        raise UserError(f"{path} is not there; give the name of a file.")
    if path.suffix.lower() in SUFFIXES:
        shot = read_shot(path)
        return shot.lens, shot.size
    if path.suffix.lower() == ".json":
        return _own_lens(path)
    if path.suffix.lower() != ".txt":
        raise UserError(f"{path.name}: lenses are read from {', '.join(SUFFIXES)}, .json, and .txt of 3DEqualizer.")
    if path.stat().st_size > LARGEST:
        raise UserError(f"{path.name} is too large for a lens.")
    if size is None:
        raise UserError(f"{path.name} does not say how large the plate is; give --size 1920x1080.")
    return lens_of_text(path.read_text(encoding="utf-8", errors="replace"), size, path.name), size


def _check_unit(lens: Array, unit: float) -> None:
    if abs(lens[UNIT] / unit - 1.0) > 1e-3:
        raise UserError("The lens is of another filmback than the plate; 3DEqualizer would bend it otherwise.")
