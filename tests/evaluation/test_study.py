"""Studies, comparisons, the paper's claims and the command."""

import contextlib
import html
import io
import json
import math
import pathlib
import re
import tempfile
import unittest
from dataclasses import replace

import numpy as np
import partiemc

from partiemc_evaluation import __main__ as command
from partiemc_evaluation.comparisons import (bootstrap, compare_parts, compare_rows, geometric_mean, match, mean_over,
                                             ratio_of_means)
from partiemc_evaluation.geometry import Outline
from partiemc_evaluation.paper import default_film, judge, judge_claims, run_paper, worst
from partiemc_evaluation.report import Evaluation, as_html, as_text
from partiemc_evaluation.scenes import Frame, Recipe, Sequence, make_scene
from partiemc_evaluation.study import (BASELINE, DEFAULT, METRICS, PLACEMENTS, Evaluator, Row, Study, all_methods,
                                       run_study)
from partiemc_evaluation.tables import Table, part_table, step_table

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

    def test_measures_a_lattice_in_a_square_as_geometry_expects(self):
        scene = make_scene(Recipe("square", shape="square", seed=12, sampler="lattice", particles=625))
        found = Evaluator(scene).run(all_methods()[0])
        self.assertLess(found["mean_deviation"], 0.15)
        self.assertLess(found["hausdorff"], 1.2)
        self.assertLess(found["bias"], 0.03)
        self.assertEqual([found[m] for m in ("component_error", "self_intersections", "folds")], [0, 0, 0])
        self.assertAlmostEqual(found["center_mean"], 0.5, delta=0.1)  # Centres lie half a spacing inside.
        self.assertEqual(len(found.frames), 8)
        self.assertEqual(["mean_jitter" in frame for frame in found.frames], [False] + 7 * [True])
        again = Evaluator(scene).run(all_methods()[0])
        self.assertEqual({**found.values, "milliseconds": 0}, {**again.values, "milliseconds": 0})

    def test_rows_do_not_depend_on_the_number_of_jobs(self):
        methods = [m for m in all_methods() if m.name in (BASELINE, DEFAULT)]
        rows = [run_study(RECIPES, methods, ["spacing"], jobs).rows for jobs in (1, 2)]
        for one, other in zip(*rows):
            np.testing.assert_equal({**one.values, "milliseconds": 0}, {**other.values, "milliseconds": 0})
            self.assertEqual((one.sequence, one.method), (other.sequence, other.method))

    def test_ids_change_no_outline(self):
        frame = make_scene(RECIPES[1]).frames[0]
        for placement in PLACEMENTS:
            digests = [partiemc.reconstruct(frame.positions, ids=ids, placement=placement).rings_digest
                       for ids in (None, frame.ids)]
            self.assertEqual(*digests)

    def test_an_error_names_the_sequence_and_the_frame(self):
        broken = make_scene(RECIPES[0])
        broken.frames[2].positions[5, 1] = math.nan
        with self.assertRaisesRegex(partiemc.Error, "a-disc, frame 2: "):
            run_study([broken], all_methods()[:1], ["spacing"])

    def test_recordings_have_jitter_by_velocities(self):
        scene = make_scene(Recipe("square", shape="square", seed=12, sampler="lattice", particles=400, frames=4))
        for now, after in zip(scene.frames, scene.frames[1:]):
            now.velocities = after.positions - now.positions
        for frame in scene.frames:
            frame.truth, frame.area, frame.ids = Outline(), 0.0, None
        scene.motion, scene.group = None, "recording"
        found = Evaluator(scene).run(all_methods()[0])
        self.assertTrue(math.isnan(found["hausdorff"]))
        self.assertLess(found["mean_jitter"], 0.1)
        self.assertLess(abs(found["area_error"]), 0.03)
        self.assertEqual(found.frames[-1]["known_share"], 0)  # No velocity leads back from the last frame.

    def test_knows_the_motion_of_recordings_for_every_method(self):
        # A block moves as one. A cloud next to it has new random places in every frame.
        rng, block = np.random.default_rng(5), np.stack(np.divmod(np.arange(400), 20), axis=1)
        frames = [Frame(float(t), np.concatenate([block + (0.3 * t, 0), rng.uniform((40, 0), (60, 20), (400, 2))]),
                        ids=np.arange(800)) for t in range(4)]
        evaluator = Evaluator(Sequence("block and cloud", "recording", "", "", 1.0, frames))
        for method in all_methods():
            if method.name in (BASELINE, "qef", DEFAULT):
                found = evaluator.run(method)
                self.assertGreater(found["mean_jitter"], 0.2)
                self.assertLess(found["known_mean_jitter"], 0.1)
                self.assertTrue(0.4 < found["known_share"] < 0.55, found["known_share"])

    def test_means_leave_out_what_is_absent_or_not_judged(self):
        rows = [row("a", hausdorff=1.0), row("b", judged=False, hausdorff=7.0), row("c")]
        self.assertEqual(mean_over(rows, "hausdorff"), 1)
        self.assertTrue(math.isnan(mean_over(rows, "bias")))

    def test_steps_and_constants_are_varied_one_at_a_time(self):
        changes = [method.parameters["_research"] for method in all_methods(True, True) if method.is_step]
        self.assertEqual(len(changes), 6 + 2 * 14)
        self.assertTrue(all(len(kind) == 1 and len(next(iter(kind.values()))) == 1 for kind in changes))
        rows = run_study(RECIPES[:1], [m for m in all_methods(True) if m.name.endswith(("plane", "without-area"))],
                         ["volumes"]).rows
        self.assertNotEqual(rows[0]["mean_deviation"], rows[1]["mean_deviation"])


