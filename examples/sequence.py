"""Makes a sequence with known force, estimates it and draws both:  sequence.py SCENE.yaml FOLDER [PROGRAM]"""

import subprocess
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import palpate

simulated, folder = Path(sys.argv[1]), Path(sys.argv[2])
program = sys.argv[3] if len(sys.argv) > 3 else "palpate"
subprocess.run([program, "simulate", simulated, "-o", folder, "--json"], check=True, stdout=subprocess.DEVNULL)

scene = palpate.Scene.read(folder / "scene.yaml")
recording = palpate.Recording(scene.recording)
rectification = palpate.make_rectification(palpate.read_rig(scene.recording), recording.size)
rest = next(recording)
tissue_map = palpate.build_tissue_map(rest, rectification, scene.map, scene.tissue, scene.attachments)
estimator = palpate.ForceEstimator(tissue_map, rest, rectification, scene.instrument, scene.contact, scene.tuning)
estimates = [estimator.update(frame) for frame in recording]

time_s = [estimate.time_s for estimate in estimates]
force_N = np.array([np.linalg.norm(estimate.force_N) for estimate in estimates])
truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
true_N = np.interp(time_s, truth["time_s"], truth["force_N"])

figure, axes = plt.subplots(figsize=(8, 3.5), layout="constrained")
low, high = ([getattr(estimate.band, end) for estimate in estimates] for end in ("low_N", "high_N"))
axes.fill_between(time_s, low, high, alpha=0.25, label="95 % band")
axes.plot(time_s, force_N, label="estimated")
axes.plot(time_s, true_N, "k--", label="true")
axes.set(xlabel="time, s", ylabel="force, N", title=f"E = {scene.tissue.young_modulus_kPa:g} kPa, {scene.tissue.law}")
axes.legend()
figure.savefig(folder / "forces.png", dpi=120)

error = np.sqrt(np.mean((force_N - true_N) ** 2)) / true_N.max()
print(f"{len(estimates)} frames, force NRMSE {100 * error:.1f} % of the true peak of {true_N.max():.2f} N")
