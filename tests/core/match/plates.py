"""Plates made by formula: a smooth texture under a known motion, so that every place in every frame is known."""

import numpy as np

WAVES = np.random.default_rng(4)
DIRECTION = WAVES.uniform(0.0, 2.0 * np.pi, (40, 3))
LENGTH = WAVES.uniform(7.0, 40.0, (40, 3))
PHASE = WAVES.uniform(0.0, 2.0 * np.pi, (40, 3))
NOISE = 2.0


def texture(x, y):
    """Sums of waves at any place: (..., 3), about 0 to 255."""
    k = 2.0 * np.pi / LENGTH
    angle = x[..., None, None] * (k * np.cos(DIRECTION)) + y[..., None, None] * (k * np.sin(DIRECTION)) + PHASE
    return 128.0 + 14.0 * np.sin(angle).sum(axis=-2)


def matrix(k):
    """Texture place of a pixel in frame k, as a 2 x 3 matrix: it drifts, turns and grows."""
    turn, scale = 0.01 * k, 1.0 + 0.006 * k
    c, s = scale * np.cos(turn), scale * np.sin(turn)
    middle = np.array([80.0, 60.0])
    linear = np.array([[c, -s], [s, c]])
    return np.column_stack((linear, middle - linear @ (middle + np.array([0.9, 0.5]) * k)))


def place(point, k, first=0):
    """Where a pixel of frame `first` lies in frame k."""
    there = matrix(first)[:, :2] @ point + matrix(first)[:, 2]
    return np.linalg.solve(matrix(k)[:, :2], there - matrix(k)[:, 2])


def frame(k, seed=0, gain=1.0, bias=0.0, size=(120, 160), noise=NOISE):
    """Frame k as float32 (H, W, 3), with noise of two grey levels."""
    y, x = np.mgrid[0 : size[0], 0 : size[1]].astype(np.float64)
    m = matrix(k)
    image = texture(m[0, 0] * x + m[0, 1] * y + m[0, 2], m[1, 0] * x + m[1, 1] * y + m[1, 2])
    rng = np.random.default_rng([seed, abs(int(8 * k)), int(k < 0)])
    return (image * gain + bias + rng.normal(0.0, noise, image.shape)).astype(np.float32)
