"""The evaluation as text, as JSON and as one HTML page with pictures."""

import base64
import html
import io
import json
import math
from dataclasses import dataclass, field
from typing import Any, Sequence as Seq

import matplotlib
import numpy as np

matplotlib.use("Agg")  # No window. Before pyplot.
import matplotlib.pyplot as plt
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from .comparisons import compare_rows, match
from .geometry import Outline
from .matter import Found, matter_tables
from .paper import FINDINGS, SHARES, SUBJECTS, Claim, PaperRuns, Shot, thinned_values
from .study import BASELINE, DEFAULT, PAPER, Row, Study
from .tables import Table, fill_table, judged_metrics, paper_tables, study_tables

_COLORS = {BASELINE: "#8a8f98", "qef": "#b08a2e", PAPER: "#c0554d", DEFAULT: "#2c6fae",
           f"{BASELINE}-clean": "#4b5058", f"{DEFAULT}-no-volumes": "#7d5fb2"}


@dataclass
class Evaluation:
    """A study, and the paper's runs and claims if there are any. notes: sentences for the reader."""
    title: str
    study: Study
    runs: PaperRuns | None = None
    claims: list[Claim] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def as_text(evaluation: Evaluation) -> str:
    tables = study_tables(evaluation.study, [DEFAULT])
    if evaluation.runs:
        tables += paper_tables(evaluation.study, evaluation.runs) + [fill_table(evaluation.runs)]
    claims = [f"{claim.about}, {claim.subject}: {claim.sentence}\n" for claim in evaluation.claims]
    return "".join([*(table.as_text() for table in tables), *claims, *(f"{note}\n" for note in evaluation.notes)])


def as_json(evaluation: Evaluation) -> str:
    """title, notes, rows, claims. Absent numbers are null."""
    return json.dumps({"title": evaluation.title, "notes": evaluation.notes, "rows": _json_rows(evaluation.study.rows),
                       "claims": [claim._asdict() for claim in evaluation.claims]}, indent=1)


def _json_rows(rows: Seq[Row]) -> list[dict[str, Any]]:
    return [{**{key: value for key, value in vars(row).items() if key not in ("values", "frames")},
             **{metric: value if math.isfinite(value) else None for metric, value in row.values.items()}}
            for row in rows]


def _picture(figure: Figure, alt: str) -> str:
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=110, bbox_inches="tight")
    plt.close(figure)
    return f'<img alt="{html.escape(alt)}" src="data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}">\n'


def _patch(outline: Outline, **style: Any) -> PathPatch:
    rings = [Path(np.concatenate([ring, ring[:1]]), closed=True) for ring in outline.rings()]
    return PathPatch(Path.make_compound_path(*rings) if rings else Path(np.zeros((1, 2))), **style)


def _draw(axis: Any, shot: Shot) -> None:
    if shot.mesh:
        points, triangles, classes = shot.mesh
        for kind, color in ((0, "#dfe9f3"), (1, "#f4ecd8")):
            part = triangles[classes == kind]
            if len(part):
                axis.tripcolor(*points.T, part, np.zeros(len(part)), linewidth=0.3, edgecolors="#9aa7b5",
                               cmap=ListedColormap([color]))
    else:
        axis.add_patch(_patch(shot.outline, facecolor="#e8eef5", edgecolor="none"))
    if shot.particles is not None:
        axis.plot(*shot.particles.T, ".", color="#9aa7b5", markersize=1.5)
    axis.add_patch(_patch(shot.outline, facecolor="none", edgecolor="#123a5c", linewidth=1))
    axis.add_patch(_patch(shot.truth, facecolor="none", edgecolor="#c0554d", linewidth=0.8, linestyle="--"))
    axis.set_title(shot.title, fontsize=8)


def shots_figure(shots: Seq[Shot], columns: int) -> Figure:
    """A picture for each shot, all of the same part of the world. Rings smaller than a hundredth of the largest do not
    enlarge this part."""
    corners = []
    for shot in shots:
        areas = np.abs(shot.outline.ring_areas)
        large = [ring for ring, area in zip(shot.outline.rings(), areas) if area >= areas.max() / 100]
        corners += [point for ring in large for point in (ring.min(axis=0), ring.max(axis=0))]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    margin, rows = 0.03 * float((high - low).max()), math.ceil(len(shots) / columns)
    height = 3.4 * float(np.clip((high - low)[1] / (high - low)[0], 0.3, 1.2)) + 0.6
    figure, axes = plt.subplots(rows, columns, figsize=(3.4 * columns, height * rows), squeeze=False)
    for axis, shot in zip(axes.flat, shots):
        _draw(axis, shot)
        axis.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin), aspect="equal")
        axis.set_axis_off()
    return figure


