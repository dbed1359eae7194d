"""Frames, and what partiemc makes of files of them, for the tests with files of other programs."""

import argparse
import csv
import json
import pathlib
import resource
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

SPACING = 0.1
TIMES = [0.5, 0.75, 1.25]
STEPS = [100, 150, 250]


def frames():
    """A drop that falls and widens: positions (N, 3) with z = 0 that are exact in float32."""
    axis = numpy.arange(-1, 1, SPACING)
    grid = numpy.stack(numpy.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    disc = grid[(grid ** 2).sum(axis=1) < 0.8]
    for k in range(len(TIMES)):
        moved = disc * [1 + 0.02 * k, 1] - [0, 0.1 * k]
        yield numpy.column_stack([moved, numpy.zeros(len(disc))]).astype("f4").astype("f8")


FRAMES = list(frames())
IDS = numpy.arange(len(FRAMES[0]))[::-1] + 5
VELOCITIES = numpy.tile([0.1, -0.4, 0], (len(FRAMES[0]), 1))
VOLUMES = numpy.full(len(FRAMES[0]), SPACING ** 2)


def limit_memory():
    """Hostile files must be refused before memory is allocated for them."""
    resource.setrlimit(resource.RLIMIT_DATA, (700 << 20, 700 << 20))


class ProgramTest(unittest.TestCase):
    """Tests that run partiemc."""

    program = None  # Set by main.


class ReplayTest(ProgramTest):
    """Replays files of FRAMES and compares the digests with those of CSV."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def attribute_ranges(self):
        """The least and the greatest value of each attribute in the last frame that was replayed."""
        ranges = {}
        for name, value in self.properties.items():
            for k, suffix in enumerate(("_min", "_max")):
                if name.endswith(suffix):
                    ranges.setdefault(name.removesuffix(suffix), [None, None])[k] = value
        return ranges

    def replay(self, source, *flags):
        """The rows of --stats, and the times of the frames."""
        table = self.folder / "stats.csv"
        with tempfile.TemporaryDirectory() as out:
            subprocess.run([self.program, "replay", str(source), "--local", "--quiet", "--spacing", str(SPACING),
                            "--stats", str(table), "--output-dir", out, "--format", "geojson", *flags], check=True)
            written = [json.loads(path.read_text()) for path in sorted(pathlib.Path(out).glob("*.geojson"))]
        times = [one["time"] for one in written]
        self.properties = written[-1]["features"][0]["properties"] if written[-1]["features"] else {}
        with open(table, newline="") as rows:
            return [{**row, "time": time} for row, time in zip(csv.DictReader(rows), times)]

    def csv_rows(self, columns, time):
        """The rows of the same frames as CSV with these columns."""
        folder = self.folder / "truth"
        folder.mkdir()
        for k, positions in enumerate(FRAMES):
            table = {"x": positions[:, 0], "y": positions[:, 1], "id": IDS, "vx": VELOCITIES[:, 0],
                     "vy": VELOCITIES[:, 1], "volume": VOLUMES}
            with open(folder / f"frame_{k}.csv", "w", newline="") as file:
                writer = csv.writer(file)
                writer.writerow(columns)
                writer.writerows(zip(*(map(repr, table[name].tolist()) for name in columns)))
        if time:
            lines = "\n".join(f"{k},{t}" for k, t in enumerate(TIMES))
            (folder / "times.csv").write_text(f"frame,t\n{lines}\n")
        return self.replay(folder)

    def assert_same(self, source, *flags, columns=("x", "y"), time=True, count=len(FRAMES)):
        truth = self.csv_rows(columns, time)[:count]
        rows = self.replay(source, *flags)
        self.assertEqual(len(rows), count)
        keys = [key for key in rows[0] if "digest" in key] + ["particles", "time"]
        self.assertEqual(keys[:2], ["rings_digest", "mesh_digest"])
        for row, true in zip(rows, truth):
            self.assertEqual([row[key] for key in keys], [true[key] for key in keys])

    def setUpTruth(self):
        truth = self.folder / "truth"
        if truth.exists():
            for file in truth.iterdir():
                file.unlink()
            truth.rmdir()

    def run_replay(self, source, **options):
        """`partiemc replay` of files that it may refuse."""
        return subprocess.run([self.program, "replay", str(source), "--local"], capture_output=True, text=True,
                              **options)


def main():
    """Runs the tests of the program, which is called with --partiemc PROGRAM."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--partiemc", required=True)
    arguments, rest = parser.parse_known_args()
    ProgramTest.program = arguments.partiemc
    unittest.main(argv=[sys.argv[0], *rest])
