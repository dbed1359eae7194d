"""Deviation, jitter, defects, advection, walls and recordings against truths that are known."""

import os
import pathlib
import types
import unittest

import numpy as np

from partiemc_evaluation.advection import Advection
from partiemc_evaluation.geometry import Curve, Outline, ellipse_ring
from partiemc_evaluation.metrics import carried, compare, find_defects, jitter, known_jitter, nearest_neighbours
from partiemc_evaluation.motions import FlowMotion, Shear, Similarity, SimilarityMotion
from partiemc_evaluation.recordings import add_truth, moment_ellipse, read_recording, wall_roughness
from partiemc_evaluation.scenes import Frame, Sequence
from partiemc_evaluation.shapes import make_shape

RECORDINGS = pathlib.Path(os.environ["PARTIEMC_SOURCE_DIR"]) / "tests/data/recordings"


def disc(radius, x=0.0, y=0.0):
    return Outline.of([ellipse_ring((x, y), radius, radius, 0.0, 0.04)])


def polygon(*corners):
    return Outline.of([np.array(corners, float)])


def block(side, shift=(0.0, 0.0)):
    """A block of particles of spacing 1, (side^2, 2)."""
    return np.stack(np.divmod(np.arange(side * side), side), axis=1) + np.asarray(shift, float)


class DeviationTest(unittest.TestCase):
    def test_of_concentric_circles_is_the_difference_of_radii(self):
        for spacing in (1.0, 0.5):
            found = compare(Curve(disc(10), spacing), Curve(disc(10.3), spacing), spacing)
            np.testing.assert_allclose(found, 0.3 / spacing, atol=1e-3)

    def test_of_shifted_circles_is_largest_along_the_shift(self):
        found = compare(Curve(disc(10), 1.0), Curve(disc(10, 0.4), 1.0), 1.0)
        self.assertAlmostEqual(found.hausdorff, 0.4, delta=1e-3)
        self.assertAlmostEqual(found.mean, 0.4 * 2 / np.pi, delta=5e-3)

    def test_sees_a_corner_that_is_cut_off(self):
        square = polygon((0, 0), (10, 0), (10, 10), (0, 10))
        cut = polygon((0, 0), (10, 0), (10, 9), (9, 10), (0, 10))
        self.assertAlmostEqual(compare(Curve(cut, 1.0), Curve(square, 1.0), 1.0).hausdorff, 0.5 ** 0.5, delta=1e-12)

    def test_is_symmetric_and_counts_what_one_curve_has(self):
        one, two = Curve(disc(5), 1.0), Curve(Outline.of([disc(5).points, disc(5, 30).points]), 1.0)
        self.assertEqual(compare(one, two, 1.0), compare(two, one, 1.0))
        self.assertAlmostEqual(compare(one, two, 1.0).hausdorff, 30, delta=0.01)

    def test_from_nothing_is_the_extent_of_the_other(self):
        nothing = Curve(Outline(), 1.0)
        self.assertAlmostEqual(compare(Curve(disc(5), 1.0), nothing, 1.0).hausdorff, 200 ** 0.5, delta=0.01)
        self.assertEqual(compare(nothing, nothing, 1.0), (0, 0))


class NeighboursTest(unittest.TestCase):
    def test_are_those_that_all_pairs_give(self):
        points = np.concatenate([np.random.default_rng(17).uniform(0, 20, (200, 2)), [(500.0, 500.0)]])
        apart = np.linalg.norm(points[:, None] - points, axis=2) + 1e9 * np.eye(201)
        nearest = apart.min(axis=1)
        nearest = nearest[nearest < 2]  # Without the spray.
        np.testing.assert_allclose(nearest_neighbours(points, 1.0), (nearest.mean(), nearest.std()), atol=1e-12)
        np.testing.assert_allclose(nearest_neighbours(2 * points, 2.0), nearest_neighbours(points, 1.0), atol=1e-12)
        self.assertEqual(nearest_neighbours(points[:1], 1.0), (0, 0))


