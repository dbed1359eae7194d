#!/usr/bin/python3
"""Draws a replay as one animated SVG: filled outlines with the edges of their merged meshes.

  partiemc replay client/recordings/dam_break.pemc --local --output-dir frames --format geojson,obj
  client/recordings/animate.py frames client/recordings/dam_break.svg --step 2
"""
import argparse
import json
import pathlib


def read_rings(path):
    """Rings of a frame: lists of (x, y), without the repeated last point."""
    rings = []
    for feature in json.loads(path.read_text())["features"]:
        geometry = feature["geometry"]
        polygons = geometry["coordinates"]
        if geometry["type"] == "Polygon":
            polygons = [polygons]
        rings += [ring[:-1] for polygon in polygons for ring in polygon]
    return rings


def read_edges(path):
    """Edges of a mesh, each once: pairs of (x, y)."""
    points, edges = [], set()
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            points.append((float(words[1]), float(words[2])))
        elif words[:1] == ["f"]:
            corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
            edges |= {tuple(sorted(pair)) for pair in zip(corners, corners[1:] + corners[:1])}
    return [(points[a], points[b]) for a, b in sorted(edges)]


class View:
    """Maps world coordinates to whole pixels, y downward."""

    def __init__(self, points, width, margin):
        left, right = min(x for x, _ in points), max(x for x, _ in points)
        bottom, self.top = min(y for _, y in points), max(y for _, y in points)
        self.left, self.margin = left, margin
        self.scale = (width - 2 * margin) / (right - left)
        self.width = width
        self.height = round((self.top - bottom) * self.scale) + 2 * margin

    def __call__(self, point):
        return (round((point[0] - self.left) * self.scale) + self.margin,
                round((self.top - point[1]) * self.scale) + self.margin)


def path_of(lines, view, closed):
    """SVG path data of polylines, in relative steps, because these have fewer digits."""
    words = []
    for line in lines:
        pixels = [view(point) for point in line]
        x, y = pixels[0]
        words.append(f"M{x} {y}l")
        steps = []
        for next_x, next_y in pixels[1:]:
            if (next_x, next_y) != (x, y):
                steps.append(f"{next_x - x} {next_y - y}")
            x, y = next_x, next_y
        words.append(" ".join(steps or ["0 0"]).replace(" -", "-"))
        if closed:
            words.append("z")
    return "".join(words)


def animated(name, frames, seconds):
    return (f'<path class="{name}" d="{frames[0]}"><animate attributeName="d" calcMode="discrete" '
            f'dur="{seconds:g}s" repeatCount="indefinite" values="{";".join(frames)}"/></path>')


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("frames", type=pathlib.Path, help="folder of frame_*.geojson and .obj")
    parser.add_argument("svg", type=pathlib.Path)
    parser.add_argument("--step", type=int, default=1, help="every so many frames")
    parser.add_argument("--rate", type=float, default=12, help="frames shown in a second")
    parser.add_argument("--width", type=int, default=800, help="pixels")
    parser.add_argument("--height", type=float, help="world units from the lowest point that are shown")
    arguments = parser.parse_args()

    files = sorted(arguments.frames.glob("frame_*.geojson"))[::arguments.step]
    if not files:
        parser.error(f"{arguments.frames}: has no frame_*.geojson")
    rings = [read_rings(file) for file in files]
    meshes = [read_edges(file.with_suffix(".obj")) for file in files]
    points = [point for frame in rings for ring in frame for point in ring]
    if arguments.height is not None:
        bottom = min(y for _, y in points)
        points = [(x, min(y, bottom + arguments.height)) for x, y in points]
    view = View(points, arguments.width, margin=6)
    seconds = len(files) / arguments.rate
    outlines = [path_of(frame, view, closed=True) for frame in rings]
    edges = [path_of(frame, view, closed=False) for frame in meshes]
    arguments.svg.write_text("\n".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {view.width} {view.height}">',
        "<style>path{stroke-linejoin:round;fill:none}.inside{fill:#dcebf7;fill-rule:evenodd;"
        "stroke:#0b4f86;stroke-width:2}.mesh{stroke:#9dbfdc;stroke-width:.6}</style>",
        '<rect width="100%" height="100%" fill="#fff"/>',
        animated("inside", outlines, seconds),
        animated("mesh", edges, seconds),
        "</svg>\n"]))


if __name__ == "__main__":
    main()
