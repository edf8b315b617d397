"""A solved camera as Alembic: one camera with a sample per frame, and the points of the scene.

Y is up. Alembic knows no bend of a lens: the picture of the camera is the straight one. How large the plate is and the
names of tracks stand in user properties.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from core.errors import UserError
from core.formats.sandbox import run_bounded
from core.formats.shot_film import film_of, shot_of_film
from core.match.solve.shot import Shot

SUFFIX = ".abc"
SECONDS, MEMORY = 60.0, 4 << 30


def write(path: Path, shot: Shot) -> None:
    """Write camera ``/Solve/camera`` and points ``/Solve/points``, 24 frames to the second.

    Raises
    ------
    UserError
        The archive could not be written.
    """
    world, points = shot.up()
    with tempfile.TemporaryDirectory(prefix="filoplume-") as folder:
        arrays = Path(folder) / "shot.npz"
        np.savez(arrays, frames=shot.frames, world=world, film=film_of(shot), points=points)
        said = {"path": str(path), "arrays": str(arrays), "size": list(shot.size), "tracks": "\n".join(shot.names)}
        try:
            run_bounded("core.formats.alembic_camera_path:write_in_child", said, what="The archive", seconds=SECONDS,
                        memory=MEMORY)
        except UserError as error:
            raise UserError(
                f"The Alembic file could not be written to {path.parent}; free some space there or save elsewhere."
            ) from error


def read_shot(path: Path) -> Shot:
    """The first camera of an archive over its frames, with the points that stand in it.

    The plate is as large as the file says (a solve of this program does), else 1920 pixels wide.

    Raises
    ------
    UserError
        The file holds no camera, or cannot be read.
    """
    found = run_bounded(
        "core.formats.alembic_camera_path:read_in_child", {"path": str(path)}, what=path.name, seconds=SECONDS,
        memory=MEMORY)
    world, film, frames = found["world"], found["film"], found["frames"]
    usable = np.isfinite(world).all() and np.isfinite(film).all() and (film[:, :3] > 0.0).all()
    if not usable or (np.diff(frames) <= 0).any():
        raise UserError(f"{path.name} holds no camera that can be used.")
    points = np.asarray(found["points"], np.float64)
    names = tuple(found["tracks"].split("\n"))
    width, height = found["size"]
    return shot_of_film(
        (width, height), frames, world, film, points, names if len(names) == len(points) else (), found["up"])
