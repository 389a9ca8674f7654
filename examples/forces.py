import sys

import numpy as np
import palpate

scene = palpate.Scene.read(sys.argv[1])
recording = palpate.Recording(scene.recording)
rectification = palpate.make_rectification(palpate.read_rig(scene.recording), recording.size)
rest = next(recording)
tissue_map = palpate.build_tissue_map(rest, rectification, scene.map, scene.tissue, scene.attachments)
estimator = palpate.ForceEstimator(tissue_map, rest, rectification, scene.instrument, scene.contact)
for frame in recording:
    estimate = estimator.update(frame)
    print(f"{estimate.frame} {estimate.status} {np.linalg.norm(estimate.force_N):.3f} N")