class TablesTest(unittest.TestCase):
    def study(self, *numbers):
        """Rows of the baseline and of the default: sequence, group, sampler, mean deviation of both."""
        rows = [Row(sequence, group, "disc", sampler, True, name, "spacing",
                    {**dict.fromkeys(METRICS, math.nan), "mean_deviation": value}, [])
                for sequence, group, sampler, *values in numbers for name, value in zip((DEFAULT, BASELINE), values)]
        return Study(all_methods(), ["spacing"], rows)

    def test_put_the_worst_part_first_and_list_what_is_lost(self):
        study = self.study(("a", "rigid", "lattice", 0.5, 1.0), ("b", "rigid", "clumped", 2.0, 1.0),
                           ("c", "noise", "lattice", 3.0, 1.0), ("d", "growth", "relaxed", 1.2, 1.0))
        groups, samplers = (part_table(study, "spacing", False, DEFAULT, what) for what in ("group", "sampler"))
        losses = part_table(study, "spacing", False, DEFAULT, "sequence", losses=True)
        names = [[name for name, _ in table.rows if not name.startswith(" ")] for table in (groups, samplers, losses)]
        self.assertEqual(names, [["noise", "growth", "rigid", "all"], ["clumped", "lattice", "relaxed", "all"],
                                 ["c", "b", "all"]])
        self.assertEqual(dict(groups.rows)["noise"][1], "3.000!")
        self.assertEqual(dict(samplers.rows)["lattice"][1], "1.225!")  # The square root of 1.5.

    def test_steps_that_are_better_without_are_marked(self):
        study = self.study(("a", "rigid", "lattice", 0.5, 1.0))
        step = all_methods(steps=True)[-1]
        study.methods.append(step)
        study.rows.append(replace(study.rows[0], method=step.name, values={**study.rows[0].values,
                                                                          "mean_deviation": 0.4}))
        self.assertEqual([(name, cells[1]) for name, cells in step_table(study, "spacing", False).rows],
                         [(DEFAULT, "0.500"), (step.name, "0.400!")])
        study.methods.pop()
        self.assertEqual(step_table(study, "spacing", False).rows, [])

    def test_text_and_page_show_the_same_table(self):
        table = Table("Title", "A note.", ["one", "two"], [("row <1>", ["1", "2!"])])
        self.assertEqual(table.as_text(), "Title\nA note.\n         one  two\nrow <1>    1   2!\n\n")
        self.assertIn('row &lt;1&gt;</th><td>1</td><td class="alert">2</td>', table.as_html())


