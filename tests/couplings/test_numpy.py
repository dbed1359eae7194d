"""The NumPy loop streams while the server is killed."""

import importlib.util
import unittest

from live import COUPLINGS, Server, digests, run

import partiemc

EVERY, STEPS = 2, 600


class Drops(unittest.TestCase):
    def test_nothing_is_missing_though_the_server_is_killed(self):
        specification = importlib.util.spec_from_file_location("drops", COUPLINGS / "numpy_drops.py")
        drops = importlib.util.module_from_spec(specification)
        specification.loader.exec_module(drops)
        with Server() as server:
            answers = run([COUPLINGS / "numpy_drops.py", "--server", server.address, "--every", EVERY,
                           "--steps", STEPS], server, kill_after=20)
        sequence = partiemc.Reconstructor(spacing=drops.SPACING)
        expected = [(time, digests(sequence.reconstruct(positions, time, velocities=velocities)))
                    for step, time, positions, velocities in drops.simulate(STEPS)
                    if step % EVERY == 0]
        self.assertEqual([(answer.time, answer.digests) for answer in answers], expected)
        self.assertEqual((answers[0].rings, answers[-1].rings > 0), (2, True))
        area = len(positions_of(drops)) * drops.SPACING ** 2
        for answer in answers[:20]:  # The drops are whole.
            self.assertAlmostEqual(answer.area / area, 1, delta=0.02)


def positions_of(drops):
    _, _, positions, _ = next(drops.simulate(1))
    return positions


if __name__ == "__main__":
    unittest.main()
