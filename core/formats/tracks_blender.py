"""2D tracks of Blender, as the Python scripts that its text editor runs.

What is written places markers in a clip. What is read is such a script: its list of tracks, taken out of the text
without running it. Tracks made in Blender come as JSON by ``resources/blender/give_tracks.py``.
Blender's positions are parts of the picture, y up, and its markers count a sequence's first file as 1 whatever its
number; only the script, in Blender, can know the number of the file the clip begins with.
"""

from __future__ import annotations

import json
import re

from core.errors import UserError
from core.formats.tracks_json import Tracks
from core.formats.tracks_text import Rows, Size, corner_up, free_name, ours_from_unit_up, tracks_of
from core.match.track import Track

GIVEN = re.compile(r'json\.loads\(("[^\n]*")\)')
SCRIPT = """import bpy
import json
import re

# name, then frame (as the files count), x and y as parts of the picture, y up
TRACKS = json.loads({rows})

clip = getattr(bpy.context.space_data, "clip", None) or bpy.data.movieclips[0]
number = re.search(r"(\\d+)\\D*$", bpy.path.basename(clip.filepath)) if clip.source == "SEQUENCE" else None
first = (int(number[1]) if number else 1) + clip.frame_offset
tracks = clip.tracking.objects[0].tracks
for name, points in TRACKS:
    track = tracks.new(name=name, frame=points[0][0] - first + 1)
    for frame, x, y in points:
        track.markers.insert_frame(frame - first + 1, co=(x, y))
"""


def write_blender(tracks: tuple[Track, ...], size: Size) -> str:
    """A script for Blender's text editor: markers in the clip that is shown, or the first one."""
    rows = []
    for track in tracks:
        points = corner_up(track.points, size) / size
        places = zip(track.frames, points, strict=True)
        rows.append([track.name, [[int(f), round(float(x), 9), round(float(y), 9)] for f, (x, y) in places]])
    return SCRIPT.format(rows=json.dumps(json.dumps(rows)))


def read_blender(text: str, size: Size, name: str) -> Tracks:
    """The tracks of a script as it is written here; the script is looked at, never run."""
    rows: Rows = {}
    line = GIVEN.search(text)
    try:
        for word, points in json.loads(json.loads(line[1])) if line is not None else ():
            rows[free_name(str(word), rows)] = [(float(frame), float(x), float(y)) for frame, x, y in points]
    except (ValueError, TypeError, RecursionError):
        line = None
    if line is None:
        raise UserError(
            f"{name} is no script of tracks for Blender; run resources/blender/give_tracks.py in Blender and read "
            "the .json it writes."
        )
    return tracks_of(rows, size, name, ours_from_unit_up)
