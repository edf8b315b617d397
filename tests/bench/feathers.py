"""Coats of feathers: placing, interpolating, layering, frames, proxies, files; animals of the shared data where set."""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from app.deliver import posed_document
from core.evaluator import Evaluator
from core.feather.coat.coat import FeatherCoat, Placement
from core.feather.coat.dress import dress_feathers
from core.feather.coat.export import instances
from core.feather.coat.layering import crossings
from core.feather.coat.place import place_feathers
from core.feather.coat.plumage import Plumage
from core.feather.coat.posing import LENGTH
from core.feather.coat.proxy import demoted, promoted
from core.feather.look import FeatherLook
from core.formats import rig_file
from core.formats.mesh_file import read_mesh
from core.formats.usd_feathers import FeatherFrame, FeatherWriter
from core.groom.groom import Groom
from core.mesh.mesh import Mesh
from core.mesh.skin import Skin, skin_at_rest, skin_posed
from core.record import freeze
from tests.bench.bench import Row, median_ms
from tests.core.feather.coat.bodies import egg

TITLE = "Feathers: 10,000 from 20 keys"
COUNT, KEYS = 10_000, 20
CLIPS = {"parrot": "animation/bird_morph_parrot/Parrot.glb", "fox": "animation/fox_gltf/animated/Fox.glb"}
SMOOTH = 0.05  # frames of a clip between the poses of a smooth motion
ANIMALS = {"penguin": "meshes/odedstein_A/penguin/penguin.obj", "parrot": "animation/bird_morph_parrot/Parrot.glb"}


def run() -> list[Row]:
    evaluator = Evaluator()
    rows = [*_placing(evaluator), *_torso(evaluator)]
    root = os.environ.get("FILOPLUME_DATA")
    for name, path in ANIMALS.items() if root else ():
        rows += _animal(name, read_mesh(Path(str(root)) / path).mesh, evaluator)
    for name, path in CLIPS.items() if root else ():
        rows += _clip(name, Path(str(root)) / path, evaluator)
    evaluator.close()
    return rows


def _clip(name: str, path: Path, evaluator: Evaluator) -> list[Row]:
    """An animal in motion: what crosses in frames of its clip, and which feathers jump when it moves smoothly."""
    document = rig_file.document_of(rig_file.read_rig(path))
    item, first, last = document.meshes[0], document.first_frame, document.last_frame
    coat, keys = dress_feathers(item.mesh, evaluator, COUNT)
    plumage = Plumage(evaluator)
    lengths = plumage.at_rest(coat.replace(layered=False), keys, item.mesh).layered.poses[:, LENGTH, None, None, None]
    most, skin_hits, jumping = 0.0, 0, 0
    for frame in np.linspace(first, last, 7)[:-1] + 0.25:
        seen = []
        for step in range(3):
            skin = posed_document(document, float(frame + step * SMOOTH), evaluator)[item.id]
            laid = plumage.at_frame(coat, keys, item.mesh, skin, float(first), float(first))
            frames = plumage.root_frames(coat, keys, item.mesh, skin).astype(np.float64)
            away = laid.layered.vanes.astype(np.float64) - laid.feathers.roots[:, None, None]
            seen.append(np.einsum("nij,nrcj->nrci", frames, away) / lengths)
        told = crossings(laid.layered, skin.bvh, evaluator.workers)
        most, skin_hits = max(most, 100.0 * len(told.first) / told.pairs), max(skin_hits, len(told.skin))
        jumps = np.linalg.norm(seen[0] - 2.0 * seen[1] + seen[2], axis=-1).max(axis=(1, 2))
        jumping = max(jumping, int((jumps > 0.02).sum()))
    return [
        Row(f"{name} in motion: pairs that cross, the worst of 6 frames", most, "%", 1.0),
        Row(f"{name} in motion: feathers in the skin", float(skin_hits), "", 0.0),
        Row(f"{name} in motion: feathers of {COUNT:,} that jump by over 2 %", float(jumping), "", 0.0),
    ]


