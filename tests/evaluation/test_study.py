"""Studies, comparisons, the paper's claims and the command."""

import contextlib
import io
import json
import math
import pathlib
import tempfile
import unittest

import numpy as np

from partiemc_evaluation import __main__ as command
from partiemc_evaluation.comparisons import (bootstrap, compare_parts, compare_rows, geometric_mean, match,
                                             ratio_of_means)
from partiemc_evaluation.paper import default_film, judge, judge_claims, run_paper, worst
from partiemc_evaluation.report import Evaluation, as_html, as_text
from partiemc_evaluation.scenes import Recipe, make_scene
from partiemc_evaluation.study import BASELINE, DEFAULT, METRICS, PLACEMENTS, Row, all_methods, run_study

RECIPES = [Recipe("a-disc", shape="disc", seed=5, sampler="hexagonal", particles=300, frames=3),
           Recipe("bodies", "topology", "discs", 6, "blue-noise", particles=300, frames=3)]


def pairs(*values):
    return np.array(values, float).reshape(-1, 2)


def row(sequence, group="rigid", judged=True, **values):
    return Row(sequence, group, "disc", "relaxed", judged, "m", "spacing", {**dict.fromkeys(METRICS, math.nan), **values},
               [])


class ComparisonsTest(unittest.TestCase):
    def test_geometric_mean_of_ratios_has_limits(self):
        self.assertAlmostEqual(geometric_mean(pairs(1, 2, 200, 100, 0.125, 1)), 0.5, delta=1e-15)
        self.assertAlmostEqual(geometric_mean(pairs(1, 1e-9, 1e-9, 1)), 1, delta=1e-14)
        self.assertAlmostEqual(geometric_mean(pairs(0, 1, 0, 0)), 0.1 ** 0.5, delta=1e-14)
        self.assertTrue(math.isnan(geometric_mean(pairs())))

    def test_ratio_of_means(self):
        self.assertAlmostEqual(ratio_of_means(pairs(1, 2, 200, 100, 0.125, 1)), 201.125 / 103)
        self.assertEqual(ratio_of_means(pairs(0, 0)), 1)
        self.assertEqual(ratio_of_means(pairs(1, 0)), math.inf)

    def test_bootstrap_has_the_width_that_theory_expects(self):
        reach = math.exp(1.96 * math.log(2) / 10)
        found = bootstrap(pairs(*[0.5, 1, 2, 1] * 50), 5)
        self.assertAlmostEqual(found.value, 1, delta=1e-14)
        self.assertAlmostEqual(found.low, 1 / reach, delta=0.02)
        self.assertAlmostEqual(found.high, reach, delta=0.02)
        self.assertEqual(found, bootstrap(pairs(*[0.5, 1, 2, 1] * 50), 5))
        np.testing.assert_allclose(bootstrap(pairs(1, 2, 2, 4)), 0.5, atol=1e-14)
        # Four samples of two: 1/4, 1 twice, 4.
        np.testing.assert_allclose(bootstrap(pairs(1, 4, 4, 1)), (1, 0.25, 4), atol=1e-14)

    def test_matches_by_name_what_is_judged_and_there(self):
        method = [row("a", hausdorff=1.0), row("b", hausdorff=3.0), row("c"), row("d", judged=False, hausdorff=9.0),
                  row("e", hausdorff=9.0)]
        baseline = [row(name, hausdorff=2.0) for name in "bacd"]
        found = compare_rows(method, baseline, "hausdorff")
        self.assertAlmostEqual(found.ratio.value, 0.75 ** 0.5, delta=1e-14)
        self.assertEqual((found.wins, found.ties, found.losses), (1, 0, 1))

    def test_one_percent_is_a_tie(self):
        values = (0.98, 0.995, 1.005, 1.02)
        found = compare_rows([row(str(v), hausdorff=v) for v in values], [row(str(v), hausdorff=1.0) for v in values],
                             "hausdorff")
        self.assertEqual((found.wins, found.ties, found.losses), (1, 2, 1))

    def test_known_jitter_needs_a_baseline_that_moves(self):
        method = [row("still", known_mean_jitter=0.02), row("moves", known_mean_jitter=0.02)]
        baseline = [row("still", known_mean_jitter=0.01), row("moves", known_mean_jitter=0.04)]
        self.assertEqual(match(method, baseline, "known_mean_jitter").tolist(), [[0.02, 0.04]])

    def test_the_worst_part_is_first_and_unmeasured_ones_last(self):
        method = [row("a", "rigid", hausdorff=1.0), row("b", "noise", hausdorff=3.0), row("c", "ragged")]
        baseline = [row(name, hausdorff=2.0) for name in "abc"]
        parts = compare_parts(method, baseline, ["hausdorff"], "hausdorff", lambda r: r.group)
        self.assertEqual([part.name for part in parts], ["noise", "rigid", "ragged"])


class StudyTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.study = run_study(RECIPES, all_methods(), ["spacing", "nothing"])

    def test_has_a_row_for_each_method_and_knowledge(self):
        self.assertEqual([method.name for method in self.study.methods[:1]], [BASELINE])
        self.assertEqual(len(self.study.rows), 2 * (2 * 6 - 1))
        self.assertTrue(set(PLACEMENTS) <= {method.name for method in self.study.methods})

    def test_finds_marching_squares_near_the_truth(self):
        for found in self.study.of(BASELINE, "spacing"):
            self.assertLess(found["mean_deviation"], 0.3)
            self.assertLess(found["hausdorff"], 2.5)
            self.assertLess(abs(found["area_error"]), 0.1)
            self.assertEqual(found["wrong_normals"], 0)
            self.assertGreater(found["mean_jitter"], 0)

    def test_does_not_depend_on_the_unit_of_length(self):
        one, other = make_scene(RECIPES[0]), make_scene(RECIPES[0])
        for frame in other.frames:
            frame.positions, frame.area = frame.positions * 8, frame.area * 64
            frame.truth = frame.truth.moved(frame.truth.points * 8)
        other.spacing *= 8
        other.motion = None
        one.motion = None
        rows = [run_study([scene], all_methods()[:1], ["spacing"]).rows[0] for scene in (one, other)]
        for metric in ("hausdorff", "mean_deviation", "area_error"):
            self.assertAlmostEqual(rows[0][metric], rows[1][metric], delta=1e-6)

    def test_steps_and_constants_are_varied_one_at_a_time(self):
        changes = [method.parameters["_research"] for method in all_methods(True, True) if method.is_step]
        self.assertEqual(len(changes), 6 + 2 * 14)
        self.assertTrue(all(len(kind) == 1 and len(next(iter(kind.values()))) == 1 for kind in changes))
        rows = run_study(RECIPES[:1], [m for m in all_methods(True) if m.name.endswith(("plane", "without-area"))],
                         ["volumes"]).rows
        self.assertNotEqual(rows[0]["mean_deviation"], rows[1]["mean_deviation"])


class PaperTest(unittest.TestCase):
    def test_a_ratio_reproduces_from_nine_tenths_of_the_effect_on(self):
        self.assertEqual([judge(0.5, measured) for measured in (0.4, 0.55, 0.56, 0.97, 0.98, 1.5, math.nan)],
                         ["reproduces", "reproduces", "weaker", "weaker", "fails", "fails", "fails"])
        self.assertEqual(worst("reproduces", "fails", "weaker"), "fails")

    def test_every_table_and_figure_has_its_claims_and_pictures(self):
        film = make_scene(Recipe("a <film>", "topology", "discs", 9, "blue-noise", particles=300, frames=4))
        study = run_study(RECIPES, [m for m in all_methods() if m.name in PLACEMENTS], ["spacing"])
        runs = run_paper(film, lambda part: None, ("disc",))
        claims = judge_claims(study, runs)
        self.assertEqual(len(claims), 27)
        self.assertEqual({claim.about for claim in claims}, {f"Table {k}" for k in (1, 2, 3, 4)}
                         | {f"Figure {k}" for k in (5, 6, 10, 11, 12, 13, 14)})
        evaluation = Evaluation("test", study, runs, claims)
        page, text = as_html(evaluation), as_text(evaluation)
        self.assertIn("a &lt;film&gt;", page)
        self.assertNotIn("<film>", page)
        self.assertNotIn("<script", page)
        self.assertEqual(page.count("<img "), 1 + 7)
        self.assertIn("Figure 14, virtual-plane", text)


class CommandTest(unittest.TestCase):
    def run_command(self, *arguments):
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                code = command.main(arguments)
            except SystemExit as end:
                code = end.code
        return code, out.getvalue(), err.getvalue()

    def test_measures_recordings_and_writes_page_and_json(self):
        recording = pathlib.Path(__file__).parent.parent / "data/recordings/ellipse.pemc"
        with tempfile.TemporaryDirectory() as folder:
            code, out, err = self.run_command("set", "none", "--recording", str(recording), "--frames", "0:3", "--jobs",
                                              "1", "--methods", "placements", "--quiet", "--output-dir", folder)
            self.assertEqual((code, err), (0, ""))
            written = json.loads((pathlib.Path(folder) / "evaluation.json").read_text())
            self.assertEqual(len(written["rows"]), 8)
            self.assertIsNone(written["rows"][0]["wall_roughness"])
            self.assertIn("Recordings: geometric means", out)
            self.assertTrue((pathlib.Path(folder) / "evaluation.html").read_text().startswith("<!DOCTYPE html>"))

    def test_refuses_what_it_cannot_measure_in_one_line(self):
        for arguments, code, words in ((("set", "none"), 1, "nothing to measure"),
                                       (("set", "smoke", "--methods", "qef,best"), 1, "best"),
                                       (("set", "none", "--recording", "/nowhere.pemc"), 1, "/nowhere.pemc"),
                                       (("set", "large"), 2, "invalid choice")):
            found, _, err = self.run_command(*arguments)
            self.assertEqual(found, code, arguments)
            self.assertIn(words, err)

    def test_help_has_examples(self):
        code, out, _ = self.run_command("--help")
        self.assertEqual(code, 0)
        self.assertIn("set tuning --steps", out)

    def test_film_for_studies_without_a_recording(self):
        self.assertEqual(len(default_film().frames), 16)


if __name__ == "__main__":
    unittest.main()
