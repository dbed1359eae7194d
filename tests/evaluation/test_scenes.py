"""Motions, scenes and sets: exact truth, seeds, digests."""

import os
import pathlib
import unittest
from collections import Counter
from dataclasses import replace

import numpy as np

from partiemc_evaluation.geometry import Curve
from partiemc_evaluation.motions import Body, BodiesMotion, FlowMotion, InUnits, Shear, Similarity, SimilarityMotion
from partiemc_evaluation.scenes import SETS, Recipe, digest, make_scene, make_set
from partiemc_evaluation.shapes import make_shape

DIGESTS = pathlib.Path(os.environ["PARTIEMC_SOURCE_DIR"]) / "client/evaluation/digests.txt"
FLOW = FlowMotion((Shear(np.array([0.6, 0.8]), 2.0, 0.2, 0.3), Shear(np.array([-0.8, 0.6]), 1.0, 0.15, 1.3)),
                  np.array([4.0, 0.0]), 12.0, 0.7)


class MotionsTest(unittest.TestCase):
    def test_a_flow_keeps_areas(self):
        disc = make_shape("disc", 300, 0.01)
        moved = disc.moved(FLOW.carry(0, disc.points))
        self.assertAlmostEqual(moved.area / disc.area, 1, delta=1e-6)
        self.assertGreater(np.abs(moved.points - disc.points).max(), 1)

    def test_a_similarity_has_its_inverse(self):
        points = np.random.default_rng(1).random((20, 2))
        one = Similarity.plane(0.7, 2.5, (3, -4))
        np.testing.assert_allclose(one.inverse()(one(points)), points, atol=1e-14)
        motion = InUnits(SimilarityMotion([Similarity.plane(0.3)]), one)
        np.testing.assert_allclose(motion.carry(0, one(points)), one(Similarity.plane(0.3)(points)), atol=1e-13)

    def test_distance_of_an_ellipse_is_exact_near_it(self):
        body = Body(3.0, 2.0, 0.4, np.array([1.0, 1.0]), np.array([0.5, 0.0]))
        turn = np.linspace(0, 2 * np.pi, 50)
        on = Similarity.plane(0.4)(np.stack([3 * np.cos(turn), 2 * np.sin(turn)], axis=1)) + body.center(2)
        self.assertLess(np.abs(body.distance(2, on)).max(), 1e-12)
        self.assertLess(body.distance(2, body.center(2)[None])[0], 0)
        outward = on + 0.01 * (on - body.center(2)) / np.linalg.norm(on - body.center(2), axis=1)[:, None]
        self.assertTrue((body.distance(2, outward) > 0.008).all())

    def test_bodies_unite_to_the_area_of_two_discs(self):
        radius, apart = 5.0, 6.0
        bodies = BodiesMotion([Body(radius, radius, 0.0, np.zeros(2), np.zeros(2)),
                               Body(radius, radius, 0.0, np.array([apart, 0.0]), np.array([-1.0, 0.0]))])
        half = np.arccos(apart / 2 / radius)
        shared = 2 * radius ** 2 * half - apart * np.sqrt(radius ** 2 - (apart / 2) ** 2)
        self.assertAlmostEqual(bodies.outline(0).area, 2 * np.pi * radius ** 2 - shared, delta=0.01)
        samples = [np.zeros((1, 2)), np.array([[-4.0, 0.0], [4.0, 0.0]])]
        points, ids = bodies.particles(samples, 0)
        self.assertEqual(ids.tolist(), [0, 2])  # The first sample of the second body lies in the first.
        np.testing.assert_allclose(points[1], [10, 0])


    def test_bodies_apart_have_an_outline_each(self):
        bodies = BodiesMotion([Body(5.0, 5.0, 0.0, np.zeros(2), np.zeros(2)),
                               Body(5.0, 5.0, 0.0, np.array([20.0, 0.0]), np.array([-3.0, 0.0]))])
        self.assertEqual([bodies.outline(t).loop_counts for t in (0, 4)], [(2, 0), (1, 0)])

    def test_bodies_in_a_ring_leave_a_hole(self):
        turn = 2 * np.pi * np.arange(5) / 5
        centers = 10 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        bodies = BodiesMotion([Body(7.0, 7.0, 0.0, center, np.zeros(2)) for center in centers])
        self.assertEqual(bodies.outline(0).loop_counts, (1, 1))


class ScenesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scenes = [make_scene(recipe) for recipe in make_set("smoke")]

    def test_are_the_committed_ones(self):
        committed = dict(reversed(line.split(None, 1)) for line in DIGESTS.read_text().splitlines()
                         if not line.startswith("#"))
        for scene in self.scenes:
            self.assertEqual(digest(scene), committed[f"smoke/{scene.name}"], scene.name)
        for name, chosen in (("tuning", (3, 40)), ("validation", (3, 38))):
            recipes = make_set(name)
            for k in chosen:
                self.assertEqual(digest(make_scene(recipes[k])), committed[f"{name}/{recipes[k].name}"], k)

    def test_follow_from_their_recipe(self):
        recipe = Recipe("one", "growth", "disc", 7, "blue-noise", particles=200, frames=3)
        self.assertEqual(digest(make_scene(recipe)), digest(make_scene(recipe)))
        other = Recipe("one", "growth", "disc", 8, "blue-noise", particles=200, frames=3)
        self.assertNotEqual(digest(make_scene(recipe)), digest(make_scene(other)))

    def test_know_their_area_and_their_spacing(self):
        for scene in self.scenes:
            first = scene.frames[0]
            self.assertAlmostEqual(len(first.positions) * scene.spacing ** 2 / first.area, 1, delta=1e-9)
            for frame in scene.frames:
                self.assertAlmostEqual(frame.truth.area / frame.area, 1, delta=1e-6, msg=scene.name)
                self.assertAlmostEqual(frame.volumes.sum() / frame.area, 1, delta=1e-6)

    def test_truth_follows_the_motion(self):
        for scene in self.scenes:
            if scene.truth_follows_motion:
                for t in range(len(scene.frames) - 1):
                    moved = scene.motion.carry(t, scene.frames[t].truth.points)
                    error = np.abs(moved - scene.frames[t + 1].truth.points).max() / scene.spacing
                    self.assertLess(error, 1e-8, scene.name)

    def test_particles_of_an_id_follow_the_motion(self):
        for scene, recipe in zip(self.scenes, make_set("smoke")):
            if scene.group == "topology":
                continue
            # Noise is new in every frame. Where a region grows, its particles settle.
            slack = {"noise": 12 * recipe.noise, "growth": 1.5}.get(scene.group, 1e-8)
            for t in range(len(scene.frames) - 1):
                now, after = scene.frames[t], scene.frames[t + 1]
                _, i, j = np.intersect1d(now.ids, after.ids, return_indices=True)
                self.assertEqual(len(i), len(now.ids), scene.name)
                gap = np.linalg.norm(scene.motion.carry(t, now.positions[i]) - after.positions[j], axis=1)
                self.assertLess(gap.max(), slack * scene.spacing, scene.name)

    def test_particles_of_merging_bodies_move_with_their_body(self):
        for backwards in (False, True):
            scene = make_scene(Recipe("chain", "topology", "disc-chain", 3, particles=400, backwards=backwards))
            moves, counts = {}, set()
            for now, after in zip(scene.frames, scene.frames[1:]):
                _, i, j = np.intersect1d(now.ids, after.ids, return_indices=True)
                counts.add(len(after.ids))
                for name, move in zip(now.ids[i].tolist(), after.positions[j] - now.positions[i]):
                    known = moves.setdefault(name, move)
                    self.assertLess(np.abs(move - known).max(), 1e-9 * scene.spacing, name)
            self.assertGreater(len(counts), 1)  # Particles vanish or appear.
            kinds = np.unique(np.round(np.array(list(moves.values())) / scene.spacing, 6), axis=0)
            self.assertEqual(len(kinds), 3)

    def test_the_motion_of_merging_bodies_carries_their_boundaries(self):
        # A point of the boundary moves with its own body, so it ends on the next boundary or in another body.
        for name in ("smoke", "tuning", "validation"):
            for recipe in make_set(name):
                if recipe.group != "topology" or recipe.sampler not in ("lattice", "blue-noise", "hexagonal"):
                    continue
                scene = make_scene(replace(recipe, particles=400, sampler="hexagonal"))
                for t in range(len(scene.frames) - 1):
                    moved = scene.motion.carry(t, scene.frames[t].truth.points)
                    region = Curve(scene.frames[t + 1].truth, scene.spacing)
                    outside = moved[~region.contains(moved)]
                    distance = region.nearest(outside)[0] if len(outside) else np.zeros(1)
                    self.assertLess(distance.max(), 1e-3 * scene.spacing, recipe.name)

    def test_bodies_that_merge_have_a_simple_truth_and_enough_particles(self):
        for name in ("tuning", "validation"):
            for recipe in make_set(name):
                if recipe.group != "topology" or recipe.sampler != "hexagonal":
                    continue
                scene = make_scene(recipe)
                for frame in scene.frames:
                    self.assertTrue(frame.truth.to_shapely().is_valid, recipe.name)
                    self.assertEqual(frame.truth.count_crossings(), 0, recipe.name)
                    covered = len(frame.positions) * scene.spacing ** 2 / frame.area
                    self.assertAlmostEqual(covered, 1, delta=0.015, msg=recipe.name)
                components = {frame.truth.loop_counts[0] for frame in scene.frames}
                self.assertGreaterEqual(len(components), 2, recipe.name)
                self.assertEqual(min(components), 1, recipe.name)

    def test_rigid_motion_and_flow_keep_the_area(self):
        for scene in self.scenes:
            if scene.group not in ("topology", "growth"):
                for frame in scene.frames:
                    self.assertAlmostEqual(frame.area / scene.frames[0].area, 1, delta=1e-5, msg=scene.name)

    def test_particles_lie_inside_the_truth(self):
        for scene in self.scenes:
            if scene.group != "noise":
                frame = scene.frames[-1]
                region = Curve(frame.truth, scene.spacing)
                outside = ~region.contains(frame.positions)
                far = region.nearest(frame.positions)[0] > 1e-6 * scene.spacing
                self.assertFalse((outside & far).any(), scene.name)

    def test_only_thirty_percent_is_not_judged(self):
        for share, judged in ((1.0, True), (0.5, True), (0.3, False)):
            recipe = Recipe("t", "thinned", "disc", 5, "hexagonal", particles=300, frames=2, kept_share=share)
            self.assertEqual(make_scene(recipe).judged, judged)