class JitterTest(unittest.TestCase):
    def test_of_exact_transport_is_zero(self):
        flow = FlowMotion((Shear(np.array([1.0, 0]), 1.5, 0.2, 0.3), Shear(np.array([0, 1.0]), 1.0, 0.15, 1.3)),
                          np.array([2.0, 3.0]), 15.0, 0.4)
        outline = make_shape("star", 400, 0.04)
        for motion in (flow, SimilarityMotion([Similarity.plane(0.3, 1.0, (5, -2))])):
            after = Curve(outline.moved(motion.carry(0, outline.points)), 1.0)
            self.assertLess(max(jitter(carried(outline, motion, 0, 1.0), after, 1.0)), 1e-9)

    def test_leaves_out_what_the_truth_does_not_carry_along(self):
        two, one = Outline.of([disc(5).points, disc(5, 30).points]), disc(5)
        found = jitter(Curve(two, 1.0), Curve(disc(5.02), 1.0), 1.0, Curve(two, 1.0), Curve(one, 1.0))
        self.assertAlmostEqual(found.hausdorff, 0.02, delta=1e-3)

    def test_of_a_rigid_recording_is_known_everywhere(self):
        turn = Similarity.plane(0.05, 1.0, (2.0, 1.0))
        before = Frame(0.0, block(14), ids=np.arange(196))
        order = np.random.default_rng(1).permutation(196)
        after = Frame(1.0, turn(block(14))[order], ids=np.arange(196)[order])
        advection = Advection.between(before, after, 1.0)
        outline = polygon((0, 0), (13, 0), (13, 13), (0, 13))
        moved = Curve(outline.moved(turn(outline.points)), 1.0)
        self.assertLess(max(compare(Curve(advection.carry(outline), 1.0), moved, 1.0)), 0.02)
        found, share = known_jitter(Curve(outline, 1.0), moved, advection, 1.0)
        self.assertEqual(share, 1)
        self.assertLess(found.hausdorff, 0.02)

    def test_counts_only_where_particles_determine_the_motion(self):
        # One half moves as one, the other at random: a difference in the second half is no jitter.
        before = scattered(20, 9)
        rng, left = np.random.default_rng(10), before[:, 0] < 0
        after = before + np.where(left[:, None], (2.0, 0.0), rng.uniform(-6, 6, before.shape))
        outline = disc(20.5)
        left = outline.points[:, :1] < 0
        changed = Curve(outline.moved(outline.points + np.where(left, (2.05, 0.0), -0.3 * outline.points)), 1.0)
        advection = recorded(before, after)
        found, share = known_jitter(Curve(outline, 1.0), changed, advection, 1.0)
        self.assertTrue(0.3 < share < 0.5, share)
        self.assertAlmostEqual(found.hausdorff, 0.05, delta=0.005)
        self.assertGreater(compare(Curve(advection.carry(outline), 1.0), changed, 1.0).mean, 0.5)
        self.assertTrue(np.isnan(known_jitter(Curve(Outline(), 1.0), changed, advection, 1.0)[0].mean))


def scattered(radius, seed, shift=(0.0, 0.0)):
    """Points of a lattice of spacing 1 within a disc, each moved at random by up to 0.2."""
    at = np.arange(-radius - 1, radius + 2)
    points = np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2).astype(float)
    points += np.random.default_rng(seed).uniform(-0.2, 0.2, points.shape)
    return points[np.linalg.norm(points, axis=1) < radius] + shift


def recorded(before, after):
    ids = np.arange(len(before))
    return Advection.between(Frame(0.0, before, ids=ids), Frame(1.0, after, ids=ids), 1.0)


