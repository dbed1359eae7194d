"""Deviation, jitter, defects, advection, walls and recordings against truths that are known."""

import os
import pathlib
import types
import unittest

import numpy as np

from partiemc_evaluation.advection import Advection
from partiemc_evaluation.geometry import Curve, Outline, ellipse_ring
from partiemc_evaluation.metrics import carried, compare, find_defects, jitter, known_jitter
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

    def test_is_unknown_where_particles_trade_places(self):
        rng = np.random.default_rng(2)
        before = Frame(0.0, block(14), ids=np.arange(196))
        after = Frame(1.0, block(14) + rng.normal(0, 1.5, (196, 2)), ids=np.arange(196))
        curve = Curve(polygon((0, 0), (13, 0), (13, 13), (0, 13)), 1.0)
        self.assertLess(known_jitter(curve, curve, Advection.between(before, after, 1.0), 1.0)[1], 0.05)

    def test_uses_velocities_where_there_are_no_ids(self):
        velocity = np.tile([0.5, -0.25], (196, 1))
        before, after = Frame(0.0, block(14), velocities=velocity), Frame(2.0, block(14, (1, -0.5)),
                                                                          velocities=velocity)
        arrival, uncertainty = Advection.between(before, after, 1.0).follow(np.array([[6.0, 6.0]]), True)
        np.testing.assert_allclose(arrival, [[7.0, 5.5]], atol=1e-12)
        self.assertLess(uncertainty[0], 1e-9)
        self.assertIsNone(Advection.between(Frame(0.0, block(3)), Frame(1.0, block(3)), 1.0))

    def test_a_place_where_particles_come_or_go_is_unknown(self):
        before = Frame(0.0, block(14), ids=np.arange(196))
        after = Frame(1.0, block(14), ids=np.where(np.arange(196) == 90, 999, np.arange(196)))
        advection = Advection.between(before, after, 1.0)
        near, far = advection.follow(np.array([block(14)[90] + 0.5, [0.0, 0.0]]), True)[1]
        self.assertEqual(near, np.inf)
        self.assertLess(far, 1e-9)


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
        add_truth("# a comment\nwall 0 0 4 0 # a floor\nellipse\nspray\n", sequence)
        self.assertEqual((len(sequence.walls), sequence.whole), (1, False))
        self.assertAlmostEqual(sequence.frames[0].truth.area, 81, delta=0.01)
        for text in ("wall 0 0 4", "wall 1 1 1 1", "wall a b c d", "wall 0 0 nan 1", "drop"):
            with self.assertRaises(ValueError):
                add_truth(text, sequence)

    def test_moment_ellipse_is_the_one_that_particles_fill(self):
        points = np.random.default_rng(1).uniform(-9, 9, (40000, 2))
        turn = Similarity.plane(0.7, 1.0, (3, 4))
        inside = (points[:, 0] / 8) ** 2 + (points[:, 1] / 3) ** 2 < 1
        found = moment_ellipse(turn(points[inside]), 0.01, 24 * np.pi)
        truth = Outline.of([turn(ellipse_ring((0, 0), 8, 3, 0, 0.04))])
        self.assertLess(compare(Curve(found, 1.0), Curve(truth, 1.0), 1.0).hausdorff, 0.1)


class WallsTest(unittest.TestCase):
    def test_roughness_is_the_standard_deviation_of_the_height(self):
        x = np.linspace(0, 40, 4001)
        wave = 0.1 * np.sin(2 * np.pi * x / 4)
        outline = Outline.of([np.concatenate([np.stack([x, wave], axis=1), [(40.0, 10.0), (0.0, 10.0)]])])
        particles = np.stack(np.meshgrid(np.arange(0.5, 40), np.arange(0.5, 5)), axis=-1).reshape(-1, 2)
        wall = np.array([[(0.0, 0.0), (40.0, 0.0)]])
        self.assertAlmostEqual(wall_roughness(outline, particles, wall, 1.0), 0.1 / 2 ** 0.5, delta=1e-3)
        units = Similarity.plane(0.3, 0.02, (7, -3))
        moved = wall_roughness(outline.moved(units(outline.points)), units(particles), units(wall), 0.02)
        self.assertAlmostEqual(moved, 0.1 / 2 ** 0.5, delta=1e-3)

    def test_dry_walls_have_none(self):
        outline, wall = polygon((0, 5), (40, 5), (40, 9), (0, 9)), np.array([[(0.0, 0.0), (40.0, 0.0)]])
        self.assertTrue(np.isnan(wall_roughness(outline, block(9, (0, 5)), wall, 1.0)))


if __name__ == "__main__":
    unittest.main()
