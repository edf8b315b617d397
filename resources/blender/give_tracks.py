"""Run in Blender's text editor: writes the tracks of the clip that is shown, or the first one, beside its film.

``NAME.tracks.json`` is read by ``filoplume track --tracks`` and by File, Import tracks. Frames are numbered as the
files are; disabled markers are left out.
"""

import json
import re
from pathlib import Path

import bpy

clip = getattr(bpy.context.space_data, "clip", None) or bpy.data.movieclips[0]
film = Path(bpy.path.abspath(clip.filepath))
number = re.search(r"(\d+)\D*$", film.name) if clip.source == "SEQUENCE" else None
first = (int(number[1]) if number else 1) + clip.frame_offset
width, height = clip.size
tracks = []
for tracking in clip.tracking.objects:
    for track in tracking.tracks:
        points = [
            [m.frame + first - 1, m.co[0] * width - 0.5, (1.0 - m.co[1]) * height - 0.5]
            for m in track.markers
            if not m.mute
        ]
        if points:
            tracks.append({"name": track.name, "points": points})
out = film.with_name(f"{film.stem}.tracks.json")
out.write_text(json.dumps({"size": [width, height], "tracks": tracks}), encoding="utf-8")