class AdvectionTest(unittest.TestCase):
    def test_follows_identities_in_any_order(self):
        particles, ids = scattered(9, 1), np.arange(len(scattered(9, 1)))
        advection = Advection.between(Frame(0.0, particles, ids=ids),
                                      Frame(1.0, particles[::-1] + (3, -1), ids=ids[::-1]), 1.0)
        moved = compare(Curve(advection.carry(disc(8)), 1.0), Curve(disc(8, 3, -1), 1.0), 1.0)
        self.assertLess(moved.hausdorff, 1e-9)

    def test_uses_velocities_where_there_are_no_ids(self):
        velocity = np.tile([4.0, -2.0], (3, 1))
        before = Frame(2.0, np.array([(0.0, 0), (1, 0), (0, 1)]), velocities=velocity)
        after = Frame(2.5, before.positions + (2, -1), velocities=velocity)
        contour = polygon((0, 0), (1, 0), (50, 50))  # The last point is far from all particles.
        moved = Advection.between(before, after, 1.0).carry(contour)
        np.testing.assert_allclose(moved.points[0], [2, -1], atol=1e-12)
        self.assertLess(np.abs(moved.points - contour.densified(0.1).points - (2, -1)).max(), 1e-9)
        self.assertIsNone(Advection.between(Frame(0.0, block(3)), after, 1.0))

    def test_follows_a_shear_beyond_the_outermost_particles(self):
        # The mean displacement would lag behind, by 0.1 of the distance to the particles' centre.
        before = np.stack(np.divmod(np.arange(400), 20), axis=1) + (-9.5, -19.5)
        moved = recorded(before, before + before[:, 1:] * (0.1, 0.0)).carry(polygon((0, 0), (-1, 0), (-1, -10)))
        self.assertAlmostEqual(moved.points[0, 0], 0, delta=0.05)
        self.assertAlmostEqual(moved.points[0, 1], 0, delta=1e-12)

    def test_knows_every_place_around_a_body_that_moves_as_one(self):
        before = np.concatenate([scattered(9, 2), [(40.0, 0.0), (0.0, 40.0), (1.0, 40.0)]])
        outline = Outline.of([disc(9.5).points, disc(0.8, 40, 0).points, disc(1, 0.5, 40).points])
        motion = Similarity.plane(0.1, 1.0, (7, -3))
        found, share = known_jitter(Curve(outline, 1.0), Curve(outline.moved(motion(outline.points)), 1.0),
                                    recorded(before, motion(before)), 1.0)
        self.assertEqual(share, 1)
        self.assertLess(found.mean, 0.01)
        shifted = recorded(before, before + (7, -3))
        self.assertLess(shifted.follow(outline.points, True)[1].max(), 1e-9)

    def test_knows_nothing_where_particles_trade_places(self):
        contour = Curve(disc(12.5), 1.0)
        for seed in range(1, 6):
            before = scattered(12, seed)
            after = np.random.default_rng(100 + seed).permutation(before)
            found, share = known_jitter(contour, contour, recorded(before, after), 1.0)
            self.assertEqual(share, 0, seed)
            self.assertTrue(np.isnan(found.mean), seed)

    def test_is_as_uncertain_as_the_mean_of_the_particles_around(self):
        before, places = scattered(20, 3), disc(20.5).points
        for step in (0.05, 0.2, 0.8):
            after = before + np.random.default_rng(4).uniform(-step, step, before.shape)
            arrival, uncertainty = recorded(before, after).follow(places, True)
            error = (((arrival - places) ** 2).sum(axis=1) / 2).mean() ** 0.5  # Along one axis.
            # The largest of both standard errors and the way back: above the error by less than twice.
            self.assertTrue(error < (uncertainty ** 2).mean() ** 0.5 < 2 * error, step)

    def test_does_not_know_where_bodies_meet(self):
        one, other = scattered(10, 5, (-12, 0)), scattered(10, 6, (14, 0))
        advection = recorded(np.concatenate([one, other]), np.concatenate([one + (2, 0), other - (2, 0)]))

        def uncertainty(x, forward):
            return advection.follow(np.array([(x, 0.0)]), forward)[1][0]
        # Of two bodies that approach each other, a contour is known where the other one is far.
        self.assertGreater(uncertainty(-1.7, True), 0.1)
        self.assertGreater(uncertainty(0.3, False), 0.1)
        self.assertLess(uncertainty(-22.5, True), 1e-9)
        self.assertLess(uncertainty(22.5, False), 1e-9)

    def test_does_not_know_where_particles_come_or_go(self):
        particles, ids = scattered(10, 7), np.arange(len(scattered(10, 7)))
        before, after = (Frame(t, np.concatenate([particles, [(side, 0.0)]]), ids=np.append(ids, 10 ** 6 + side))
                         for t, side in ((0.0, 10), (1.0, -10)))
        advection = Advection.between(before, after, 1.0)
        places = np.array([(-10.0, 1), (10, 1), (0, 14), (0, 10)])  # The third is beyond every particle.
        for forward in (True, False):
            uncertainty = advection.follow(places, forward)[1]
            self.assertTrue(np.isinf(uncertainty[:3]).all(), uncertainty)
            self.assertLess(uncertainty[3], 1e-9)

    def test_does_not_trust_velocities_that_change(self):
        particles = scattered(10, 8)
        velocity = np.tile([1.0, 0.0], (len(particles), 1))
        before = Frame(0.0, particles, velocities=velocity)
        for after, expected in ((1.3 * velocity, 0.3), (velocity, 0.0), (None, np.inf)):
            advection = Advection.between(before, Frame(1.0, particles + (1, 0), velocities=after), 1.0)
            found = advection.follow(np.array([(10.0, 0.0)]), True)[1][0]
            self.assertTrue(found == expected or abs(found - expected) < 1e-9, found)


