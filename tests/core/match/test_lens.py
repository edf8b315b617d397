import cv2
import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from core.errors import UserError
from core.formats.lens_file import lens_of_text, lens_text
from core.match.lens import MODELS, bent, model_of, start_lens, straightened
from core.match.lens_kernels import BROWN5, pixel_of
from core.match.lens_maps import canvas, redistort_map, undistort_map

SIZE = (1920, 1080)
NAMES = [model.name for model in MODELS]


def _lens(name: str) -> np.ndarray:
    lens = start_lens(1500.0, *SIZE, name)
    rng = np.random.default_rng(len(lens))
    lens[3:6] = 0.03, 940.0, 560.0
    lens[list(model_of(lens).found)] = rng.uniform(-0.02, 0.02, len(model_of(lens).found))
    if name == "radial4":
        lens[11:13] = 0.01, -0.02
    if name == "anamorphic4":
        lens[15:18] = 0.04, 1.03, 0.98
    return lens


def _pixels() -> np.ndarray:
    x, y = np.meshgrid(np.linspace(-190, 2110, 9), np.linspace(-100, 1180, 7))
    return np.stack([x.ravel(), y.ravel()], axis=1)


@pytest.mark.parametrize("name", NAMES)
def test_there_and_back_is_where_it_was(name):
    lens, xy = _lens(name), _pixels()
    np.testing.assert_allclose(bent(lens, 0.1, straightened(lens, 0.1, xy)), xy, atol=1e-7)


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_are_those_of_differences(name):
    lens, flat = _lens(name), np.array([0.31, -0.22])
    room = np.zeros(6 + 2 * len(lens))
    assert pixel_of(lens, 0.1, *flat, room)

    def there(lens, flat):
        return bent(lens, 0.1, flat[None])[0]

    for k in range(2):
        step = np.eye(2)[k] * 1e-6
        np.testing.assert_allclose(
            room[[2 + k, 4 + k]], (there(lens, flat + step) - there(lens, flat - step)) / 2e-6, rtol=1e-6, atol=1e-4)
    for column in range(len(lens)):
        if column == 6 and name.endswith("4"):
            continue  # the unit is never found
        step = np.eye(len(lens))[column] * 1e-6
        theirs = (there(lens + step, flat) - there(lens - step, flat)) / 2e-6
        ours = room[6 + 2 * column : 8 + 2 * column]
        np.testing.assert_allclose(ours, theirs, rtol=1e-5, atol=1e-4, err_msg=str(column))


def test_a_fisheye_is_that_of_opencv():
    lens = _lens("fisheye")
    flat = np.random.default_rng(0).uniform(-2.0, 2.0, (50, 2))
    f = np.exp(lens[0])
    matrix = np.array([[f, 0, lens[4]], [0, f * np.exp(lens[3]), lens[5]], [0, 0, 1]])
    theirs = cv2.fisheye.distortPoints(flat[None], matrix, lens[[1, 2, 6, 7]])[0]
    np.testing.assert_allclose(bent(lens, 0.0, flat), theirs, atol=1e-6)


@pytest.mark.parametrize("name", ["brown", "brown5"])
def test_a_lens_of_brown_is_that_of_opencv(name):
    lens = _lens(name)
    flat = np.random.default_rng(0).uniform(-0.8, 0.8, (50, 2))
    f = np.exp(lens[0])
    matrix = np.array([[f, 0, lens[4]], [0, f * np.exp(lens[3]), lens[5]], [0, 0, 1]])
    numbers = np.concatenate([lens[1:3], lens[6:], np.zeros(BROWN5 - len(lens))])
    theirs = cv2.projectPoints(np.c_[flat, np.ones(50)], np.zeros(3), np.zeros(3), matrix, numbers)[0][:, 0]
    np.testing.assert_allclose(bent(lens, 0.0, flat), theirs, atol=1e-6)


def test_where_a_lens_folds_over_there_is_nothing():
    lens = start_lens(1000.0, *SIZE)
    lens[1] = -0.3
    assert np.isnan(straightened(lens, 0.0, np.array([[5000.0, 500.0]]))).all()
    assert np.isnan(bent(lens, 0.0, np.array([[1.3, 0.0]]))).all()


