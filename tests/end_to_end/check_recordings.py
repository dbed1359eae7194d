#!/usr/bin/python3
"""Replays recordings with every placement and checks the written files, frame by frame, with an
independent geometry library (GEOS, through Shapely).

For every frame and placement:
  - every GeoJSON polygon is valid, its outer ring counter-clockwise, its holes clockwise;
  - polygons do not overlap, and every hole lies in its polygon;
  - no triangle of the OBJ mesh is folded or degenerate, and the mesh has the rings' area to 1e-5;
  - the statistics have the same area and the same number of triangles as the files.
`farthest-particle` may break the geometry, but only in frames whose statistics count it.

usage: check_recordings.py --partiemc build/release/bin/partiemc [--data FOLDER]
FOLDER contains recordings outside of the repository; without it only the bundled ones are
replayed. Exit code 0 only if every check passed.
"""
import argparse
import csv
import itertools
import json
import pathlib
import subprocess
import sys
import tarfile
import tempfile
from fractions import Fraction

import numpy
from shapely.geometry import Polygon
from shapely.validation import explain_validity

PLACEMENTS = ["marching-squares", "qef", "farthest-particle", "virtual-plane"]
MAY_FOLD = {"farthest-particle"}
AREA_TOLERANCE = 1e-5


def bundled(root):
    yield "bundled dam break", root / "client/recordings/dam_break.pemc", []


