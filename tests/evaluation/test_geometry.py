"""Outlines, shapes, curves and samplers against analytic truths and brute force."""

import unittest

import numpy as np
from scipy.spatial import cKDTree
from shapely.geometry import Point

from partiemc_evaluation.geometry import Curve, Outline, ellipse_ring, sample_curve
from partiemc_evaluation.samplers import SAMPLERS, push_inside, raster, relax, throw_darts
from partiemc_evaluation.shapes import TUNING_SHAPES, VALIDATION_SHAPES, fits_lattice, make_shape


def disc(radius, x=0.0, y=0.0, step=0.04):
    return Outline.of([ellipse_ring((x, y), radius, radius, 0.0, step)])


def annulus(outer, inner, step=0.04):
    return Outline.of([disc(outer, step=step).points, disc(inner, step=step).points[::-1]])


class OutlineTest(unittest.TestCase):
    def test_has_the_area_of_its_rings(self):
        ring = annulus(10, 4)
        self.assertAlmostEqual(ring.area, np.pi * 84, delta=1e-3)
        self.assertEqual(ring.loop_counts, (1, 1))
        self.assertAlmostEqual(ring.moved(ring.points + 1e6).area, ring.area, delta=1e-6)

    def test_densified_keeps_area_and_limits_segments(self):
        square = Outline.of([np.array([(0.0, 0), (3, 0), (3, 1), (0, 1)])])
        dense = square.densified(0.4)
        self.assertAlmostEqual(dense.area, 3, delta=1e-14)
        length = np.linalg.norm(dense.points[dense.following] - dense.points, axis=1)
        self.assertLessEqual(length.max(), 0.4 + 1e-12)
        self.assertEqual(len(dense.points), 2 * 8 + 2 * 3)

    def test_survives_shapely(self):
        ring = annulus(10, 4)
        again = Outline.of_shapely(ring.to_shapely())
        self.assertAlmostEqual(again.area, ring.area, delta=1e-9)
        self.assertEqual(again.loop_counts, (1, 1))

    def test_counts_crossings(self):
        eight = Outline.of([np.array([(0.0, 0), (2, 2), (2, 0), (0, 2)])])
        self.assertEqual(eight.count_crossings(), 1)
        self.assertEqual(annulus(10, 4, 0.5).count_crossings(), 0)
        rng = np.random.default_rng(4)
        tangle = Outline.of([rng.random((40, 2))])
        a, b = tangle.points, tangle.points[tangle.following]
        count = 0
        for i in range(40):
            for j in range(i + 1, 40):
                if tangle.following[i] == j or tangle.following[j] == i:
                    continue
                cross = lambda u, v: u[0] * v[1] - u[1] * v[0]
                count += (cross(b[i] - a[i], a[j] - a[i]) * cross(b[i] - a[i], b[j] - a[i]) < 0
                          and cross(b[j] - a[j], a[i] - a[j]) * cross(b[j] - a[j], b[i] - a[j]) < 0)
        self.assertEqual(tangle.count_crossings(), count)

    def test_erosion(self):
        self.assertAlmostEqual(disc(10).eroded(0.5).area, np.pi * 9.5 ** 2, delta=0.02)
        self.assertAlmostEqual(annulus(10, 4).eroded(0.5).area, np.pi * (9.5 ** 2 - 4.5 ** 2), delta=0.05)
        square = Outline.of([np.array([(0.0, 0), (4, 0), (4, 4), (0, 4)])])
        self.assertAlmostEqual(square.eroded(0.5).area, 9, delta=1e-9)  # Convex corners stay sharp.
        self.assertTrue(make_shape("two-discs", 200, 0.25).eroded(0.5))
        # The eroded box of 40 without the box of 20 of its notch, whose corner became an arc.
        exact = 39 ** 2 - 20 ** 2 + (1 - np.pi / 4) * 0.5 ** 2
        self.assertAlmostEqual(make_shape("ell", 1200, 0.25).eroded(0.5).area, exact, delta=1e-3)
        self.assertFalse(Outline.of([np.array([(0.0, 0), (9, 0), (9, 0.9), (0, 0.9)])]).eroded(0.5))


