"""A solved camera as a pinhole and a grid: OpenCV says where points of the world lie on the plate."""

import cv2
import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation

from core.camera import project
from core.match.lens import start_lens
from core.match.solved import SolvedCamera, frozen
from core.match.through import over_plate, places_of_pixels, through_lens

SIZE = (640, 360)
UP = np.array([1.0, -1.0, -1.0])


def solved(k1=-0.18, k2=0.03, focal=520.0, model="brown", centre=(330.0, 172.0)):
    """A camera that looks at the origin from about 4 m, and turns."""
    frames = np.arange(1001, 1004)
    turns = Rotation.from_rotvec(np.column_stack([0.05 * np.arange(3), 0.1 + 0.1 * np.arange(3), 0.02 * np.arange(3)]))
    lens = start_lens(focal, *SIZE, model)
    lens[1:3], lens[4:6] = (k1, k2), centre
    return SolvedCamera(
        id=1, plate_id=1, size=SIZE, kind="free", lens=frozen(lens), frames=frozen(frames, np.int32),
        rotation=frozen(turns.as_matrix()), translation=frozen(np.tile([0.1, -0.05, 4.0], (3, 1))),
        focal=frozen(np.full(3, focal)), points=frozen(np.zeros((1, 3))), track_ids=frozen([1], np.int32),
        errors=frozen([0.1]), by_frame=frozen([0.1, 0.1, 0.1]), rms=0.1, median=0.1, p95=0.1, focal_sigma=1.0)


def opencv(camera, row, points):
    """Pixels (N, 2) of points of the solve's world, by OpenCV."""
    matrix = np.array([[camera.focal[row], 0.0, camera.lens[4]], [0.0, camera.focal[row], camera.lens[5]], [0, 0, 1]])
    turn = cv2.Rodrigues(camera.rotation[row])[0]
    bend = np.array([camera.lens[1], camera.lens[2], 0.0, 0.0])
    return cv2.projectPoints(points, turn, camera.translation[row], matrix, bend)[0][:, 0]


def test_the_pinhole_and_the_grid_lead_where_opencv_does():
    camera, rng = solved(), np.random.default_rng(2)
    points = rng.uniform(-1.2, 1.2, (400, 3))
    for row, frame in enumerate(camera.frames):
        through = through_lens(camera, int(frame))
        xy = opencv(camera, row, points)
        inside = (xy > 0.0).all(axis=1) & (xy < np.array(SIZE) - 1.0).all(axis=1)
        assert inside.sum() > 100
        flat = project(through.camera, points * UP, *through.size).xy
        rows, columns = through.places.shape[:2]
        at = (xy + 0.5) / SIZE * (columns - 1, rows - 1)  # of the grid
        grid = through.places * through.size - 0.5
        led = np.stack([map_coordinates(grid[..., k], at[:, ::-1].T, order=1) for k in (0, 1)], axis=1)
        off = np.linalg.norm(led - flat, axis=1)[inside]
        assert off.max() < 0.05  # pixels


def test_a_frame_without_a_camera_and_a_lens_wider_than_a_pinhole():
    assert through_lens(solved(), 999) is None
    wide = solved(0.0, 0.0, focal=120.0, model="fisheye")
    through = through_lens(wide, 1001)
    assert np.isnan(through.places).any()
    assert np.isfinite(through.places).any()
    assert max(through.size) <= 8192


def test_what_is_covered_is_mixed_as_light_and_the_rest_of_the_plate_stays():
    through = through_lens(solved(0.0, 0.0, centre=(319.5, 179.5)), 1001, 1.0)
    rng = np.random.default_rng(3)
    plate = rng.integers(0, 256, (SIZE[1], SIZE[0], 3), dtype=np.uint8)
    picture = np.zeros((through.size[1], through.size[0], 4), np.uint8)
    picture[100:200, 200:300] = 255
    out = over_plate(plate, picture, through)
    assert (out[104:196, 204:296] == 255).all()
    outside = np.ones(SIZE[::-1], bool)
    outside[95:205, 195:305] = False
    np.testing.assert_array_equal(out[outside], plate[outside])
    half = over_plate(np.zeros_like(plate), picture, through, 0.5)
    assert half[150, 250].tolist() == pytest.approx([188] * 3, abs=1)  # half the light is 188 of 255 in sRGB


def test_pixels_lie_between_the_nodes_of_the_grid():
    through = through_lens(solved(), 1002, 1.0)
    found = places_of_pixels(through, *SIZE)
    rows, columns = through.places.shape[:2]
    y, x = np.mgrid[: SIZE[1], : SIZE[0]].astype(float)
    at = np.stack([(y + 0.5) / SIZE[1] * (rows - 1), (x + 0.5) / SIZE[0] * (columns - 1)])
    for k in (0, 1):
        np.testing.assert_allclose(found[..., k], map_coordinates(through.places[..., k], at, order=1), atol=1e-9)