def ratio_figure(study: Study, given: str, recordings: bool) -> Figure:
    """Geometric means of ratios to marching squares with their intervals, grouped by metric."""
    baseline = study.of(BASELINE, given, recordings)
    metrics = [metric for metric in judged_metrics(recordings) if len(match(baseline, baseline, metric))]
    methods = [m.name for m in study.methods[1:] if not m.is_step and study.of(m.name, given, recordings)]
    figure, axis = plt.subplots(figsize=(9, 0.9 + 0.55 * len(metrics)))
    for k, method in enumerate(methods):
        rows = study.of(method, given, recordings)
        values = np.array([compare_rows(rows, baseline, metric).ratio for metric in metrics], float).reshape(-1, 3)
        axis.errorbar(values[:, 0], np.arange(len(metrics)) + 0.7 * (k + 0.5) / len(methods) - 0.35,
                      xerr=np.abs(values[:, 1:] - values[:, :1]).T, fmt="o", markersize=4, linewidth=1.2,
                      color=_COLORS.get(method), label=method)
    axis.axvline(1, color="#8a8f98", linewidth=0.8)
    axis.set(yticks=range(len(metrics)), yticklabels=[m.replace("_", " ") for m in metrics], xscale="log",
             ylim=(len(metrics) - 0.5, -0.5), xlabel="ratio to marching squares, 95 % interval; below 1 is better",
             title=f"{'Recordings' if recordings else 'Synthetic sequences'}, {given} given")
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(lambda x, _: f"{x:.1g}" if f"{x:.1g}"[-1] in "25" else "")
    axis.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1, 1))
    return figure


def lines_figure(charts: Seq[tuple[str, Seq[Any], Seq[Any]]]) -> Figure:
    """Charts beside each other: title, labels, and names with their values. A name begins with its placement."""
    figure, axes = plt.subplots(1, len(charts), figsize=(10, 3), squeeze=False)
    for axis, (title, labels, series) in zip(axes.flat, charts):
        for name, values in series:
            axis.plot(labels, values, marker="o", markersize=2.5, label=name, color=_COLORS.get(name.split(",")[0]))
        axis.set_ylim(bottom=0)
        axis.set_title(title, fontsize=9)
        axis.legend(fontsize=7)
    return figure


def _paper_sections(evaluation: Evaluation, runs: PaperRuns) -> list[str]:
    tables, film = [table.as_html() for table in paper_tables(evaluation.study, runs)], runs.film.name
    thinned = lines_figure([(f"{metric.replace('_', ' ')} by share of particles, h at 100 %",
                             [f"{100 * share:.0f} %" for share in SHARES],
                             [(name, thinned_values(runs, name, metric)) for name in (BASELINE, *SUBJECTS)])
                            for metric in ("hausdorff", "mean_jitter")])
    counts = lines_figure([(f"Triangles, frames of {film}", range(len(runs.film.frames)),
                            [(f"{name}, {fill}", runs.films[name, fill].triangles) for name, fill in
                             ((BASELINE, "grid"), (PAPER, "greedy"), (DEFAULT, "greedy"))])])

    def shots(figure: str, columns: int = 4) -> str:
        return _picture(shots_figure(runs.shots[figure], columns), f"{figure} of the paper, from our scenes")
    parts = (
        ("Tables 1 to 4", "", "".join(tables), ("Table 1", "Table 2", "Table 3", "Table 4")),
        ("Figure 5: features and volume", "The paper: marching cubes smooths features and loses volume, the method keeps "
         "both. Dashed: the true boundary.", shots("Figure 5", 3), ("Figure 5",)),
        ("Figures 6 and 10: fewer particles", "The paper: outlines stay stable with 80, 50 and 30 % of the particles. The "
         "same particles are left out in every frame; each method is given the spacing that is left.",
         shots("Figure 6") + _picture(thinned, "Hausdorff distance and jitter by share"), ("Figure 6", "Figure 10")),
        ("Figure 11: merging on two grids", "32 and 64 cells across the bounding square.", shots("Figure 11"),
         ("Figure 11",)),
        ("Figure 12: frames and their triangles", f"Four frames of {film}.", shots("Figure 12"), ("Figure 12",)),
        ("Figure 13: two resolutions", "The paper: a low resolution keeps shape and features.", shots("Figure 13"),
         ("Figure 13",)),
        ("Figure 14: triangles over the frames", "The paper: fewer triangles than marching squares in every frame.",
         _picture(counts, "Triangles over the frames"), ("Figure 14",)),
        ("Fills", "What merging leaves of the grid's triangles.", fill_table(runs).as_html(), ()))
    return [_section(heading, text, content + _claim_list([c for c in evaluation.claims if c.about in about]))
            for heading, text, content, about in parts]


