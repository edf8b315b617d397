"""BVH motion (Biovision hierarchy): joints with an offset each, channels in any order, one row of numbers a frame.

Rotations apply in the order of the channels, the first of them outermost; a position channel replaces the offset. The
first frame is frame 1.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.rig_parts import RawClip, RawRig, concatenated
from core.pose.clip import check_frames
from core.transform import quaternion_about, quaternion_product

FIRST_FRAME = 1.0
LARGEST = 512 << 20  # bytes
MOST_JOINTS = 10_000
CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "xyz")


class _Joint(NamedTuple):
    name: str
    parent: int
    offset: list[float]
    channels: list[str]


def read_raw(path: Path) -> RawRig:
    """The skeleton and the motion of a BVH file, in its own units.

    Raises
    ------
    UserError
        When it is not a BVH file, is cut short, or its rows do not fit its channels.
    """
    if path.stat().st_size > LARGEST:
        raise UserError(f"{path.name} is larger than {LARGEST >> 20} MB; export a part of the motion.")
    text = path.read_bytes().decode("utf-8", "replace").removeprefix("﻿")
    head, mark, tail = text.partition("MOTION")
    if not mark or head.lstrip()[:9].upper() != "HIERARCHY":
        raise UserError(f"{path.name} is not a BVH file that can be read; export it again.")
    joints = _joints(path, head)
    rate, rows = _motion(path, tail, sum(len(joint.channels) for joint in joints))
    check_frames(path.stem, len(rows), len(joints))
    offsets = np.array([joint.offset for joint in joints])
    parents = np.array([joint.parent for joint in joints], np.int64)
    rest = np.tile(np.eye(4), (len(joints), 1, 1))
    rest[:, :3, 3] = offsets
    moved = np.tile(offsets, (len(rows), 1, 1))
    turned = np.tile([0.0, 0.0, 0.0, 1.0], (len(rows), len(joints), 1))
    column = 0
    for j, joint in enumerate(joints):
        for channel in joint.channels:
            axis = "xyz".index(channel[0])
            if channel.endswith("position"):
                moved[:, j, axis] = rows[:, column]
            else:
                with np.errstate(all="ignore"):  # what is not finite is found by the checks
                    turn = quaternion_about(np.eye(3)[axis], np.radians(rows[:, column]))
                    turned[:, j] = quaternion_product(turned[:, j], turn)
            column += 1
    clip = RawClip(
        path.stem or "clip", FIRST_FRAME, rate, moved, turned, np.ones_like(moved), (), np.zeros((len(rows), 0)),
    )  # fmt: skip
    return RawRig(
        None, tuple(joint.name for joint in joints), parents, rest, concatenated(rest, parents),
        np.zeros((0, 0), np.int64), np.zeros((0, 0)), clips=(clip,),
    )  # fmt: skip


def _joints(path: Path, head: str) -> list[_Joint]:
    """The joints of the hierarchy; end sites only close a bone and are none."""
    joints: list[_Joint] = []
    open_: list[int] = []  # rows of the joints that are open, -1 for an end site
    waiting: int | None = None  # what the next brace opens
    for number, line in enumerate(head.splitlines()[1:], 2):
        words = line.replace("{", " { ").replace("}", " } ").split()
        while words:
            word = words.pop(0)
            kind = word.upper()
            if kind in ("ROOT", "JOINT"):
                brace = words.index("{") if "{" in words else len(words)
                name, words = " ".join(words[:brace]), words[brace:]
                joints.append(_Joint(name, open_[-1] if open_ else -1, [0.0, 0.0, 0.0], []))
                waiting = len(joints) - 1
                if len(joints) > MOST_JOINTS:
                    raise UserError(f"{path.name} has more than {MOST_JOINTS:,} joints; export a part of it.")
            elif kind == "END":
                words, waiting = words[1:], -1
            elif kind == "{" and waiting is not None:
                open_.append(waiting)
                waiting = None
            elif kind == "}" and open_:
                open_.pop()
            elif kind == "OFFSET" and open_:
                values, words = [_number(path, w, number) for w in words[:3]], words[3:]
                if len(values) != 3:
                    raise UserError(f"{path.name}, line {number}: an offset needs three numbers.")
                if open_[-1] >= 0:
                    joints[open_[-1]].offset[:] = values
            elif kind == "CHANNELS" and open_ and open_[-1] >= 0 and words and words[0].isdecimal():
                count = min(int(words[0]), 7)
                names, words = [w.lower() for w in words[1 : 1 + count]], words[1 + count :]
                if len(names) != count or not set(names) <= set(CHANNELS) or len(set(names)) != count:
                    raise UserError(f"{path.name}, line {number}: channels are {', '.join(CHANNELS)}, each once.")
                joints[open_[-1]].channels[:] = names
            else:
                raise UserError(f"{path.name}, line {number}: {word[:40]!r} is not expected there; export it again.")
    if open_ or not joints:
        raise UserError(f"{path.name} is cut short or has no joints; export it again.")
    return joints


def _motion(path: Path, tail: str, channels: int) -> tuple[float, NDArray[np.float64]]:
    """Frames per second and the numbers (F, channels)."""
    lines = tail.split("\n")
    said: dict[str, str] = {}
    at = 0
    while at < len(lines) and len(said) < 2:
        key, colon, value = lines[at].partition(":")
        if colon:
            said[" ".join(key.lower().split())] = value.strip()
        elif lines[at].strip():
            break
        at += 1
    try:
        seconds, frames = float(said["frame time"]), int(said["frames"])
    except (KeyError, ValueError):
        raise UserError(f"{path.name} does not say its frames and their time; export it again.") from None
    if not 1e-6 < seconds < 1e3:
        raise UserError(f"{path.name} has a frame time of {seconds} s, which makes no sense; mend it.")
    try:
        values = np.array(" ".join(lines[at:]).split(), np.float64)
    except ValueError:
        raise UserError(f"{path.name} has words among the numbers of its motion; export it again.") from None
    if frames < 1 or not channels or len(values) != frames * channels:
        raise UserError(
            f"{path.name} has {len(values)} numbers where {max(frames, 0)} frames of {channels} channels "
            "are announced; it may be cut short."
        )
    rate = 1.0 / seconds
    whole = round(rate)
    return (float(whole) if abs(rate - whole) < 3e-4 * whole else rate), values.reshape(frames, channels)


def _number(path: Path, word: str, line: int) -> float:
    try:
        return float(word)
    except ValueError:
        raise UserError(f"{path.name}, line {line}: {word[:40]!r} is not a number.") from None
