"""Surfaces in space against the truth: scenes, their sets, metrics and the table of ratios to marching cubes."""

import hashlib
from dataclasses import dataclass
from typing import Any, Callable, Iterator, Sequence as Seq

import numpy as np
import partiemc

from .comparisons import compare_parts, compare_rows
from .geometry import Bools, Floats, Points, dot, norm
from .metrics import ABSENT, compare
from .motions import Similarity
from .samplers import SAMPLERS, Rng, raster, throw_darts
from .solids import SOLIDS, TUNING_SOLIDS, VALIDATION_SOLIDS, Balls, Ellipsoid, Mesh, Solid
from .study import Row, map_in_processes, mean_of
from .tables import Table, fixed

BASELINE, DEFAULT = "marching-cubes", "virtual-plane"
PLACEMENTS = (BASELINE, "qef", DEFAULT)
_NAMES_OF_OUTLINES = {BASELINE: "marching-squares"}  # The parameter `placement` where it has another name.
ON_TRUTH = "points on the truth"  # The default's triangles with all points on the truth: the least error of a mesh.
# Means over the frames of a scene; lengths in spacings, angles in radians, volumes relative.
METRICS = ("mean_deviation", "hausdorff", "normal_error", "mean_jitter", "hausdorff_jitter", "volume_error",
           "shell_error", "genus_error", "triangles")
_PARTICLES, _FRAMES = 1200, 5
_NOISE = {"noise-5": 0.05, "noise-10": 0.10}
_KEPT_SHARE, _STRETCH = 0.85, 1.05
_SHIFT, _TURN = (0.5, 3.0), 0.1     # Rigid motion in each frame: range in spacings; largest turn, radians.
_GAP, _DEPTH = 3.1, 6.0             # Gap of balls at first, depth in each other at last; spacings.
_SPRAY_SIZES, _LONE = (2, 3, 5, 8, 12, 20, 30, 60), 30
_RAGGED_MARGIN = 2.0
_APART = 3.0                        # Points nearer than this to both balls, in spacings, may merge.


@dataclass(frozen=True)
class Recipe:
    """A scene before it is made. group: rigid, noise-5, noise-10, thinned, deformed, topology, spray or ragged."""
    name: str
    group: str
    shape: str
    sampler: str
    seed: int


@dataclass
class Frame:
    """positions: (N, 3). motion: maps points of this frame to the next one; None for the last frame."""
    positions: Points
    truth: Solid
    motion: Callable[[Points], Points] | None


def _rotation(rng: Rng, angle: float | None = None) -> Floats:
    """A random rotation, or one by `angle` around a random axis."""
    if angle is None:
        q, r = np.linalg.qr(rng.standard_normal((3, 3)))
        q = q * np.sign(np.diag(r))
        return np.asarray(q if np.linalg.det(q) > 0 else -q)
    axis = rng.standard_normal(3)
    x, y, z = axis / norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def _sample(solid: Solid, sampler: str, rng: Rng) -> Points:
    if sampler == "close-packed":
        # A face-centred lattice in random position.
        edge = 4 ** (1 / 3)
        cell = edge * np.array([(0, 0, 0), (0, .5, .5), (.5, 0, .5), (.5, .5, 0)]) + edge * rng.random(3)
        turn = Similarity(_rotation(rng), np.zeros(3))
        turned = Solid(solid.form, turn)
        return turn.inverse()(np.concatenate([raster(turned, edge, offset) for offset in cell]))
    if sampler == "ragged":
        around = SOLIDS["cube"](float(np.prod(np.ptp(solid.bounds, axis=0) + 2 * _RAGGED_MARGIN)))
        side = np.ptp(solid.bounds, axis=0) + 2 * _RAGGED_MARGIN
        box = Solid(around, Similarity(np.diag(side / np.ptp(Solid(around).bounds, axis=0)), np.zeros(3)))
        darts = throw_darts(box, round(float(np.prod(side))), rng, inset=0)
        return darts[solid.contains(darts)]
    return SAMPLERS[sampler](solid, solid.measure > 0 and sampler == "lattice", rng)


def _moving(recipe: Recipe, rng: Rng) -> Iterator[Frame]:
    solid = Solid(SOLIDS[recipe.shape](float(_PARTICLES)))
    points = _sample(solid, recipe.sampler, rng)
    if recipe.group == "thinned":
        points = points[np.sort(rng.permutation(len(points))[:round(_KEPT_SHARE * len(points))])]
    place = Similarity(_rotation(rng), rng.uniform(-50, 50, 3))
    solid, points = solid.moved(place), place(points)
    noise = _NOISE.get(recipe.group, 0.0)
    for t in range(_FRAMES):
        middle, shift = solid.bounds.mean(axis=0), rng.standard_normal(3)
        turn = _rotation(rng, rng.uniform(_TURN / 4, _TURN))
        shift *= rng.uniform(*_SHIFT) / norm(shift)
        step = Similarity(turn, middle + shift - turn @ middle)
        shaken = points + noise * rng.standard_normal(points.shape) if noise else points
        yield Frame(shaken, solid, step if t + 1 < _FRAMES else None)
        solid, points = solid.moved(step), step(points)