class CurveTest(unittest.TestCase):
    def test_nearest_is_what_all_segments_together_give(self):
        outline = Outline.of([ring * 3 for ring in make_shape("star", 40, 5).rings()])
        curve = Curve(outline, 1.0)
        points = np.random.default_rng(1).uniform(-25, 25, (300, 2))
        a, along = outline.points, outline.points[outline.following] - outline.points
        arm = points[:, None] - a
        share = np.clip((arm * along).sum(2) / (along ** 2).sum(1), 0, 1)
        every = np.linalg.norm(arm - share[..., None] * along, axis=2)
        distance, foot, normal = curve.nearest(points)
        np.testing.assert_allclose(distance, every.min(axis=1), atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(points - foot, axis=1), distance, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-12)

    def test_normals_of_a_disc_point_outward(self):
        points = np.random.default_rng(2).uniform(-3, 3, (50, 2)) + (20, 0)
        _, foot, normal = Curve(disc(5, 20), 1.0).nearest(points)
        self.assertGreater(((foot - (20, 0)) * normal).sum(axis=1).min(), 4.9)

    def test_contains_respects_holes_and_gaps(self):
        ring = Curve(annulus(10, 4), 1.0)
        radius = np.array([1.0, 3.9, 4.1, 9.9, 10.1])
        inside = ring.contains(np.stack([radius, np.zeros(5)], axis=1))
        self.assertEqual(inside.tolist(), [False, False, True, True, False])

    def test_samples_are_even_and_corners_are_kept(self):
        square = Outline.of([np.array([(0.0, 0), (4, 0), (4, 4), (0, 4)])])
        samples = sample_curve(square, 0.1)
        self.assertEqual((len(samples.middles), len(samples.corners)), (160, 4))
        np.testing.assert_allclose(samples.middles[:3, 0], [0.05, 0.15, 0.25], atol=1e-12)
        self.assertEqual(len(sample_curve(disc(5), 0.1).corners), 0)


class ShapesTest(unittest.TestCase):
    def test_are_valid_and_have_the_area_requested(self):
        for name in (*TUNING_SHAPES, *VALIDATION_SHAPES):
            with self.subTest(name):
                outline = make_shape(name, 900, 0.25)
                self.assertTrue(outline.to_shapely().is_valid)
                self.assertEqual(outline.count_crossings(), 0)
                self.assertAlmostEqual(outline.to_shapely().area, outline.area, delta=1e-6)
                self.assertAlmostEqual(outline.area, 900, delta=200 if fits_lattice(name) else 0.01)

    def test_tuning_and_validation_share_none(self):
        self.assertEqual(len({*TUNING_SHAPES, *VALIDATION_SHAPES}), 39)

    def test_a_lattice_fits_without_a_remainder(self):
        for name in filter(fits_lattice, (*TUNING_SHAPES, *VALIDATION_SHAPES)):
            outline = make_shape(name, 700, 0.25)
            centers = raster(Curve(outline, 1.0), 1.0, np.full(2, 0.5))
            self.assertEqual(len(centers), round(outline.area), name)