class PaperTest(unittest.TestCase):
    def test_a_ratio_reproduces_from_nine_tenths_of_the_effect_on(self):
        # Near the threshold of 0.55, not on it: 1 - 0.55 is less than 0.9 * 0.5 in binary numbers.
        self.assertEqual([judge(0.5, measured) for measured in (0.4, 0.5499, 0.5501, 0.97, 0.98, 1.5, math.nan)],
                         ["reproduces", "reproduces", "weaker", "weaker", "fails", "fails", "fails"])
        self.assertEqual(worst("reproduces", "fails", "weaker"), "fails")

    def test_every_table_and_figure_has_its_claims_and_pictures(self):
        film = default_film()
        self.assertEqual(len(film.frames), 16)
        film = replace(film, name="a <film>", frames=film.frames[::5])
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
        for words in ("nan", "http://", "https://"):
            self.assertNotIn(words, re.sub(r'src="[^"]*"', "", page))
        for claim in claims:
            self.assertIn(html.escape(claim.sentence), page)
        self.assertEqual([len(runs.shots[f"Figure {k}"]) for k in (5, 6, 11, 12, 13)], [3, 8, 4, 4, 4])
        for (_, share), (_, ratio) in runs.thinned.items():
            self.assertAlmostEqual(ratio, share ** -0.5, delta=5e-3)
        for grid in runs.fills.values():
            self.assertTrue(grid.same_rings)
            self.assertLess(grid.triangles["greedy"], grid.triangles["grid"])
            self.assertLessEqual(grid.triangles["polygon"], grid.triangles["greedy"])
            self.assertEqual(grid.t_junctions["conforming"], 0)
        # A finding follows from the numbers.
        for (_, fill), film_run in runs.films.items():
            if fill == "greedy":
                film_run.triangles[:] = 1e6
        findings = {claim.about: claim.finding for claim in judge_claims(study, runs)}
        self.assertEqual((findings["Figure 12"], findings["Figure 14"]), ("fails", "fails"))


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

    def test_recordings_of_a_folder_are_measured_by_what_is_known_of_them(self):
        folder = pathlib.Path(__file__).parent.parent / "data/recordings"
        with tempfile.TemporaryDirectory() as output:
            code, out, _ = self.run_command("set", "none", "--recordings", str(folder), "--frames", "8:10", "--methods",
                                            "placements", "--quiet", "--jobs", "1", "--output-dir", output)
            rows = json.loads((pathlib.Path(output) / "evaluation.json").read_text())["rows"]
        self.assertEqual(code, 0)
        self.assertIn("ratios by sequence, virtual-plane", out)
        known = {metric: {row["sequence"] for row in rows if row[metric] is not None} for metric in METRICS}
        walls = {"drop_on_film", "granular_column", "sloshing", "splash"}
        self.assertEqual(known["known_mean_jitter"], walls | {"ellipse", "square"})
        self.assertEqual(known["wall_roughness"], walls)
        self.assertEqual(known["mean_deviation"], {"ellipse"})
        self.assertEqual(known["area_error_size"], {"ellipse", "sloshing", "square"})

    def test_refuses_what_it_cannot_measure_in_one_line(self):
        for arguments, code, words in ((("set", "none"), 1, "nothing to measure"),
                                       (("set", "smoke", "--methods", "qef,best"), 1, "best"),
                                       (("set", "none", "--recording", "/nowhere.pemc"), 1, "/nowhere.pemc"),
                                       (("set", "smoke", "--recordings", "/nowhere"), 1, "/nowhere"),
                                       (("set", "none", "--frames", "x"), 2, "--frames"),
                                       (("set", "none", "--jobs", "0"), 2, "--jobs"),
                                       (("set", "large"), 2, "invalid choice")):
            found, _, err = self.run_command(*arguments)
            self.assertEqual(found, code, arguments)
            self.assertIn(words, err)
            self.assertEqual(err.count("\n"), 1 if code == 1 else err.count("\n"))

    def test_help_has_examples(self):
        code, out, _ = self.run_command("--help")
        self.assertEqual(code, 0)
        self.assertIn("set tuning --steps", out)


if __name__ == "__main__":
    unittest.main()
