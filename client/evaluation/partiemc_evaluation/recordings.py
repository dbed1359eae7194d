"""Reads recordings (.pemc) as sequences, and their known facts: walls, ellipses, spray."""

import pathlib
from typing import Any, Iterator

import numpy as np
import partiemc
import zstandard

from .geometry import Floats, Outline, Points, cross, dot, ellipse_ring, norm
from .metrics import ABSENT
from .motions import Similarity
from .scenes import Frame, Sequence
from .shapes import CURVE_STEP


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    value, shift = 0, 0
    while True:
        byte = data[at]
        value, shift, at = value | (byte & 127) << shift, shift + 7, at + 1
        if byte < 128:
            return value, at


def _fields(message: memoryview) -> dict[int, Any]:
    """The fields of a Protobuf message by number: varints, doubles and bytes. Of a repeated field the last."""
    fields: dict[int, Any] = {}
    at = 0
    while at < len(message):
        key, at = _varint(message, at)
        if key & 7 == 0:
            fields[key >> 3], at = _varint(message, at)
        elif key & 7 == 1:
            fields[key >> 3], at = float(np.frombuffer(message[at:at + 8], "<f8")[0]), at + 8
        elif key & 7 == 2:
            size, at = _varint(message, at)
            fields[key >> 3], at = message[at:at + size], at + size
        else:
            raise ValueError(f"wire type {key & 7}, which recordings do not have")
    return fields


def _messages(path: pathlib.Path) -> Iterator[dict[int, Any]]:
    """The header (partiemc.recording.v1) and the frames (partiemc.v1.ParticleFrame) of a file."""
    with open(path, "rb") as file:
        stream = zstandard.ZstdDecompressor().stream_reader(file, read_across_frames=True)
        data, at = memoryview(stream.read()), 0
    while at < len(data):
        size, at = _varint(data, at)
        yield _fields(data[at:at + size])
        at += size


def _frame(fields: dict[int, Any]) -> Frame:
    kinds = {1: "<f4", 2: "<f8"}  # Position formats with two coordinates.
    if fields.get(3) not in kinds or not fields.get(4):
        raise ValueError("is not a recording of the plane, or has a frame without particles")

    def array(number: int, dtype: str) -> Any:
        return np.frombuffer(fields[number], dtype) if fields.get(number) else None
    ids, volumes, velocities = array(5, "<u8"), array(6, "<f4"), array(7, "<f4")
    return Frame(fields.get(2, 0.0), array(4, kinds[fields[3]]).astype(float).reshape(-1, 2), volumes, ids,
                 None if velocities is None else velocities.astype(float).reshape(-1, 2),
                 area=0.0 if volumes is None else float(volumes.sum(dtype=float)))


def read_recording(path: pathlib.Path, notes: list[str], frames: slice = slice(None)) -> Sequence:
    """Reads NAME.pemc, and NAME.truth in the same folder if it exists.

    A spacing that the file lacks is estimated from the first frame, and `notes` says so. Raises ValueError with the
    file's name.
    """
    try:
        header, *messages = list(_messages(path))
        selected = [_frame(fields) for fields in messages[frames]]
        if len(selected) < 2:
            raise ValueError(f"has {len(selected)} frames to evaluate; must be two or more")
        spacing = header.get(1)
        if spacing is None:
            spacing = partiemc.reconstruct(selected[0].positions, fill="none").spacing
            notes.append(f"{path.stem}: has no spacing; {spacing:.6g} was estimated from its first frame")
        sequence = Sequence(path.stem, "recording", path.stem, "", spacing, selected)
        truth = path.with_suffix(".truth")
        if truth.exists():
            add_truth(truth.read_text(), sequence)
    except (ValueError, IndexError, zstandard.ZstdError) as error:
        raise ValueError(f"{path}: {error}") from error
    return sequence


def add_truth(text: str, sequence: Sequence) -> None:
    """Adds the facts of `text` to a recording, one on each line; '#' begins a comment. Raises ValueError.

    wall X0 Y0 X1 Y1: a rigid straight wall, world units; the particles' volume ends on it. ellipse: one body that is an
    ellipse in every frame; its truth is moment_ellipse. spray: spray comes off that no outline contains; areas are not
    compared.
    """
    walls = list(sequence.walls)
    for line in text.splitlines():
        words = line.split("#")[0].split()
        if words == ["ellipse"]:
            for frame in sequence.frames:
                frame.area = frame.area or len(frame.positions) * sequence.spacing ** 2
                frame.truth = moment_ellipse(frame.positions, sequence.spacing, frame.area)
        elif words == ["spray"]:
            sequence.whole = False
        elif words[:1] == ["wall"] and len(words) == 5:
            try:
                wall = np.array(words[1:], float).reshape(2, 2)
            except ValueError:
                wall = np.full((2, 2), np.nan)
            if not np.isfinite(wall).all() or (wall[0] == wall[1]).all():
                raise ValueError(f"'{line}': must be two different points")
            walls.append(wall)
        elif words:
            raise ValueError(f"'{line}'; must be 'wall X0 Y0 X1 Y1', 'ellipse' or 'spray'")
    sequence.walls = np.reshape(walls, (-1, 2, 2))


