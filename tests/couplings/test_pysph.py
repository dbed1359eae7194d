"""PySPH's dam break streams while the server is killed; its files are read afterwards."""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from live import COUPLINGS, Server, digests, run, skip_unless

skip_unless("pysph", "h5py")

import numpy
import partiemc
from pysph.solver.utils import dump, load

# PySPH takes 50 ms to write an HDF5 file.
EVERY, STEPS, SPACING = 8, 400, 0.03
STEPS_IN_SPACE = 240


class Run:
    """Runs the dam break, streamed with `latest` and with every frame."""


def setUpModule():
    folder = tempfile.TemporaryDirectory()
    unittest.addModuleCleanup(folder.cleanup)
    Run.folder = pathlib.Path(folder.name)
    with Server() as server:
        command = [COUPLINGS / "pysph_dam_break.py", "--quiet", "--server", server.address]
        # PySPH compiles its equations to where HOME is, in both runs the same.
        Run.latest = run([*command, "--every", "1", "--max-steps", "104", "--disable-output",
                          "--latest", "-d", Run.folder / "latest"], server, HOME=folder.name)
        Run.in_space = run([COUPLINGS / "pysph_dam_break_3d.py", "--quiet", "--server",
                            server.address, "--dx", "0.1", "--every", EVERY, "--pfreq", EVERY,
                            "--max-steps", STEPS_IN_SPACE, "-d", Run.folder / "in_space"],
                           server, kill_after=10, HOME=folder.name)
        Run.answers = run([*command, "--every", EVERY, "--pfreq", EVERY, "--max-steps", STEPS, "-d",
                           Run.folder / "run"], server, kill_after=10, HOME=folder.name)
    _, *Run.frames = partiemc.read_pysph(Run.folder / "run")  # The first was no step.