class SetsTest(unittest.TestCase):
    def test_names_and_seeds_are_different(self):
        recipes = [recipe for name in SETS for recipe in make_set(name)]
        self.assertEqual(len({recipe.seed for recipe in recipes}), len(recipes))
        for name in SETS:
            self.assertEqual(len({recipe.name for recipe in make_set(name)}), len(make_set(name)))

    def test_sizes(self):
        self.assertEqual([len(make_set(name)) for name in SETS], [7, 86, 114, 32])

    def test_every_group_has_eight_judged_sequences_of_fair_size(self):
        for name in ("tuning", "validation"):
            judged = Counter(recipe.group for recipe in make_set(name) if recipe.kept_share > 0.4)
            self.assertEqual(len(judged), 7)
            self.assertGreaterEqual(min(judged.values()), 8)
            for recipe in make_set(name):
                self.assertEqual(recipe.frames, 8)
                self.assertTrue(500 <= recipe.particles <= 3600, recipe.name)  # Thinned ones begin with 600 more.

    def test_smoke_is_small_and_has_every_group(self):
        self.assertEqual(len({recipe.group for recipe in make_set("smoke")}), 7)
        self.assertLessEqual(max(recipe.particles for recipe in make_set("smoke")), 500)

    def test_discs_are_relaxed_short_and_long_still_and_turning(self):
        recipes = make_set("discs")
        counts = Counter((recipe.shape, recipe.sampler, recipe.pace) for recipe in recipes)
        self.assertEqual((len(counts), set(counts.values())), (8, {4}))
        still, turning = (make_scene(replace(recipes[k], sampler="hexagonal")) for k in (0, 4))
        self.assertEqual((still.frames[0].positions == still.frames[-1].positions).all(), True)
        self.assertNotEqual((turning.frames[0].positions == turning.frames[-1].positions).all(), True)
        drift = turning.frames[-1].truth.points.mean(axis=0) - turning.frames[0].truth.points.mean(axis=0)
        self.assertLess(np.linalg.norm(drift), 1e-6 * turning.spacing)

    def test_validation_has_shapes_of_its_own(self):
        shapes = [{recipe.shape for recipe in make_set(name)} for name in ("tuning", "validation")]
        self.assertFalse(shapes[0] & shapes[1])

    def test_every_sampler_meets_every_kind_of_motion(self):
        for name, rounds in (("tuning", 2), ("validation", 3)):
            for group in ("rigid", "deformed", "topology", "growth"):
                samplers = [recipe.sampler for recipe in make_set(name) if recipe.group == group]
                self.assertEqual(len(samplers), 7 * rounds)
                self.assertEqual(len(set(samplers)), 7)


if __name__ == "__main__":
    unittest.main()
