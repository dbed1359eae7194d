"""Tables of a study and of the paper's runs, for a terminal and for the page."""

import html
import math
from dataclasses import dataclass
from typing import Sequence as Seq

import numpy as np

from .comparisons import LOSS_RATIO, TIE_SHARE, Ratio, compare_parts, compare_rows, geometric_mean, match, mean_over
from .paper import FILLS, GRIDS, PAPER_MERGING, PAPER_ROWS, PaperRuns
from .study import BASELINE, DEFAULT, METRICS, Study

# The metrics that compare methods: of scenes against the truth, of recordings by their known facts.
SCENE_METRICS = ("hausdorff", "mean_deviation", "bias", "area_deviation", "hausdorff_jitter", "mean_jitter")
RECORDING_METRICS = ("mean_deviation", "area_error_size", "area_deviation", "hausdorff_jitter", "mean_jitter",
                     "known_hausdorff_jitter", "known_mean_jitter", "wall_roughness")


@dataclass
class Table:
    """rows: a name, and a text for each head. A text that ends with "!" is highlighted."""
    title: str
    note: str
    heads: list[str]
    rows: list[tuple[str, list[str]]]

    def as_text(self) -> str:
        lines = [["", *self.heads]] + [[name, *cells] for name, cells in self.rows]
        widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
        body = "\n".join(line[0].ljust(widths[0]) + "".join(
            "  " + cell.rjust(width) for cell, width in zip(line[1:], widths[1:])) for line in lines)
        return f"{self.title}\n{self.note}\n{body}\n\n"

    def as_html(self) -> str:
        def cell(text: str) -> str:
            alert = ' class="alert"' if text.endswith("!") else ""
            return f"<td{alert}>{html.escape(text.rstrip('!'))}</td>"
        heads = "".join(f"<th>{html.escape(head)}</th>" for head in self.heads)
        rows = "\n".join(f"<tr><th>{html.escape(name)}</th>{''.join(map(cell, cells))}</tr>"
                         for name, cells in self.rows)
        return (f"<h3>{html.escape(self.title)}</h3>\n<p>{html.escape(self.note)}</p>\n<div class=\"wide\">"
                f"<table><tr><th></th>{heads}</tr>\n{rows}</table></div>\n")


def fixed(value: float, digits: int = 3) -> str:
    return "-" if math.isnan(value) else f"{value:.{digits}f}"


def _ratio(ratio: Ratio) -> str:
    return fixed(ratio.value) + ("!" if ratio.value > 1 else "")


def _interval(ratio: Ratio) -> str:
    return "-" if math.isnan(ratio.value) else f"{ratio.low:.3f}..{ratio.high:.3f}"


def judged_metrics(recordings: bool) -> tuple[str, ...]:
    return RECORDING_METRICS if recordings else SCENE_METRICS


def _table(what: str, note: str, given: str, recordings: bool, heads: Seq[str]) -> Table:
    kind = "Recordings" if recordings else "Synthetic sequences"
    return Table(f"{kind}: {what}, {given} given", note, [head.replace("_", " ") for head in heads], [])


def ratio_table(study: Study, given: str, recordings: bool) -> Table:
    metrics, baseline = judged_metrics(recordings), study.of(BASELINE, given, recordings)
    table = _table("geometric means of ratios to marching squares", "Every sequence counts alike; below 1 is better. "
                   "95 % bootstrap interval; ratio of the means; sequences won / tied (1 %) / lost.", given, recordings,
                   metrics)
    for method in study.methods:
        rows = study.of(method.name, given, recordings)
        if method.is_step or method.name == BASELINE or not rows:
            continue
        found = [compare_rows(rows, baseline, metric) for metric in metrics]
        table.rows += [(method.name, [_ratio(c.ratio) for c in found]),
                       ("  95 % interval", [_interval(c.ratio) for c in found]),
                       ("  ratio of means", [fixed(c.ratio_of_means) for c in found]),
                       ("  won / tied / lost", [f"{c.wins}/{c.ties}/{c.losses}" for c in found])]
    return table


def step_table(study: Study, given: str, recordings: bool) -> Table:
    """The default with each step or constant changed; no rows if the study has no such methods."""
    metrics, baseline = judged_metrics(recordings), study.of(BASELINE, given, recordings)
    table = _table(f"{DEFAULT} with a step or a constant changed", "Geometric means of ratios to marching squares; "
                   "marked where the change is better by 1 %.", given, recordings, metrics)
    steps = [m.name for m in study.methods if m.is_step and study.of(m.name, given, recordings)]
    whole: list[float] = []
    for name in [DEFAULT, *steps] if steps else []:
        rows = study.of(name, given, recordings)
        means = [geometric_mean(match(rows, baseline, metric)) for metric in metrics]
        whole = whole or means
        table.rows.append((name, [fixed(value) + ("!" if value < (1 - TIE_SHARE) * own else "")
                                  for value, own in zip(means, whole)]))
    return table


