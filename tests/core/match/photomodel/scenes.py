"""Things that were photographed, so the model made of them can be compared with what they are."""

import numpy as np

from core.match.photomodel.records import ModelPoint, Photo, Photomodel, picked
from core.match.photomodel.rows import seen_by

SIZE = (3000, 2000)
FOCAL = 2600.0
# a house: a box with a gable, a door on its front; metres, y up
HOUSE = np.array([
    [0, 0, 0], [4, 0, 0], [4, 0, 6], [0, 0, 6], [0, 3, 0], [4, 3, 0], [4, 3, 6], [0, 3, 6], [2, 4.5, 0], [2, 4.5, 6],
    [1, 0, 0], [1, 2, 0],
], float)
NAMES = ("a", "b", "c", "d", "e", "f", "g", "h", "ridge front", "ridge back", "door low", "door high")
EDGES = ((0, 1), (1, 2), (4, 5), (5, 6), (0, 4), (1, 5), (2, 6), (8, 9), (5, 8), (10, 11))


def photo(id_: int, centre, target=(2.0, 1.8, 2.5), size=SIZE, focal=FOCAL, **more) -> Photo:
    """A photograph taken at `centre` of `target`."""
    centre, target = np.array(centre, float), np.array(target, float)
    ahead = (target - centre) / np.linalg.norm(target - centre)
    right = np.cross(ahead, [0.0, 1, 0])
    right /= np.linalg.norm(right)
    turn = np.stack([right, np.cross(ahead, right), ahead])
    return Photo(
        id=id_, name=f"photo {id_}", width=size[0], height=size[1], focal_px=focal, rotation=turn,
        translation=tuple(map(float, -turn @ centre)), **more,
    )


PHOTOS = (photo(1, (-6, 2, -9)), photo(2, (2, 4, -12)), photo(3, (10, 3, -8)))


def picks_of(photos, place, rng, noise=0.5):
    """Where a point is seen in photographs, with the unsteadiness of a hand."""
    xy = [tuple(seen_by(one, np.array([place]))[0][0] + rng.normal(0, noise, 2)) for one in photos]
    return picked([one.id for one in photos], xy)


def unsolved(photos):
    """The photographs before anything was found."""
    return tuple(one.replace(rotation=None, translation=None) for one in photos)


def house(seed=0, noise=0.5, photos=PHOTOS, **more) -> Photomodel:
    """Picks of the house's points in photographs, nothing solved."""
    rng = np.random.default_rng(seed)
    points = tuple(
        ModelPoint(id=k + 1, name=name, picks=picks_of(photos, place, rng, noise))
        for k, (name, place) in enumerate(zip(NAMES, HOUSE, strict=True))
    )
    return Photomodel(id=1, name="house", photos=unsolved(photos), points=points, **more)


def places(model: Photomodel) -> np.ndarray:
    """(P, 3) of the model's points."""
    return np.array([point.place for point in model.points])


def edge_errors(model: Photomodel) -> np.ndarray:
    """Lengths of the house's edges over the true ones, less 1, after the best common scale."""
    there = places(model)
    ours, true = (np.array([np.linalg.norm(x[a] - x[b]) for a, b in EDGES]) for x in (there, HOUSE))
    ratio = ours / true
    return ratio / np.exp(np.log(ratio).mean()) - 1.0
