"""Motion by frames: numbers between samples, another frame rate, another skeleton."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.errors import UserError
from core.pose.skeleton import Clip, Skeleton
from core.record import freeze
from core.transform import compose, matrix_from_quaternion, quaternion_from_matrix, slerp

MOST_FRAMES = 1_000_000
MOST_SAMPLES = 100_000_000  # frames times joints
RATES = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0)  # tried in this order on keys that only know seconds


def between(clip: Clip, frame: float) -> tuple[int, int, float]:
    """The samples before and after a frame and the share of the later one; held outside the clip."""
    at = min(max(frame - clip.start, 0.0), float(len(clip.translations) - 1))
    low = int(at)
    return low, min(low + 1, len(clip.translations) - 1), at - low


def local_matrices(clip: Clip, frame: float) -> NDArray[np.float64]:
    """Matrices (J, 4, 4) parent_from_joint at any frame; between samples mixed, held outside the clip."""
    low, high, part = between(clip, frame)
    t = (1.0 - part) * clip.translations[low].astype(np.float64) + part * clip.translations[high]
    s = (1.0 - part) * clip.scales[low].astype(np.float64) + part * clip.scales[high]
    return compose(t, slerp(clip.rotations[low], clip.rotations[high], np.full(t.shape[0], part)), s)


def numbers_at(clip: Clip, frame: float) -> dict[str, float]:
    """The numbers of abstract controls at any frame; empty when the clip has none."""
    if clip.numbers is None:
        return {}
    low, high, part = between(clip, frame)
    mixed = (1.0 - part) * clip.numbers[low].astype(np.float64) + part * clip.numbers[high]
    return dict(zip(clip.number_names, mixed.tolist(), strict=True))


def split_matrices(
    matrices: ArrayLike,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float]:
    """Translations, rotations (quaternions) and scales of matrices (..., 4, 4), and how much shear is lost.

    Returns
    -------
    (..., 3), (..., 4), (..., 3) float64, and the largest error of an entry relative to the scale of its matrix.
    """
    m = np.asarray(matrices, np.float64)
    inner = m[..., :3, :3]
    scales = np.linalg.norm(inner, axis=-2)
    scales = np.where(np.linalg.det(inner)[..., None] < 0.0, -scales, scales)
    unit = inner / np.where(scales == 0.0, 1.0, scales)[..., None, :]
    u, _, vt = np.linalg.svd(unit)
    u[..., 2] *= np.where(np.linalg.det(u @ vt) < 0.0, -1.0, 1.0)[..., None]
    rotations = quaternion_from_matrix(u @ vt)
    again = matrix_from_quaternion(rotations) * scales[..., None, :]
    size = np.maximum(np.abs(scales).max(axis=-1, initial=0.0), 1e-30)
    lost = float((np.abs(again - inner).max(axis=(-2, -1), initial=0.0) / size).max(initial=0.0))
    return m[..., :3, 3], rotations, scales, lost


def clip_of_matrices(
    name: str, start: float, frames_per_second: float, local: ArrayLike,
    number_names: tuple[str, ...] = (), numbers: ArrayLike | None = None,
) -> Clip:
    """A clip of matrices (F, J, 4, 4) parent_from_joint and numbers (F, N); shear, which no clip has, is lost."""
    t, q, s, _ = split_matrices(local)
    return Clip(
        name=name, start=float(start), frames_per_second=float(frames_per_second),
        translations=freeze(t.astype(np.float32)), rotations=freeze(without_flips(q).astype(np.float32)),
        scales=freeze(s.astype(np.float32)), number_names=number_names,
        numbers=None if numbers is None or not number_names else freeze(np.array(numbers, np.float32)),
    )


def without_flips(rotations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions (F, ..., 4) of which each lies on the side of the one before (q and -q turn the same)."""
    if len(rotations) < 2:
        return rotations
    turned = np.sum(rotations[1:] * rotations[:-1], axis=-1) < 0.0
    sign = np.where(np.cumsum(turned, axis=0) % 2 == 1, -1.0, 1.0)
    return np.concatenate([rotations[:1], rotations[1:] * sign[..., None]])


