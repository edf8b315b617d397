"""The camera path of an Alembic archive with its points, as written and read in the child process.

The library takes its process with it where a disk is full or a file is damaged. It loads nothing of the solver, so that
the child starts in a fraction of a second. Apertures are in centimetres there, focal lengths in millimetres.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from core.errors import UserError

FPS = 24.0
MOST_FRAMES, MOST_POINTS = 100_000, 5_000_000
WIDTH_SAID, HEIGHT_SAID, TRACKS_SAID = "filoplume_width", "filoplume_height", "filoplume_tracks"


def write_in_child(path: str, arrays: str, size: list[int], tracks: str) -> dict[str, Any]:
    """Write the archive of `arrays` (.npz): frames (F,), world (F, 4, 4) of column vectors, film (F, 5) in mm as USD's
    focal length, apertures, offsets; points (P, 3)."""
    import imath
    from alembic3d import Abc, AbcCoreAbstract, AbcGeom

    given = np.load(arrays, allow_pickle=False)
    frames, points = given["frames"], np.ascontiguousarray(given["points"], np.float32)
    archive = Abc.OArchive(path)
    if (np.diff(frames) != 1).any():
        times = AbcCoreAbstract.TimeVector()
        times.extend((frames / FPS).tolist())
        sampling = AbcCoreAbstract.TimeSampling(
            AbcCoreAbstract.TimeSamplingType(AbcCoreAbstract.AcyclicFlag.kAcyclic), times)
    else:
        sampling = AbcCoreAbstract.TimeSampling(1.0 / FPS, float(frames[0]) / FPS)
    clock = archive.addTimeSampling(sampling)
    top = AbcGeom.OXform(archive.getTop(), "Solve")
    said = top.getSchema().getUserProperties()
    for name, value in zip((WIDTH_SAID, HEIGHT_SAID), size, strict=True):
        Abc.ODoubleProperty(said, name).setValue(float(value))
    Abc.OStringProperty(said, TRACKS_SAID).setValue(tracks)
    stand = AbcGeom.OXform(top, "camera", clock)
    lens = AbcGeom.OCamera(stand, "cameraShape", clock).getSchema()
    for world, (focal, wide, tall, right, up) in zip(given["world"], given["film"], strict=True):
        pose = AbcGeom.XformSample()
        pose.setMatrix(imath.M44d(*world.T.ravel().tolist()))  # Alembic's vectors are rows
        stand.getSchema().set(pose)
        sample = AbcGeom.CameraSample()
        sample.setFocalLength(float(focal))
        sample.setHorizontalAperture(float(wide) / 10.0)
        sample.setVerticalAperture(float(tall) / 10.0)
        sample.setHorizontalFilmOffset(float(right) / 10.0)
        sample.setVerticalFilmOffset(float(up) / 10.0)
        lens.set(sample)
    if len(points):
        ids = imath.IntArray(len(points))
        for row in range(len(points)):
            ids[row] = row
        shape = AbcGeom.OPoints(AbcGeom.OXform(top, "points"), "pointsShape")
        shape.getSchema().set(AbcGeom.OPointsSchemaSample(imath.V3fArrayFromBuffer(points), ids))
    return {}


def read_in_child(path: str) -> dict[str, Any]:
    """The first camera: `frames`, `world`, `film` as :func:`write_in_child` has them, `points`, `size`, `tracks`."""
    from alembic3d import Abc, AbcGeom

    from core.formats.alembic_mesh import UP, read_properties

    name = Path(path).name
    try:
        archive = Abc.IArchive(path)
    except Exception:  # its exceptions are of the C++ runtime
        raise UserError(f"{name} is not an Alembic file that can be read; export it again.") from None
    found, points = None, np.zeros((0, 3), np.float32)
    said: dict[str, Any] = {}
    waiting: list[tuple[Any, tuple[Any, ...]]] = [(archive.getTop(), ())]
    while waiting:
        parent, chain = waiting.pop()
        for row in reversed(range(parent.getNumChildren())):
            child, inner = parent.getChild(row), chain
            header = child.getHeader()
            if AbcGeom.IXform.matches(header):
                inner = (*chain, AbcGeom.IXform(parent, child.getName()).getSchema())
                read_properties(inner[-1].getUserProperties(), said, (WIDTH_SAID, HEIGHT_SAID, TRACKS_SAID, UP))
            elif AbcGeom.ICamera.matches(header):
                found = (AbcGeom.ICamera(parent, child.getName()).getSchema(), chain)
            elif AbcGeom.IPoints.matches(header):
                schema = AbcGeom.IPoints(parent, child.getName()).getSchema()
                if schema.getNumSamples():
                    points = np.array(schema.getValue().getPositions(), np.float32).reshape(-1, 3)[:MOST_POINTS]
            waiting.append((child, inner))
    if found is None or not found[0].getNumSamples():
        raise UserError(f"{name} holds no camera.")
    schema, chain = found
    longest = max((schema, *chain), key=lambda one: one.getNumSamples())
    count = longest.getNumSamples()
    if count > MOST_FRAMES:
        raise UserError(f"{name} has more than {MOST_FRAMES} frames.")
    seconds = [longest.getTimeSampling().getSampleTime(row) for row in range(count)]
    world, film = [], []
    for second in seconds:
        when = Abc.ISampleSelector(second)
        place = np.eye(4)
        for form in chain:
            sample = form.getValue(when)
            local = np.array(sample.getMatrix(), np.float64).reshape(4, 4)
            place = local @ place if sample.getInheritsXforms() else local
        lens = schema.getValue(when)
        world.append(place.T)
        film.append((lens.getFocalLength(), 10.0 * lens.getHorizontalAperture() * lens.getLensSqueezeRatio(),
                     10.0 * lens.getVerticalAperture(), 10.0 * lens.getHorizontalFilmOffset(),
                     10.0 * lens.getVerticalFilmOffset()))
    frames = np.rint(np.array(seconds) * FPS).astype(np.int32)
    tracks = said.get(TRACKS_SAID)
    return {
        "frames": frames, "world": np.array(world), "film": np.array(film), "points": points,
        "size": [int(said.get(key) or 0) for key in (WIDTH_SAID, HEIGHT_SAID)],
        "up": "z" if said.get(UP) == "z" else "y", "tracks": tracks if isinstance(tracks, str) else "",
    }
