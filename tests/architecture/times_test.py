#!/usr/bin/python3
"""The table of timeouts and intervals in server/OPERATIONS.md has the names and values of the code."""

import os
import pathlib
import re
import unittest

ROOT = pathlib.Path(os.environ["PARTIEMC_SOURCE_DIR"])
MILLISECONDS = {"milliseconds": 1, "seconds": 1000, "minutes": 60_000, "hours": 3_600_000,
                "ms": 1, "s": 1000, "min": 60_000, "h": 3_600_000}
UNIT = r"\b(milliseconds|seconds|minutes|hours)"
NUMBER = r"(\d[\d'_]*)"


def times_of_code(text):
    """(name, milliseconds) of every constant, member and default argument except 0."""
    text = re.sub(r"//.*", "", text)
    found = re.findall(rf"(\w+) = (?:std::chrono::)?{UNIT}[({{]{NUMBER}", text)
    for unit, declared in re.findall(rf"{UNIT} (.*)", text):
        found += [(name, unit, number)
                  for name, number in re.findall(rf"(\w+)[({{]{NUMBER}[)}}]", declared)
                  if name not in MILLISECONDS]
    found += [(name, "seconds" if name.endswith("Seconds") else "milliseconds", number)
              for name, number in re.findall(rf"\b(\w+(?:_MS|Ms|Seconds)) = {NUMBER}", text)]
    times = ((name, int(re.sub("['_]", "", number)) * MILLISECONDS[unit])
             for name, unit, number in found)
    return {(name, time) for name, time in times if time > 0}


def times_of_table(text):
    """(name, milliseconds) of every row that names constants, in the section of the table."""
    times = set()
    section = text.partition("## Timeouts and intervals")[2].partition("\n## ")[0]
    for names, defaults in re.findall(r"^\| (.*?) \| (.*?) \|", section, re.MULTILINE):
        names = re.findall(r"`([A-Za-z_]\w*)`", names)
        values = re.findall(r"([\d.]+) (ms|s|min|h)\b", defaults)
        if names and len(names) != len(values):
            raise ValueError(f"{names} have {defaults}")
        times |= {(name, float(number) * MILLISECONDS[unit])
                  for name, (number, unit) in zip(names, values)}
    return times


class Times(unittest.TestCase):
    def test_reads_declarations(self):
        for text, times in {
                "constexpr std::chrono::milliseconds kA(1'500), kB(20);": {("kA", 1500), ("kB", 20)},
                "  std::chrono::milliseconds a{15'000};  // b{3}": {("a", 15_000)},
                "Limits b{.c = std::chrono::hours(1)};": {("c", 3_600_000)},
                "constexpr int kAMs = 100, kBMs = 50;": {("kAMs", 100), ("kBMs", 50)},
                "const RELEASE_MS = 60_000;": {("RELEASE_MS", 60_000)},
                "milliseconds none{0}; seconds Of(int x);": set()}.items():
            self.assertEqual(times_of_code(text), times, text)

    def test_table_has_the_times_of_the_code(self):
        code = set()
        for room in ("server", "client"):
            for path in sorted((ROOT / room).rglob("*")):
                if path.suffix in (".h", ".cc", ".ts") and "node_modules" not in path.parts:
                    code |= times_of_code(path.read_text(encoding="utf-8"))
        table = times_of_table((ROOT / "server/OPERATIONS.md").read_text(encoding="utf-8"))
        self.assertEqual(sorted(code - table), [], "missing in the table (milliseconds)")
        self.assertEqual(sorted(table - code), [], "not in the code (milliseconds)")


if __name__ == "__main__":
    unittest.main()