def resampled(clip: Clip, frames_per_second: float, start: float | None = None) -> Clip:
    """The same motion at another frame rate, its first sample at `start` (None: where it was).

    Raises
    ------
    UserError
        When that would be too many frames.
    """
    start = clip.start if start is None else float(start)
    if frames_per_second == clip.frames_per_second:
        return clip if start == clip.start else clip.replace(start=start)
    step = clip.frames_per_second / frames_per_second
    count = int(np.floor((len(clip.translations) - 1) / step + 1e-6)) + 1
    check_frames(clip.name, count, clip.translations.shape[1])
    at = np.minimum(np.arange(count) * step, len(clip.translations) - 1.0)
    near = np.abs(at - np.round(at)) < 1e-6
    at = np.where(near, np.round(at), at)
    low = at.astype(np.int64)
    high, part = np.minimum(low + 1, len(clip.translations) - 1), at - low

    def mixed(values: NDArray[np.float32]) -> NDArray[np.float32]:
        share = part.reshape(-1, *[1] * (values.ndim - 1))
        return freeze(((1.0 - share) * values[low] + share * values[high]).astype(np.float32))

    joints = clip.translations.shape[1]
    turned = slerp(clip.rotations[low], clip.rotations[high], np.repeat(part[:, None], joints, axis=1))
    return clip.replace(
        start=start, frames_per_second=float(frames_per_second), translations=mixed(clip.translations),
        rotations=freeze(without_flips(turned).astype(np.float32)), scales=mixed(clip.scales),
        numbers=None if clip.numbers is None else mixed(clip.numbers), keys=(),
    )


def onto_skeleton(clip: Clip, source: Skeleton, target: Skeleton) -> Clip:
    """Motion of one skeleton on the joints of the same names of another.

    What a joint turns from its rest is carried over; roots are moved as well, the rest of the joints keep their place
    and every joint its scale, so that limbs of other lengths stay as long as they are.

    Raises
    ------
    UserError
        When the skeletons have no joint of the same name.
    """
    found = [(source.names.index(n), j) for j, n in enumerate(target.names) if n in source.names]
    if not found:
        raise UserError("The clip moves none of the joints of this rig; rename them so that they agree.")
    frames = len(clip.translations)
    t, q, s, _ = split_matrices(target.rest)
    all_t, all_q, all_s = (np.tile(v, (frames, 1, 1)) for v in (t, q, s))
    rows, joints = [r for r, _ in found], [j for _, j in found]
    rest = split_matrices(source.rest[rows])[1]
    moved = matrix_from_quaternion(rest).swapaxes(-1, -2) @ matrix_from_quaternion(clip.rotations[:, rows])
    all_q[:, joints] = quaternion_from_matrix(matrix_from_quaternion(q[joints]) @ moved)
    for row, joint in found:
        if target.parents[joint] < 0:
            all_t[:, joint] += clip.translations[:, row] - source.rest[row, :3, 3]
    return clip.replace(
        translations=freeze(all_t.astype(np.float32)), rotations=freeze(without_flips(all_q).astype(np.float32)),
        scales=freeze(all_s.astype(np.float32)),
    )


def rate_of(seconds: ArrayLike) -> float:
    """The usual frame rate at which keys lie on whole frames; 24 when there is none."""
    keys = np.unique(np.asarray(seconds, np.float64))
    for rate in RATES:
        if np.abs(keys * rate - np.round(keys * rate)).max(initial=0.0) < 2e-3:
            return rate
    return RATES[0]


def check_frames(name: str, frames: int, joints: int) -> None:
    """Refuse a clip that is too long to be kept sampled; UserError."""
    if frames > MOST_FRAMES or frames * max(joints, 1) > MOST_SAMPLES:
        raise UserError(f"The clip {name!r} has {frames:,} frames, which is too long; export a part of it.")