class DamBreak(unittest.TestCase):
    def test_every_frame_has_its_result_though_the_server_is_killed(self):
        self.assertEqual(len(Run.answers), STEPS // EVERY)
        self.assertEqual([answer.time for answer in Run.answers],
                         [frame["time"] for frame in Run.frames])

    def test_results_are_those_of_the_frames_that_pysph_has_written(self):
        sequence = partiemc.Reconstructor(spacing=SPACING)
        expected = [digests(sequence.reconstruct(**frame)) for frame in Run.frames]
        self.assertEqual([answer.digests for answer in Run.answers], expected)

    def test_the_area_is_the_sum_of_volumes(self):
        for answer, frame in zip(Run.answers, Run.frames):
            self.assertEqual(answer.rings, 1)
            self.assertEqual(len(frame["volumes"]), 2278)
            self.assertAlmostEqual(answer.area / frame["volumes"].sum(), 1, delta=0.02)

    def test_the_script_of_the_page_reads_what_pysph_has_written(self):
        page = (COUPLINGS / "README.md").read_text()
        script, = [block for block in re.findall("```python\n(.*?)```", page, re.S)
                   if "dam_break_2d_output" in block]
        (Run.folder / "dam_break_2d_output").symlink_to(Run.folder / "run")
        ran = subprocess.run([sys.executable, "-c", script], cwd=Run.folder, capture_output=True,
                             text=True)
        self.assertEqual(len(ran.stdout.splitlines()), 1 + len(Run.frames), ran.stderr)

    def test_latest_leaves_frames_out_but_not_the_last(self):
        times = [answer.time for answer in Run.latest]
        self.assertEqual(times, sorted(set(times)))
        self.assertLessEqual(len(times), 104)
        self.assertEqual(times[-1], Run.answers[104 // EVERY - 1].time)


class DamBreakInSpace(unittest.TestCase):
    def test_every_frame_has_its_surface_though_the_server_is_killed(self):
        _, *frames = partiemc.read_pysph(Run.folder / "in_space")
        # PySPH also writes at other times.
        frames = [frame for frame in frames if frame["time"] in {a.time for a in Run.in_space}]
        self.assertEqual(len(Run.in_space), STEPS_IN_SPACE // EVERY)
        self.assertEqual([answer.time for answer in Run.in_space],
                         [frame["time"] for frame in frames])
        sequence = partiemc.Reconstructor(spacing=0.1, output="surface")
        for answer, frame in zip(Run.in_space, frames):
            self.assertEqual(answer.digests, digests(sequence.reconstruct(**frame)))
            self.assertAlmostEqual(answer.volume / frame["volumes"].sum(), 1, delta=0.01)


class Files(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.written = load(str(next((Run.folder / "run").glob("*_00104.*"))))

    def write(self, name):
        path = self.folder / name
        dump(str(path), list(self.written["arrays"].values()), self.written["solver_data"])
        return path

    def refused(self, path, **options):
        with self.assertRaises(partiemc.Error) as caught:
            list(partiemc.read_pysph(path, **options))
        return caught.exception

    def test_both_formats_give_what_pysph_itself_reads(self):
        fluid = self.written["arrays"]["fluid"]
        for name in ("run_100.hdf5", "run_100.npz"):
            frame, = partiemc.read_pysph(self.write(name))
            self.assertEqual(frame["time"], self.written["solver_data"]["t"])
            for found, expected in zip((*frame["positions"], *frame["velocities"]),
                                       (fluid.x, fluid.y, fluid.u, fluid.v)):
                numpy.testing.assert_array_equal(found, expected)
            numpy.testing.assert_array_equal(frame["volumes"], fluid.m / fluid.rho)
        self.assertEqual(len(partiemc.reconstruct(
            frame["positions"], volumes=frame["volumes"], spacing=SPACING).rings), 1)

    def test_steps_come_in_their_order(self):
        for step in (5, 100, 20):
            self.written["solver_data"]["t"] = float(step)
            self.write(f"run_{step}.npz")
        self.assertEqual([frame["time"] for frame in partiemc.read_pysph(self.folder)],
                         [5, 20, 100])

    def test_three_dimensions_stay_three(self):
        self.written["arrays"]["fluid"].z[0] = 1
        frame, = partiemc.read_pysph(self.write("run_1.hdf5"))
        self.assertEqual((len(frame["positions"]), len(frame["velocities"])), (3, 3))

    def test_what_is_not_there_is_told(self):
        error = self.refused(self.folder)
        self.assertEqual((error.code, error.field), ("NOT_FOUND", str(self.folder)))
        error = self.refused(self.write("run_1.npz"), array="water")
        self.assertEqual((error.field, error.value), ("array", "water"))
        self.assertIn("boundary, fluid", error.rule)
        self.write("run_1.hdf5")
        self.assertIn("each step once", self.refused(self.folder).rule)
        (self.folder / "run_1.hdf5").unlink()
        self.write("other_1.npz")
        self.assertIn("other, run", self.refused(self.folder).value)

    def test_nothing_of_a_pickle_is_run(self):
        marker = self.folder / "run"

        class Touch:
            def __reduce__(self):
                return os.mkdir, (str(marker),)

        path = self.folder / "run_1.npz"
        numpy.savez(path, version=2, particles=numpy.array({"fluid": Touch()}, dtype=object),
                    solver_data=numpy.array({"t": 0.0}, dtype=object))
        error = self.refused(path)
        self.assertEqual(error.code, "DATA_LOSS")
        self.assertIn("posix.mkdir", str(error))
        self.assertFalse(marker.exists())

    def test_damaged_files_are_refused(self):
        for name in ("run_1.hdf5", "run_1.npz"):
            path = self.write(name)
            whole = path.read_bytes()
            for length in (0, 10, len(whole) // 2, len(whole) - 1):
                path.write_bytes(whole[:length])
                self.assertEqual(self.refused(path).code, "DATA_LOSS", (name, length))
        for particles in ([1], {"fluid": {"arrays": {"x": "text", "y": numpy.zeros(4)}}},
                          {"fluid": {"arrays": {"x": numpy.zeros(4), "y": numpy.zeros(5)}}}):
            numpy.savez(path, version=2, particles=numpy.array(particles, dtype=object),
                        solver_data=numpy.array({"t": 0.0}, dtype=object))
            self.assertEqual(self.refused(path).code, "DATA_LOSS")

    def test_a_size_that_is_not_in_the_file_is_refused(self):
        import h5py
        path = self.write("run_1.hdf5")
        with h5py.File(path, "a") as file:
            arrays = file["particles/fluid/arrays"]
            attributes = dict(arrays["x"].attrs)
            del arrays["x"]
            arrays.create_dataset("x", (10**12,), dtype="f8", chunks=(1000,)).attrs.update(attributes)
        error = self.refused(path)
        self.assertEqual((error.code, error.value), ("DATA_LOSS", f"{8 * 10**12} bytes"))


if __name__ == "__main__":
    unittest.main()