def _stretched(recipe: Recipe, rng: Rng) -> Iterator[Frame]:
    """An ellipsoid, stretched along its first axis and pressed along the others, as a flow does."""
    form = SOLIDS[recipe.shape](float(_PARTICLES))
    assert isinstance(form, Ellipsoid)
    points = _sample(Solid(form), recipe.sampler, rng)
    stretch = np.array([_STRETCH, _STRETCH ** -0.5, _STRETCH ** -0.5])
    place = Similarity(_rotation(rng), rng.uniform(-50, 50, 3))
    for t in range(_FRAMES):
        step = Similarity(place.matrix @ np.diag(stretch) @ place.matrix.T, np.zeros(3))
        step = Similarity(step.matrix, place.shift - step.matrix @ place.shift)
        yield Frame(place(points), Solid(form, place), step if t + 1 < _FRAMES else None)
        form, points = Ellipsoid(form.axes * stretch), points * stretch


def _merging(recipe: Recipe, rng: Rng) -> Iterator[Frame]:
    """Two balls that merge, or part for odd seeds. Where they overlap, only the first has particles."""
    share = rng.uniform(0.3, 0.5)
    radii = (np.array([1 - share, share]) * _PARTICLES / (4 / 3 * np.pi)) ** (1 / 3)
    samples = [_sample(Solid(Balls(np.zeros((1, 3)), radii[k:k + 1])), recipe.sampler, rng) for k in range(2)]
    direction, aside = np.linalg.qr(rng.standard_normal((3, 2)))[0].T
    distances = radii.sum() + np.linspace(_GAP, -_DEPTH, _FRAMES)
    offset = rng.uniform(0, 0.3) * radii.sum()
    order = range(_FRAMES)[::-1] if recipe.seed % 2 else range(_FRAMES)
    centers = [np.stack([np.zeros(3), distances[t] * direction + offset * aside]) for t in order]
    for t, now in enumerate(centers):
        second = samples[1] + now[1]
        points = np.concatenate([samples[0], second[norm(second - now[0]) >= radii[0]]])

        def motion(asked: Points, now: Points = now, t: int = t) -> Points:
            nearest = np.stack([np.abs(norm(asked - now[k]) - radii[k]) for k in range(2)]).argmin(axis=0)
            return np.asarray(asked + (centers[t + 1] - now)[nearest])
        yield Frame(points, Solid(Balls(now, radii)), motion if t + 1 < _FRAMES else None)


