"""Solids against brute force, triangles as a boundary, scenes in space and their metrics."""

import unittest

import numpy as np
from scipy.spatial import cKDTree

from partiemc_evaluation.metrics import compare
from partiemc_evaluation.motions import Similarity
from partiemc_evaluation.solids import SOLIDS, Balls, Mesh, Solid
from partiemc_evaluation.surfaces import METRICS, make_frames, measure_scene, surface_digest, surface_sets


def octahedron(radius=1.0, center=(0.0, 0.0, 0.0)):
    points = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)
    triangles = [(x, y, z) if (x + y + z) % 2 == 0 else (x, z, y)
                 for x in (0, 1) for y in (2, 3) for z in (4, 5)]
    return Mesh(radius * points + center, np.array(triangles))


class SolidTest(unittest.TestCase):
    def test_feet_are_the_nearest_boundary_points(self):
        rng = np.random.default_rng(3)
        place = Similarity(0.9 * np.linalg.qr(rng.standard_normal((3, 3)))[0], np.array([5.0, -3, 2]))
        if np.linalg.det(place.matrix) < 0:
            place = Similarity(-place.matrix, place.shift)
        for name, form in SOLIDS.items():
            solid = Solid(form(300.0), place)
            low, high = solid.bounds
            points = low + (high - low) * rng.random((20_000, 3))
            volume = solid.contains(points).mean() * np.prod(high - low)
            self.assertAlmostEqual(volume / solid.measure, 1, delta=0.05, msg=name)
            asked = points[:500]
            distance, foot, normal = solid.nearest(asked)
            self.assertLess(solid.nearest(foot)[0].max(), 1e-9, name)
            self.assertLess(np.abs((normal ** 2).sum(axis=1) - 1).max(), 1e-9, name)
            samples = np.concatenate(solid.samples)
            brute = cKDTree(samples).query(asked)[0]
            self.assertTrue((distance <= brute + 1e-9).all(), name)
            self.assertLess((brute - distance).max(), 1.0, name)
            # The solid lies on the inner side of its boundary.
            smooth = solid.samples.middles
            outward = solid.nearest(smooth)[2]
            self.assertGreater(solid.contains(smooth - 1e-3 * outward).mean(), 0.99, name)
            self.assertLess(solid.contains(smooth + 1e-3 * outward).mean(), 0.01, name)

    def test_balls_that_overlap_are_a_union(self):
        balls = Balls(np.array([(0.0, 0, 0), (3, 0, 0)]), np.array([2.0, 2.0]))
        # The balls overlap in two caps of height .5.
        cap = np.pi * 0.5 ** 2 * (3 * 2 - 0.5) / 3
        self.assertAlmostEqual(balls.volume, 2 * (32 / 3 * np.pi - cap), delta=1e-12)
        # The point of the crease that is nearest to a point in the middle plane.
        feet = balls.feet(np.array([(1.5, 0.1, 0.0)]))
        np.testing.assert_allclose(feet.points, [(1.5, np.sqrt(4 - 2.25), 0)], atol=1e-12)


class MeshTest(unittest.TestCase):
    def test_nearest_is_exact(self):
        rng, mesh = np.random.default_rng(4), octahedron(2.0)
        points = rng.uniform(-4, 4, (500, 3))
        distance, foot, _ = mesh.nearest(points)
        outside = np.abs(points).sum(axis=1) > 2
        u = rng.dirichlet(np.ones(3), 100_000)
        dense = np.concatenate([u @ mesh.points[t] for t in mesh.triangles])
        brute = cKDTree(dense).query(points)[0]
        self.assertTrue((distance <= brute + 1e-12).all())
        self.assertLess((brute - distance)[outside].max(), 0.05)
        np.testing.assert_allclose(np.abs(foot).sum(axis=1), 2, atol=1e-12)

    def test_samples_stand_for_equal_areas(self):
        mesh = octahedron(3.0)
        middles = mesh.samples.middles
        np.testing.assert_allclose(np.abs(middles).sum(axis=1), 3, atol=1e-12)
        per_face = np.bincount(((middles > 0) @ (1, 2, 4)), minlength=8)
        self.assertLessEqual(np.ptp(per_face), 2)
        self.assertAlmostEqual(mesh.measure, 4 / 3 * 27, delta=1e-12)

    def test_deviation_of_a_shifted_body_is_the_shift(self):
        shifted = compare(octahedron(2.0), octahedron(2.0, (0.3, 0, 0)), 1.0)
        self.assertAlmostEqual(shifted.hausdorff, 0.3, delta=1e-9)
        self.assertLess(shifted.mean, 0.3 / np.sqrt(3) + 1e-9)


class SceneTest(unittest.TestCase):
    def test_sets_share_no_solid_and_no_seed(self):
        tuning, validation = surface_sets()["tuning"], surface_sets()["validation"]
        special = {"two-balls-moving", "ball-and-drops"}
        self.assertFalse({r.shape for r in tuning} & {r.shape for r in validation} - special)
        self.assertFalse({r.seed for r in tuning} & {r.seed for r in validation})
        self.assertEqual({r.group for r in tuning}, {r.group for r in validation})

    def test_particles_lie_in_the_truth_and_fill_it(self):
        for recipe in surface_sets()["smoke"]:
            for frame in make_frames(recipe):
                if recipe.group.startswith("noise"):
                    continue
                self.assertTrue(frame.truth.contains(frame.positions).all(), recipe.name)
            first = make_frames(recipe)[0]
            self.assertAlmostEqual(len(first.positions), first.truth.measure, delta=1e-6)

    def test_digests_are_the_same_each_time(self):
        recipe = surface_sets()["smoke"][0]
        self.assertEqual(surface_digest(recipe), surface_digest(recipe))

    def test_the_default_beats_marching_cubes_on_a_ball(self):
        recipe = next(r for r in surface_sets()["tuning"] if r.name.startswith("rigid-ball-blue-noise"))
        rows = {row.method: row for row in measure_scene(recipe)}
        default, baseline = rows["virtual-plane"], rows["marching-cubes"]
        for metric in ("mean_deviation", "normal_error", "mean_jitter", "volume_error"):
            self.assertLess(default[metric], baseline[metric], metric)
        self.assertEqual(default["shell_error"], 0)
        self.assertEqual(default["genus_error"], 0)
        self.assertTrue(set(default.values) == set(METRICS))


if __name__ == "__main__":
    unittest.main()
