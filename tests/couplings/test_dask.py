"""Recordings mapped over the workers of a Dask cluster."""

import pathlib
import sys
import tempfile
import unittest

from live import skip_unless

skip_unless("dask", "distributed")

import numpy
import partiemc
import partiemc.dask


def recording(path, seed):
    """Four frames of a drop that drifts, in one file: positions (T, N, 2)."""
    random = numpy.random.default_rng(seed)
    lattice = numpy.stack(numpy.meshgrid(numpy.arange(40), numpy.arange(40)), -1).reshape(-1, 2)
    drop = lattice[numpy.hypot(*(lattice - 19.5).T) < 10 + seed / 2]
    drop = drop + random.uniform(-0.1, 0.1, drop.shape)
    numpy.savez(path, positions=[drop + 0.3 * k for k in range(4)], times=numpy.arange(4) / 10)


def read(path):
    with numpy.load(path) as content:
        for positions, time in zip(content["positions"], content["times"]):
            yield {"positions": positions, "time": time}


def worst_bend(result):
    """Some of a result's numbers are arrays."""
    return result.rings.area.copy()


class Cluster(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        import dask.distributed

        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.paths = [str(pathlib.Path(folder.name, f"{k}.npz")) for k in range(20)]
        for seed, path in enumerate(cls.paths):
            recording(path, seed)
        # Workers are separate processes, as on other machines.
        cls.cluster = dask.distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=folder.name)
        cls.addClassCleanup(cls.cluster.close)
        cls.client = dask.distributed.Client(cls.cluster)
        cls.addClassCleanup(cls.client.close)
        # They get the functions of this file as sent objects only.
        import cloudpickle
        cloudpickle.register_pickle_by_value(sys.modules[__name__])

    def test_two_workers_give_the_digests_of_one_process(self):
        found = partiemc.dask.bag(self.paths, read, spacing=1).compute()
        expected = [partiemc.dask.reconstruct(path, read, spacing=1) for path in self.paths]
        self.assertEqual(found, expected)
        self.assertEqual([len(figures) for figures in found], [4] * 20)
        self.assertEqual(len({frame["rings_digest"] for frames in found for frame in frames}), 80)

    def test_what_is_collected_is_the_callers_choice(self):
        found = partiemc.dask.bag(self.paths[:3], read, collect=worst_bend, spacing=1).compute()
        self.assertEqual([[area.shape for area in areas] for areas in found], [[(1,)] * 4] * 3)

    def test_an_error_of_one_recording_is_raised(self):
        broken = pathlib.Path(self.paths[0]).with_name("broken.npz")
        numpy.savez(broken, positions=[[[0, numpy.nan]]], times=[0])
        with self.assertRaises(partiemc.Error) as caught:
            partiemc.dask.bag([*self.paths[:2], str(broken)], read, spacing=1).compute()
        self.assertEqual((caught.exception.reason, caught.exception.field),
                         ("NOT_FINITE", "positions[0].y"))

    def test_no_recordings_are_an_error(self):
        with self.assertRaisesRegex(ValueError, "recordings"):
            partiemc.dask.bag([], read)


if __name__ == "__main__":
    unittest.main()
