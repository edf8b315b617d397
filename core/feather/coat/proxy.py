"""Proxies: a procedural feather taken over by hand, and given back.

A proxy keeps the shaft the feather had when it was taken and the shaft it has at keyed frames, both in the frame of its
root, so that it rides on the skin. Its vane is that of the procedural feather carried along the change of the shaft:
while nobody has moved it, it is the same feather to the bit, and so are all others.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.feather.coat.coat import FeatherCoat, Proxy
from core.mesh.bvh import Bvh
from core.record import freeze
from core.workers import Workers

if TYPE_CHECKING:  # its kernels load with the first coat; a hand takes feathers over without
    from core.feather.coat.layering import Feathers, Layered

POINTS = 8  # of a shaft that is animated by hand


def promoted(coat: FeatherCoat, feather: int, vane: NDArray[np.float32], root: NDArray[np.float32],
             frame: NDArray[np.float32], when: float) -> FeatherCoat:
    """The coat with a feather taken over by hand, in the shape it has.

    Parameters
    ----------
    feather : its id. vane : (R, C, 3) float32, where it lies. root : (3,), frame : (3, 3) rows right, along, out.
    when : the frame its first key stands at.
    """
    if any(proxy.id == feather for proxy in coat.proxies):
        raise UserError(f"The feather {feather} is animated by hand already.")
    middle = vane[:, vane.shape[1] // 2].astype(np.float64)
    places = np.linspace(0.0, len(middle) - 1.0, POINTS)
    shaft = np.stack([np.interp(places, np.arange(len(middle)), middle[:, k]) for k in range(3)], axis=1)
    local = ((shaft - root) @ frame.astype(np.float64).T).astype(np.float32)
    proxy = Proxy(
        id=feather, frames=freeze(np.array([when], np.float32)), rest=freeze(local), shafts=freeze(local[None].copy()),
        rolls=freeze(np.zeros(1, np.float32)),
    )
    return coat.replace(proxies=(*coat.proxies, proxy))


def demoted(coat: FeatherCoat, feather: int) -> FeatherCoat:
    """The coat with a feather given back to the keys."""
    _find(coat, feather)
    return coat.replace(proxies=tuple(p for p in coat.proxies if p.id != feather))


def keyed(coat: FeatherCoat, feather: int, when: float, shaft: NDArray[np.float32], roll: float = 0.0) -> FeatherCoat:
    """The coat with a key of a proxy set at a frame: `shaft` (P, 3) float32 in the frame of its root, metres."""
    proxy = _find(coat, feather)
    if shaft.shape != proxy.rest.shape:
        raise UserError(f"The shaft of feather {feather} has {len(proxy.rest)} points; give as many.")
    at = int(np.searchsorted(proxy.frames, np.float32(when)))
    there = at < len(proxy.frames) and proxy.frames[at] == np.float32(when)
    cut = at + 1 if there else at
    changed = proxy.replace(
        frames=freeze(np.concatenate([proxy.frames[:at], [when], proxy.frames[cut:]]).astype(np.float32)),
        shafts=freeze(np.concatenate([proxy.shafts[:at], shaft[None], proxy.shafts[cut:]]).astype(np.float32)),
        rolls=freeze(np.concatenate([proxy.rolls[:at], [roll], proxy.rolls[cut:]]).astype(np.float32)),
    )
    return coat.replace(proxies=tuple(changed if p is proxy else p for p in coat.proxies))


def shaft_at(proxy: Proxy, frame: float) -> tuple[NDArray[np.float64], float]:
    """The shaft (P, 3) and the roll of a proxy at a frame: straight between keys, still before and after them."""
    flat = proxy.shafts.reshape(len(proxy.frames), -1).astype(np.float64)
    found = np.array([np.interp(frame, proxy.frames, flat[:, k]) for k in range(flat.shape[1])])
    return found.reshape(-1, 3), float(np.interp(frame, proxy.frames, proxy.rolls))


def apply_proxies(
    coat: FeatherCoat, ids: NDArray[np.int32], feathers: Feathers, frames: NDArray[np.float32], laid: Layered,
    frame: float, bvh: Bvh, workers: Workers,
) -> Layered:
    """The coat with its proxies as they are at a frame, and their neighbours out of their way.

    frames : (N, 3, 3) float32, of the roots without yaw, as proxies were taken in.
    """
    from core.feather.coat.layering import layer_around

    rows, vanes = [], laid.vanes.copy()
    for proxy in coat.proxies:
        row = int(np.searchsorted(ids, proxy.id))
        if row >= len(ids) or ids[row] != proxy.id:
            continue  # its placement has fewer feathers now; it comes back with them
        shaft, roll = shaft_at(proxy, frame)
        if roll == 0.0 and np.array_equal(shaft.astype(np.float32), proxy.rest):
            continue
        vanes[row] = _carried(vanes[row], proxy.rest.astype(np.float64), shaft, roll, feathers.roots[row], frames[row])
        rows.append(row)
    if not rows:
        return laid
    return layer_around(feathers, laid._replace(vanes=vanes), np.array(rows, np.int32), bvh, workers)


def _carried(
    vane: NDArray[np.float32], rest: NDArray[np.float64], shaft: NDArray[np.float64], roll: float,
    root: NDArray[np.float32], frame: NDArray[np.float32],
) -> NDArray[np.float32]:
    """A vane (R, C, 3) carried from one shaft to another, both in `frame` at `root`."""
    turn = frame.astype(np.float64)
    local = (vane.astype(np.float64) - root) @ turn.T
    places = np.linspace(0.0, len(rest) - 1.0, len(vane))
    before, after = _along(rest, places), _along(shaft, places)
    tangent_before, tangent_after = _tangents(rest, places), _tangents(shaft, places)
    out = np.empty_like(local)
    for r in range(len(vane)):
        spin = _rotation(tangent_before[r], tangent_after[r])
        share = r / max(len(vane) - 1, 1)
        spin = _about(tangent_after[r], roll * share) @ spin
        out[r] = after[r] + (local[r] - before[r]) @ spin.T
    return (out @ turn + root).astype(np.float32)


def _along(line: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([np.interp(places, np.arange(len(line)), line[:, k]) for k in range(3)], axis=1)


def _tangents(line: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    steps = np.gradient(line, axis=0)
    found = _along(steps, places)
    return np.asarray(found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-30))


def _rotation(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """The smallest rotation (3, 3) from unit a to unit b."""
    axis, cosine = np.cross(a, b), float(a @ b)
    if cosine < -0.999999:  # a half turn about anything square to a
        helper = np.eye(3)[int(np.argmin(np.abs(a)))]
        square = np.cross(a, helper)
        return _about(square / np.linalg.norm(square), np.pi)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + cosine))


def _about(axis: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew)


def _find(coat: FeatherCoat, feather: int) -> Proxy:
    found = next((proxy for proxy in coat.proxies if proxy.id == feather), None)
    if found is None:
        raise UserError(f"The feather {feather} is not animated by hand.")
    return found