def moment_ellipse(positions: Points, spacing: float, area: float) -> Outline:
    """The ellipse of area `area` (world units squared) with the centroid of the particles (N, 2). The directions and
    the ratio of its axes follow from the particles' second moments; each particle is a square of side `spacing`."""
    center = positions.mean(axis=0)
    moments = np.cov(positions.T, bias=True) + np.eye(2) * spacing ** 2 / 12
    values, vectors = np.linalg.eigh(moments)
    ratio = float(np.sqrt(values[1] / values[0]))
    b = float(np.sqrt(area / (np.pi * ratio))) / spacing
    angle = float(np.arctan2(vectors[1, 1], vectors[0, 1]))
    units = Similarity.plane(scale=spacing, shift=center)
    return Outline.of([units(ellipse_ring((0, 0), ratio * b, b, angle, CURVE_STEP))])


# Length of a piece of a wall, in spacings; wet pieces required on either side of a piece; a
# particle nearer to the wall than this, in spacings, wets its piece.
_PIECE, _WET_PIECES, _WET_HEIGHT = 2.0, 2, 1.25
_SAMPLES, _HIGHEST, _FEWEST = 20, 1.5, 30         # Samples of a piece; largest height, in spacings; fewest samples.


def wall_roughness(outline: Outline, positions: Points, walls: Floats, spacing: float) -> float:
    """Standard deviation of an outline's distance from its walls, in spacings: the root mean
    square, over the samples of all walls, of the deviation from the mean of the same wall.

    Samples lie every tenth of a spacing where the wall is wet: a piece of two spacings, and two pieces on either side,
    have particles within 1.25 spacings. This leaves out contact lines and corners, for every method. Distances are
    limited to 1.5 spacings. Absent if fewer than three spacings of wall are wet.
    """
    squares, samples = 0.0, 0
    for start, end in walls:
        length = float(norm(end - start)) / spacing
        along = (end - start) / norm(end - start)
        wet = np.zeros(int(length / _PIECE), np.bool_)

        def place(points: Points) -> tuple[Floats, Floats]:
            arm = points - start
            return dot(arm, along[None]) / spacing, cross(along[None], arm) / spacing
        at, height = place(positions)
        near = (np.abs(height) < _WET_HEIGHT) & (at >= 0) & (at < len(wet) * _PIECE)
        wet[(at[near] / _PIECE).astype(int)] = True
        if len(wet) <= 2 * _WET_PIECES:
            continue
        inner = np.lib.stride_tricks.sliding_window_view(wet, 2 * _WET_PIECES + 1).all(axis=1)
        counted = np.repeat(np.concatenate([[False] * _WET_PIECES, inner, [False] * _WET_PIECES]), _SAMPLES)
        if not counted.any():
            continue
        heights = _heights(*place(outline.points), outline, len(counted))[counted]
        squares += float(heights.var()) * len(heights)
        samples += len(heights)
    return float(np.sqrt(squares / samples)) if samples >= _FEWEST else ABSENT


def _heights(at: Floats, height: Floats, outline: Outline, count: int) -> Floats:
    """(count,) height of the outline over the middle of each step of a wall, in spacings: of several the smallest
    magnitude, _HIGHEST without one. at, height: (P,) coordinates of the outline's points along and above the wall."""
    step = _PIECE / _SAMPLES
    heights = np.full(count, _HIGHEST)
    first = np.minimum(at, at[outline.following])
    last = np.maximum(at, at[outline.following])
    begin = np.clip(np.ceil(first / step - 0.5), 0, count).astype(int)
    end = np.clip(np.ceil(last / step - 0.5), 0, count).astype(int)
    for k in np.flatnonzero(end > begin):
        middles = (np.arange(begin[k], end[k]) + 0.5) * step
        share = (middles - at[k]) / (at[outline.following[k]] - at[k])
        new = (1 - share) * height[k] + share * height[outline.following[k]]
        old = heights[begin[k]:end[k]]
        heights[begin[k]:end[k]] = np.where(np.abs(new) < np.abs(old), new, old)
    return heights