def _spray(recipe: Recipe, rng: Rng) -> Iterator[Frame]:
    """A ball, drops of some particles and lone particles, all moving by the same step. The truth of a drop of n
    particles is a ball of volume n."""
    counts = [_PARTICLES // 2, *_SPRAY_SIZES, *[1] * _LONE]
    radii = (np.array(counts) / (4 / 3 * np.pi)) ** (1 / 3)
    centers = np.zeros((1, 3))
    while len(centers) < len(radii):
        place, k = rng.uniform(-1, 1, 3) * 3.2 * radii[0], len(centers)
        if (norm(centers - place) > radii[:k] + radii[k] + 4.5).all():
            centers = np.concatenate([centers, place[None]])
    drops = [_sample(Solid(Balls(np.zeros((1, 3)), radii[k:k + 1])), recipe.sampler, rng) if count > 1
             else np.zeros((1, 3)) for k, count in enumerate(counts)]
    step = rng.standard_normal(3)
    for t in range(_FRAMES):
        moved = Similarity(np.eye(3), step)
        yield Frame(np.concatenate([drop + center for drop, center in zip(drops, centers)]),
                    Solid(Balls(centers, radii)), moved if t + 1 < _FRAMES else None)
        centers = centers + step


_GROUPS: dict[str, Callable[[Recipe, Rng], Iterator[Frame]]] = {
    "deformed": _stretched, "topology": _merging, "spray": _spray}


def make_frames(recipe: Recipe) -> list[Frame]:
    """In spacings: each scene is scaled so that its particles have the volume of the first frame's truth."""
    frames = list(_GROUPS.get(recipe.group, _moving)(recipe, np.random.default_rng(recipe.seed)))
    scale = (len(frames[0].positions) / frames[0].truth.measure) ** (1 / 3)
    units = Similarity(scale * np.eye(3), np.zeros(3))

    def moved(motion: Callable[[Points], Points] | None) -> Callable[[Points], Points] | None:
        return motion and (lambda points: units(motion(points / scale)))
    return [Frame(scale * frame.positions, frame.truth.moved(units), moved(frame.motion)) for frame in frames]


def _set(shapes: Seq[str], ellipsoid: str, samplers: Seq[str], first_seed: int) -> list[Recipe]:
    """Every shape in three groups of motion with changing samplers, then the groups of special scenes."""
    recipes: list[Recipe] = []

    def add(group: str, shape: str, sampler: str) -> None:
        recipes.append(Recipe(f"{group}-{shape}-{sampler}-{len(recipes)}", group, shape, sampler,
                              first_seed + len(recipes)))
    for k, shape in enumerate(shapes):
        for j in range(3):
            add("rigid", shape, samplers[(k + 2 * j) % len(samplers)])
        add("noise-5", shape, samplers[(k + 1) % len(samplers)])
        add("noise-10", shape, samplers[(k + 3) % len(samplers)])
        if k % 2 == 0:
            add("thinned", shape, "relaxed")
            add("ragged", shape, "ragged")
    for k in range(4):
        add("deformed", ellipsoid, samplers[k % len(samplers)])
        add("topology", "two-balls-moving", samplers[(k + 1) % len(samplers)])
        add("spray", "ball-and-drops", ("relaxed", "blue-noise")[k % 2])
    return recipes


def surface_sets() -> dict[str, list[Recipe]]:
    """The sets by name. `validation` has other solids and seeds; it is read once, when a method is final."""
    samplers = ("relaxed", "lattice", "blue-noise", "close-packed", "settled", "clumped")
    tuning = _set(TUNING_SOLIDS, "ellipsoid", samplers, 7_000)
    return {"smoke": [r for r in tuning if r.shape in ("ball", "ell") and r.sampler in ("lattice", "blue-noise")],
            "tuning": tuning, "validation": _set(VALIDATION_SOLIDS, "pill", samplers, 910_000)}


def surface_digest(recipe: Recipe) -> str:
    """A hash, in 16 hexadecimal digits, of all positions, rounded to thousandths of a spacing."""
    total = hashlib.sha256()
    for frame in make_frames(recipe):
        total.update(np.round(1000 * frame.positions).astype(np.int64).tobytes())
    return total.hexdigest()[:16]


def _genus(surface: dict[str, Any]) -> int:
    """The number of handles of all shells."""
    triangles = surface["triangles"].astype(np.int64)
    euler = len(surface["points"]) - len(triangles) // 2  # Edges are three halves of the triangles.
    return int(len(surface["outer_of"]) - euler // 2)


_TRUE_GENUS = {"torus": 1, "drop-ring": 1, "bean-ring": 1, "aitch-ring": 1}


def _measure(recipe: Recipe, frame: Frame, surface: dict[str, Any], mesh: Mesh) -> dict[str, float]:
    deviation = compare(mesh, frame.truth, 1.0)
    found = {"mean_deviation": deviation.mean, "hausdorff": deviation.hausdorff,
             "triangles": float(len(mesh.triangles))}
    if mesh:
        expected = frame.truth.nearest(mesh.points)[2]
        cosine = np.clip(dot(surface["normals"].astype(float), expected), -1, 1)
        found["normal_error"] = float(np.arccos(cosine).mean())
    if recipe.group != "topology":  # There, the particles do not have the true volume.
        found["volume_error"] = abs(mesh.measure / frame.truth.measure - 1)
    shells = len(frame.truth.form.radii) if isinstance(frame.truth.form, Balls) else (
        2 if recipe.shape in ("hollow-ball", "eccentric-shell") else 1)
    if recipe.group != "topology":
        found["shell_error"] = float(abs(len(surface["outer_of"]) - shells))
        found["genus_error"] = float(abs(_genus(surface) - _TRUE_GENUS.get(recipe.shape, 0)))
    return found


def _on_truth(surface: dict[str, Any], truth: Solid) -> dict[str, Any]:
    """The surface with its points at the nearest points of the truth: only its facets deviate."""
    if not len(surface["points"]):
        return surface
    _, points, normals = truth.nearest(surface["points"])
    return {**surface, "points": points, "normals": normals}


def _row(recipe: Recipe, frames: Seq[Frame], method: str, surfaces: Seq[dict[str, Any]]) -> Row:
    before, numbers = Mesh(np.empty((0, 3)), np.empty((0, 3), np.int64)), []
    for t, (frame, surface) in enumerate(zip(frames, surfaces)):
        mesh = Mesh(surface["points"], surface["triangles"].astype(np.int64))
        found = _measure(recipe, frame, surface, mesh)
        if t and before and mesh:
            motion = frames[t - 1].motion
            assert motion is not None
            carried = before.moved(motion(before.points))
            counts = _apart(frames[t - 1], frame) if recipe.group == "topology" else None
            deviation = compare(carried, mesh, 1.0, counts)
            found.update(mean_jitter=deviation.mean, hausdorff_jitter=deviation.hausdorff)
        numbers.append(found)
        before = mesh
    values = {metric: mean_of([one.get(metric, ABSENT) for one in numbers]) for metric in METRICS}
    return Row(recipe.name, recipe.group, recipe.shape, recipe.sampler, True, method, "spacing", values, numbers)


def _reconstruct(placement: str, positions: Points) -> dict[str, Any]:
    """The surface of one frame. Raises partiemc.Error if it breaks a guarantee (S1 to S5)."""
    surface = partiemc.reconstruct(positions, output="surface", spacing=1, threads=1,
                                   placement=_NAMES_OF_OUTLINES.get(placement, placement)).surface
    surface.check()
    return {"points": surface.points, "triangles": surface.triangles, "normals": surface.normals,
            "outer_of": surface.outer_of}


def measure_scene(recipe: Recipe, placements: Seq[str] = PLACEMENTS) -> list[Row]:
    """A row for each placement, and one for the default with its points on the truth."""
    frames, rows = make_frames(recipe), []
    for placement in placements:
        surfaces = [_reconstruct(placement, frame.positions) for frame in frames]
        rows.append(_row(recipe, frames, placement, surfaces))
        if placement == DEFAULT:
            rows.append(_row(recipe, frames, ON_TRUTH, [_on_truth(surface, frame.truth)
                                                        for surface, frame in zip(surfaces, frames)]))
    return rows


def _apart(before: Frame, frame: Frame) -> Callable[[Points], Bools]:
    """Returns a function that selects points of `frame` away from a merging: farther than _APART from the ball that is
    not the nearest, now and in the frame before."""
    then, now = (Balls(f.truth.place(form.centers), f.truth.scale * form.radii) for f in (before, frame)
                 if isinstance(form := f.truth.form, Balls))

    def counts(points: Points) -> Bools:
        nearest = np.stack([np.abs(norm(points - c) - r) for c, r in zip(now.centers, now.radii)]).argmin(axis=0)
        other = 1 - nearest
        gaps = [norm(points - now.centers[nearest] - (form.centers[other] - form.centers[nearest])) - form.radii[other]
                for form in (then, now)]
        return np.asarray(np.minimum(*gaps) > _APART)
    return counts


def run_surfaces(recipes: Seq[Recipe], jobs: int, progress: Callable[[int], None] = lambda done: None) -> list[Row]:
    """All placements on all scenes; the same rows for any number of jobs."""
    return [row for found in map_in_processes(measure_scene, recipes, jobs, progress) for row in found]


def surface_tables(rows: Seq[Row]) -> list[Table]:
    """Geometric means of ratios to marching cubes: over all scenes, then of the default by group, sampler and shape,
    worst first. Last, the means of all metrics."""
    def of(placement: str) -> list[Row]:
        return [row for row in rows if row.method == placement]
    metrics = METRICS[:5] + METRICS[8:]
    heads = [metric.replace("_", " ") for metric in metrics]
    whole = Table("Surfaces: geometric means of ratios to marching cubes", "Every scene counts alike; below 1 is better. "
                  "95 % bootstrap intervals.", heads, [])
    for placement in (*PLACEMENTS[1:], ON_TRUTH):
        found = [compare_rows(of(placement), of(BASELINE), metric).ratio for metric in metrics]
        whole.rows += [(placement, [fixed(ratio.value) for ratio in found]),
                       ("  95 % interval", [f"{ratio.low:.3f}..{ratio.high:.3f}" for ratio in found])]
    tables = [whole]
    for what in ("group", "sampler", "shape"):
        table = Table(f"Surfaces: {DEFAULT} by {what}", "The same ratios; worst first by mean deviation.",
                      [*heads, "scenes"], [])
        for part in compare_parts(of(DEFAULT), of(BASELINE), metrics, "mean_deviation", lambda row: getattr(row, what)):
            table.rows.append((part.name, [fixed(r.value) + ("!" if r.value > 1 and m != "triangles" else "")
                                           for m, r in part.ratios.items()] + [str(part.sequences)]))
        tables.append(table)
    means = Table("Surfaces: means over all scenes", "Lengths in spacings, angles in radians, volumes relative.",
                  list(PLACEMENTS), [])
    for metric in METRICS:
        means.rows.append((metric, [fixed(mean_of([row[metric] for row in of(p)]), 5) for p in PLACEMENTS]))
    return [*tables, means]
