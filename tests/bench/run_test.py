"""Tests the check of ratios in run.py."""

import contextlib
import io
import math
import tempfile
import unittest
from pathlib import Path

import run


ROWS = [{"metric": "slow", "value": 2, "better": "lower", "margin": 1.7},
        {"metric": "fast", "value": 80, "better": "higher", "margin": 1.7}]


def worse(slow, fast):
    return run.failures(ROWS, {"slow": slow, "fast": fast})


def worse_twice(first, second):
    """Names of the metrics that fail twice. `first`, `second`: values of slow and fast."""
    measured = [dict(zip(("slow", "fast"), values)) for values in (first, second)]
    with contextlib.redirect_stderr(io.StringIO()):
        return list(run.failures_twice(ROWS, measured[0], lambda: measured[1]))


def file_with(text):
    file = tempfile.NamedTemporaryFile("w+", suffix=".csv", encoding="utf-8")
    file.write(text)
    file.flush()
    return file


class Failures(unittest.TestCase):
    def test_noise_and_improvements_pass(self):
        self.assertEqual(worse(2 * 1.5, 80 / 1.5), {})
        self.assertEqual(worse(0.1, 1000), {})

    def test_twice_as_slow_fails(self):
        self.assertRegex(worse(4, 80)["slow"], "^slow is 4, recorded 2")
        self.assertRegex(worse(2, 40)["fast"], "^fast is 40, recorded 80")
        self.assertEqual(len(worse(math.nan, math.nan)), 2)

    def test_zero_stays_zero(self):
        row = {"metric": "allocations", "value": 0, "better": "lower", "margin": 1.7}
        self.assertEqual(len(run.failures([row], {"allocations": 1})), 1)

    def test_unmeasured_metric_fails(self):
        row = {"metric": "gone", "value": 1, "better": "lower", "margin": 2}
        self.assertEqual(len(run.failures([row], {})), 1)

    def test_same_metric_fails_twice(self):
        self.assertEqual(worse_twice((4, 80), (4, 80)), ["slow"])
        self.assertEqual(worse_twice((4, 40), (2, 40)), ["fast"])
        self.assertEqual(worse_twice((4, 40), (4, 40)), ["slow", "fast"])

    def test_other_metric_of_second_measurement_passes(self):
        self.assertEqual(worse_twice((4, 80), (2, 80)), [])
        self.assertEqual(worse_twice((4, 80), (2, 40)), [])

    def test_second_measurement_follows_a_failure_only(self):
        self.assertEqual(run.failures_twice(ROWS, {"slow": 2, "fast": 80}, self.fail), {})


class Expectations(unittest.TestCase):
    def test_refresh_replaces_values_only(self):
        with file_with("# why\nmetric,value,better,margin\nslow,2,lower,1.7\n") as file:
            run.refresh(file.name, {"slow": math.pi})
            self.assertEqual(Path(file.name).read_text(),
                             "# why\nmetric,value,better,margin\nslow,3.14,lower,1.7\n")

    def test_bad_row_is_named(self):
        for row in ("slow,2,lower", "slow,x,lower,2", "slow,2,worse,2", "slow,2,lower,0.5"):
            with self.subTest(row), file_with(f"metric,value,better,margin\n{row}\n") as file:
                with self.assertRaises(SystemExit) as end:
                    run.read_expectations(file.name)
                self.assertIn(row.split(",")[1], str(end.exception))

    def test_recorded_expectations_are_read(self):
        rows = run.read_expectations(run.EXPECTED)
        self.assertTrue(rows)
        for row in rows:
            self.assertLess(row["margin"], 2, row["metric"])


class Repetitions(unittest.TestCase):
    def test_least_time_and_most_calls(self):
        runs = [{"name": "frame/1m/iterations:4/repeats:3", "run_type": "iteration",
                 "cpu_time": time, "calls": time, "bins_cpu_ms": 1, "field_cpu_ms": 2} for time in (3, 1, 2)]
        runs.append({"name": "frame/1m_mean", "run_type": "aggregate", "cpu_time": 9})
        measures = run.Measures({"benchmarks": runs})
        self.assertEqual(measures.least("frame/1m"), 1)
        self.assertEqual(measures.most("frame/1m", "calls"), 3)
        self.assertEqual(measures.stages("frame/1m", "bins", "field"), 3)
        self.assertEqual(measures.scenes("frame"), ["1m"])


if __name__ == "__main__":
    with contextlib.redirect_stdout(io.StringIO()):
        unittest.main()
