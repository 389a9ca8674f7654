#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scores forces.csv of any estimator against truth.csv: python3 score.py BENCHMARK ENTRY

BENCHMARK/NAME/truth.csv, ENTRY/NAME/forces.csv (and truth_2.csv, forces_2.csv). Frames are matched by number; a frame of the truth
without a row, or with one that is not finite, counts as no force and no contact. Writes ENTRY/scores.csv.
"""
import csv
import math
import pathlib
import sys

FIGURES = ["force_nrmse_pct", "gain", "direction_error_deg_median", "onset_error_frames", "release_error_frames",
           "false_contact_frames", "missed_force_frames", "reversed_ok_frames", "band_coverage_pct", "band_half_width_pct"]


def number(row, name, otherwise=math.nan):
    try:
        return float(row.get(name, ""))
    except ValueError:
        return otherwise


def read(path):
    """Rows by frame: force vector, magnitude, contact, status, band."""
    rows = {}
    with open(path, newline="", encoding="utf-8-sig") as file:
        for row in csv.DictReader(file):
            force = [number(row, f"f{axis}_N", 0.0) for axis in "xyz"]
            magnitude = number(row, "force_N", math.hypot(*force))
            rows[int(float(row["frame"]))] = {
                "force": force, "magnitude": magnitude, "contact": row.get("in_contact", "").strip() in ("1", "true"),
                "status": row.get("status", ""), "low": number(row, "force_low_N"), "high": number(row, "force_high_N")}
    return rows


NOTHING = {"force": [0.0, 0.0, 0.0], "magnitude": 0.0, "contact": False, "status": "", "low": math.nan, "high": math.nan}


def median(values):
    """The value in the middle; of an even number, the mean of the two."""
    values = sorted(values)
    half = len(values) // 2
    return values[half] if len(values) % 2 else 0.5 * (values[half - 1] + values[half])


def angle_deg(a, b):
    lengths = math.hypot(*a) * math.hypot(*b)
    if lengths == 0:
        return 180.0
    return math.degrees(math.acos(max(-1.0, min(1.0, sum(x * y for x, y in zip(a, b)) / lengths))))


def score(estimate, truth):
    frames = sorted(truth)
    true = [truth[f] for f in frames]
    found = []
    for f in frames:
        row = estimate.get(f, NOTHING)
        found.append(row if math.isfinite(row["magnitude"]) and all(map(math.isfinite, row["force"])) else NOTHING)
    peak = max(t["magnitude"] for t in true)
    figures = dict.fromkeys(FIGURES, "")
    pairs = list(zip(found, true))
    if peak > 0:
        rmse = math.sqrt(sum((e["magnitude"] - t["magnitude"]) ** 2 for e, t in pairs) / len(pairs))
        figures["force_nrmse_pct"] = 100 * rmse / peak
        squares = sum(t["magnitude"] ** 2 for t in true)
        figures["gain"] = sum(e["magnitude"] * t["magnitude"] for e, t in pairs) / squares
        angles = [angle_deg(e["force"], t["force"]) for e, t in pairs
                  if t["magnitude"] > 0.25 * peak and math.hypot(*e["force"]) > 0]
        if angles:
            figures["direction_error_deg_median"] = median(angles)
        loaded = [(e, t) for e, t in pairs if t["magnitude"] > 0.05 * peak]
        figures["reversed_ok_frames"] = sum(
            e["status"] == "ok" and sum(x * y for x, y in zip(e["force"], t["force"])) < 0 for e, t in loaded)
        if any(math.isfinite(e["low"]) and math.isfinite(e["high"]) for e in found):
            band = [(0.0, 0.0) if math.isnan(e["low"]) or math.isnan(e["high"]) else (e["low"], e["high"]) for e, _ in loaded]
            inside = [low <= t["magnitude"] <= high for (low, high), (_, t) in zip(band, loaded)]
            figures["band_coverage_pct"] = 100 * sum(inside) / len(inside)
            figures["band_half_width_pct"] = 100 * sum((high - low) / 2 for low, high in band) / len(band) / peak
    contacts = [i for i, t in enumerate(true) if t["contact"]]
    if contacts:
        ours = [i for i, e in enumerate(found) if e["contact"]]
        if ours:
            figures["onset_error_frames"] = frames[ours[0]] - frames[contacts[0]]
            figures["release_error_frames"] = frames[ours[-1]] - frames[contacts[-1]]
    figures["false_contact_frames"] = sum(
        not t["contact"] and (e["contact"] or e["magnitude"] > 0.01 * peak) for e, t in pairs)
    missed, of_contact = 0, 0
    for e, t in pairs:
        of_contact = of_contact + 1 if t["contact"] else 0
        missed += of_contact >= 3 and not e["contact"] and t["magnitude"] > 0.05 * peak
    figures["missed_force_frames"] = missed
    return figures


def text(value):
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    benchmark, entry = map(pathlib.Path, sys.argv[1:])
    rows = []
    for truth in sorted(benchmark.glob("*/truth*.csv")):
        forces = entry / truth.parent.name / truth.name.replace("truth", "forces")
        found = read(forces) if forces.exists() else {}
        name = truth.parent.name + ("" if truth.name == "truth.csv" else ", second")
        rows.append([name] + [text(value) for value in score(found, read(truth)).values()])
    if not rows:
        sys.exit(f"{benchmark}: no */truth.csv there")
    with open(entry / "scores.csv", "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([["sequence"] + FIGURES] + rows)
    widths = [max(len(str(row[i])) for row in rows + [["sequence"] + FIGURES]) for i in range(len(FIGURES) + 1)]
    for row in [["sequence"] + FIGURES] + rows:
        print("  ".join(cell.rjust(width) if i else cell.ljust(width) for i, (cell, width) in enumerate(zip(row, widths))))


if __name__ == "__main__":
    main()
