"""Real matter: the scenes of `matter_scenes` as rows, and their tables of the feature against its absence."""

from typing import Callable, NamedTuple, Sequence as Seq

import numpy as np

from .comparisons import geometric_mean, match
from .matter_scenes import FEATURE, WITHOUT, Recipe, measure
from .paper import Shot
from .study import Row, map_in_processes, mean_of
from .tables import Table, fixed

# Limits of metrics: group, beginnings of kinds, metric, noise (False: at rest, None: both), must, aim. The must is
# required, the aim is wanted. The first entry that fits counts.
_Target = tuple[str, tuple[str, ...], str, bool | None, float, float]
_TARGETS: tuple[_Target, ...] = (
    ("sizes", ("1:3",), "deviation", False, 0.08, 0.05), ("sizes", ("2:1",), "deviation", False, 0.05, 0.035),
    ("grains", ("",), "cut", None, 0.12, 0.05), ("grains", ("",), "lone area", None, 0.2, 0.1),
    ("phases", ("",), "deviation", False, 0.05, 0.02), ("phases", ("",), "deviation", True, 0.055, 0.035),
    ("phases", ("",), "gap and overlap", None, 0.0, 0.0), ("phases", ("drop of 30",), "area", None, 0.03, 0.005),
    ("phases", ("",), "area", None, 0.005, 0.001), ("phases", ("sectors",), "junction", False, 0.1, 0.03),
    ("phases", ("T",), "junction", False, 0.15, 0.05),
    ("walls", ("drop at 60", "drop at 90", "drop at 120"), "contact", False, 0.5, 0.2),
    ("walls", ("drop at 30", "drop at 60", "drop at 90", "drop at 120"), "angle", False, 5.0, 3.0),
    ("walls", ("tank of", "round tank of"), "offset", False, 0.05, 0.01),
    ("walls", ("tank of", "round tank of"), "rms", False, 0.04, 0.015),
    ("walls", ("tank of",), "corner", False, 0.25, 0.12), ("walls", ("tank",), "corner", False, 0.0, 0.0),
    ("walls", ("tank",), "offset", False, 0.0, 0.0), ("walls", ("tank",), "rms", False, 0.0, 0.0))
_BY_WORST = ("cut", "lone area", "area", "gap and overlap")  # The worst scene is judged; for other metrics the mean.
_ROUNDING, _NEGLIGIBLE = 1e-9, 1e-3
_PICTURED = ("1:10 bidisperse", "2:1 zone", "pile 1:3", "loose 1:3", "sectors", "drop of 30", "tank of particles",
             "drop at 120", "layer", "across a corner")


class Found(NamedTuple):
    """Rows and, by group, pictures: two for each scene, with the feature and without it."""
    rows: list[Row]
    shots: dict[str, list[Shot]]


def _measure_rows(recipe: Recipe) -> tuple[list[Row], list[Shot]]:
    found = measure(recipe)
    state = f"noise {recipe.noise:g}" if recipe.noise else "at rest"
    rows = [Row(recipe.name, recipe.group, recipe.kind, state, True, name, "spacing", values, [])
            for name, values in found.values.items()]
    return rows, [Shot(f"{recipe.kind}, {state}, {name}", outline, found.particles, found.truth)
                  for name, outline in found.outlines.items()]


def run_matter(recipes: Seq[Recipe], jobs: int, progress: Callable[[int], None] = lambda done: None) -> Found:
    """Measures all scenes; the same rows for any number of jobs. The last scene of each kind in
    _PICTURED has pictures."""
    rows: list[Row] = []
    shots: dict[str, dict[str, list[Shot]]] = {}
    for (of_scene, of_pictures), recipe in zip(map_in_processes(_measure_rows, recipes, jobs, progress), recipes):
        rows += of_scene
        if recipe.kind in _PICTURED:
            shots.setdefault(recipe.group, {})[recipe.kind] = of_pictures
    return Found(rows, {group: sum(kinds.values(), []) for group, kinds in shots.items()})


def target_of(group: str, kind: str, state: str, metric: str) -> tuple[float, float] | None:
    """The required and the wanted limit of a metric (must, aim); None if it has none."""
    for of_group, kinds, of_metric, noisy, must, aim in _TARGETS:
        if (group, metric) == (of_group, of_metric) and kind.startswith(kinds) and noisy in (None, state != "at rest"):
            return must, aim
    return None


def matter_tables(rows: Seq[Row]) -> list[Table]:
    """A table for each group: a row for each kind, state and metric, then the group's geometric means of ratios."""
    return [_group_table(group, [row for row in rows if row.group == group])
            for group in dict.fromkeys(row.group for row in rows)]


def _group_table(group: str, rows: Seq[Row]) -> Table:
    table = Table(f"Matter: {group}", "Means over scenes. Ratio: geometric mean over scenes of the number with the "
                  "feature over that without, within .1 to 10; scenes with both below .001 are left out. ! beside a "
                  "ratio: worse than without; beside a number: misses the must.",
                  ["feature", "without", "ratio", "worst", "scene", "must", "aim", "scenes"], [])
    with_it, without = ([row for row in rows if row.method == name] for name in (FEATURE, WITHOUT))
    for kind, state in dict.fromkeys((row.shape, row.sampler) for row in rows):
        own, other = ([row for row in part if (row.shape, row.sampler) == (kind, state)] for part in (with_it, without))
        for metric in own[0].values:
            worst = max(own, key=lambda row: np.nan_to_num(row[metric], nan=np.inf))
            mean, target = mean_of([row[metric] for row in own]), target_of(group, kind, state, metric)
            judged = worst[metric] if metric in _BY_WORST else mean
            missed = target is not None and not judged <= target[0] + _ROUNDING
            by_mean, by_worst = missed and metric not in _BY_WORST, missed and metric in _BY_WORST
            table.rows.append((f"{kind}, {state}: {metric}", [
                fixed(mean, 4) + "!" * by_mean, fixed(mean_of([row[metric] for row in other]), 4),
                _ratio(own, other, metric), fixed(worst[metric], 4) + "!" * by_worst, worst.sequence,
                *([f"{value:g}" for value in target] if target else ["-", "-"]), str(len(own))]))
    for metric in dict.fromkeys(metric for row in with_it for metric in row.values):
        own, other = ([row for row in part if metric in row.values] for part in (with_it, without))
        table.rows.append((f"all: {metric}", ["", "", _ratio(own, other, metric), "", "", "", "", str(len(own))]))
    return table


def _ratio(own: Seq[Row], other: Seq[Row], metric: str) -> str:
    pairs = match(own, other, metric)
    ratio = geometric_mean(pairs[(pairs > _NEGLIGIBLE).any(axis=1)])
    return fixed(ratio) + "!" * (ratio > 1)
