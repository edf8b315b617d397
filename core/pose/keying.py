"""Poses keyed into a clip: it takes the pose on at a frame, and the difference eases off to the keys beside it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.pose.clip import MOST_FRAMES, check_frames, split_matrices, without_flips
from core.pose.pose import Pose, local_of_pose
from core.pose.rig import Rig
from core.pose.skeleton import Clip, Skeleton
from core.pose.synthesis import pose_at
from core.record import freeze
from core.transform import slerp


def still_clip(skeleton: Skeleton, first: float, frames: int, rate: float, name: str = "keys") -> Clip:
    """A clip of a skeleton at rest.

    Raises
    ------
    UserError
        When that would be too many frames.
    """
    check_frames(name, frames, len(skeleton.names))
    t, q, s, _ = split_matrices(skeleton.rest)
    moved, turned, scaled = (freeze(np.repeat(part[None].astype(np.float32), frames, axis=0)) for part in (t, q, s))
    return Clip(
        name=name, start=first, frames_per_second=rate, translations=moved, rotations=turned, scales=scaled)


def keyed(clip: Clip, rig: Rig, pose: Pose, frame: float) -> Clip:
    """The clip with a key of a pose at the sample nearest to a frame; beyond its ends the clip is held and gets longer.

    What a pose differs by from the clip there is added on both sides, all of it at the frame and nothing at the next
    keys, eased between; where there is no further key, all of it to the end. So a clip of keys alone goes from key to
    key, and captured motion is corrected between two keys that hold it.

    Raises
    ------
    UserError
        When the clip would be too long.
    """
    at = round(max(min(frame - clip.start, 2.0 * MOST_FRAMES), -2.0 * MOST_FRAMES))
    clip = _reaching(clip, at)
    at = max(at, 0)
    before = max((k for k in clip.keys if k < at), default=None)
    after = min((k for k in clip.keys if k > at), default=None)
    share = _eased(len(clip.translations), at, before, after)
    t, q, _, _ = split_matrices(local_of_pose(rig.skeleton, pose))
    moved = clip.translations + share[:, None, None] * (t - clip.translations[at])
    now = clip.rotations.astype(np.float64)
    unturned = np.zeros_like(q)
    unturned[:, 3] = 1.0
    offset = _product(q, now[at] * [-1.0, -1.0, -1.0, 1.0])
    shape = (len(share), len(q), 4)
    part = slerp(np.broadcast_to(unturned, shape), np.broadcast_to(offset, shape),
                 np.repeat(share[:, None], len(q), axis=1))
    turned = _product(part, now)
    turned[at] = q
    names, numbers = _numbers(clip, rig, pose)
    if numbers is not None:
        set_to = np.array([pose.numbers.get(n, rest) for n, rest in _rests(rig, names)])
        numbers = numbers + share[:, None] * (set_to - numbers[at])
    return clip.replace(
        translations=freeze(moved.astype(np.float32)), rotations=freeze(without_flips(turned).astype(np.float32)),
        number_names=names, numbers=None if numbers is None else freeze(numbers.astype(np.float32)),
        keys=tuple(sorted({*clip.keys, at})))


def without_key(clip: Clip, frame: float) -> Clip:
    """The clip without the key at the sample nearest to a frame; the clip itself where there is none.

    Between two keys alone the motion goes straight from one to the other again, and beyond the last it is held, as if
    the key had never been. Captured motion, which does not ease from key to key, stays as it is: only the mark goes.
    """
    at = round(min(max(frame - clip.start, -1.0), 2.0 * MOST_FRAMES))
    if at not in clip.keys:
        return clip
    before = max((k for k in clip.keys if k < at), default=None)
    after = min((k for k in clip.keys if k > at), default=None)
    left: Clip = clip.replace(keys=tuple(k for k in clip.keys if k != at))
    if not (_eases(clip, before, at) and _eases(clip, at, after)) or (before is None and after is None):
        return left
    first, last = before if before is not None else 0, after if after is not None else len(clip.translations) - 1
    a, b = (before if before is not None else after), (after if after is not None else before)
    assert a is not None
    assert b is not None
    rows = _between(clip, a, b, first, last)
    whole: dict[str, NDArray[np.float32]] = {}
    for name, part in rows.items():
        values = getattr(clip, name).copy()
        values[first : last + 1] = part
        whole[name] = freeze(values)
    mended: Clip = left.replace(**whole)
    return mended


def with_moved_key(clip: Clip, rig: Rig, frame: float, to: float) -> Clip:
    """The clip with the key of one frame at another, where it has the pose it had."""
    if round(frame - clip.start) not in clip.keys or round(frame) == round(to):
        return clip
    pose = pose_at(rig.replace(clip=clip), frame)
    return keyed(without_key(clip, frame), rig, pose, to)


SAME = 1e-4  # metres, or of a quaternion: what samples in single precision miss an eased way by


def _eases(clip: Clip, a: int | None, b: int | None) -> bool:
    """True when the samples from key to key, or from a key to the end of the clip, are only what joins them."""
    first = 0 if a is None else a
    last = len(clip.translations) - 1 if b is None else b
    one, other = (b if a is None else a), (a if b is None else b)
    assert one is not None
    assert other is not None
    made = _between(clip, one, other, first, last)
    for name, part in made.items():
        there = getattr(clip, name)[first : last + 1].astype(np.float64)
        if name == "rotations":  # q and -q turn the same
            part = part * np.where((part * there).sum(axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
        if np.abs(part - there).max(initial=0.0) > SAME:
            return False
    return True


def _between(clip: Clip, a: int, b: int, first: int, last: int) -> dict[str, NDArray[np.float32]]:
    """Rows first .. last of the arrays of a clip that eases from its sample `a` to `b`; all alike when they are one."""
    count = last - first + 1
    t = np.zeros(count) if a == b else (np.arange(first, last + 1) - a) / (b - a)
    share = t * t * (3.0 - 2.0 * t)

    def mixed(values: NDArray[np.float32]) -> NDArray[np.float32]:
        part = share.reshape(-1, *[1] * (values.ndim - 1))
        return np.asarray((1.0 - part) * values[a] + part * values[b], np.float32)

    joints = clip.rotations.shape[1]
    turned = slerp(np.repeat(clip.rotations[a : a + 1], count, axis=0), np.repeat(clip.rotations[b : b + 1], count, 0),
                   np.repeat(share[:, None], joints, axis=1)) if joints else clip.rotations[first : last + 1]
    made = {"translations": mixed(clip.translations), "scales": mixed(clip.scales),
            "rotations": without_flips(np.asarray(turned, np.float64)).astype(np.float32)}
    return made if clip.numbers is None else {**made, "numbers": mixed(clip.numbers)}


def _reaching(clip: Clip, at: int) -> Clip:
    """The clip long enough to have the sample `at`; negative ones are put before its first."""
    count = len(clip.translations)
    front, back = max(-at, 0), max(at - count + 1, 0)
    if not front and not back:
        return clip
    check_frames(clip.name, count + front + back, clip.translations.shape[1])
    rows = np.clip(np.arange(-front, count + back), 0, count - 1)
    return clip.replace(
        start=clip.start - front, translations=freeze(clip.translations[rows]), rotations=freeze(clip.rotations[rows]),
        scales=freeze(clip.scales[rows]), numbers=None if clip.numbers is None else freeze(clip.numbers[rows]),
        keys=tuple(key + front for key in clip.keys))


def _eased(count: int, at: int, before: int | None, after: int | None) -> NDArray[np.float64]:
    """Shares (count,): 1 at `at`, 0 at the keys beside it and beyond, eased between; 1 where there is no key."""
    frames = np.arange(count, dtype=np.float64)
    rise = np.ones(count) if before is None else np.clip((frames - before) / (at - before), 0.0, 1.0)
    fall = np.ones(count) if after is None else np.clip((after - frames) / (after - at), 0.0, 1.0)
    part = np.where(frames <= at, rise, fall)
    return np.asarray(part * part * (3.0 - 2.0 * part))


def _product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions x, y, z, w that turn by `b`, then by `a`."""
    av, aw, bv, bw = a[..., :3], a[..., 3:], b[..., :3], b[..., 3:]
    vector = aw * bv + bw * av + np.cross(av, bv)
    return np.concatenate([vector, aw * bw - (av * bv).sum(axis=-1, keepdims=True)], axis=-1)


def _numbers(clip: Clip, rig: Rig, pose: Pose) -> tuple[tuple[str, ...], NDArray[np.float64] | None]:
    """Names and values (F, N) of the numbers of a clip, those that the pose sets among them."""
    known = {control.name: control.rest for control in rig.controls if control.kind == "number"}
    new = [n for n in known if n in pose.numbers and n not in clip.number_names]
    names = (*clip.number_names, *new)
    if not names:
        return (), None
    had = np.zeros((len(clip.translations), 0)) if clip.numbers is None else clip.numbers.astype(np.float64)
    added = np.tile([known[n] for n in new], (len(had), 1)).reshape(len(had), len(new))
    return names, np.concatenate([had, added], axis=1)


def _rests(rig: Rig, names: tuple[str, ...]) -> list[tuple[str, float]]:
    at = {control.name: control.rest for control in rig.controls}
    return [(name, at.get(name, 0.0)) for name in names]
