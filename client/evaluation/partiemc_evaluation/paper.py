"""The runs behind the paper's tables and figures, and a verdict on each claim of the paper.

The paper: "PartiEMC: Stable Isoline Reconstruction from Particle-Based Scalar Fields via Virtual-Plane Projection".
Its placement is measured as `farthest-particle`, section 3.5 to the letter.
"""

import time
from collections import defaultdict, namedtuple
from dataclasses import dataclass, field, replace
from typing import Any, Callable, Iterator, NamedTuple, Sequence as Seq

import numpy as np
import partiemc
from partiemc import _native

from .comparisons import mean_over
from .geometry import Curve, Floats, Outline, Points
from .metrics import ABSENT, Deviation, compare
from .scenes import Recipe, Sequence, make_scene
from .shapes import TUNING_SHAPES
from .study import BASELINE, DEFAULT, PAPER, Evaluator, Method, Row, Study, outline_of, reconstruct

SUBJECTS, SHARES, GRIDS = (PAPER, DEFAULT), (1.0, 0.8, 0.5, 0.3), (32, 64)
FILLS = ("grid", "greedy", "conforming", "polygon")
_SEED, _REPETITIONS, _CELLS = 5_310, 3, (0.25, 4.0)  # _CELLS: limits of cell sizes, in spacings.


# A row of the paper's Tables 2 to 4, with the placement and the fill of PartiEMC that correspond to it.
PaperRow = namedtuple("PaperRow", "name placement fill milliseconds triangles hausdorff mean_deviation area_deviation "
                      "triangle_deviation")
PAPER_ROWS = (PaperRow("Marching Squares (MS)", BASELINE, "grid", 11.8, 548, 0.043, 0.018, 0.071, 64.2),
              PaperRow("EMC-based reconstruction", "qef", "grid", 18.6, 612, 0.029, 0.012, 0.049, 51.8),
              PaperRow("PartiEMC (w/o greedy)", PAPER, "grid", 10.4, 231, 0.026, 0.010, 0.031, 22.4),
              PaperRow("PartiEMC (with greedy)", PAPER, "greedy", 7.9, 162, 0.026, 0.010, 0.031, 15.7))
PAPER_MERGING = ((2106, 630), (1876, 512))  # Table 1: triangles before and after, two conditions.


@dataclass
class Shot:
    """One frame as it is drawn. mesh: points (V, 2), triangles (T, 3), classes (T,)."""
    title: str
    outline: Outline
    particles: Points | None = None
    truth: Outline = field(default_factory=Outline)
    mesh: tuple[Floats, Any, Any] | None = None


class Film(NamedTuple):
    """One placement and fill over all frames. milliseconds: mean processor time of a frame, one thread. triangles,
    digests (of rings): one for each frame."""
    milliseconds: float
    triangles: Floats
    digests: list[int]


class Grid(NamedTuple):
    """One frame on one grid. triangles, t_junctions: by fill. same_rings: all fills have the same rings, to the bit."""
    cell_size: float
    triangles: dict[str, float]
    t_junctions: dict[str, int]
    area: float
    same_rings: bool
    outline: Outline


@dataclass
class PaperRuns:
    """conditions: frames of Table 1. films: by placement and fill. features: rows of Figure 5. thinned: by placement and
    share of particles, rows of Figures 6 and 10; the factor converts their lengths to spacings of the full set.
    grids: by placement and cells across the bounding square. resolution: by placement, between the two grids. fills:
    by shape and cells. shots: by figure."""
    film: Sequence
    conditions: tuple[int, int] = (0, 0)
    films: dict[tuple[str, str], Film] = field(default_factory=dict)
    features: list[Row] = field(default_factory=list)
    thinned: dict[tuple[str, float], tuple[Row, float]] = field(default_factory=dict)
    grids: dict[tuple[str, int], Grid] = field(default_factory=dict)
    resolution: dict[str, Deviation] = field(default_factory=dict)
    fills: dict[tuple[str, int], Grid] = field(default_factory=dict)
    shots: dict[str, list[Shot]] = field(default_factory=lambda: defaultdict(list))


