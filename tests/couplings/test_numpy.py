"""The NumPy loop streams while the server is killed."""

import importlib.util
import unittest

from live import COUPLINGS, Server, digests, run

import partiemc

EVERY, STEPS = 2, 600


def load_drops():
    specification = importlib.util.spec_from_file_location("drops", COUPLINGS / "numpy_drops.py")
    drops = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(drops)
    return drops


class Drops(unittest.TestCase):
    def check(self, dimensions, steps, **parameters):
        """The answers of a run, and the volume of its particles."""
        drops = load_drops()
        with Server() as server:
            answers = run([COUPLINGS / "numpy_drops.py", "--server", server.address, "--every", EVERY,
                           "--steps", steps, "--dimensions", dimensions], server, kill_after=20)
        sequence = partiemc.Reconstructor(spacing=drops.SPACING, **parameters)
        expected = [(time, digests(sequence.reconstruct(positions, time, velocities=velocities)))
                    for step, time, positions, velocities in drops.simulate(steps, dimensions)
                    if step % EVERY == 0]
        self.assertEqual([(answer.time, answer.digests) for answer in answers], expected)
        _, _, positions, _ = next(drops.simulate(1, dimensions))
        return answers, len(positions) * drops.SPACING ** dimensions

    def test_nothing_is_missing_though_the_server_is_killed(self):
        answers, area = self.check(2, STEPS)
        self.assertEqual((answers[0].rings, answers[-1].rings > 0), (2, True))
        for answer in answers[:20]:  # The drops are whole.
            self.assertAlmostEqual(answer.area / area, 1, delta=0.02)

    def test_surfaces_have_the_volume_of_the_particles(self):
        answers, volume = self.check(3, 200, output="surface")
        self.assertEqual((answers[0].shells, len(answers)), (2, 100))
        for answer in answers:
            self.assertAlmostEqual(answer.volume / volume, 1, delta=0.01)


if __name__ == "__main__":
    unittest.main()
