"""Runs methods on sequences and collects rows of metrics. Methods do not receive ids: no outline depends on them."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Callable, Iterator, NamedTuple, Sequence as Seq, TypeVar

import numpy as np
import partiemc
from partiemc import _native

from .advection import Advection
from .geometry import Curve, Outline
from .metrics import ABSENT, Deviation, carried, compare, find_defects, jitter, known_jitter, nearest_neighbours
from .recordings import wall_roughness
from .scenes import Frame, Recipe, Sequence, make_scene

Source, Found = TypeVar("Source"), TypeVar("Found")

BASELINE, PAPER, DEFAULT = "marching-squares", "farthest-particle", "virtual-plane"
PLACEMENTS = (BASELINE, "qef", PAPER, DEFAULT)

# The numbers of a row. Each is a mean over frames unless noted. Lengths are in spacings, areas are relative, absent
# numbers are NaN.
METRICS = (
    "hausdorff", "mean_deviation",      # To the true boundary.
    "bias", "area_deviation",           # |mean of area_error|; Eq. 29-30 on area / true area, frames after the first.
    "hausdorff_jitter", "mean_jitter",  # From the outline before, carried along.
    "known_hausdorff_jitter", "known_mean_jitter",    # Where particles determine the motion; recordings.
    "known_share", "area_error_size",                 # Share of samples used; |area_error|.
    "wall_roughness", "area_error",     # Standard deviation of the distance from straight walls; area / true area - 1.
    "center_hausdorff", "center_mean",  # To the curve through the outermost centres, where it is defined.
    "triangles", "triangle_deviation",  # Of the mesh; their standard deviation over the frames.
    "self_intersections", "folds", "spurious_components", "component_error", "hole_error", "wrong_normals",
    "vertices", "neighbour_mean", "neighbour_deviation",  # Of the rings; distances of nearest particles.
    "milliseconds")                     # All stages, wall clock, one thread.


@dataclass(frozen=True)
class Method:
    """Keyword arguments of partiemc.Reconstructor under a name. is_step: the default with a step switched off or a
    constant changed, for a separate table. needs_spacing: not run without a given spacing, because it is the same as
    another method then."""
    name: str
    parameters: dict[str, Any]
    remark: str = ""
    is_step: bool = False
    needs_spacing: bool = False


def all_methods(steps: bool = False, sensitivity: bool = False) -> list[Method]:
    """The baseline first, then the other placements and two variants. steps: also the default without each of its
    steps. sensitivity: also the default with each of its constants times 0.7 and 1.4."""
    def changed(name: str, remark: str, kind: str, value: dict[str, Any], is_step: bool = True) -> Method:
        return Method(f"{DEFAULT}-{name}", {"placement": DEFAULT, "_research": {kind: value}}, remark, is_step,
                      value == {"area": False})
    methods = [
        Method(BASELINE, {"placement": BASELINE}, "linear interpolation, its own calibration"),
        Method(f"{BASELINE}-clean", {"placement": BASELINE, "clean": True}, "with the default's cleaning"),
        Method("qef", {"placement": "qef"}, "the paper's EMC baseline"),
        Method(PAPER, {"placement": PAPER}, "the paper's method, section 3.5 to the letter"),
        Method(DEFAULT, {"placement": DEFAULT}, "the default"),
        changed("no-volumes", "the default without its area step", "steps", {"area": False}, False)]
    knobs = _native._research()
    if steps:
        methods += [changed(f"without-{name}", f"without the step {name}", "steps", {name: False})
                    for name in knobs["steps"]]
    if sensitivity:
        methods += [changed(f"{factor}-{name}", f"{factor} times {name}", "constants", {name: factor * value})
                    for name, value in knobs["constants"].items() for factor in (0.7, 1.4)]
    return methods


@dataclass
class Row:
    """One method on one sequence. given: its input beside positions, "spacing", "volumes" (and spacing) or "nothing".
    values: by metric. frames: the same for each frame."""
    sequence: str
    group: str
    shape: str
    sampler: str
    judged: bool
    method: str
    given: str
    values: dict[str, float]
    frames: list[dict[str, float]] = field(repr=False)

    def __getitem__(self, metric: str) -> float:
        return self.values[metric]


def reconstruct(sequence: Sequence, parameters: dict[str, Any], given: str = "spacing") -> Iterator[Any]:
    """The result of each frame, a partiemc.Result, one thread. Raises partiemc.Error that names the sequence and the
    frame."""
    spacing = None if given == "nothing" else sequence.spacing
    stream = partiemc.Reconstructor(spacing=spacing, threads=1, **parameters)
    for t, frame in enumerate(sequence.frames):
        try:
            yield stream.reconstruct(frame.positions, frame.time,
                                     volumes=frame.volumes if given == "volumes" else None)
        except partiemc.Error as error:
            error.args = (f"{sequence.name}, frame {t}: {error}",)
            raise


def outline_of(result: Any) -> Outline:
    """The rings of a partiemc.Result, copied."""
    return Outline(np.array(result.rings.points), result.rings.offsets.astype(np.int64))


class _Reference(NamedTuple):
    """The truth of one frame: the boundary; the curve through the outermost centres; the truth of the frame before,
    carried along, if the truth does not follow the motion."""
    truth: Curve | None = None
    centers: Curve | None = None
    before: Curve | None = None


class Evaluator:
    """A sequence with its truth prepared once for several methods. centers: also compares with the curve through the
    outermost centres."""

    def __init__(self, sequence: Sequence, centers: bool = True) -> None:
        self.sequence = sequence
        self._references = [self._reference(t, frame, centers) for t, frame in enumerate(sequence.frames)]
        self._neighbours = [nearest_neighbours(frame.positions, sequence.spacing) for frame in sequence.frames]
        self._advections = [] if sequence.motion else [
            Advection.between(before, after, sequence.spacing)
            for before, after in zip(sequence.frames, sequence.frames[1:])]

    def _reference(self, t: int, frame: Frame, centers: bool) -> _Reference:
        sequence, h = self.sequence, self.sequence.spacing
        if not frame.truth:
            return _Reference()
        inner, before = frame.truth.eroded(h / 2) if centers else Outline(), None
        if t > 0 and sequence.motion and not sequence.truth_follows_motion:
            last = sequence.frames[t - 1].truth
            before = Curve(last.moved(sequence.motion.carry(t - 1, last.points)), h)
        return _Reference(Curve(frame.truth, h), Curve(inner, h) if inner else None, before)

    def run(self, method: Method, given: str = "spacing") -> Row:
        sequence, before = self.sequence, Outline()
        frames: list[dict[str, float]] = []
        for t, result in enumerate(reconstruct(sequence, method.parameters, given)):
            curve = Curve(outline_of(result), sequence.spacing)
            frames.append({**self._measure(t, result, curve), **(self._jitter(t, before, curve) if t else {})})
            before = curve.outline
        return Row(sequence.name, sequence.group, sequence.shape, sequence.sampler, sequence.judged, method.name,
                   given, _summary(frames), frames)

    def _measure(self, t: int, result: Any, curve: Curve) -> dict[str, float]:
        sequence, frame, h, reference = (self.sequence, self.sequence.frames[t], self.sequence.spacing,
                                         self._references[t])
        area = frame.area or len(frame.positions) * h * h
        truth = compare(curve, reference.truth, h) if reference.truth else Deviation()
        centers = compare(curve, reference.centers, h) if reference.centers else Deviation()
        return {"hausdorff": truth.hausdorff, "mean_deviation": truth.mean,
                "center_hausdorff": centers.hausdorff, "center_mean": centers.mean,
                "area_error": result.area / area - 1 if sequence.whole else ABSENT,
                "wall_roughness": wall_roughness(curve.outline, frame.positions, sequence.walls, h),
                "triangles": len(result.mesh), "vertices": len(result.rings.points),
                "milliseconds": result.times["total"], "neighbour_mean": self._neighbours[t][0],
                "neighbour_deviation": self._neighbours[t][1], **find_defects(result, reference.truth)}

    def _jitter(self, t: int, before: Outline, curve: Curve) -> dict[str, float]:
        motion, h, reference = self.sequence.motion, self.sequence.spacing, self._references[t]
        numbers: dict[str, float] = {}
        if motion:
            deviation = jitter(carried(before, motion, t - 1, h), curve, h, reference.before, reference.truth)
        else:
            advection = self._advections[t - 1]
            if advection is None:
                return numbers
            deviation = compare(Curve(advection.carry(before), h), curve, h)
            known, share = known_jitter(Curve(before, h), curve, advection, h)
            numbers.update(known_hausdorff_jitter=known.hausdorff, known_mean_jitter=known.mean,
                           known_share=share)
        return {**numbers, "hausdorff_jitter": deviation.hausdorff, "mean_jitter": deviation.mean}


def mean_of(values: Any, weights: Any = 1.0) -> float:
    """Weighted mean of the values that are not NaN; ABSENT if there are none, or their weights are 0."""
    values, weights = np.broadcast_arrays(np.asarray(values, float), weights)
    there = ~np.isnan(values)
    total = weights[there].sum()
    return float((weights[there] * values[there]).sum() / total) if total > 0 else ABSENT


def _summary(frames: list[dict[str, float]]) -> dict[str, float]:
    columns = {metric: np.array([frame.get(metric, ABSENT) for frame in frames]) for metric in METRICS}
    values = {metric: mean_of(column) for metric, column in columns.items()}
    share = 1 + columns["area_error"]
    values["bias"] = abs(values["area_error"])
    values["area_error_size"] = mean_of(np.abs(columns["area_error"]))
    # If the first frame has no area, the deviation counts as 100 %.
    values["area_deviation"] = 1.0 if share[0] <= 0 else mean_of(np.abs(share[1:] / share[0] - 1))
    values["triangle_deviation"] = float(columns["triangles"].std())
    for metric in ("known_hausdorff_jitter", "known_mean_jitter"):
        # Each pair of frames is weighted by the share of its samples that is used.
        values[metric] = mean_of(columns[metric], columns["known_share"])
    return values


@dataclass
class Study:
    """All rows, ordered by sequence, then method, then `given`; recordings last."""
    methods: list[Method]
    given: list[str]
    rows: list[Row]

    def of(self, method: str, given: str, recordings: bool = False) -> list[Row]:
        return [row for row in self.rows if row.method == method and row.given == given
                and (row.group == "recording") == recordings]


def _run_all(methods: list[Method], given: list[str], source: Recipe | Sequence) -> list[Row]:
    evaluator = Evaluator(make_scene(source) if isinstance(source, Recipe) else source)
    return [evaluator.run(method, each) for method in methods for each in given
            if each != "nothing" or not method.needs_spacing]


def map_in_processes(run: Callable[[Source], Found], sources: Seq[Source], jobs: int,
                     progress: Callable[[int], None] = lambda done: None) -> Iterator[Found]:
    """run(source) of each source, in their order. jobs: number of processes; 1: this one. progress: called with the
    number of sources done."""
    # Starts new processes instead of forking, because a fork would lose the threads of the native module.
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) if jobs > 1 else None
    try:
        for k, found in enumerate(pool.map(run, sources) if pool else map(run, sources)):
            yield found
            progress(k + 1)
    finally:
        if pool:
            pool.shutdown(cancel_futures=True)


def run_study(sources: Seq[Recipe | Sequence], methods: list[Method], given: list[str], jobs: int = 1,
              progress: Callable[[int], None] = lambda done: None) -> Study:
    """Every method on every sequence. The rows are the same for any number of jobs, except times."""
    run = partial(_run_all, methods, given)
    rows = [row for of_sequence in map_in_processes(run, sources, jobs, progress) for row in of_sequence]
    return Study(methods, given, rows)