def _mesh(result: Any) -> tuple[Floats, Any, Any]:
    return np.array(result.mesh.points), np.array(result.mesh.triangles), np.array(result.mesh.classes)


def default_film() -> Sequence:
    """A film for studies without a recording: two bodies that merge."""
    return make_scene(Recipe("merging discs", "topology", "discs", _SEED + 3, particles=1500, frames=16))


def run_paper(film: Sequence, progress: Callable[[str], None], shapes: Seq[str] = TUNING_SHAPES) -> PaperRuns:
    """All of the paper's tables and figures on our own scenes, in one thread, so that times are comparable. progress:
    called with the name of each part. shapes: for the comparison of fills."""
    runs = PaperRuns(film)
    for part in (_run_film, _run_features, _run_thinned, _run_grids):
        progress(part.__name__[5:])
        part(runs)
    for shape in shapes:
        progress(f"fills, {shape}")
        scene = make_scene(Recipe(shape, shape=shape, seed=_SEED + 2, frames=2))
        side = float(np.ptp(scene.frames[0].truth.points, axis=0).max())
        for cells in GRIDS:
            runs.fills[shape, cells], _ = _run_grid(scene, 0, DEFAULT, side, cells, FILLS)
    return runs


def _run_film(runs: PaperRuns) -> None:
    """Tables 1 and 2, Figures 12 and 14."""
    shown = [k * (len(runs.film.frames) - 1) // 3 for k in range(4)]
    runs.conditions = shown[1], shown[3]
    ours = [(row.placement, row.fill) for row in PAPER_ROWS] + [(DEFAULT, "grid"), (DEFAULT, "greedy")]
    for placement, fill in ours:
        times, results = [], []
        for _ in range(_REPETITIONS):
            begin = time.thread_time()
            results = list(reconstruct(runs.film, {"placement": placement, "fill": fill}, "volumes"))
            times.append(1e3 * (time.thread_time() - begin) / len(results))
        runs.films[placement, fill] = Film(float(np.median(times)), np.array([float(len(r.mesh)) for r in results]),
                                           [result.rings_digest for result in results])
    before = runs.films[DEFAULT, "grid"].triangles  # The last run was the default with greedy.
    runs.shots["Figure 12"] = [Shot(f"frame {t}\n{len(results[t].mesh)} triangles, {before[t]:.0f} before merging",
                                    outline_of(results[t]), mesh=_mesh(results[t])) for t in shown]


def _measure(scene: Sequence, placement: str) -> tuple[Row, Outline]:
    """The row, and the outline of the first frame."""
    row = Evaluator(scene, centers=False).run(Method(placement, {"placement": placement}))
    return row, outline_of(next(reconstruct(scene, {"placement": placement})))


def _run_features(runs: PaperRuns) -> None:
    """Figure 5: a shape with sharp features."""
    scene = make_scene(Recipe("star", shape="star", seed=_SEED, pace="drift", particles=700))
    for placement in (BASELINE, *SUBJECTS):
        row, outline = _measure(scene, placement)
        first = row.frames[0]
        runs.features.append(row)
        runs.shots["Figure 5"].append(Shot(
            f"{placement}\narea {100 * first['area_error']:+.2f} %, Hausdorff {first['hausdorff']:.2f} h", outline,
            scene.frames[0].positions, scene.frames[0].truth))


def _run_thinned(runs: PaperRuns) -> None:
    """Figures 6 and 10: fewer and fewer particles, the same ones in all frames."""
    whole = make_scene(Recipe("ell", shape="ell", seed=_SEED + 1))
    order = np.random.default_rng(_SEED).permutation(len(whole.frames[0].positions))
    for placement in (BASELINE, *SUBJECTS):
        for share in SHARES:
            kept = np.sort(order[:round(share * len(order))])
            frames = [replace(frame, positions=frame.positions[kept], volumes=None, ids=None)
                      for frame in whole.frames]
            ratio = (len(order) / len(kept)) ** 0.5
            row, outline = _measure(replace(whole, frames=frames, spacing=whole.spacing * ratio), placement)
            runs.thinned[placement, share] = row, ratio
            title = f"{placement}, {100 * share:.0f} %\nHausdorff {row.frames[0]['hausdorff'] * ratio:.2f} h"
            if placement != BASELINE:
                runs.shots["Figure 6"].append(Shot(title, outline, frames[0].positions, frames[0].truth))


def _run_grid(sequence: Sequence, t: int, placement: str, side: float, cells: int,
              fills: Seq[str]) -> tuple[Grid, dict[str, Any]]:
    """Frame t on a lattice of `cells` cells across `side`; the cell size is limited to the range of the core."""
    cell_size = float(np.clip(side / cells / sequence.spacing, *_CELLS))
    results = {fill: partiemc.reconstruct(sequence.frames[t].positions, spacing=sequence.spacing, threads=1,
                                          placement=placement, fill=fill, cell_size=cell_size)
               for fill in fills}
    first = results[fills[0]]
    return Grid(cell_size, {fill: float(len(result.mesh)) for fill, result in results.items()},
                {fill: _native._count_t_junctions(result) for fill, result in results.items()}, first.area,
                len({result.rings_digest for result in results.values()}) == 1, outline_of(first)), results


def _run_grids(runs: PaperRuns) -> None:
    """Figures 11 and 13: two grids over one frame. The number of the frame is in the middle of the
    film, and is halved until the bounding square is small enough for the coarsest cells. The square
    is around the largest ring, so spray does not count."""
    film, t, side = runs.film, len(runs.film.frames), np.inf
    while t > 0 and side > GRIDS[0] * _CELLS[1] * film.spacing:
        t //= 2
        usual = outline_of(partiemc.reconstruct(film.frames[t].positions, spacing=film.spacing, threads=1))
        side = float(np.ptp(usual.rings()[int(usual.ring_areas.argmax())], axis=0).max())
    for placement in SUBJECTS:
        for cells in GRIDS:
            grid, results = _run_grid(film, t, placement, side, cells, FILLS[:2])
            runs.grids[placement, cells] = grid
            runs.shots["Figure 13"].append(Shot(
                f"frame {t}, {placement}, {cells} x {cells}\narea {grid.area:.5g}, {len(grid.outline.points)} vertices",
                grid.outline, film.frames[t].positions))
            if placement == DEFAULT:
                runs.shots["Figure 11"].extend(
                    Shot(f"frame {t}, {cells} x {cells}, {fill}\n{grid.triangles[fill]:.0f} triangles, cell "
                         f"{grid.cell_size:.2f} h", grid.outline, mesh=_mesh(result))
                    for fill, result in results.items())
        coarse, fine = (Curve(runs.grids[placement, cells].outline, film.spacing) for cells in GRIDS)
        runs.resolution[placement] = compare(coarse, fine, film.spacing)


FINDINGS = {"reproduces": "reproduces", "weaker": "the direction reproduces, the size does not",
            "fails": "does not reproduce"}
# An effect is 1 - ratio. A claim reproduces with this share of the paper's effect; a ratio above _NO_EFFECT is no gain.
_SHARE_OF_EFFECT, _NO_EFFECT = 0.9, 0.98
# The paper claims that results are "stable" and "consistent" but gives no numbers. These limits are our own choice.
_STABLE, _CONSISTENT_CELLS, _CONSISTENT_AREA = 1.5, 0.25, 0.02


class Claim(NamedTuple):
    """The verdict on one claim of a table or figure. subject: our placement or fill. finding: a key of FINDINGS."""
    about: str
    subject: str
    finding: str
    sentence: str


def judge(paper: float, measured: float) -> str:
    """A key of FINDINGS. paper, measured: ratios to a baseline; less is better."""
    if not measured < _NO_EFFECT:  # Also where nothing was measured.
        return "fails"
    return "reproduces" if 1 - measured >= _SHARE_OF_EFFECT * (1 - paper) else "weaker"


def worst(*findings: str) -> str:
    return max(findings, key=list(FINDINGS).index)


def judge_claims(study: Study, runs: PaperRuns) -> list[Claim]:
    """The 27 claims, in the paper's order. Uses the synthetic rows of the study with `study.given[0]` given."""
    found = [*_merging(runs), *_efficiency(runs), *_accuracy(study), *_stability(study, runs), *_features(runs),
             *_thinning(runs), *_merged_frames(runs), *_resolutions(runs), *_counts(runs)]
    return [Claim(*claim[:3], f"{claim[3]}: {FINDINGS[claim[2]]}.") for claim in found]


_Claims = Iterator[tuple[str, str, str, str]]


def _saved(ratios: Any) -> str:
    return " and ".join(f"{100 * (1 - ratio):.1f} %" for ratio in ratios)


def _merging(runs: PaperRuns) -> _Claims:
    grid, greedy = (runs.films[DEFAULT, fill].triangles for fill in FILLS[:2])
    paper, ours = [after / before for before, after in PAPER_MERGING], [greedy[t] / grid[t] for t in runs.conditions]
    yield ("Table 1", "greedy", worst(*map(judge, paper, ours)),
           f"Greedy merging: paper {_saved(paper)} fewer triangles in its two conditions, measured {_saved(ours)} in "
           f"two frames of {runs.film.name}")
    for placement in SUBJECTS:
        before, after = (runs.films[placement, fill].digests for fill in FILLS[:2])
        same = sum(a == b for a, b in zip(before, after))
        yield ("Table 1", placement, "reproduces" if same == len(before) else "fails",
               f"Merging leaves the boundary unchanged: rings equal to the bit in {same} of {len(before)} frames")


def _efficiency(runs: PaperRuns) -> _Claims:
    for placement in SUBJECTS:
        for fill, rival, what, k, j in (("grid", "qef", "against the QEF placement, neither merged", 2, 1),
                                        ("greedy", BASELINE, "with greedy against marching squares", 3, 0)):
            paper = PAPER_ROWS[k].milliseconds / PAPER_ROWS[j].milliseconds
            ours, theirs = (runs.films[key].milliseconds for key in ((placement, fill), (rival, "grid")))
            yield ("Table 2", placement, judge(paper, ours / theirs), f"Frame time {what}: paper {paper:.2f}x, measured "
                   f"{ours / theirs:.2f}x ({ours:.3f} against {theirs:.3f} ms)")


def _paper_ratio(row: int, number: str) -> float:
    return getattr(PAPER_ROWS[row], number) / getattr(PAPER_ROWS[0], number)


def _means(study: Study, placement: str, metric: str) -> tuple[float, float, float]:
    """The ratio to the baseline, the mean of the placement and of the baseline."""
    ours, theirs = (mean_over(study.of(name, study.given[0]), metric) for name in (placement, BASELINE))
    return (ours / theirs if theirs else ABSENT), ours, theirs


def _accuracy(study: Study) -> _Claims:
    paper = [_paper_ratio(2, number) for number in ("hausdorff", "mean_deviation")]
    for placement in SUBJECTS:
        for name, metrics in (("true boundary", ("hausdorff", "mean_deviation")),
                              ("curve through the outermost centres", ("center_hausdorff", "center_mean"))):
            ours = [_means(study, placement, metric)[0] for metric in metrics]
            yield ("Table 3", placement, worst(*map(judge, paper, ours)),
                   f"Against marching squares, {name}: paper {paper[0]:.2f}x Hausdorff and {paper[1]:.2f}x mean "
                   f"deviation, measured {ours[0]:.2f}x and {ours[1]:.2f}x")


def _stability(study: Study, runs: PaperRuns) -> _Claims:
    paper = _paper_ratio(2, "area_deviation")
    for placement in SUBJECTS:
        ratio, ours, theirs = _means(study, placement, "area_deviation")
        yield ("Table 4", placement, judge(paper, ratio), "Mean area deviation (Eq. 30) against marching squares: "
               f"paper {paper:.2f}x, measured {ratio:.2f}x ({ours:.5f} against {theirs:.5f})")
    paper = _paper_ratio(3, "triangle_deviation")
    for placement in SUBJECTS:
        ours, theirs = (float(runs.films[key].triangles.std()) for key in ((placement, "greedy"), (BASELINE, "grid")))
        yield ("Table 4", placement, judge(paper, ours / theirs),
               f"Standard deviation of the merged triangle count over {runs.film.name}, against marching squares' "
               f"grid: paper {paper:.2f}x, measured {ours / theirs:.2f}x ({ours:.1f} against {theirs:.1f})")


def _features(runs: PaperRuns) -> _Claims:
    squares, *rows = runs.features
    for row in rows:
        better = all(row[metric] / squares[metric] < _NO_EFFECT for metric in ("hausdorff", "bias"))
        yield ("Figure 5", row.method, "reproduces" if better else "fails",
               f"Sharp features and volume kept better than by marching squares, means of {len(row.frames)} frames: "
               f"Hausdorff {row['hausdorff']:.2f} against {squares['hausdorff']:.2f} h, area "
               f"{100 * row['area_error']:+.2f} % against {100 * squares['area_error']:+.2f} %")


def thinned_values(runs: PaperRuns, placement: str, metric: str) -> list[float]:
    """The metric for each share of particles, in spacings of the full set."""
    return [row[metric] * ratio for row, ratio in (runs.thinned[placement, share] for share in SHARES)]


def _thinning(runs: PaperRuns) -> _Claims:
    for about, metric, what in (("Figure 6", "hausdorff", "Hausdorff distance"),
                                ("Figure 10", "mean_jitter", "mean jitter")):
        for placement in SUBJECTS:
            values, squares = (thinned_values(runs, name, metric) for name in (placement, BASELINE))
            stable = [value <= _STABLE * values[0] for value in values]
            ours, theirs = (", ".join(f"{value:.3g}" for value in line) for line in (values, squares))
            yield (about, placement, "reproduces" if stable[3] else "weaker" if stable[1] else "fails",
                   f"Stable down to 30 % of the particles (at most {_STABLE}x the {what} at 100 %): {ours} h at 100, "
                   f"80, 50, 30 %, marching squares {theirs} h")


def _merged_frames(runs: PaperRuns) -> _Claims:
    grids = [runs.grids[DEFAULT, cells] for cells in GRIDS]
    ratios, same = [g.triangles["greedy"] / g.triangles["grid"] for g in grids], all(g.same_rings for g in grids)
    yield ("Figure 11", "greedy", worst(*(judge(0.30, ratio) for ratio in ratios)) if same else "fails",
           f"Greedy merging: paper 70-75 % fewer triangles, measured {_saved(ratios)} at 32 x 32 and 64 x 64, the "
           f"boundary {'equal to the bit' if same else 'changed'}")
    grid, greedy = (runs.films[DEFAULT, fill].triangles for fill in FILLS[:2])
    saved = 1 - greedy[grid > 0] / grid[grid > 0]
    yield ("Figure 12", "greedy", judge(0.30, 1 - float(saved.min())),
           f"Merging saves as much in every frame: paper 70-75 %, measured {100 * saved.min():.1f} to "
           f"{100 * saved.max():.1f} % over {len(grid)} frames of {runs.film.name}")


def _resolutions(runs: PaperRuns) -> _Claims:
    for placement in SUBJECTS:
        coarse, fine = (runs.grids[placement, cells] for cells in GRIDS)
        cells, area = runs.resolution[placement].mean / coarse.cell_size, abs(coarse.area / fine.area - 1)
        kept = int(cells <= _CONSISTENT_CELLS) + int(area <= _CONSISTENT_AREA)
        yield ("Figure 13", placement, ("fails", "weaker", "reproduces")[kept],
               f"The outline is consistent between 32 x 32 and 64 x 64 (mean distance at most {_CONSISTENT_CELLS} "
               f"coarse cells, areas within {100 * _CONSISTENT_AREA:.0f} %): measured {cells:.3f} cells and "
               f"{100 * area:.2f} %")


def _counts(runs: PaperRuns) -> _Claims:
    squares, paper = runs.films[BASELINE, "grid"].triangles, _paper_ratio(3, "triangles")
    for placement in SUBJECTS:
        ours = runs.films[placement, "greedy"].triangles
        fewer, ratio = int((ours < squares).sum()), float(ours.mean() / squares.mean())
        yield ("Figure 14", placement, judge(paper, ratio) if fewer == len(ours) else "fails",
               f"Fewer triangles than marching squares' grid in every frame: paper {paper:.2f}x in the mean, measured "
               f"{ratio:.2f}x, fewer in {fewer} of {len(ours)} frames")