def part_table(study: Study, given: str, recordings: bool, method: str, what: str, losses: bool = False) -> Table:
    """Ratios of one method by "group", "sampler" or "sequence", worst first, all together last. losses: only parts
    with a ratio above LOSS_RATIO in any metric but the area bias."""
    metrics, worst = judged_metrics(recordings), "known_mean_jitter" if recordings else "mean_deviation"
    table = _table(f"ratios by {what}{f' above {LOSS_RATIO}' if losses else ''}, {method}", "Geometric means to marching "
                   f"squares; worst first by {worst.replace('_', ' ')}. Above 1 is marked.", given, recordings,
                   [*metrics, "sequences"])
    rows, baseline = study.of(method, given, recordings), study.of(BASELINE, given, recordings)
    parts = compare_parts(rows, baseline, metrics, worst, lambda row: str(getattr(row, what)))
    if losses:
        parts = [part for part in parts
                 if any(ratio.value > LOSS_RATIO for m, ratio in part.ratios.items() if m != "bias")]
    for part in parts and parts + compare_parts(rows, baseline, metrics, worst, lambda row: "all"):
        table.rows.append((part.name, [*map(_ratio, part.ratios.values()), str(part.sequences)]))
        if part.sequences > 1:
            table.rows.append(("  95 % interval", [*map(_interval, part.ratios.values()), ""]))
    return table


def mean_table(study: Study, given: str, recordings: bool) -> Table:
    """Means of all metrics over the judged sequences, a row for each metric."""
    names = [m.name for m in study.methods if not m.is_step and study.of(m.name, given, recordings)]
    table = _table("means", "Over the judged sequences. Lengths in spacings, areas relative.", given, recordings, names)
    for metric in METRICS:
        means = [mean_over(study.of(name, given, recordings), metric) for name in names]
        if not np.isnan(means).all():
            defect = metric in ("self_intersections", "folds", "spurious_components")
            table.rows.append((metric, [fixed(mean, 5) + ("!" if defect and mean > 0 else "") for mean in means]))
    return table


def study_tables(study: Study, methods: Seq[str]) -> list[Table]:
    """The tables, the most important first, with details of `methods` only."""
    tables = []
    for recordings, given in ((r, t) for r in (False, True) for t in study.given if study.of(BASELINE, t, r)):
        tables += [ratio_table(study, given, recordings), step_table(study, given, recordings)]
        one_group = len({row.group for row in study.of(BASELINE, given, recordings)}) == 1
        for method in methods:
            if study.of(method, given, recordings):
                tables += [part_table(study, given, recordings, method, what) for what in
                           (["sequence"] if one_group else ["group"]) + ([] if recordings else ["sampler"])]
                tables += [part_table(study, given, recordings, method, "sequence", losses=True)]
        tables.append(mean_table(study, given, recordings))
    return [table for table in tables if table.rows]


def paper_tables(study: Study, runs: PaperRuns) -> list[Table]:
    """The paper's Table 1, then its Tables 2 to 4 in one, because they have the same rows."""
    merging = Table("Table 1: triangles before and after greedy merging",
                    f"Measured: two frames of {runs.film.name}, {DEFAULT}.",
                    ["paper: before", "after", "measured: before", "after"], [])
    for t, counts in zip(runs.conditions, PAPER_MERGING):
        ours = (runs.films[DEFAULT, fill].triangles[t] for fill in FILLS[:2])
        merging.rows.append((f"frame {t}", [f"{count:.0f}" for count in (*counts, *ours)]))
    metrics = ("hausdorff", "mean_deviation", "center_hausdorff", "center_mean", "area_deviation")
    table = Table("Tables 2 to 4: efficiency, accuracy, stability", f"Milliseconds and triangles: all frames of "
                  f"{runs.film.name}, processor time of one thread (the paper's includes its browser). The rest: means "
                  "over the synthetic sequences, in spacings (the paper names no unit). In brackets: over marching "
                  "squares; compare these.",
                  ["ms", "triangles", "std of triangles", *(metric.replace("_", " ") for metric in metrics)], [])

    def add(name: str, values: Seq[float], base: Seq[float]) -> None:
        table.rows.append((name, [f"{value:.3g} ({value / of:.2f})" if value == value else "-"
                                  for value, of in zip(values, base)]))

    def measured(placement: str, fill: str) -> list[float]:
        film = runs.films[placement, fill]
        return [film.milliseconds, float(film.triangles.mean()), float(film.triangles.std()),
                *(mean_over(study.of(placement, study.given[0]), metric) for metric in metrics)]
    for row in PAPER_ROWS:
        paper = [[r.milliseconds, r.triangles, r.triangle_deviation, r.hausdorff, r.mean_deviation, math.nan, math.nan,
                  r.area_deviation] for r in (row, PAPER_ROWS[0])]
        add(f"paper: {row.name}", *paper)
    for key in runs.films:
        add(", ".join(key), measured(*key), measured(BASELINE, "grid"))
    return [merging, table]


def fill_table(runs: PaperRuns) -> Table:
    """The share of the grid's triangles that each fill saves, over all shapes, at both grids."""
    table = Table(f"Triangles by fill, {DEFAULT}", "Mean share of the grid's triangles that a fill saves, over "
                  f"{len(runs.fills) // len(GRIDS)} shapes of about 1,000 particles; N cells across the bounding square.",
                  [*FILLS[1:], "conforming / greedy", "most T-junctions: greedy", "conforming", "rings"], [])
    for size in GRIDS:
        grids = [grid for (_, cells), grid in runs.fills.items() if cells == size]
        left = np.mean([[g.triangles[fill] / g.triangles["grid"] for fill in FILLS[1:]] for g in grids], axis=0)
        most = [max(g.t_junctions[fill] for g in grids) for fill in ("greedy", "conforming")]
        table.rows.append((f"{size} x {size}", [*(f"{100 * (1 - share):.1f} %" for share in left),
                                                fixed(left[1] / left[0], 2), *map(str, most),
                                                "equal" if all(g.same_rings for g in grids) else "differ!"]))
    return table
