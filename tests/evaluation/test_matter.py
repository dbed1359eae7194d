"""Packings of different sizes and of grains, scenes of real matter, their tables and the command."""

import contextlib
import io
import json
import math
import pathlib
import tempfile
import unittest
from unittest import mock

import numpy as np
from scipy.spatial import cKDTree
from shapely.geometry import box

from partiemc_evaluation import __main__ as command
from partiemc_evaluation import matter_scenes
from partiemc_evaluation.geometry import Curve, Outline, norm
from partiemc_evaluation.matter import matter_tables, target_of
from partiemc_evaluation.matter_scenes import FEATURE, SETS, WITHOUT, Recipe, make_matter_set, measure
from partiemc_evaluation.packings import fill_sizes, pile_grains, shrink_to_grains, spray_grains
from partiemc_evaluation.study import Row


def curve_of(*corners):
    return Curve(Outline.of_shapely(box(*corners)), 1.0)


def gaps_of(centers, diameters):
    """(N, N) gaps between discs; infinite on the diagonal."""
    gaps = norm(centers[:, None] - centers) - (diameters[:, None] + diameters) / 2
    return gaps + np.diag(np.full(len(gaps), np.inf))


class PackingsTest(unittest.TestCase):
    def test_particles_of_two_sizes_fill_their_region(self):
        region = curve_of(0, 0, 20, 15)
        centers, sizes = fill_sizes(region, lambda rng, points: np.where(rng.random(len(points)) < 0.1, 3.0, 1.0),
                                    np.random.default_rng(8))
        self.assertEqual(len(sizes), 300)
        self.assertAlmostEqual((sizes ** 2).sum(), 300)
        self.assertAlmostEqual(sizes.max() / sizes.min(), 3)
        self.assertTrue(region.contains(centers).all())
        # Pairs are about a mean size apart.
        apart = norm(centers[:, None] - centers) / ((sizes[:, None] + sizes) / 2) + 9 * np.eye(300)
        self.assertGreater(apart.min(), 0.6)
        self.assertGreater((region.nearest(centers)[0] / sizes).min(), 0.1)
        self.assertAlmostEqual(apart.min(axis=1).mean(), 0.9, delta=0.1)

    def test_zones_without_a_draw_stay_empty_at_first(self):
        centers, sizes = fill_sizes(curve_of(-10, 0, 10, 10), matter_scenes._zones, np.random.default_rng(3))
        large = sizes > sizes.mean()
        self.assertLess(np.median(centers[large, 0]), -2)
        self.assertGreater(np.median(centers[~large, 0]), 2)

    def test_grains_rest_on_the_floor_or_on_two_others(self):
        diameters = np.random.default_rng(4).uniform(1, 2, 60)
        centers = pile_grains(diameters, 12, np.random.default_rng(5))
        gaps = gaps_of(centers, diameters)
        self.assertGreater(gaps.min(), -1e-8)
        height = centers[:, 1] - diameters / 2
        self.assertGreater(height.min(), -1e-8)
        touching = (gaps < 1e-6).sum(axis=1)
        self.assertTrue(((height < 1e-6) | (touching >= 2)).all())

    def test_lone_grains_are_a_diameter_apart_and_loose_ones_touch(self):
        diameters = np.random.default_rng(6).uniform(1, 3, 40)
        centers = spray_grains(diameters, np.random.default_rng(7))
        self.assertTrue((gaps_of(centers, diameters) >= np.maximum(diameters[:, None], diameters) - 1e-9).all())
        self.assertAlmostEqual(gaps_of(centers, shrink_to_grains(centers, 9 * diameters)).min(), 0)


class MeasuresTest(unittest.TestCase):
    def test_gap_and_overlap_of_known_squares(self):
        inner = box(-5, 1, 5, 9)
        for shift, width in ((0.2, 0.2), (-0.3, 0.3), (0.0, 0.0)):
            curves = [curve_of(-9, 0, 0, 10), curve_of(shift, 0, 9, 10)]
            # Gaps count inside of `inner`, overlaps everywhere.
            expected = width * (10 / 8 if shift < 0 else 1)
            self.assertAlmostEqual(matter_scenes._gap_and_overlap(curves, inner, 8), expected)

    def test_junction_is_the_point_nearest_to_all_phases(self):
        curves = [curve_of(-9, -9, 0.3, 0), curve_of(0.3, -9, 9, 0), curve_of(-9, 0, 9, 9)]
        self.assertAlmostEqual(matter_scenes._junction_distance(curves, np.zeros(2)), 0.3, delta=0.03)

    def test_local_sizes_are_means_of_near_particles(self):
        particles, sizes = np.array([(0.0, 0), (40, 0), (41, 0)]), np.array([1.0, 3, 1])
        local = matter_scenes._local_sizes(np.array([(0.5, 0), (40.5, 0), (20, 0)]), particles, sizes)
        self.assertEqual(local[0], 1)
        self.assertTrue(1.5 < local[1] < 2.5)
        self.assertEqual(local[2], 1)

    def test_areas_are_those_of_the_rings_around_points(self):
        outline = Outline.of([ring for corners in ((0, 0, 2, 3), (5, 5, 6, 6))
                              for ring in Outline.of_shapely(box(*corners)).rings()])
        areas = matter_scenes._areas_at(np.array([(1.0, 1), (5.5, 5.5), (9, 9)]), outline)
        np.testing.assert_allclose(areas, (6, 1, 0))


