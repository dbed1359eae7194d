"""The core in this process: arrays in, views out."""

import _thread
import pickle
import re
import subprocess
import sys
import threading
import time
import unittest
import warnings

import numpy
import partiemc

from scenes import ball, block, digests, digests_of_replay, document


class Layouts(unittest.TestCase):
    def test_every_layout_gives_the_digests_of_replay(self):
        for dtype in (numpy.float32, numpy.float64):
            particles = block(0.25, dtype=dtype)
            expected, = digests_of_replay([particles])
            wide = numpy.zeros((len(particles), 7), dtype)
            wide[:, 3:5] = particles
            record = numpy.zeros(len(particles), [("kind", "i1"), ("x", dtype), ("y", dtype)])
            record["x"], record["y"] = particles.T  # Packed: nothing is aligned.
            spatial = numpy.insert(particles, 1, 5, axis=1)
            layouts = {
                "contiguous": particles,
                "columns of a table": wide[:, 3:5],
                "Fortran's order": numpy.asfortranarray(particles),
                "tuple": (particles[:, 0].copy(), particles[:, 1].copy()),
                "fields of a record": (record["x"], record["y"]),
                "reversed twice": particles[::-1].copy()[::-1],
                "read only": numpy.frombuffer(particles.tobytes(), dtype).reshape(-1, 2),
                "another order of bytes": particles.astype(particles.dtype.newbyteorder()),
            }
            for name, positions in layouts.items():
                with self.subTest(layout=name, dtype=dtype):
                    result = partiemc.reconstruct(positions, spacing=1)
                    self.assertEqual(digests(result), expected)
            result = partiemc.reconstruct(spatial, spacing=1, plane="xz")
            self.assertEqual(digests(result), expected)
        self.assertEqual(digests(partiemc.reconstruct(block().tolist(), spacing=1)),
                         digests(partiemc.reconstruct(block(), spacing=1)))
        self.assertEqual(digests(partiemc.reconstruct(block().astype(int), spacing=1)),
                         digests(partiemc.reconstruct(block(), spacing=1)))

    def test_slices_have_the_axes_that_they_tell(self):
        positions = ball()
        centre = {"x": (20, 30), "y": (10, 30), "z": (10, 20)}
        for axis, at in zip("xyz", (10, 20, 30)):
            section = partiemc.reconstruct(positions, spacing=1, slice=(axis, at + 4))
            self.assertEqual(len(section.rings.offsets), 2)
            self.assertLess(abs(section.area / (numpy.pi * (12 ** 2 - 4 ** 2)) - 1), 0.02)
            middle = section.rings.points.mean(axis=0)
            self.assertLess(abs(middle - centre[axis]).max(), 0.3, axis)

    def test_slices_give_the_digests_of_replay(self):
        positions = ball()
        normal = (1.0, -2.0, 0.5)
        section = partiemc.reconstruct(positions, spacing=1, slice=((10, 20, 30), normal))
        flags = ["--slice", "10,20,30,1,-2,.5"]
        self.assertEqual([digests(section)], digests_of_replay([positions], flags=flags))
        flat = partiemc.Reconstructor(spacing=1, slice=("z", 30))
        self.assertEqual(flat.parameters["slice"], ((0, 0, 30), (0, 0, 1)))
        self.assertEqual([digests(flat.reconstruct(positions))],
                         digests_of_replay([positions], flags=["--slice", "z=30"]))

    def test_sections_give_the_digests_of_replay(self):
        positions = ball()
        sections = [{"isovalue": 0.4}, {"slice": ("x", 12)}, {"slice": ("x", 12), "isovalue": 0.4}]
        result = partiemc.reconstruct(positions, spacing=1, slice=("z", 33), sections=sections)
        self.assertEqual(len(result.sections), 3)
        self.assertIs(result.sections[1], result.sections[1])
        expected = digests_of_replay(
            [positions], flags=["--slice", "z=33", "--slice", "x=12", "--isolines", "0.4"])
        self.assertEqual([digests(each) for each in [result, *result.sections]], expected)
        points = result.sections[1].rings.points
        area = result.sections[1].area
        del result
        self.assertTrue(numpy.isfinite(points).all())
        self.assertAlmostEqual(area, numpy.pi * (12 ** 2 - 2 ** 2), delta=0.02 * area)
        self.assertEqual(sections[0], {"isovalue": 0.4})
        told = partiemc.Reconstructor(spacing=1, isovalue=0.5, sections=sections[:1]).parameters
        self.assertEqual(told["isovalue"], 0.5)
        self.assertEqual(told["sections"], [{"slice": None, "isovalue": 0.4}])

    def test_a_sequence_gives_the_digests_of_replay(self):
        frames = [block(0.3 * k) for k in range(8)]
        sequence = partiemc.Reconstructor(spacing=1, threads=2)
        results = [sequence.reconstruct(frame) for frame in frames]
        self.assertEqual([digests(result) for result in results], digests_of_replay(frames))
        self.assertEqual([result.sequence for result in results], list(range(1, 9)))
        self.assertEqual([result.time for result in results], list(range(8)))
        first = results[0].rings.identities
        self.assertTrue(all((result.rings.identities == first).all() for result in results))
        self.assertEqual(results[1].rings.parents.tolist(), first.tolist())
        sequence.reset()
        self.assertEqual(digests(sequence.reconstruct(frames[0])), digests(results[0]))

    def test_a_layer_across_a_periodic_box_is_cut(self):
        x, y = numpy.meshgrid(numpy.arange(30) + 0.3, numpy.arange(6))
        layer = numpy.column_stack([x.ravel(), y.ravel() + 10])
        drop = numpy.column_stack([x.ravel() % 5 - 2.5, y.ravel() + 20])[::6]
        drop[:, 0] %= 30
        box = {"x": (0, 30), "y": (0, 40)}
        alone = partiemc.reconstruct(layer, spacing=1.0, box=box)
        self.assertAlmostEqual(alone.area, 180, places=6)
        self.assertAlmostEqual(alone.perimeter, 60, places=6)
        rings = alone.rings
        self.assertEqual(len(rings.cuts), 2)
        for k in rings.cuts:
            following = (k + 1) % len(rings.points)
            self.assertEqual(rings.points[k, 0], rings.points[following, 0])
        segments = re.findall(r"M[^MZ]*", alone.to_svg().rsplit("stroke=", 1)[1])
        self.assertEqual(len(segments), len(rings.points) - 2)
        both = numpy.concatenate([layer, drop])
        whole = partiemc.reconstruct(both, spacing=1.0, box=box)
        wrapped = partiemc.reconstruct(both, spacing=1.0, box=box, wrap=True)
        left, right = whole.rings.points[:, 0].min(), whole.rings.points[:, 0].max()
        self.assertTrue(left < 0 or right > 30)  # The drop is whole.
        self.assertGreaterEqual(wrapped.rings.points[:, 0].min(), 0)
        self.assertEqual(len(wrapped.rings), len(whole.rings) + 1)
        numpy.testing.assert_array_equal(pickle.loads(pickle.dumps(wrapped)).rings.cuts,
                                         wrapped.rings.cuts)
        with self.assertRaisesRegex(partiemc.Error, "wrap"):
            partiemc.reconstruct(both, spacing=1.0, wrap=True)

    def test_a_frame_may_have_its_own_box(self):
        x, y = numpy.meshgrid(numpy.arange(30) + 0.3, numpy.arange(6))
        layer = numpy.column_stack([x.ravel(), y.ravel() + 10])
        sequence = partiemc.Reconstructor(spacing=1.0, box={"x": (0, 30)})
        first = sequence.reconstruct(layer)
        wider = sequence.reconstruct(layer * [1.01, 1], box={"x": (0, 30.3)})
        self.assertAlmostEqual(wider.rings.points[:, 0].max(), 30.3, places=6)
        self.assertEqual(wider.rings.identities.tolist(), first.rings.identities.tolist())
        for wrong in ({"y": (0, 30)}, {"x": (0, 30), "y": (0, 40)}, {"x": (0, 5)}, {"u": (0, 9)}, 3):
            with self.assertRaisesRegex(partiemc.Error, "box"):
                sequence.reconstruct(layer, box=wrong)
        with self.assertRaises(partiemc.Error):
            partiemc.Reconstructor(spacing=1.0).reconstruct(layer, box={"x": (0, 30)})

    def test_a_column_wets_the_walls_of_its_tank(self):
        x, y = numpy.meshgrid(numpy.arange(20) + 0.5, numpy.arange(15) + 0.5)
        column = numpy.column_stack([x.ravel(), y.ravel()])
        tank = [0, 0, 40, 0, 40, 30, 0, 30]
        sequence = partiemc.Reconstructor(spacing=1, walls=[tank])
        self.assertEqual(sequence.parameters["walls"], [tank])
        self.assertEqual(partiemc.Reconstructor().parameters["walls"], [])
        result = sequence.reconstruct(column)
        rings = result.rings
        self.assertEqual((rings.wetted.dtype, rings.contacts.dtype), (numpy.uint32, numpy.uint32))
        self.assertGreater(len(rings.wetted), 2)
        wet = rings.points[rings.wetted]
        self.assertTrue((wet.min(axis=1) == 0).all())  # On the floor or on the left side.
        self.assertEqual(len(rings.contacts), 2)
        self.assertEqual(rings.contact_angles.dtype, numpy.float32)
        numpy.testing.assert_allclose(rings.contact_angles, numpy.pi / 2, atol=0.5)
        kept = pickle.loads(pickle.dumps(result)).rings
        for name in ("wetted", "contacts", "contact_angles"):
            numpy.testing.assert_array_equal(getattr(kept, name), getattr(rings, name))
        pairs = numpy.array(tank, dtype=numpy.float32).reshape(-1, 2)
        for walls in ([pairs], numpy.array([tank]), ([(0, 0), (40, 0), (40, 30), (0, 30)],)):
            again = partiemc.Reconstructor(spacing=1, walls=walls).reconstruct(column)
            self.assertEqual(digests(again), digests(result))
        dry = partiemc.reconstruct(column, spacing=1).rings
        self.assertEqual((len(dry.wetted), len(dry.contacts), len(dry.contact_angles)), (0, 0, 0))

    def test_a_noise_filter_moves_particles_with_ids(self):
        random = numpy.random.default_rng(1)
        frames = [block() + random.normal(scale=0.1, size=block().shape) for _ in range(3)]
        ids = numpy.arange(len(frames[0]))
        plain = partiemc.Reconstructor(spacing=1)
        filtered = partiemc.Reconstructor(spacing=1, noise_filter=0.5)
        self.assertEqual(filtered.parameters["noise_filter"], 0.5)
        self.assertIsNone(plain.parameters["noise_filter"])
        for k, frame in enumerate(frames):
            same = digests(filtered.reconstruct(frame, ids=ids)) == digests(
                plain.reconstruct(frame, ids=ids))
            self.assertEqual(same, k == 0)
        with self.assertRaises(partiemc.Error) as caught:
            filtered.reconstruct(frames[0])
        self.assertEqual(caught.exception.field, "ids")

    def test_what_goes_along_counts(self):
        # A drop that leaps over a body: ids and velocities identify it.
        def leap(frame):
            drop = numpy.array([[60.0 * frame + k % 4, 40 + k // 4] for k in range(16)])
            return numpy.concatenate([block(side=20), drop])

        for velocity_dtype in (numpy.float32, numpy.float64):
            for id_dtype in (numpy.int32, numpy.uint32, numpy.int64, numpy.uint64):
                sequence = partiemc.Reconstructor(spacing=1)
                ids = numpy.arange(len(leap(0)), dtype=id_dtype)
                velocities = numpy.zeros((len(ids), 2), velocity_dtype)
                velocities[-16:, 0] = 60
                found = []
                for frame in range(2):
                    result = sequence.reconstruct(leap(frame), frame, ids=ids,
                                                  velocities=velocities)
                    drop = numpy.argmax(result.rings.centroids[:, 1])
                    found.append(int(result.rings.identities[drop]))
                self.assertEqual(found[0], found[1])
        heavy = partiemc.reconstruct(block(), spacing=1, volumes=numpy.full(len(block()), 1.2))
        self.assertGreater(heavy.area, partiemc.reconstruct(block(), spacing=1).area)

    def test_own_sizes_set_the_spacing(self):
        sequence = partiemc.Reconstructor(sizes="own")
        result = sequence.reconstruct(3 * block(), volumes=numpy.full(len(block()), 9))
        self.assertEqual(sequence.parameters["sizes"], "own")
        self.assertEqual(result.spacing, 3)
        equal = partiemc.reconstruct(3 * block(), spacing=3)
        self.assertAlmostEqual(result.area / equal.area, 1, places=3)

    def test_grains_are_lone_components(self):
        sequence = partiemc.Reconstructor(sizes="own", boundary="grains")
        grains = numpy.array([[0, 0], [5, 0], [5, 5]])
        result = sequence.reconstruct(grains, volumes=numpy.array([1, 4, 9]))
        self.assertEqual(sequence.parameters["boundary"], "grains")
        self.assertEqual(len(result.rings), 3)
        self.assertAlmostEqual(result.area / (numpy.pi / 4 * 14), 1, delta=0.05)


class Errors(unittest.TestCase):
    def assert_refused(self, reason, field, **arguments):
        arguments.setdefault("positions", block())
        with self.assertRaises(partiemc.Error) as caught:
            partiemc.reconstruct(**{"spacing": 1, **arguments})
        error = caught.exception
        self.assertEqual((error.reason, error.field), (reason, field), str(error))
        self.assertTrue(error.value and error.rule)
        for part in (error.field, error.value, error.rule):
            self.assertIn(part, str(error))
        return error

    def test_they_tell_what_broke_which_rule(self):
        spoiled = block()
        spoiled[17, 0] = numpy.nan
        error = self.assert_refused("NOT_FINITE", "positions[17].x", positions=spoiled)
        self.assertEqual((error.value, error.code), ("nan", "INVALID_ARGUMENT"))
        again = pickle.loads(pickle.dumps(error))
        self.assertEqual((str(again), again.reason), (str(error), error.reason))
        count = len(block())
        self.assert_refused("COUNT", "positions", positions=numpy.zeros((5, 4)))
        self.assert_refused("COUNT", "positions", positions=numpy.zeros(5))
        self.assert_refused("COUNT", "positions", positions=(numpy.zeros(5), numpy.zeros(4)))
        self.assert_refused("COUNT", "positions", positions=(numpy.zeros(5),))
        self.assert_refused("UNSUPPORTED", "positions", positions=numpy.array([["a", "b"]]))
        self.assert_refused("COUNT", "positions", positions=object())
        self.assert_refused("COUNT", "volumes", volumes=numpy.ones(count - 1))
        self.assert_refused("COUNT", "volumes", volumes=numpy.ones((count, 1)))
        self.assert_refused("COUNT", "volumes", sizes="own")
        self.assert_refused("UNSUPPORTED", "parameters.sizes", sizes="large")
        self.assert_refused("OUT_OF_RANGE", "parameters.boundary", boundary="grains")
        self.assert_refused("UNSUPPORTED", "walls[0]", walls=[0, 0, 1, 0])
        self.assert_refused("UNSUPPORTED", "walls[1]", walls=[[0, 0, 1, 0], "floor"])
        self.assert_refused("UNSUPPORTED", "walls[0]", walls=[numpy.zeros((2, 3))])
        for wall in ([0, 0, 1], [0, 0], [0, 0, 0, 0], [0, 0, 1, numpy.inf]):
            with self.assertRaises(partiemc.Error) as caught:
                partiemc.Reconstructor(walls=[wall])
            self.assertTrue(caught.exception.field.startswith("parameters.walls[0].points"))
        self.assert_refused("COUNT", "ids", ids=numpy.arange(count + 1))
        self.assert_refused("UNSUPPORTED", "ids", ids=numpy.ones(count))
        self.assert_refused("UNSUPPORTED", "ids", ids=numpy.ones(count, numpy.int16))
        self.assert_refused("DUPLICATE", "ids[1]", ids=numpy.ones(count, int))
        self.assert_refused("COUNT", "velocities", velocities=numpy.zeros((count, 3)))
        self.assert_refused("COUNT", "velocities", velocities=numpy.zeros((count - 1, 2)))
        self.assert_refused("OUT_OF_RANGE", "parameters.spacing", spacing=-1)
        for time in (numpy.nan, numpy.inf, -numpy.inf):
            with self.assertRaises(partiemc.Error) as caught:
                partiemc.Reconstructor(spacing=1).reconstruct(block(), time)
            self.assertEqual((caught.exception.reason, caught.exception.field), ("NOT_FINITE", "time"))
        for axis in ("w", "", "xy"):
            self.assert_refused("UNSUPPORTED", "slice", slice=(axis, 1))
        self.assert_refused("UNSUPPORTED", "slice", slice=((0, 0), (0, 0, 1)))
        self.assert_refused("UNSUPPORTED", "slice", slice=3)
        self.assert_refused("UNSUPPORTED", "sections[1]", sections=[{}, {"isovalues": 1}])
        self.assert_refused("OUT_OF_RANGE", "parameters.isovalue", isovalue=11)
        for tolerance in (-0.1, 1.5, numpy.nan):
            self.assert_refused("OUT_OF_RANGE", "parameters.attribute_tolerance",
                                attribute_tolerance=tolerance)
        self.assert_refused("OUT_OF_RANGE", "parameters.sections[0].slice",
                            sections=[{"slice": ("z", 0)}])
        self.assert_refused("OUT_OF_RANGE", "parameters.slice.normal", spacing=1,
                            slice=((0, 0, 0), (0, 0, 0)))
        self.assert_refused("OUT_OF_RANGE", "parameters.spacing", spacing=None, slice=("z", 0))
        self.assert_refused("OUT_OF_RANGE", "components", spacing=1, slice=("z", 0))
        error = self.assert_refused("UNSUPPORTED", "parameters.fill", fill="mostly")
        self.assertIn("greedy", error.rule)

    def test_a_refused_frame_leaves_no_trace(self):
        sequence, untouched = (partiemc.Reconstructor(spacing=1) for _ in range(2))
        sequence.reconstruct(block())
        untouched.reconstruct(block())
        with self.assertRaises(partiemc.Error):
            sequence.reconstruct(numpy.full((3, 2), numpy.inf))
        results = [each.reconstruct(block(0.3)) for each in (sequence, untouched)]
        self.assertEqual(digests(results[0]), digests(results[1]))
        self.assertEqual(results[0].sequence, 2)

    def test_unknown_names_are_told(self):
        with self.assertRaisesRegex(TypeError, "spaceing"):
            partiemc.reconstruct(block(), spaceing=1)
        with self.assertRaisesRegex(TypeError, "spacing"):
            partiemc.reconstruct(block(), spacing="wide")


class Doubts(unittest.TestCase):
    def doubts_of(self, call):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            result = call()
        for one in caught:
            self.assertIs(one.category, partiemc.PartiemcWarning)
            self.assertEqual(one.filename, __file__)
        kinds = [str(one.message).split(":")[0] for one in caught]
        return result, kinds

    def test_each_kind_warns_once(self):
        sequence = partiemc.Reconstructor(spacing=9)
        result, kinds = self.doubts_of(lambda: sequence.reconstruct(block()))
        self.assertEqual(kinds, ["spacing-contradicted"])
        self.assertEqual(result.doubts, kinds)
        small = numpy.full(len(block()), 1e-3)
        result, kinds = self.doubts_of(lambda: sequence.reconstruct(block(), volumes=small))
        self.assertEqual(kinds, ["volumes-contradict-spacing"])
        self.assertEqual(result.doubts, ["spacing-contradicted", "volumes-contradict-spacing"])
        _, kinds = self.doubts_of(lambda: sequence.reconstruct(block(), volumes=small))
        self.assertEqual(kinds, [])
        _, kinds = self.doubts_of(lambda: partiemc.reconstruct(block(), spacing=9))
        self.assertEqual(kinds, ["spacing-contradicted"])
        _, kinds = self.doubts_of(lambda: partiemc.reconstruct(block(), spacing=1))
        self.assertEqual(kinds, [])

    def test_a_warning_can_be_an_error(self):
        with warnings.catch_warnings():
            warnings.simplefilter("error", partiemc.PartiemcWarning)
            with self.assertRaises(partiemc.PartiemcWarning) as raised:
                partiemc.reconstruct(block(), spacing=9)
            warnings.simplefilter("ignore", partiemc.PartiemcWarning)
            expected = partiemc.reconstruct(block(), spacing=9)
        self.assertEqual(digests(raised.exception.result), digests(expected))

    def test_a_thread_without_a_python_frame_warns_too(self):
        sequence = partiemc.Reconstructor(spacing=9)
        unraisable = []
        hook, sys.unraisablehook = sys.unraisablehook, unraisable.append
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                _thread.start_new_thread(sequence.reconstruct, (block(),))
                until = time.monotonic() + 30
                while not caught and not unraisable and time.monotonic() < until:
                    time.sleep(0.01)
        finally:
            sys.unraisablehook = hook
        self.assertEqual(unraisable, [])
        self.assertEqual([one.category for one in caught], [partiemc.PartiemcWarning])

    def test_the_readme_lists_every_kind(self):
        header = document("core/include/partiemc/doubt.h")
        kinds = re.search(r"enum class Doubt.*?};", header, re.DOTALL).group()
        names = [re.sub("(?<!^)([A-Z])", r"-\1", name).lower()
                 for name in re.findall(r"^  k(\w+),$", kinds, re.MULTILINE)]
        self.assertEqual(len(names), 5)
        readme = document("client/python/README.md")
        self.assertIn("PartiemcWarning", readme)
        self.assertEqual([name for name in names if f"| `{name}` |" not in readme], [])


class Threads(unittest.TestCase):
    def test_others_run_while_a_frame_is_computed(self):
        sequence = partiemc.Reconstructor(spacing=1)
        particles = block(side=1000)
        done = threading.Event()
        worker = threading.Thread(target=lambda: (sequence.reconstruct(particles), done.set()))
        worker.start()
        turns = 0
        while not done.is_set():
            turns += 1
            done.wait(0.001)
        worker.join()
        self.assertGreater(turns, 2)  # One if the GIL is held; a busy machine gives few.

    def test_many_threads_get_the_same_bits(self):
        expected = digests(partiemc.reconstruct(block(side=60), spacing=1))
        found = []
        workers = [threading.Thread(target=lambda: found.append(
            digests(partiemc.reconstruct(block(side=60), spacing=1)))) for _ in range(4)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        self.assertEqual(found, [expected] * 4)


class Import(unittest.TestCase):
    def test_it_takes_no_numpy_and_no_converter(self):
        script = ("import sys, partiemc\n"
                  "print([m for m in ('numpy', 'shapely', 'matplotlib', 'meshio')"
                  " if m in sys.modules])")
        ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
        self.assertEqual(ran.stdout, "[]\n", ran.stderr)


if __name__ == "__main__":
    unittest.main()
