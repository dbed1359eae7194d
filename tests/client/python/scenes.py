"""Particles, servers and the command line, for the tests of the Python package."""

import csv
import os
import pathlib
import subprocess
import tempfile
import time
import unittest

import numpy


def block(shift=0.0, side=30, dtype=numpy.float64):
    """A block of particles with a hole, spacing 1, `shift` to the right: (N, 2)."""
    rows, columns = numpy.divmod(numpy.arange(side * side), side)
    inside = (abs(2 * rows - side) * 3 >= side) | (abs(2 * columns - side) * 3 >= side)
    return numpy.stack([columns[inside] + shift, rows[inside]], axis=1).astype(dtype)


def ball(centre=(10, 20, 30), radius=12):
    """A ball of particles in space, spacing 1: (N, 3)."""
    axis = numpy.arange(-radius, radius + 1.0)
    nodes = numpy.stack(numpy.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    return nodes[(nodes ** 2).sum(axis=1) < radius ** 2] + numpy.array(centre)


def digests(result):
    return f"{result.rings_digest:016x} {result.mesh_digest:016x}"


def digests_of_replay(frames, spacing=1.0, flags=(), columns=("rings_digest", "mesh_digest")):
    """Digests of `partiemc replay` for the same frames."""
    with tempfile.TemporaryDirectory() as folder:
        for k, frame in enumerate(frames):
            numpy.save(f"{folder}/frame_{k:03}.npy", frame)
        subprocess.run([os.environ["PARTIEMC_PROGRAM"], "replay", f"{folder}/frame_*.npy", "--local",
                        "--spacing", str(spacing), "--stats", f"{folder}/statistics.csv", *flags],
                       check=True, capture_output=True)
        with open(f"{folder}/statistics.csv", newline="") as file:
            return [" ".join(row[column] for column in columns) for row in csv.DictReader(file)]


def assert_equal(case, one, other, but=()):
    """`one` equals `other` in every public property, except for those named in `but`."""
    for name in ("sequence", "time", "area", "perimeter", "volume", "spacing", "cell_size", "doubts",
                 "times", "particle_count", "rings_digest", "mesh_digest", "surface_digest", "level_error",
                 "level_digest", "particle_box", "dropped", "gap", "rejoined"):
        if name not in but:
            case.assertEqual(getattr(one, name), getattr(other, name), name)
    of_all = "points normals area centroids particle_counts identities parents parent_offsets outer_of"
    for part, names in (("rings", f"{of_all} offsets perimeter cuts wetted contacts contact_angles"),
                        ("mesh", "points triangles classes"),
                        ("surface", f"{of_all} point_offsets triangle_offsets triangles volume cuts")):
        for name in names.split():
            mine, its = (getattr(getattr(each, part), name) for each in (one, other))
            case.assertEqual((mine.dtype, mine.shape, mine.tobytes()), (its.dtype, its.shape, its.tobytes()),
                             f"{part}.{name}")
    for name in ("attributes", "particle_attributes"):
        mine, its = ({key: (values.shape, values.tobytes()) for key, values in getattr(each, name).items()}
                     for each in (one, other))
        case.assertEqual(mine, its, name)
    case.assertEqual(one.particles.shape, other.particles.shape)
    case.assertEqual(one.particles.tobytes(), other.particles.tobytes())
    case.assertEqual(len(one.sections), len(other.sections))
    for mine, its in zip(one.sections, other.sections):
        assert_equal(case, mine, its, but)


class Server:
    """partiemc-server on a new socket, for `with`."""

    def __enter__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.address = f"unix:{self.folder.name}/server.sock"
        return self.start()

    def start(self):
        program = os.environ["PARTIEMC_SERVER_PROGRAM"]
        self.process = subprocess.Popen([program, "--address", self.address],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for _ in range(300):
            ready = subprocess.run([program, "--address", self.address, "--health-check"],
                                   capture_output=True)
            if ready.returncode == 0:
                return self
            time.sleep(0.1)
        self.__exit__()
        raise RuntimeError("the server does not come up")

    def stop(self):
        self.process.kill()
        self.process.wait()

    def __exit__(self, *_):
        self.stop()
        self.folder.cleanup()


class ServerTest(unittest.TestCase):
    """Tests that share a server."""

    @classmethod
    def setUpClass(cls):
        cls.server = Server().__enter__()
        cls.addClassCleanup(cls.server.__exit__)
        cls.address = cls.server.address


def document(path):
    """The text of a file of the project."""
    return pathlib.Path(os.environ["PARTIEMC_SOURCE_DIR"], path).read_text()


def readme():
    """The script of client/python/README.md."""
    return document("client/python/README.md").split("```python\n")[1].split("```")[0]
