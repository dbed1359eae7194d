"""Results of the core in this process: views, values, pickles, attributes and other libraries."""

import contextlib
import copy
import gc
import io
import pickle
import re
import tempfile
import tracemalloc
import unittest

import numpy
import partiemc

from scenes import assert_equal, block, digests, document


class Results(unittest.TestCase):
    def setUp(self):
        self.result = partiemc.reconstruct(block(), spacing=1)

    def test_attributes_come_back_at_the_vertices(self):
        particles = block()
        x, y = particles.T
        wide = numpy.zeros((len(particles), 3), numpy.float32)
        wide[:, 1] = 3 * x - y
        plain = partiemc.reconstruct(particles, spacing=1)
        self.assertEqual(plain.attributes, {})
        result = partiemc.reconstruct(
            particles, spacing=1, attributes={"pressure": wide[:, 1], "flow": (y, -x)})
        self.assertEqual(result.rings.points.tolist(), plain.rings.points.tolist())
        pressure, flow = result.attributes["pressure"], result.attributes["flow"]
        at_x, at_y = result.mesh.points.T
        self.assertEqual((pressure.dtype, pressure.shape, flow.shape),
                         (numpy.float32, at_x.shape, (len(at_x), 2)))
        error = 0.01 * numpy.ptp(3 * x - y)
        self.assertLess(numpy.abs(pressure - (3 * at_x - at_y)).max(), error)
        self.assertLess(numpy.abs(flow - numpy.stack((at_y, -at_x), axis=1)).max(), error)
        self.assertFalse(pressure.flags.writeable)
        outline = partiemc.reconstruct(particles, spacing=1, fill="none",
                                       attributes={"pressure": wide[:, 1]})
        points = outline.rings.points
        coarse = partiemc.reconstruct(particles, spacing=1, attributes={"pressure": wide[:, 1]},
                                      attribute_tolerance=1)
        self.assertEqual(digests(coarse), digests(plain))
        self.assertEqual(outline.attributes["pressure"].tolist(), pressure[:len(points)].tolist())

    def test_wrong_attributes_are_told(self):
        particles = block()
        for given, reason in (([1, 2], "UNSUPPORTED"), ({1: particles[:, 0]}, "UNSUPPORTED"),
                              ({"p": particles[1:, 0]}, "COUNT"),
                              ({"p": numpy.zeros((len(particles), 4))}, "COUNT"),
                              ({"p": numpy.full(len(particles), numpy.nan)}, "NOT_FINITE")):
            with self.assertRaises(partiemc.Error) as raised:
                partiemc.reconstruct(particles, spacing=1, attributes=given)
            self.assertEqual(raised.exception.reason, reason, raised.exception)

    def test_shapes_and_values_are_as_documented(self):
        rings, mesh = self.result.rings, self.result.mesh
        self.assertEqual(len(rings), 2)
        points = int(rings.offsets[-1])
        shapes = {"points": (points, 2), "offsets": (3,), "outer_of": (2,), "normals": (points, 2),
                  "area": (2,), "perimeter": (2,), "centroids": (2, 2), "particle_counts": (2,),
                  "identities": (2,), "parents": (0,), "parent_offsets": (3,)}
        for name, shape in shapes.items():
            self.assertEqual(getattr(rings, name).shape, shape, name)
        self.assertEqual(mesh.points.shape[1], 2)
        self.assertEqual(mesh.triangles.shape, (len(mesh), 3))
        self.assertEqual(mesh.classes.shape, (len(mesh),))
        self.assertEqual(sorted(rings.outer_of.tolist()), [-1, int(numpy.argmax(rings.area))])
        self.assertAlmostEqual(rings.area.sum(), self.result.area)
        self.assertLess(abs(self.result.area / len(block()) - 1), .02)
        self.assertEqual(self.result.particle_count, len(block()))
        self.assertEqual((self.result.spacing, self.result.cell_size), (1, 1))
        self.assertEqual(self.result.doubts, [])
        self.assertIn("vertices", self.result.times)
        corners = mesh.points[mesh.triangles]
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        areas = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
        self.assertTrue((areas > 0).all())
        self.assertAlmostEqual(areas.sum(), self.result.area)
        self.assertEqual([len(ring) for ring in rings], numpy.diff(rings.offsets).tolist())
        self.assertTrue((rings[-1] == rings.points[rings.offsets[1]:]).all())
        with self.assertRaises(IndexError):
            rings[2]

    def test_arrays_are_views_that_keep_their_result(self):
        rings = self.result.rings
        address = rings.points.__array_interface__["data"][0]
        self.assertEqual(rings.points.__array_interface__["data"][0], address)  # Not a new array.
        self.assertIs(rings.points.base, self.result)
        self.assertIs(self.result.mesh.triangles.base, self.result)
        second = rings[1].__array_interface__["data"][0]
        self.assertEqual(second, address + 16 * int(rings.offsets[1]))
        measures = [rings.area, rings.perimeter, rings.identities]
        starts = [array.__array_interface__["data"][0] for array in measures]
        self.assertEqual(starts[1] - starts[0], 8)  # Columns of one table.
        self.assertGreater(measures[0].strides[0], 8)
        for array in (rings.points, rings.offsets, rings.area, rings[0], self.result.mesh.points):
            self.assertFalse(array.flags.owndata)
            with self.assertRaises(ValueError):
                array[0] = 7

        points, expected = rings.points, rings.points.copy()
        del rings, measures
        self.result = None
        gc.collect()
        for k in range(20):
            partiemc.reconstruct(block(k), spacing=1)  # Overwrites freed memory.
        self.assertTrue((points == expected).all())
        self.assertEqual(points.__array_interface__["data"][0], address)

    def test_nothing_of_numpys_is_allocated_for_a_frame(self):
        wide = numpy.zeros((200_000, 7))
        wide[:, 0], wide[:, 3] = numpy.divmod(numpy.arange(len(wide)), 400)
        ids = numpy.arange(2 * len(wide), dtype=numpy.int32)[::2]
        sequence = partiemc.Reconstructor(spacing=1)
        tracemalloc.start()
        try:
            result = sequence.reconstruct((wide[:, 0], wide[:, 3]), ids=ids)
            seen = [result.rings.points, result.mesh.points, result.mesh.triangles]
            _, peak = tracemalloc.get_traced_memory()
            self.assertLess(peak, 100_000)
            copy = wide[:, 0].copy()  # The counter must see a copy.
            self.assertGreater(tracemalloc.get_traced_memory()[1], copy.nbytes)
        finally:
            tracemalloc.stop()
        self.assertEqual(len(seen), 3)

    def test_they_pickle_and_copy(self):
        particles = block()
        x, y = particles.T
        sequence = partiemc.Reconstructor(spacing=1, sections=[{"isovalue": 0.3}])
        sequence.reconstruct(particles, 0.5)
        result = sequence.reconstruct(particles, 1.5, attributes={"p": x, "v": (y, x)})
        for protocol in (0, 1):
            with self.assertRaisesRegex(TypeError, "requires protocol 2"):
                pickle.dumps(result, protocol)
        for fresh in (True, False):  # Sections as Python objects are made at the first access.
            again = pickle.loads(pickle.dumps(result))
            assert_equal(self, again, result)
            self.assertIs(again.rings.points.base, again)
        for copied in (copy.copy(result), copy.deepcopy(result), pickle.loads(pickle.dumps(again))):
            assert_equal(self, copied, result)
        for part in ("rings", "mesh"):
            mine = getattr(result, part)
            for its in (pickle.loads(pickle.dumps(mine)), copy.copy(mine), copy.deepcopy(mine)):
                self.assertEqual(its.points.tolist(), mine.points.tolist())
        state = result.__getstate__()
        for damaged in (state[:5], (state[0][:-1], *state[1:]),
                        (*state[:2], bytes(15), *state[3:])):
            with self.assertRaises(ValueError):
                result.__class__.__new__(result.__class__).__setstate__(damaged)
        former = result.__class__.__new__(result.__class__)
        former.__setstate__(state[:6])  # Of a version without surfaces.
        assert_equal(self, former, result)
        for outline in (partiemc.reconstruct(particles, spacing=1, fill="none", attributes={"p": x}),
                        partiemc.reconstruct(particles[:0], spacing=1)):
            assert_equal(self, pickle.loads(pickle.dumps(outline)), outline)

    def test_fills_have_attributes_as_the_readme_says(self):
        table = re.findall(r'^\| `"(\w+)"`.*?\| at `(\w+)\.points`(.*?) \| (.*?) \|$',
                           document("client/python/README.md"), re.MULTILINE)
        self.assertEqual([row[0] for row in table],
                         ["greedy", "conforming", "polygon", "grid", "none"])
        particles = block(side=60)

        def wave(points):
            return numpy.sin(points[:, 0] / 6) * numpy.cos(points[:, 1] / 8)

        errors, triangles = {}, {}
        for fill, part, more, interpolates in table:
            result = partiemc.reconstruct(particles, spacing=1, fill=fill,
                                          attributes={"wave": wave(particles)})
            at = getattr(result, part).points
            self.assertEqual(result.attributes["wave"].shape, (len(at),))
            if "equal to `rings.points`" in more:
                self.assertEqual(at.tolist(), result.rings.points.tolist())
            if fill == "none":
                self.assertEqual(len(result.mesh), 0)
                continue
            triangles[fill] = len(result.mesh)
            corners = at[result.mesh.triangles]
            sides = corners[:, 1:] - corners[:, :1]
            area = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
            found = result.attributes["wave"][result.mesh.triangles].mean(axis=1)
            errors[fill] = numpy.average(abs(found - wave(corners.mean(axis=1))), weights=area)
            try:
                from matplotlib.tri import TrapezoidMapTriFinder
            except ImportError:
                continue
            if interpolates == "no":
                with self.assertRaises(RuntimeError):
                    TrapezoidMapTriFinder(result.mesh.to_triangulation())
            else:
                TrapezoidMapTriFinder(result.mesh.to_triangulation())
        self.assertLess(3 * max(errors["greedy"], errors["grid"]),
                        min(errors["conforming"], errors["polygon"]))
        self.assertLess(triangles["polygon"], triangles["grid"])
        self.assertLess(triangles["greedy"], triangles["grid"])

    def test_no_particles_are_an_empty_result(self):
        result = partiemc.reconstruct(numpy.zeros((0, 2)), spacing=1)
        self.assertEqual((len(result.rings), len(result.mesh)), (0, 0))
        self.assertEqual(result.rings.points.shape, (0, 2))
        self.assertEqual(result.rings.offsets.tolist(), [0])
        self.assertTrue(result.to_svg().startswith("<svg"))

    def test_gauges_measure_the_outline(self):
        rings = partiemc.reconstruct(block(), spacing=1).rings
        (left, bottom), (right, top) = rings.points.min(axis=0), rings.points.max(axis=0)
        middle = (left + right) / 2
        heights = rings.heights_at(middle)
        reading = rings.gauge("height", x=middle)
        self.assertEqual((reading["lowest"], reading["highest"]), (heights[0], heights[-1]))
        self.assertEqual(reading["crossings"], len(heights))
        self.assertEqual(rings.gauge("front", dx=1, dy=0)["position"], right)
        whole = rings.gauge("box", min_x=left - 1, min_y=bottom - 1, max_x=right + 1, max_y=top + 1)
        self.assertAlmostEqual(whole["area"], rings.area.sum())
        wetted = rings.gauge("wetted", x0=middle, y0=bottom - 1, x1=middle, y1=top + 1)
        self.assertAlmostEqual(wetted["length"], (heights[1::2] - heights[::2]).sum())

    def test_packing_of_touching_discs(self):
        box = {"min_x": 2.5, "min_y": 2.5, "max_x": 6.5, "max_y": 6.5}
        positions = numpy.stack(numpy.meshgrid(numpy.arange(12.0), numpy.arange(12.0)), axis=-1).reshape(-1, 2)
        rings = partiemc.reconstruct(positions, spacing=1).rings
        radii = numpy.full(len(positions), 0.5)
        for sizes in ({"radii": radii}, {"volumes": numpy.pi * radii ** 2}):
            packing = rings.gauge("packing", positions=positions, **sizes, **box)
            self.assertAlmostEqual(packing["fraction"], numpy.pi / 4, 6)
        for wrong in ({}, {"positions": positions}, {"positions": positions, "radii": radii, "volumes": radii},
                      {"positions": positions, "radii": radii[1:]}, {"positions": radii, "radii": radii},
                      {"positions": positions, "radii": -radii}, {"positions": positions, "volumes": radii * numpy.nan}):
            with self.assertRaises(partiemc.Error):
                rings.gauge("packing", **wrong, **box)
        with self.assertRaises(partiemc.Error):
            rings.gauge("box", positions=positions, **box)

    def test_gauges_refuse_wrong_arguments(self):
        rings = self.result.rings
        for kind, numbers, field in (("depth", {}, "kind"), ("height", {}, "gauge height"),
                                     ("height", {"y": 1}, "gauge height"),
                                     ("height", {"x": float("nan")}, "gauge height.x")):
            with self.assertRaises(partiemc.Error) as caught:
                rings.gauge(kind, **numbers)
            self.assertEqual(caught.exception.field, field)

    def test_others_take_results(self):
        try:
            shapes = self.result.rings.to_shapely()
        except ImportError:
            self.skipTest("NOT TESTED: there is no shapely (Debian: python3-shapely)")
        self.assertTrue(shapes.is_valid)
        self.assertAlmostEqual(shapes.area, self.result.area)
        self.assertEqual(len(shapes.geoms[0].interiors), 1)
        self.assertGreater(self.result.to_svg().count("M"), len(self.result.mesh))

    def test_matplotlib_takes_results(self):
        try:
            path = self.result.rings.to_path()
        except ImportError:
            self.skipTest("NOT TESTED: there is no matplotlib (Debian: python3-matplotlib)")
        polygons = path.to_polygons()
        self.assertEqual(len(polygons), 2)
        for ring, polygon in zip(self.result.rings, polygons):
            numpy.testing.assert_array_equal(polygon, numpy.concatenate([ring, ring[:1]]))
        self.assertEqual(len(self.result.mesh.to_triangulation().triangles), len(self.result.mesh))

    def test_matplotlib_interpolates_attributes(self):
        try:
            from matplotlib.tri import LinearTriInterpolator, TrapezoidMapTriFinder
        except ImportError:
            self.skipTest("NOT TESTED: there is no matplotlib (Debian: python3-matplotlib)")
        particles = block()
        x, y = particles.T
        wave = numpy.sin(x / 3) + numpy.cos(y / 4)
        for fill in ("greedy", "conforming", "polygon"):
            for attributes in ({"wave": wave}, {}):
                if fill == "greedy" and not attributes:
                    continue
                with self.subTest(fill=fill, attributes=list(attributes)):
                    result = partiemc.reconstruct(particles, spacing=1, fill=fill,
                                                  attributes=attributes)
                    triangulation = result.mesh.to_triangulation()
                    found = TrapezoidMapTriFinder(triangulation)(x, y)
                    self.assertGreater((found >= 0).mean(), 0.99)
                    if fill == "greedy":
                        read = LinearTriInterpolator(triangulation, result.attributes["wave"])(x, y)
                        error = numpy.abs(read - wave).mean()
                        self.assertLess(error, 0.02 * numpy.ptp(wave))

    def test_meshio_takes_results(self):
        try:
            mesh = self.result.mesh.to_meshio()
        except ImportError:
            self.skipTest("NOT TESTED: there is no meshio (Debian: python3-meshio)")
        self.assertEqual(len(mesh.cells[0].data), len(self.result.mesh))
        import meshio
        for extension in ("vtu", "vtk", "stl", "msh", "obj", "ply"):
            with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
                mesh.write(f"{folder}/mesh.{extension}")
                read = meshio.read(f"{folder}/mesh.{extension}")
            self.assertEqual(sum(len(cells.data) for cells in read.cells), len(self.result.mesh),
                             extension)


    def test_meshio_takes_attributes(self):
        try:
            import meshio
        except ImportError:
            self.skipTest("NOT TESTED: there is no meshio (Debian: python3-meshio)")
        positions = block()
        result = partiemc.reconstruct(positions, spacing=1, attributes={"p": positions[:, 0], "xy": positions})
        with tempfile.TemporaryDirectory() as folder:
            result.mesh.to_meshio(result.attributes).write(f"{folder}/mesh.vtu")
            read = meshio.read(f"{folder}/mesh.vtu")
        for name, values in result.attributes.items():
            numpy.testing.assert_array_equal(read.point_data[name], values)


if __name__ == "__main__":
    unittest.main()