class DefectsTest(unittest.TestCase):
    def test_are_counted(self):
        points = np.array([(0.0, 0), (2, 2), (2, 0), (0, 2)])
        sign = np.array([1, 1, -1, -1])[:, None]
        result = types.SimpleNamespace(
            rings=types.SimpleNamespace(points=points, offsets=np.array([0, 4], np.uint32), outer_of=np.array([-1]),
                                        particle_counts=np.array([0]), normals=sign * (points - 1)),
            mesh=types.SimpleNamespace(points=np.array([(0.0, 0), (1, 0), (0, 1)]),
                                       triangles=np.array([(0, 1, 2), (0, 2, 1)], np.uint32)))
        found = find_defects(result, Curve(disc(2, 1, 1), 1.0))
        self.assertEqual(found, {"self_intersections": 1, "folds": 1, "spurious_components": 1, "component_error": 0,
                                 "hole_error": 0, "wrong_normals": 0.5})
        self.assertEqual(find_defects(result, None)["wrong_normals"], 0)


class RecordingsTest(unittest.TestCase):
    def test_are_read_with_their_truth(self):
        notes = []
        ellipse = read_recording(RECORDINGS / "ellipse.pemc", notes)
        self.assertEqual((len(ellipse.frames), ellipse.frames[0].positions.shape, notes), (16, (716, 2), []))
        self.assertAlmostEqual(ellipse.spacing, 1 / 15, delta=1e-9)
        self.assertEqual(len(np.unique(ellipse.frames[3].ids)), 716)
        self.assertAlmostEqual(ellipse.frames[9].truth.area, 716 * ellipse.spacing ** 2, delta=1e-4)
        sloshing = read_recording(RECORDINGS / "sloshing.pemc", notes, slice(2, 5))
        self.assertEqual((len(sloshing.frames), sloshing.walls.shape, sloshing.whole), (3, (3, 2, 2), True))

    def test_name_their_file_when_they_cannot_be_read(self):
        for path, frames, rule in ((RECORDINGS / "README.md", slice(None), "README.md"),
                                   (RECORDINGS / "ellipse.pemc", slice(3, 4), "must be two or more")):
            with self.assertRaises(ValueError) as caught:
                read_recording(path, [], frames)
            self.assertIn(rule, str(caught.exception))
            self.assertIn(str(path), str(caught.exception))

    def test_facts_are_checked_line_by_line(self):
        sequence = Sequence("s", "recording", "s", "", 1.0, [Frame(0.0, block(9))])
        add_truth("# a comment\n\nwall 0 -1 40.5 1e1 # a floor\r\n  spray\n", sequence)
        self.assertEqual((sequence.walls.tolist(), sequence.whole), ([[[0, -1], [40.5, 10]]], False))
        self.assertFalse(sequence.frames[0].truth)
        add_truth("ellipse", sequence)
        self.assertAlmostEqual(sequence.frames[0].truth.area, 81, delta=0.01)
        self.assertEqual(sequence.frames[0].area, 81)
        for text in ("wall 0 0 4", "wall 1 1 1 1", "wall a b c d", "wall 0 0 nan 1", "wall 0 0 inf 1", "drop",
                     "ellipses", "ellipse 1", "spray yes"):
            with self.assertRaises(ValueError, msg=text) as caught:
                add_truth(f"spray\n{text}", sequence)
            self.assertIn(text, str(caught.exception))

    def test_moment_ellipse_is_the_one_that_particles_fill(self):
        # A random sample would move the moments by 1 % or more; a fine lattice does not.
        side = np.arange(-8.95, 9, 0.1)
        lattice = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
        inside = lattice[(lattice[:, 0] / 8) ** 2 + (lattice[:, 1] / 3) ** 2 < 1]
        for angle in (0.0, 0.4, 1.2, 2.5):
            turn = Similarity.plane(angle, 1.0, (3, 4))
            found = moment_ellipse(turn(inside), 0.1, 24 * np.pi)
            truth = Outline.of([turn(ellipse_ring((0, 0), 8, 3, 0, 0.04))])
            self.assertAlmostEqual(found.area, 24 * np.pi, delta=0.01)
            self.assertLess(compare(Curve(found, 1.0), Curve(truth, 1.0), 1.0).hausdorff, 0.01)

    def test_moment_ellipse_of_a_square_is_a_disc(self):
        disc_of_25 = moment_ellipse(0.5 * block(10) + (100, 0), 0.5, 25.0)
        radius = np.linalg.norm(disc_of_25.points - (102.25, 2.25), axis=1)
        np.testing.assert_allclose(radius, (25 / np.pi) ** 0.5, atol=1e-9)


