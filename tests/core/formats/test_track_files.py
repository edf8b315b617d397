"""Files of 2D tracks: what each program counts, there and back, and hostile ones."""

import json

import numpy as np
import pytest

from core.errors import UserError
from core.formats.track_file import READERS, read_tracks, write_tracks
from core.formats.tracks_json import Tracks
from core.match.track import keyed_track

SIZE = (1920, 1080)
KEYS = [np.array([[1001, 10.25, 20.5], [1002, 11.0, 21.75], [1004, 13.5, 1000.0]]), np.array([[1003, 1900.0, 3.0]])]
TRACKS = Tracks(tuple(keyed_track(k + 1, f"t{k}", keys) for k, keys in enumerate(KEYS)), SIZE, (1001, 1004))


@pytest.mark.parametrize("suffix", [".json", ".txt", *READERS])
def test_every_format_goes_there_and_back(tmp_path, suffix):
    path = tmp_path / f"tracks{suffix}"
    write_tracks(path, TRACKS, suffix)
    found = read_tracks(path, SIZE)
    assert len(found.tracks) == 2
    for number, (track, keys) in enumerate(zip(found.tracks, KEYS, strict=True)):
        assert track.name == f"t{number}"
        np.testing.assert_array_equal(track.frames, keys[:, 0])
        np.testing.assert_allclose(track.points, keys[:, 1:], atol=2e-5)


# the middle of the pixel in the lower left corner of a 1920 x 1080 picture, as each program says it
SAMPLES = {
    ".3de": "1\np\n0\n1\n7 0.5 0.5\n",
    ".boujou": "# boujou\np 7 0.5 1079.5\n",
    ".2dt": '# "Name"\n"p"\n1\n1\n7 0.5 0.5 1.0\n',
    ".syntheyes": f"p 7 {1 / 1920 - 1} {1 - 1 / 1080} 7\n",
    ".uv": json.dumps({"points": [{"name": "p", "per_frame": [{"frame": 7, "pos": [0.5 / 1920, 0.5 / 1080]}]}]}),
    ".nk": "Tracker3 {\n track1 {{curve x7 0.5} {curve x7 0.5}}\n}\n",
    ".py": f'for name, points in json.loads("[[\\"p\\", [[7, {0.5 / 1920}, {0.5 / 1080}]]]]"):\n    pass\n',
}


@pytest.mark.parametrize("suffix", SAMPLES)
def test_pixels_are_counted_as_the_program_counts(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_text(SAMPLES[suffix])
    (track,) = read_tracks(path, SIZE).tracks
    np.testing.assert_allclose(track.keys, [[7, 0.0, 1079.0]], atol=1e-6)


def test_the_table_of_nukes_tracker_is_read_with_its_names(tmp_path):
    path = tmp_path / "a.nk"
    path.write_text("""Read { file "a.mov" }
Tracker4 {
 inputs 0
 tracks { { 1 31 3 }
{ { 5 1 20 enable e 1 }
{ 3 1 75 name name 1 }
{ 2 1 58 track_x track_x 1 } }
{
 { {curve K x1 1} "left eye" {curve x7 0.5 x8 1.5 2.5} {curve i x7 0.5 x8 0.5 1.5} {curve K x1 0} {curve K x1 0} 1 0 0 }
 { {1} nose {curve x9 100.5} {curve x9 1079.5} {} {} 1 0 0 }
 { {curve K x1 1} "track 3" {} {} {} {} 1 0 0 }
}
}
 name Tracker1
}
""")
    eye, nose = read_tracks(path, SIZE).tracks
    assert (eye.name, nose.name) == ("left eye", "nose")
    np.testing.assert_allclose(eye.keys, [[7, 0, 1079], [8, 1, 1079], [9, 2, 1078]])
    np.testing.assert_allclose(nose.keys, [[9, 100, 0]])


@pytest.mark.parametrize("suffix", [".json", ".txt", *READERS])
@pytest.mark.parametrize(
    "words",
    ["", "{}", "1\n", "9999999999\n", "1\np\n0\n5\n1 2 3\n", "a b c d e f g", "[" * 5000, "p 1 nan 2\n", "\0" * 99],
)
def test_hostile_files_are_refused_in_one_sentence(tmp_path, suffix, words):
    path = tmp_path / f"a{suffix}"
    path.write_text(words)
    with pytest.raises(UserError) as error:
        read_tracks(path, SIZE)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("point", [[1, 2], [1.5, 2, 3], [1, 1e9, 3], [2**40, 1, 1]])
def test_points_of_json_are_checked(tmp_path, point):
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"tracks": [{"name": "p", "points": [point]}]}))
    with pytest.raises(UserError, match="point 1"):
        read_tracks(path, SIZE)
