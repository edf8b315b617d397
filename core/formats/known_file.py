"""What is known of the scene of a shot: survey points as CSV, constraints of any kind as JSON.

CSV: a point a row, ``name, x, y, z`` or ``name, x, y, z, sigma``; a first row of words is a heading. JSON:
``{"constraints": [{"kind": "distance", "points": ["t1", "t2"], "value": [2.5], "sigma": 0.01}]}``, kinds and values as
`core/match/solve/constraints.py` has them. Points are names of tracks, y is up, sigma 0 is hard.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

import msgspec

from core.errors import UserError
from core.formats.given_file import LARGEST_JSON, decoded_json, must_be_readable
from core.match.solve.held import Known


class _Constraint(msgspec.Struct):
    kind: str
    points: tuple[str, ...]
    value: tuple[float, ...] = ()
    sigma: float = 0.0


class _File(msgspec.Struct):
    constraints: tuple[_Constraint, ...]


def read_known(path: Path) -> tuple[Known, ...]:
    """Read survey points or constraints.

    Raises
    ------
    UserError
        The file is not of this form; the message says where.
    """
    if path.suffix.lower() == ".json":
        file = decoded_json(path, _File, "a file of constraints")
        return tuple(Known(one.kind, one.points, one.value, one.sigma) for one in file.constraints)
    must_be_readable(path, "survey", LARGEST_JSON)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file_of_rows:
            rows = [row for row in csv.reader(file_of_rows) if any(cell.strip() for cell in row)]
    except (ValueError, csv.Error):
        raise UserError(f"{path.name} is no table of text; write a row name, x, y, z for every point.") from None
    if rows and not _numbers(rows[0]):
        rows = rows[1:]
    found = []
    for number, row in enumerate(rows, 1):
        values = _numbers(row)
        if values is None:
            raise UserError(f"{path.name}: point {number} is not name, x, y, z and perhaps sigma, in finite numbers.")
        found.append(Known("survey", (row[0].strip(),), values[:3], values[3] if len(values) > 3 else 0.0))
    if not found:
        raise UserError(f"{path.name} holds no points; write a row name, x, y, z for every point.")
    return tuple(found)


def _numbers(row: list[str]) -> tuple[float, ...] | None:
    """x, y, z and perhaps sigma of a row, None where it has no such."""
    try:
        values = tuple(float(cell) for cell in row[1:])
    except ValueError:
        return None
    return values if len(values) in (3, 4) and all(math.isfinite(v) for v in values) else None
