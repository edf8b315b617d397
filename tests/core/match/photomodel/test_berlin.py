"""Three real photographs: the tracks, the reconstruction and the control points of OpenSfM's example."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.match.photomodel.records import ModelPoint, Photo, Photomodel, picked
from core.match.photomodel.rows import ray, seen_by
from core.match.photomodel.solve import solved

FOLDER = Path(os.environ.get("FILOPLUME_DATA", "")) / "matchmove" / "opensfm_berlin" / "berlin"
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="needs FILOPLUME_DATA")
SIZE = np.array([3264, 2448])


def _pixels(xy):
    """From coordinates over the longer side about the middle."""
    return np.asarray(xy) * SIZE.max() + 0.5 * (SIZE - 1)


def _reference():
    made = json.loads((FOLDER / "reconstruction_example.json").read_text())[0]
    camera = next(iter(made["cameras"].values()))
    photos = {}
    for number, name in enumerate(("01.jpg", "02.jpg", "03.jpg"), 1):
        shot = made["shots"][name]
        photos[name] = Photo(
            id=number, name=name, width=int(SIZE[0]), height=int(SIZE[1]), focal_px=camera["focal"] * SIZE.max(),
            k1=camera["k1"], k2=camera["k2"], rotation=Rotation.from_rotvec(shot["rotation"]).as_matrix(),
            translation=tuple(shot["translation"]),
        )
    return photos


def _two_rays(photos, picks):
    """The place nearest to the rays of picks, and by how many pixels each misses it."""
    rays = [ray(photos[name], xy[None]) for name, xy in picks]
    across = [np.eye(3) - np.outer(way[0], way[0]) for _, way in rays]
    place = np.linalg.solve(sum(across), sum(a @ start for a, (start, _) in zip(across, rays, strict=True)))
    return np.array([np.linalg.norm(seen_by(photos[name], place[None])[0][0] - xy) for name, xy in picks])


def test_control_points_are_met_as_well_as_by_the_reference():
    reference = _reference()
    tracks = {}
    for line in (FOLDER / "tracks_example.csv").read_text().splitlines()[1:]:
        name, track, _, x, y = line.split("\t")[:5]
        tracks.setdefault(track, {})[name] = _pixels([float(x), float(y)])
    long = [track for track, picks in tracks.items() if len(picks) == 3][:60]
    points = [
        ModelPoint(id=k, name=track, picks=picked(
            [reference[name].id for name in tracks[track]], [tuple(xy) for xy in tracks[track].values()]))
        for k, track in enumerate(long, 1)
    ]
    model = Photomodel(
        id=1, name="berlin", points=tuple(points),
        photos=tuple(one.replace(rotation=None, translation=None) for one in reference.values()),
    )
    found = solved(model)
    assert found.known.all()
    ours = {photo.name: photo for photo in found.model.photos}
    control = json.loads((FOLDER / "ground_control_points.json").read_text())["points"]
    seen = [
        [(one["shot_id"], _pixels(one["projection"])) for one in point["observations"]] for point in control
        if len(point["observations"]) > 1
    ]
    mine = np.concatenate([_two_rays(ours, picks) for picks in seen])
    theirs = np.concatenate([_two_rays(reference, picks) for picks in seen])
    assert len(mine) == 4
    assert np.sqrt((mine**2).mean()) < 2.0 * np.sqrt((theirs**2).mean())