@pytest.mark.parametrize("name", NAMES)
def test_maps_out_and_in_again_lead_back(name):
    size = (384, 216)
    lens = start_lens(260.0, *size, name)
    lens[1:3] = (-0.06, 0.01) if name in ("brown", "fisheye") else (0.06, 0.01)
    room = canvas(lens, size)
    out, back = undistort_map(lens, size, room), redistort_map(lens, size, room)
    wide, tall = room.size
    x, y = back[..., 0] * wide - 0.5, (1.0 - back[..., 1]) * tall - 0.5
    assert x.min() >= 0
    assert y.min() >= 0
    assert x.max() <= wide - 1
    assert y.max() <= tall - 1
    there = np.stack([map_coordinates(out[..., k].astype(float), [y, x], order=1) for k in (0, 1)], axis=2)
    pixels = np.stack([there[..., 0] * size[0] - 0.5, (1.0 - there[..., 1]) * size[1] - 0.5], axis=2)
    u, v = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    inside = np.s_[3:-3, 3:-3]
    assert np.abs(pixels - np.stack([u, v], axis=2))[inside].max() < 0.01


@pytest.mark.parametrize("name", ["radial4", "anamorphic4"])
def test_a_lens_of_3dequalizer_is_as_its_kit_says(name, tmp_path):
    """The formulas of its kit in its own axes and unit, written here a second time."""
    size, lens = SIZE, _lens(name)
    lens[6] = 0.5 * np.hypot(size[0], size[1] / np.exp(lens[3]))
    text = lens_text(lens, size)
    lines = text.splitlines()
    wide, high, focal, _, cx, cy, _ = map(float, lines[1].split())
    p = {lines[k]: float(lines[k + 1]) for k in range(4, len(lines) - 1, 3)}
    xy = _pixels()
    radius = 0.5 * np.hypot(wide, high)
    x = ((xy[:, 0] + 0.5) / size[0] * wide - 0.5 * wide - cx) / radius
    y = (0.5 * high - (xy[:, 1] + 0.5) / size[1] * high - cy) / radius
    if name == "radial4":
        r = x * x + y * y
        radial = 1 + p["Distortion - Degree 2"] * r + p["Quartic Distortion - Degree 4"] * r * r
        u = p["U - Degree 2"] + p["U - Degree 4"] * r
        v = p["V - Degree 2"] + p["V - Degree 4"] * r
        a, b = x * radial + (r + 2 * x * x) * u + 2 * x * y * v, y * radial + (r + 2 * y * y) * v + 2 * x * y * u
        turn, q = np.radians(p["Phi - Cylindric Direction"]), np.sqrt(1 + p["B - Cylindric Bending"])
        c, s = np.cos(turn), np.sin(turn)
        across = (q - 1 / q) * c * s
        x, y = (c * c * q + s * s / q) * a + across * b, across * a + (c * c / q + s * s * q) * b
    else:
        turn = np.radians(p["Lens Rotation"])
        c, s = np.cos(turn), np.sin(turn)
        a, b = c * x + s * y, c * y - s * x
        r, t = np.hypot(a, b), np.arctan2(b, a)

        def along(axis):
            return (1 + p[f"C{axis}02 - Degree 2"] * r**2 + p[f"C{axis}22 - Degree 2"] * r**2 * np.cos(2 * t)
                    + p[f"C{axis}04 - Degree 4"] * r**4 + p[f"C{axis}24 - Degree 4"] * r**4 * np.cos(2 * t)
                    + p[f"C{axis}44 - Degree 4"] * r**4 * np.cos(4 * t))

        a, b = p["Squeeze-X"] * a * along("x"), p["Squeeze-Y"] * b * along("y")
        x, y = c * a - s * b, s * a + c * b
    theirs = np.stack([x, -y], axis=1) * radius / focal
    np.testing.assert_allclose(straightened(lens, 0.0, xy), theirs, atol=1e-9)
    np.testing.assert_allclose(lens_of_text(text, size, "lens.txt"), lens, atol=1e-9)


@pytest.mark.parametrize("text", ["", "lens\n1 2 3\n", "a\n3.6 2 3 1.5 nan 0 1\nDISTORTION_STATIC\n", "a\nb\nc\nd\n"])
def test_what_is_no_lens_of_3dequalizer_is_refused(text):
    with pytest.raises(UserError):
        lens_of_text(text, SIZE, "lens.txt")