def _placing(evaluator: Evaluator) -> list[Row]:
    mesh = egg(64, 96)
    coat = FeatherCoat(id=1, name="coat", mesh_id=1, placements=(Placement(kind="repulsion", count=30_000),))
    place_feathers(coat.replace(placements=(Placement(kind="repulsion", count=300),)), mesh, (), evaluator)
    start = time.perf_counter()
    places = place_feathers(coat, mesh, (), evaluator)
    seconds = time.perf_counter() - start
    skin = skin_at_rest(mesh, evaluator)
    corners = skin.points[skin.triangles.vertices[places.triangle]].astype(np.float64)
    points = np.einsum("nk,nkc->nc", places.barycentric, corners)
    nearest = cKDTree(points).query(points, 2)[0][:, 1]
    return [
        Row("30,000 placed by repulsion", seconds, "s", 4.0),
        Row("their spacing, coefficient of variation", float(nearest.std() / nearest.mean()), "", 0.06),
        Row("their closest pair over the mean spacing", float(nearest.min() / nearest.mean()), "", 0.5, at_least=True),
    ]


def _torso(evaluator: Evaluator) -> list[Row]:
    mesh = egg(64, 96)
    coat, keys = dress_feathers(mesh, evaluator, COUNT, keys=KEYS)
    plumage = Plumage(evaluator)
    plumage.bed(coat, keys, mesh)
    bare = coat.replace(layered=False)
    plumage.at_rest(bare, keys, mesh)
    combing = iter(range(1, 100))
    rows = [Row("re-interpolated after a brush stroke", median_ms(
        lambda: plumage.at_rest(bare, _combed(keys, KEYS, next(combing)), mesh, quick=True)), "ms", 100)]
    start = time.perf_counter()
    rest = plumage.at_rest(coat, keys, mesh)
    rows.append(Row("layering, all of them", time.perf_counter() - start, "s", 3.0))
    told = crossings(rest.layered, rest.skin.bvh, evaluator.workers)
    rows += [
        Row("torso: pairs that cross", 100.0 * len(told.first) / told.pairs, "%", 0.1),
        Row("torso: feathers in the skin", float(len(told.skin)), "", 0.0),
        Row("layering after one key of 120 moved", _one_key(mesh, evaluator), "ms", 100),
    ]
    rows += _frames(coat, keys, mesh, plumage)
    frames = plumage.root_frames(coat, keys, mesh)
    taken = [coat]

    def take() -> None:
        vane, root = rest.layered.vanes[77], rest.feathers.roots[77]
        taken[0] = promoted(coat, int(rest.ids[77]), vane, root, frames[77], 1001.0)
        plumage.at_frame(taken[0], keys, mesh, rest.skin, 1001.0)

    def give() -> None:
        plumage.at_frame(demoted(taken[0], int(rest.ids[77])), keys, mesh, rest.skin, 1001.0)

    rows.append(Row("a feather taken over by hand", median_ms(take), "ms", 50))
    rows.append(Row("and given back", median_ms(give), "ms", 50))
    start = time.perf_counter()
    found = instances(rest, evaluator.workers)
    rows += [
        Row("instances of quantised shapes made, settled and tested", time.perf_counter() - start, "s"),
        Row("shapes", float(len(found.prototypes)), ""),
        Row("quantising error, of the length of a feather", 100.0 * found.error, "%"),
        Row("pairs that cross, of these instances", 100.0 * len(found.left.first) / found.left.pairs, "%", 0.1),
    ]
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        looks = {"contour": FeatherLook((0.3, 0.2, 0.1))}
        writer = FeatherWriter(Path(folder) / "coat.usdc", "coat", mesh, "bench", looks, False)
        writer.write(FeatherFrame(1001.0, rest.skin.points, found, found.ids, None, {}))
        writer.close()
        rows.append(Row("USD written", time.perf_counter() - start, "s"))
    return rows