def _claim_list(claims: Seq[Claim]) -> str:
    items = (f'<li><b class="{claim.finding}">{claim.finding}</b> {html.escape(f"{claim.about}, {claim.subject}")}: '
             f"{html.escape(claim.sentence)}</li>\n" for claim in claims)
    return f"<ul>{''.join(items)}</ul>\n"


def _section(heading: str, text: str, content: str) -> str:
    return f"<section><h2>{html.escape(heading)}</h2>\n<p>{html.escape(text)}</p>\n{content}</section>\n"


_STYLE = """body { font: 14px/1.45 system-ui, sans-serif; margin: 24px auto; max-width: 1180px; padding: 0 16px }
h2 { font-size: 18px; border-top: 1px solid #d5dbe2; padding-top: 16px } h3 { font-size: 14px; margin: 18px 0 0 }
p { margin: 2px 0 6px; color: #5a6672 } img { max-width: 100% } .wide { overflow-x: auto }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 12px }
td, th { text-align: right; padding: 1px 10px 1px 0; font-weight: normal }
th:first-child { text-align: left; white-space: pre }
.alert, .fails { color: #b3261e } .reproduces { color: #1d7a46 } .weaker { color: #9a6b00 }
"""
_ABOUT = ("Hausdorff and mean deviation: symmetric, curves sampled every 0.1 spacings. Area deviation: Eq. 29 and 30 on "
          "the area over the true area. Jitter: deviation of an outline from the one before, carried along by the known "
          "motion. Motion known, on recordings: samples count if the particles around them determine their place in the "
          "other frame within 0.1 spacings. Outermost centres: the curve half a spacing inside the true boundary. A claim "
          "reproduces if at least nine tenths of the paper's effect are there; it is weaker if more than 2 % are.")


def as_html(evaluation: Evaluation) -> str:
    """One page without other files and without scripts."""
    study, sections = evaluation.study, []
    if evaluation.claims:
        count = ", ".join(f"{f}: {sum(c.finding == f for c in evaluation.claims)}" for f in FINDINGS)
        sections.append(_section("The paper's claims", f"{count}.", _claim_list(evaluation.claims)))
    pictures = "".join(_picture(ratio_figure(study, given, recordings), f"Ratios to marching squares, {given} given")
                       for recordings in (False, True) for given in study.given if study.of(BASELINE, given, recordings))
    shown = [method.name for method in study.methods[1:] if not method.is_step]
    sections.append(_section("Methods", "Every sequence counts alike; every method has its own calibration.",
                             pictures + "".join(table.as_html() for table in study_tables(study, shown))))
    sections += _paper_sections(evaluation, evaluation.runs) if evaluation.runs else []
    notes = [_ABOUT, *evaluation.notes, *(f"{method.name}: {method.remark}." for method in study.methods)]
    sections.append(_section("How it was measured", "", "".join(f"<p>{html.escape(note)}</p>" for note in notes)))
    return _page(evaluation.title, sections)


def matter_json(found: Found) -> str:
    """rows, and the tables with their musts and aims. Absent numbers are null."""
    tables = [{"title": table.title, "heads": table.heads, "rows": table.rows} for table in matter_tables(found.rows)]
    return json.dumps({"title": _MATTER, "rows": _json_rows(found.rows), "tables": tables}, indent=1)


def matter_html(found: Found) -> str:
    """One page: a picture and a table for each group."""
    sections = [_section(group, "Dashed: the truth.", _picture(shots_figure(shots, 4), f"Scenes of the group {group}"))
                for group, shots in found.shots.items()]
    return _page(_MATTER, sections + [table.as_html() for table in matter_tables(found.rows)])


_MATTER = "Evaluation: real matter"


def _page(title: str, sections: Seq[str]) -> str:
    return ("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta http-equiv=\"Content-Security-Policy\""
            " content=\"default-src 'none'; style-src 'unsafe-inline'; img-src data:\">"
            f"<title>{html.escape(title)} - PartiEMC</title>\n<style>{_STYLE}</style></head>\n"
            f"<body><h1>{html.escape(title)}</h1>\n{''.join(sections)}</body></html>\n")
