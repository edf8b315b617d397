"""COLMAP's incremental mapper on matches of photographs: IN.npz (p, t, xy, size, cam) OUT.npz (k, R, t)."""

import json
import pathlib
import sys
import tempfile
import time

import numpy as np
import pycolmap

given = np.load(sys.argv[1])
photograph, track, xy = given["p"], given["t"], given["xy"]
width, height = (int(v) for v in given["size"])
focal, x, y = (float(v) for v in given["cam"])
folder = pathlib.Path(tempfile.mkdtemp())
db = pycolmap.Database.open(folder / "db.db")
# COLMAP has corners of pixels at whole numbers
camera = pycolmap.Camera(model="SIMPLE_PINHOLE", width=width, height=height, params=[focal, x + 0.5, y + 0.5])
camera.has_prior_focal_length = True
camera.camera_id = db.write_camera(camera)
rig = pycolmap.Rig()
rig.add_ref_sensor(camera.sensor_id)
rig_id, views = db.write_rig(rig), []
for k in range(int(photograph.max()) + 1):
    image = pycolmap.Image(name=f"{k:04d}", camera_id=camera.camera_id)
    image.image_id = db.write_image(image)
    frame = pycolmap.Frame()
    frame.rig_id = rig_id
    frame.add_data_id(image.data_id)
    db.write_frame(frame)
    rows = np.flatnonzero(photograph == k)
    rows = rows[np.argsort(track[rows])]
    db.write_keypoints(image.image_id, (xy[rows] + 0.5).astype(np.float32))
    views.append((image.image_id, track[rows], xy[rows]))
start = time.perf_counter()
for i, (a, of_a, xy_a) in enumerate(views):
    for b, of_b, xy_b in views[i + 1 :]:
        both = np.intersect1d(of_a, of_b)
        if len(both) >= 15:
            match = np.c_[np.searchsorted(of_a, both), np.searchsorted(of_b, both)].astype(np.uint32)
            pair = pycolmap.estimate_calibrated_two_view_geometry(camera, xy_a + 0.5, camera, xy_b + 0.5, match)
            db.write_matches(a, b, match)
            db.write_two_view_geometry(a, b, pair)
db.close()
options = pycolmap.IncrementalPipelineOptions()
options.min_num_matches, options.min_model_size, options.extract_colors = 8, 3, False
options.ba_refine_focal_length = options.ba_refine_extra_params = options.ba_refine_principal_point = False
(folder / "out").mkdir()
models = pycolmap.incremental_mapping(folder / "db.db", folder, folder / "out", options)
model = max(models.values(), key=lambda one: one.num_reg_images())
images = {int(one.name): one for one in model.images.values() if one.has_pose}
seen = sorted(images)
np.savez(
    sys.argv[2], k=np.array(seen), R=np.array([images[k].cam_from_world().rotation.matrix() for k in seen]),
    t=np.array([images[k].cam_from_world().translation for k in seen]),
)
print(json.dumps({"seconds": time.perf_counter() - start, "photographs": len(seen)}))
