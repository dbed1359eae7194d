"""Closed surfaces of particles in space, in this process and through a server."""

import contextlib
import copy
import io
import pickle
import tempfile
import unittest

import numpy
import partiemc

from scenes import Server, assert_equal, ball, digests_of_replay


def balls(shift=0.0):
    """Two balls of particles, `shift` to the right: (N, 3)."""
    return numpy.concatenate([ball((shift, 0, 0), 5), ball((12 + shift, 0, 0), 3)])


class Surfaces(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.particles = balls()
        x, y, z = cls.particles.T
        cls.result = partiemc.reconstruct(
            cls.particles, output="surface", spacing=1, ids=numpy.arange(len(x)),
            attributes={"x": x, "where": cls.particles}, sections=[{"slice": ("z", 0.2)}])

    def test_spacing_is_estimated_on_request(self):
        self.assertAlmostEqual(partiemc.estimate_spacing(self.particles), 1)
        self.assertAlmostEqual(
            partiemc.estimate_spacing((.01 * self.particles).astype(numpy.float32)), .01)
        self.assertAlmostEqual(partiemc.estimate_spacing(self.particles.T[0:2].copy().T[:9]), 1)
        self.assertIsNone(partiemc.estimate_spacing(self.particles[:1]))
        with self.assertRaises(partiemc.Error):
            partiemc.estimate_spacing(numpy.zeros((3, 4)))

    def test_estimated_spacing_gives_the_surface_of_replay(self):
        estimated = partiemc.estimate_spacing(self.particles)
        made = partiemc.reconstruct(self.particles, output="surface", spacing=float(f"{estimated:.4g}"))
        self.assertEqual([f"{made.surface_digest:016x}"], digests_of_replay(
            [self.particles], spacing="first-frame", flags=["--surface"], columns=["surface_digest"]))

    def test_shapes_and_values_are_as_documented(self):
        result, surface = self.result, self.result.surface
        count, points = len(surface), len(surface.points)
        self.assertEqual(count, 2)
        self.assertEqual(surface.points.shape, (points, 3))
        self.assertEqual(surface.normals.shape, (points, 3))
        numpy.testing.assert_allclose(numpy.linalg.norm(surface.normals, axis=1), 1, atol=1e-6)
        self.assertEqual(sum(len(triangles) for triangles in surface), len(surface.triangles))
        self.assertEqual(surface.point_offsets[-1], points)
        self.assertEqual(surface.outer_of.tolist(), [-1, -1])
        self.assertEqual(surface.parent_offsets.tolist(), [0, 0, 0])
        self.assertEqual(sorted(surface.identities), [1, 2])
        self.assertEqual(surface.particle_counts.sum(), len(self.particles))
        numpy.testing.assert_allclose(surface.volume, surface.particle_counts, rtol=.002)
        numpy.testing.assert_allclose(result.volume, surface.volume.sum())
        numpy.testing.assert_allclose(result.area, surface.area.sum())
        numpy.testing.assert_allclose(numpy.sort(surface.centroids[:, 0]), [0, 12], atol=.1)
        self.assertEqual((len(result.rings), len(result.mesh)), (0, 0))
        surface.check()
        for index in (2, -3):
            with self.assertRaises(IndexError):
                surface[index]
        self.assertFalse(surface.points.flags.writeable)
        self.assertIs(surface.points.base, result)

    def test_triangles_enclose_the_volume(self):
        surface = self.result.surface
        for k, triangles in enumerate(surface):
            a, b, c = surface.points[triangles].transpose(1, 0, 2)
            volume = (a * numpy.cross(b, c)).sum() / 6
            self.assertAlmostEqual(volume, surface.volume[k], delta=1e-6 * surface.volume[k])

    def test_attributes_are_at_its_points(self):
        points = self.result.surface.points
        attributes = self.result.attributes
        numpy.testing.assert_allclose(attributes["x"], points[:, 0], atol=.6)
        numpy.testing.assert_allclose(attributes["where"], points, atol=.6)
        self.assertEqual(len(self.result.sections[0].rings), 2)

    def test_a_sequence_keeps_identities(self):
        sequence = partiemc.Reconstructor(output="surface", spacing=1)
        self.assertEqual(sequence.parameters["output"], "surface")
        ids = numpy.arange(len(self.particles))
        first = sequence.reconstruct(self.particles, ids=ids).surface
        order = numpy.random.default_rng(1).permutation(len(ids))
        moved = sequence.reconstruct((self.particles + .3)[order], ids=ids[order])
        self.assertEqual(sorted(moved.surface.identities), sorted(first.identities))
        self.assertEqual(sorted(moved.surface.parents), sorted(first.identities))
        self.assertNotEqual(moved.surface_digest, 0)

    def test_simplified_ones_have_fewer_triangles(self):
        simplified = partiemc.reconstruct(self.particles, output="surface", spacing=1, simplify=.1)
        simplified.surface.check()
        self.assertLess(len(simplified.surface.triangles), .5 * len(self.result.surface.triangles))

    def test_meshio_takes_them(self):
        try:
            import meshio
        except ImportError:
            self.skipTest("NOT TESTED: there is no meshio (Debian: python3-meshio)")
        surface = self.result.surface
        for extension in ("vtu", "ply", "obj", "stl"):
            with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
                surface.to_meshio().write(f"{folder}/surface.{extension}")
                read = meshio.read(f"{folder}/surface.{extension}")
            self.assertEqual(sum(len(cells.data) for cells in read.cells), len(surface.triangles))
        mesh = surface.to_meshio(self.result.attributes)
        self.assertEqual(mesh.point_data["where"].shape, surface.points.shape)

    def test_svg_is_of_outlines(self):
        with self.assertRaisesRegex(ValueError, "is a surface.*sections.*to_meshio"):
            self.result.to_svg()
        self.assertIn("<path", self.result.sections[0].to_svg())

    def test_what_they_do_not_take_is_told(self):
        for arguments, field in (({}, "parameters.spacing"),
                                 ({"spacing": 1, "slice": ("z", 0)}, "parameters.slice"),
                                 ({"spacing": 1, "thinning_distance": -1},
                                  "parameters.surface.thinning_distance")):
            with self.assertRaises(partiemc.Error) as raised:
                partiemc.reconstruct(self.particles, output="surface", **arguments)
            self.assertEqual(raised.exception.field, field)
        for call in (lambda: partiemc.reconstruct(self.particles, output="surface"),
                     lambda: partiemc.reconstruct(self.particles, slice=("z", 0)),
                     lambda: partiemc.Reconstructor(output="surface"),
                     lambda: partiemc.connect("unix:/nowhere", output="surface")):
            with self.assertRaises(partiemc.Error) as raised:
                call()
            self.assertEqual((raised.exception.field, raised.exception.value), ("parameters.spacing", "absent"))
            self.assertIn("partiemc.estimate_spacing(positions)", raised.exception.rule)
        with self.assertRaises(partiemc.Error) as raised:
            partiemc.reconstruct(self.particles[:, :2], output="surface", spacing=1)
        self.assertEqual(raised.exception.field, "components")

    def test_they_pickle_and_copy(self):
        for fresh in (True, False):  # Sections as Python objects are made at the first access.
            again = pickle.loads(pickle.dumps(self.result))
            assert_equal(self, again, self.result)
            self.assertIs(again.surface.points.base, again)
        for copied in (copy.copy(self.result), copy.deepcopy(self.result), pickle.loads(pickle.dumps(again))):
            assert_equal(self, copied, self.result)
            copied.surface.check()
        surface = self.result.surface
        for its in (pickle.loads(pickle.dumps(surface)), copy.copy(surface), copy.deepcopy(surface)):
            self.assertEqual(its.points.tobytes(), surface.points.tobytes())
        empty = partiemc.reconstruct(self.particles[:0], output="surface", spacing=1)
        self.assertEqual((len(empty.surface), empty.surface.points.shape), (0, (0, 3)))
        assert_equal(self, pickle.loads(pickle.dumps(empty)), empty)

    def test_damaged_states_are_refused(self):
        state = self.result.__getstate__()
        points = self.result.surface.points.tobytes()
        self.assertIn(points, state[0])
        # An offset that no shell can have, in the place of the last.
        offsets = self.result.surface.point_offsets.tobytes()
        self.assertEqual(state[0].count(offsets), 1)
        wrong = state[0].replace(offsets, offsets[:-4] + bytes(4))
        for damaged, error in (((*state[:6],), ValueError), ((state[0][:-1], *state[1:]), ValueError),
                               ((*state[:2], bytes(16), *state[3:]), ValueError),
                               ((wrong, *state[1:]), partiemc.Error)):
            with self.assertRaises(error):
                self.result.__class__.__new__(self.result.__class__).__setstate__(damaged)


class Streams(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Server().__enter__()
        cls.addClassCleanup(cls.server.__exit__)
        cls.address = cls.server.address
        cls.positions = [balls(.3 * k) for k in range(4)]
        ids = numpy.arange(len(cls.positions[0]))
        order = [numpy.random.default_rng(k).permutation(ids) for k in range(4)]
        cls.frames = [{"positions": each[order[k]], "ids": ids[order[k]], "time": .5 * k,
                       "velocities": numpy.full_like(each, .6), "volumes": numpy.full(len(each), 1.1),
                       "attributes": {"x": each[order[k], 0], "where": each[order[k]]}}
                      for k, each in enumerate(cls.positions)]
        cls.parameters = {"output": "surface", "spacing": 1, "sections": [{"slice": ("z", 0.2)}]}

    def made_here(self, **more):
        sequence = partiemc.Reconstructor(**self.parameters, **more)
        return [sequence.reconstruct(**frame) for frame in self.frames]

    def made_there(self, **more):
        names = ["x", "where"]
        with partiemc.connect(self.address, attributes=names, **self.parameters, **more) as stream:
            self.assertEqual(stream.parameters["output"], "surface")
            return list(stream.map(self.frames))

    def test_results_are_those_of_this_process(self):
        for more in ({}, {"simplify": .05}, {"max_drop_particles": 0, "thinning_distance": 0},
                     {"min_component_volume": 200}, {"placement": "qef", "min_component_particles": 200},
                     {"placement": "marching-squares"}):
            with self.subTest(**more):
                here, there = self.made_here(**more), self.made_there(**more)
                self.assertEqual(len(there), 4)
                for mine, its in zip(there, here):
                    self.assertNotEqual(mine.surface_digest, 0)
                    assert_equal(self, mine, its, but=["times"])
                    self.assertEqual(list(mine.attributes), ["x", "where"])
                    self.assertGreater(mine.volume, 0)
                self.assertTrue(set(there[3].surface.parents) <= set(there[2].surface.identities))
                self.assertEqual(len(there[3].surface.parents), len(there[3].surface))

    def test_digests_are_those_of_replay(self):
        expected = digests_of_replay(self.positions, flags=["--surface", "--simplify", ".05"],
                                     columns=["surface_digest"])
        with partiemc.connect(self.address, output="surface", spacing=1, simplify=.05) as stream:
            results = list(stream.map(self.positions))
        self.assertEqual([f"{result.surface_digest:016x}" for result in results], expected)
        results[-1].surface.check()

    def test_rounded_coordinates_are_near_the_exact_ones(self):
        exact = self.made_there()
        for coordinates, most in (("float32", 1e-5), ("compact", .0009)):
            for mine, its in zip(self.made_there(coordinates=coordinates), exact):
                assert_equal(self, mine, mine)
                self.assertEqual(mine.surface_digest, its.surface_digest)
                self.assert_near(mine, its, most)
                again = pickle.loads(pickle.dumps(mine))
                assert_equal(self, again, mine)

    def assert_near(self, one, other, most):
        """The same triangles, in any order within a shell; points are at most `most` away."""
        mine, its = one.surface, other.surface
        self.assertNotEqual(mine.points.tobytes(), its.points.tobytes())
        for name in ("point_offsets", "triangle_offsets", "outer_of", "identities", "volume", "parents"):
            numpy.testing.assert_array_equal(getattr(mine, name), getattr(its, name))
        distances = numpy.linalg.norm(mine.points[:, None] - its.points, axis=-1)
        partner = distances.argmin(axis=1)
        self.assertLess(distances.min(axis=1).max(), most * 3 ** .5)
        self.assertEqual(len(set(partner)), len(its.points))
        self.assertGreater((mine.normals * its.normals[partner]).sum(axis=1).min(), numpy.cos(numpy.radians(1)))
        for name, values in one.attributes.items():
            numpy.testing.assert_allclose(values, other.attributes[name][partner], atol=1e-6)

        def smallest_first(triangles):
            return sorted(min(tuple(numpy.roll(row, k)) for k in range(3)) for row in triangles.tolist())

        self.assertEqual(smallest_first(partner[mine.triangles]), smallest_first(its.triangles))

    def test_watchers_see_surfaces_and_particles(self):
        with partiemc.connect(self.address, name="bodies", echo_particles=True, **self.parameters) as stream:
            with partiemc.watch(self.address, "bodies", mode="every") as watch:
                self.assertEqual(watch.parameters["output"], "surface")
                for frame in self.frames:
                    stream.send(**frame)
                    made, seen = stream.receive(), next(watch)
                    self.assertEqual(made.particles.shape, (0, 3))
                    self.assertEqual(seen.particles.shape, (len(frame["positions"]), 3))
                    self.assertTrue((seen.particles == frame["positions"]).all())
                    self.assertEqual(seen.surface_digest, made.surface_digest)
                    self.assertEqual(seen.surface.triangles.tobytes(), made.surface.triangles.tobytes())
                    self.assertEqual(seen.sections[0].particles.shape, (0, 2))
                    assert_equal(self, pickle.loads(pickle.dumps(seen)), seen)
                    assert_equal(self, copy.deepcopy(seen), seen)
                stream.send(self.positions[0][:0])
                self.assertEqual((len(stream.receive().surface), next(watch).particles.shape), (0, (0, 3)))
                state = seen.__getstate__()
                with self.assertRaisesRegex(ValueError, "damaged"):
                    seen.__class__.__new__(seen.__class__).__setstate__((*state[:2], bytes(16), *state[3:]))

    def test_watchers_choose_a_level_of_detail(self):
        levels = ({"max_error": .1}, {"max_triangles": 300}, {"max_triangles": 1}, {})
        with contextlib.ExitStack() as opened:
            stream = opened.enter_context(partiemc.connect(self.address, name="levels", attributes=["x"],
                                                           **self.parameters))
            watches = [opened.enter_context(partiemc.watch(self.address, "levels", mode="every", **level))
                       for level in levels]
            for frame in self.frames:
                stream.send(**frame)
                made, seen = stream.receive(), [next(watch) for watch in watches]
                self.assertIsNone(made.level_error)
                exact = seen.pop()
                assert_equal(self, exact, made, but=["particles"])
                self.assert_levels(seen, made)
            self.assertEqual([level.level_error for level in seen][::2], [.1, .35])
            self.assertLessEqual(len(seen[1].surface.triangles), 300)

    def assert_levels(self, levels, exact):
        """Closed surfaces of points of the exact one, with its measures."""
        points = {point.tobytes(): value for point, value in zip(exact.surface.points, exact.attributes["x"])}
        for level in levels:
            surface = level.surface
            self.assertLess(len(surface.triangles), len(exact.surface.triangles))
            self.assertEqual([points[point.tobytes()] for point in surface.points], list(level.attributes["x"]))
            edges = surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
            self.assertEqual(sorted(map(tuple, edges)), sorted(map(tuple, edges[:, ::-1])))
            for name in ("identities", "volume", "area", "particle_counts", "outer_of"):
                numpy.testing.assert_array_equal(getattr(surface, name), getattr(exact.surface, name))
            self.assertEqual((level.volume, level.surface_digest), (exact.volume, exact.surface_digest))
            self.assertNotEqual(level.level_digest, exact.surface_digest)
            assert_equal(self, pickle.loads(pickle.dumps(level)), level)

    def test_an_impossible_level_is_told(self):
        for arguments, field in (({"max_error": 0}, ".max_error"), ({"max_error": 1.5}, ".max_error"),
                                 ({"max_error": numpy.nan}, ".max_error"), ({"max_triangles": 0}, ".max_triangles"),
                                 ({"max_error": .1, "max_triangles": 9}, "")):
            with self.assertRaises(partiemc.Error) as raised:
                partiemc.watch(self.address, "levels", **arguments)
            self.assertEqual((raised.exception.reason, raised.exception.field), ("OUT_OF_RANGE", "level_of_detail" + field))
        for wrong in ({"max_triangles": -1}, {"max_triangles": .5}, {"max_error": "small"}):
            with self.assertRaisesRegex(TypeError, next(iter(wrong))):
                partiemc.watch(self.address, "levels", **wrong)
        with partiemc.connect(self.address, name="flat", spacing=1):
            with self.assertRaises(partiemc.Error) as raised:
                partiemc.watch(self.address, "flat", max_error=.1)
            self.assertIn("open.level_of_detail: set; must be absent", str(raised.exception))

    def test_latest_delivers_the_newest(self):
        with partiemc.connect(self.address, latest=True, output="surface", spacing=1) as stream:
            *_, newest = stream.map(self.positions)
        self.assertEqual(newest.time, 3)
        self.assertEqual(newest.surface_digest,
                         partiemc.reconstruct(self.positions[3], output="surface", spacing=1).surface_digest)

    def test_what_they_do_not_take_is_told(self):
        for arguments, field in (({}, "parameters.spacing"), ({"spacing": 1, "simplify": 2}, "parameters.surface.simplify"),
                                 ({"spacing": 1, "coordinates": "float16"}, "outputs.coordinates")):
            with self.assertRaises(partiemc.Error) as raised:
                partiemc.connect(self.address, output="surface", **arguments)
            self.assertEqual(raised.exception.field, field)
        self.assertEqual(raised.exception.rule, "must be float64, float32, compact")
        with self.assertRaisesRegex(TypeError, "coordinates"):
            partiemc.reconstruct(self.positions[0], output="surface", spacing=1, coordinates="float64")
        with partiemc.connect(self.address, output="surface", spacing=1) as stream:
            stream.send(self.positions[0][:, :2])
            with self.assertRaises(partiemc.Error) as raised:
                stream.receive()
            self.assertEqual(raised.exception.field, "components")
            stream.send(self.positions[0])
            self.assertEqual(len(stream.receive().surface), 2)


if __name__ == "__main__":
    unittest.main()