class ScenesTest(unittest.TestCase):
    def test_sets_are_functions_of_their_names(self):
        everything = make_matter_set("all")
        self.assertEqual(everything, make_matter_set("all"))
        self.assertEqual(len({recipe.seed for recipe in everything}), len(everything))
        self.assertEqual(sum((make_matter_set(group) for group in SETS[2:]), []), everything)
        smoke = make_matter_set("smoke")
        self.assertLess(set(smoke), set(everything))
        self.assertEqual({(r.group, r.kind) for r in smoke}, {(r.group, r.kind) for r in everything})
        self.assertEqual(len(smoke), len({(r.group, r.kind) for r in smoke}))

    def better(self, kind, *metrics, noise=0.0):
        """Measures a scene of this kind of the smoke set; the feature is better by these metrics."""
        recipe = next(recipe for recipe in make_matter_set("smoke") if recipe.kind == kind)
        found = measure(recipe)
        for metric in metrics:
            self.assertLess(found.values[FEATURE][metric], found.values[WITHOUT][metric], (kind, metric))
        self.assertTrue(all(found.outlines.values()))
        return found.values[FEATURE]

    def test_own_sizes(self):
        self.assertLess(self.better("2:1 zone", "deviation")["deviation"], 0.05)

    def test_grains(self):
        found = self.better("spray 1:3", "cut", "lone area")
        self.assertLess(found["cut"], 0.05)
        self.assertLess(found["lone area"], 0.2)

    def test_phases(self):
        found = self.better("sectors", "gap and overlap", "junction")
        self.assertLess(found["gap and overlap"], 1e-9)

    def test_walls(self):
        self.assertLess(self.better("drop at 60", "contact", "angle", "foot")["contact"], 0.5)
        self.assertLess(self.better("tank", "offset", "rms", "deviation")["offset"], 1e-9)
        self.assertLess(self.better("round tank of particles", "rms", "deviation")["offset"], 0.05)

    def test_boxes(self):
        self.assertLess(self.better("across a corner", "perimeter", "bodies")["area"], 1e-3)
        self.assertEqual(self.better("shear flow", "bodies", "new identities")["new identities"], 0)
        self.assertEqual(self.better("layer", "cut bodies", "perimeter")["cut bodies"], 0)

    def test_particles_follow_from_the_recipe(self):
        recipe = Recipe("walls", "drop at 90", "", 0.1, 77)
        np.testing.assert_array_equal(measure(recipe).particles, measure(recipe).particles)
        self.assertEqual(recipe.name, "77")


def rows(kind, state, *values, group="sizes", metric="deviation"):
    """A scene for each pair of numbers, with the feature and without it."""
    return [Row(f"{state}-{k}", group, kind, state, True, name, "spacing", {metric: value}, [])
            for k, pair in enumerate(values) for name, value in zip((FEATURE, WITHOUT), pair)]


class TablesTest(unittest.TestCase):
    def test_the_first_target_that_fits_counts(self):
        self.assertEqual(target_of("phases", "drop of 30", "at rest", "area"), (0.03, 0.005))
        self.assertEqual(target_of("phases", "drop of 254", "noise 0.1", "area"), (0.005, 0.001))
        self.assertEqual(target_of("walls", "tank of particles", "at rest", "corner"), (0.25, 0.12))
        self.assertEqual(target_of("walls", "tank", "at rest", "corner"), (0, 0))
        self.assertIsNone(target_of("walls", "tank", "noise 0.1", "corner"))
        self.assertIsNone(target_of("sizes", "1:10 uniform", "noise 0.15", "deviation"))

    def test_ratios_are_geometric_means_and_missed_musts_are_marked(self):
        tables = matter_tables(rows("1:3 uniform", "at rest", (0.05, 0.1), (0.15, 0.075))
                               + rows("1:3 uniform", "noise 0.15", (1e-4, 2e-4))
                               + rows("pile 1:1", "at rest", (0.01, 0.2), (0.13, 0.2), group="grains", metric="cut"))
        self.assertEqual([table.title for table in tables], ["Matter: sizes", "Matter: grains"])
        cells = dict(tables[0].rows)
        self.assertEqual(cells["1:3 uniform, at rest: deviation"],
                         ["0.1000!", "0.0875", "1.000", "0.1500", "at rest-1", "0.08", "0.05", "2"])
        self.assertEqual(cells["1:3 uniform, noise 0.15: deviation"][2], "-")  # Both numbers are negligible.
        self.assertEqual(cells["all: deviation"][2], "1.000")
        # The mean is below the must, but the worst scene counts.
        self.assertEqual(dict(tables[1].rows)["pile 1:1, at rest: cut"][:4], ["0.0700", "0.2000", "0.255", "0.1300!"])


class CommandTest(unittest.TestCase):
    def test_prints_tables_and_writes_page_and_json(self):
        recipes = [recipe for recipe in make_matter_set("smoke") if recipe.kind in ("layer", "drop at 120")]
        out, err = io.StringIO(), io.StringIO()
        with tempfile.TemporaryDirectory() as folder, mock.patch.object(command, "make_matter_set", lambda name: recipes):
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                code = command.main(["matter", "smoke", "--jobs", "1", "--output-dir", folder])
            written = json.loads((pathlib.Path(folder) / "matter.json").read_text())
            page = (pathlib.Path(folder) / "matter.html").read_text()
        self.assertEqual(code, 0)
        self.assertTrue(err.getvalue().endswith("2 of 2 scenes\n"))
        self.assertIn("drop at 120, at rest: contact", out.getvalue())
        self.assertEqual(len(written["rows"]), 4)
        self.assertEqual([table["title"] for table in written["tables"]], ["Matter: walls", "Matter: periodic"])
        self.assertTrue(all(value is None or math.isfinite(value) for row in written["rows"]
                            for value in row.values() if not isinstance(value, str)))
        self.assertEqual(page.count("<img "), 2)
        self.assertNotIn("<script", page)


if __name__ == "__main__":
    unittest.main()