def _combed(keys: Groom, key: int, step: int) -> Groom:
    """The keys with the first `key` of them leaned sideways, by another angle for every step."""
    points = keys.guides.points.copy()
    for row in range(key):
        strand = points[row].astype(np.float64) - points[row, 0]
        side = np.cross(keys.guides.roots.frames[row, 2], strand)
        points[row, 1:] = (points[row, 0] + strand + 0.05 * step * side)[1:]
    return keys.replace(guides=keys.guides.replace(points=freeze(points)))


def _one_key(mesh: Mesh, evaluator: Evaluator) -> float:
    coat, keys = dress_feathers(mesh, evaluator, COUNT, keys=120)
    plumage = Plumage(evaluator)
    plumage.at_rest(coat, keys, mesh)
    steps = iter(range(1, 100))
    return median_ms(lambda: plumage.at_rest(coat, _combed(keys, 1, next(steps)), mesh, quick=True), runs=5)


def _bent(mesh: Mesh, angle: float, evaluator: Evaluator) -> Skin:
    points = mesh.points.astype(np.float64)
    along = points[:, 2] - points[:, 2].min()
    turn = angle * along / along.max()
    y = points[:, 1] * np.cos(turn) + along * np.sin(turn)
    z = points[:, 2].min() + along * np.cos(turn) - points[:, 1] * np.sin(turn)
    return skin_posed(mesh, np.stack([points[:, 0], y, z], axis=1).astype(np.float32), evaluator)


def _frames(coat: FeatherCoat, keys: Groom, mesh: Mesh, plumage: Plumage) -> list[Row]:
    """A bend of 0.01 radians a frame: seconds of a frame, and how far tips jump in the frame of their skin."""
    tips, seconds, most = [], [], 0.0
    evaluator = Evaluator()
    for step in range(6):
        skin = _bent(mesh, 0.01 * (step + 1), evaluator)
        start = time.perf_counter()
        laid = plumage.at_frame(coat, keys, mesh, skin, 1002.0 + step)
        seconds.append(time.perf_counter() - start)
        told = crossings(laid.layered, skin.bvh, evaluator.workers)
        most = max(most, 100.0 * len(told.first) / told.pairs)
        frames = plumage.root_frames(coat, keys, mesh, skin).astype(np.float64)
        away = laid.layered.vanes[:, -1, 2].astype(np.float64) - laid.feathers.roots
        tips.append(np.einsum("nij,nj->ni", frames, away) / laid.layered.poses[:, LENGTH:LENGTH + 1])
    evaluator.close()
    jumps = np.linalg.norm(np.diff(np.array(tips), n=2, axis=0), axis=2)
    return [
        Row("a frame of an animation, from the order at rest", float(np.median(seconds)), "s", 1.0),
        Row("its pairs that cross, the worst of 6 frames", most, "%"),
        Row("pop between frames, the largest of all feathers, of their length", 100.0 * float(jumps.max()), "%", 2.0),
    ]


def _animal(name: str, mesh: Mesh, evaluator: Evaluator) -> list[Row]:
    coat, keys = dress_feathers(mesh, evaluator, COUNT)
    plumage = Plumage(evaluator)
    plumage.bed(coat, keys, mesh)
    start = time.perf_counter()
    rest = plumage.at_rest(coat, keys, mesh)
    seconds = time.perf_counter() - start
    told = crossings(rest.layered, rest.skin.bvh, evaluator.workers)
    naked = plumage.at_rest(coat.replace(layered=False), keys, mesh)
    shortened = rest.layered.poses[:, LENGTH] < 0.95 * naked.layered.poses[:, LENGTH]
    return [
        Row(f"{name}: interpolated and layered", seconds, "s", 3.0),
        Row(f"{name}: pairs that cross", 100.0 * len(told.first) / told.pairs, "%", 1.0),
        Row(f"{name}: feathers in the skin", float(len(told.skin)), "", 0.0),
        Row(f"{name}: feathers shortened to find room", 100.0 * float(shortened.mean()), "%"),
    ]