class WallsTest(unittest.TestCase):
    FLOOR = np.array([[(0.0, 0.0), (40.0, 0.0)]])
    LONGER = np.array([[(-60.0, 0.0), (100.0, 0.0)]])

    @staticmethod
    def layer(height, amplitude, length=40):
        """Two layers of particles on a floor, and an outline whose lower side is a sine around `height`."""
        x = np.linspace(0, length, 20 * length + 1)
        lower = np.stack([x, height + amplitude * np.sin(np.pi * x)], axis=1)
        particles = np.stack(np.meshgrid(np.arange(0.5, length), [0.5, 1.5]), axis=-1).reshape(-1, 2)
        return Outline.of([np.concatenate([lower, [(length, 2.0), (0.0, 2.0)]])]), particles

    def test_roughness_is_the_standard_deviation_of_the_height(self):
        for height in (0.0, 0.3, -0.4):
            found = wall_roughness(*self.layer(height, 0.2), self.FLOOR, 1.0)
            self.assertAlmostEqual(found, 0.2 / 2 ** 0.5, delta=2e-3)
        self.assertAlmostEqual(wall_roughness(*self.layer(0.1, 0), self.FLOOR, 1.0), 0, delta=1e-7)

    def test_roughness_does_not_depend_on_place_and_unit(self):
        outline, particles = self.layer(0.1, 0.3)
        units = Similarity.plane(0.3, 0.02, (7, -3))
        moved = wall_roughness(outline.moved(units(outline.points)), units(particles), units(self.FLOOR), 0.02)
        self.assertAlmostEqual(moved, wall_roughness(outline, particles, self.FLOOR, 1.0), delta=1e-3)

    def test_dry_wall_contact_lines_and_corners_are_left_out(self):
        found = wall_roughness(*self.layer(0.1, 0.2), self.LONGER, 1.0)
        self.assertAlmostEqual(found, 0.2 / 2 ** 0.5, delta=5e-3)
        self.assertTrue(np.isnan(wall_roughness(*self.layer(0.1, 0.2, 9), self.LONGER, 1.0)))
        self.assertTrue(np.isnan(wall_roughness(*self.layer(0.1, 0.2), np.empty((0, 2, 2)), 1.0)))
        outline = polygon((0, 5), (40, 5), (40, 9), (0, 9))
        self.assertTrue(np.isnan(wall_roughness(outline, block(9, (0, 5)), self.FLOOR, 1.0)))

    def test_a_hole_in_the_outline_counts_as_far_away(self):
        half = polygon((0, 0), (20, 0), (20, 2), (0, 2))  # Heights 0 and 1.5 in equal parts.
        self.assertAlmostEqual(wall_roughness(half, self.layer(0, 0)[1], self.FLOOR, 1.0), 0.75, delta=0.01)


if __name__ == "__main__":
    unittest.main()