def unpack(archive, target):
    command = ["zstd", "-dcq", str(archive)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as source:
        if archive.name.endswith(".tar.zst"):
            with tarfile.open(fileobj=source.stdout, mode="r|") as tar:
                tar.extractall(target)
        else:
            (target / archive.name.removesuffix(".zst")).write_bytes(source.stdout.read())


def recordings(data, target):
    """The sequences of the data folder: name, input, further arguments."""
    for archive in sorted(data.glob("*.zst")):
        unpack(archive, target)
    yield ("dam break", target / "pysph_dam2k_csv", ["--spacing", "0.0303"])
    yield ("drum", target / "drum50.lammpstrj", ["--select", "type=1"])
    water = target / "SPHinXsys_soil_water"
    yield ("soil and water: water", f"{water}/WaterBlock_*.vtp", [])
    yield ("soil and water: soil", f"{water}/SoilBlock_*.vtp", [])
    samples = target / "formats"
    for path in sorted((samples / "vtk").iterdir()):
        yield f"sample {path.name}", path, []
    lammps = sorted(p for p in (samples / "lammps").iterdir() if not p.name.startswith(("in.", "dump.multi")))
    for path in lammps:
        yield f"sample {path.name}", path, []
    yield "sample dump.multi", f"{samples}/lammps/dump.multi.*.txt", []
    for name in ["header.csv", "noheader.csv", "semicolon_units_xz.csv", "pos_f8_C.npy", "pos_f4_fortran.npy",
                 "frame.npz", "frame_deflate.npz", "ascii.ply", "binary_le.ply", "pysph_native.npz"]:
        yield f"sample {name}", samples / "other" / name, []
    yield "sample numpy_savetxt_default.txt", samples / "other/numpy_savetxt_default.txt", ["--columns", "2,3"]


def rings_of(path):
    features = json.loads(path.read_text())["features"]
    return [f["geometry"]["coordinates"] for f in features]


def mesh_of(path):
    points, triangles = [], []
    for line in path.read_text().splitlines():
        if line.startswith("v "):
            points.append([float(x) for x in line.split()[1:3]])
        elif line.startswith("f "):
            triangles.append([int(x.split("/")[0]) - 1 for x in line.split()[1:]])
    return numpy.array(points).reshape(-1, 2), numpy.array(triangles, dtype=int).reshape(-1, 3)


def signed_area(ring):
    points = numpy.array(ring) - ring[0]
    x, y = points[:, 0], points[:, 1]
    return 0.5 * float(numpy.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


def broken_polygons(polygons):
    """Errors that GEOS finds in the polygons of one frame."""
    words, shapes = [], []
    for rings in polygons:
        if any(ring[0] != ring[-1] for ring in rings):
            words.append("a ring that is not closed")
            continue
        if signed_area(rings[0]) <= 0 or any(signed_area(hole) >= 0 for hole in rings[1:]):
            words.append("a ring of the wrong orientation")
        shape = Polygon(rings[0], rings[1:])
        if not shape.is_valid:
            words.append("not valid: " + explain_validity(shape))
        shapes.append(shape)
    if not words:
        touching = sum(a.intersects(b) for a, b in itertools.combinations(shapes, 2))
        if touching:
            words.append(f"{touching} pairs of polygons that touch")
    return words


def is_folded(corners):
    """Exact, because slivers may be thinner than the rounding of their area."""
    (ax, ay), (bx, by), (cx, cy) = [[Fraction(float(x)) for x in corner] for corner in corners]
    return (bx - ax) * (cy - ay) <= (cx - ax) * (by - ay)


def broken_mesh(points, triangles, ring_area):
    words = []
    corners = points[triangles]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
    size = numpy.abs(points).max(initial=0) ** 2
    folded = sum(is_folded(corners[k]) for k in numpy.flatnonzero(areas <= 1e-12 * size))
    if folded:
        words.append(f"{folded} folded triangles")
    if abs(areas.sum() - ring_area) > AREA_TOLERANCE * abs(ring_area):
        words.append(f"mesh area {areas.sum():.9g}, rings {ring_area:.9g}")
    return words


def check_frame(directory, row, may_fold):
    stem = directory / f"frame_{int(row['frame']):06d}"
    polygons = rings_of(stem.with_suffix(".geojson"))
    points, triangles = mesh_of(stem.with_suffix(".obj"))
    counted = int(row["self_intersections"]) + int(row["folded_triangles"])
    words = []
    area = sum(signed_area(ring) for rings in polygons for ring in rings if len(ring) > 3)
    if not (may_fold and counted):
        words += broken_polygons(polygons)
        words += broken_mesh(points, triangles, area)
        if abs(area - float(row["area"])) > 1e-9 * abs(area):
            words.append(f"statistics tell an area of {row['area']}, the rings have {area:.9g}")
    if len(triangles) != int(row["triangles"]):
        words.append(f"statistics tell {row['triangles']} triangles, the mesh has {len(triangles)}")
    return words


def check_sequence(partiemc, source, arguments, placement):
    """Returns frames, frames with counted crossings or folds, and errors."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        command = [partiemc, "replay", str(source), "--local", "--quiet", "--placement", placement,
                   "--output-dir", str(folder), "--format", "geojson,obj", "--stats", str(folder / "stats.csv")]
        command += arguments + ([] if placement in MAY_FOLD else ["--check"])
        done = subprocess.run(command, capture_output=True, text=True, timeout=600)
        if done.returncode != 0:
            return 0, 0, [f"exit code {done.returncode}: {done.stderr.strip()}"]
        with open(folder / "stats.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        words, counted = [], 0
        for row in rows:
            counted += int(row["self_intersections"]) + int(row["folded_triangles"]) > 0
            words += [f"frame {row['frame']}: {w}" for w in check_frame(folder, row, placement in MAY_FOLD)]
        if not rows:
            words.append("no frames")
        return len(rows), counted, words


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--partiemc", required=True)
    parser.add_argument("--data", type=pathlib.Path)
    options = parser.parse_args()
    root = pathlib.Path(__file__).resolve().parents[2]
    failures, frames = 0, 0
    with tempfile.TemporaryDirectory() as target:
        sequences = list(bundled(root))
        if options.data:
            sequences += list(recordings(options.data, pathlib.Path(target)))
        print(f"{len(PLACEMENTS)} placements each; counted: frames of farthest-particle that break")
        print(f"{'sequence':36} {'frames':>6} {'counted':>7}  outcome")
        for name, source, arguments in sequences:
            counted, wrong = 0, []
            for placement in PLACEMENTS:
                count, broken, words = check_sequence(options.partiemc, source, arguments, placement)
                frames += count
                counted += broken
                wrong += [f"{placement}, {word}" for word in words]
            failures += len(wrong)
            outcome = f"{len(wrong)} wrong, first: {wrong[0]}" if wrong else "good"
            print(f"{name:36} {count:6} {counted:7}  {outcome}", flush=True)
    print(f"{frames} frames checked, {failures} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