class SamplersTest(unittest.TestCase):
    # Mean and standard deviation of nearest neighbours, and particles for an area of 1.
    NEIGHBOURS = {"relaxed": ((0.94, 0.98), (0.04, 0.08)), "relaxed-100": ((0.96, 1.0), (0.04, 0.08)),
                  "settled": ((0.94, 0.98), (0.04, 0.08)), "hexagonal": ((1.0745, 1.0746), (0, 1e-6)),
                  "blue-noise": ((0.8, 0.85), (0.05, 0.09)), "clumped": ((0.57, 0.64), (0.21, 0.25)),
                  "lattice": ((1, 1.000001), (0, 1e-6)), "ragged": ((0.8, 0.87), (0.06, 0.11))}

    def test_have_the_nearest_neighbours_that_they_promise(self):
        region = Curve(make_shape("square", 400, 0.25), 1.0)
        for name, ((low, high), (least, most)) in self.NEIGHBOURS.items():
            with self.subTest(name, seed=31):
                centers = SAMPLERS[name](region, True, np.random.default_rng(31))
                distance = cKDTree(centers).query(centers, 2)[0][:, 1]
                self.assertTrue(low <= round(distance.mean(), 7) <= high, distance.mean())
                self.assertTrue(least <= distance.std() <= most, distance.std())
                self.assertAlmostEqual(len(centers) / region.measure, 1, delta=0.06)
                self.assertTrue(region.contains(centers).all())

    def test_follow_from_their_seed(self):
        region = Curve(disc(4), 1.0)
        for name, sampler in SAMPLERS.items():
            one, same, other = (sampler(region, False, np.random.default_rng(seed)) for seed in (3, 3, 4))
            self.assertTrue(np.array_equal(one, same), name)
            self.assertFalse(np.array_equal(one, other), name)

    def test_relaxed_centres_keep_apart_from_the_boundary_and_each_other(self):
        region = Curve(annulus(10, 4), 1.0)
        centers = relax(region, throw_darts(region, 264, np.random.default_rng(3)), 10)
        self.assertGreater(region.nearest(centers)[0].min(), 0.499)
        self.assertGreater(cKDTree(centers).query(centers, 2)[0][:, 1].min(), 0.5)
        self.assertEqual(len(SAMPLERS["relaxed"](region, False, np.random.default_rng(3))), round(region.measure))

    def test_clumps_keep_their_density_up_to_the_boundary(self):
        region = Curve(make_shape("disc", 600, 0.25), 1.0)
        depth = region.nearest(SAMPLERS["clumped"](region, False, np.random.default_rng(29)))[0]
        radius = (600 / np.pi) ** 0.5 - np.arange(5)
        counts = np.histogram(depth, np.arange(5))[0]
        np.testing.assert_allclose(counts / (np.pi * (radius[:-1] ** 2 - radius[1:] ** 2)), 1, atol=0.12)

    def test_ragged_centres_do_not_crowd_at_the_boundary(self):
        region = Curve(make_shape("square", 2500, 0.25), 1.0)
        depth = np.concatenate([region.nearest(SAMPLERS["ragged"](region, False, np.random.default_rng(seed)))[0]
                                for seed in range(9, 13)])
        self.assertAlmostEqual(len(depth) / (4 * 2500), 1, delta=0.02)
        self.assertAlmostEqual((depth < 0.5).sum() / (4 * (2500 - 49 ** 2)), 1, delta=0.15)

    def test_darts_keep_their_distance_and_their_inset(self):
        region = Curve(disc(8), 1.0)
        others = np.array([[0.0, 0.0], [3.0, 3.0]])
        darts = throw_darts(region, 120, np.random.default_rng(5), others=others)
        self.assertEqual(len(darts), 120)
        self.assertGreaterEqual(region.nearest(darts)[0].min(), 0.5)
        self.assertGreaterEqual(cKDTree(np.concatenate([darts, others])).query(darts, 2)[0][:, 1].min(), 0.7)

    def test_push_inside_moves_only_what_is_too_near(self):
        region = Curve(disc(8), 1.0)
        centers = np.array([[0.0, 0], [7.9, 0], [0, 8.5]])
        moved = push_inside(region, centers)
        np.testing.assert_array_equal(moved[0], centers[0])
        np.testing.assert_allclose(np.linalg.norm(moved[1:], axis=1), 7.5, atol=1e-3)
        self.assertTrue(all(Point(*p).within(region.outline.to_shapely()) for p in moved))


if __name__ == "__main__":
    unittest.main()
