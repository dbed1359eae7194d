#!/usr/bin/python3
"""Draws surfaces as one picture with smooth shading, one panel for each OBJ file.

  partiemc replay client/recordings/colliding_drops.pemc --local --surface --output-dir frames \\
      --format obj
  client/recordings/render.py frames/frame_0000{00,07,11,15,22}.obj drops.png --turn 40 --tilt 15
"""
import argparse

import matplotlib.image
import numpy as np

LIGHT = np.array([-0.35, 0.55, 0.75]) / np.linalg.norm([-0.35, 0.55, 0.75])
BODY, SKY = np.array([0.16, 0.47, 0.71]), np.array([0.83, 0.9, 0.97])
OVERSAMPLING = 3
# Least cosine between the normals of a triangle and of its corner. Below it the corner is drawn sharp.
CREASE = 0.8


def read_obj(path):
    """Points, normals and triangles of a surface."""
    points, normals, triangles = [], [], []
    with open(path) as file:
        for line in file:
            words = line.split()
            if words[:1] == ["v"]:
                points.append([float(word) for word in words[1:]])
            elif words[:1] == ["vn"]:
                normals.append([float(word) for word in words[1:]])
            elif words[:1] == ["f"]:
                triangles.append([int(word.split("/")[0]) - 1 for word in words[1:]])
    return np.array(points), np.array(normals), np.array(triangles)


def camera(turn, tilt):
    """A rotation that maps world coordinates to right, up and towards the viewer."""
    c, s = np.cos(turn), np.sin(turn)
    a, b = np.cos(tilt), np.sin(tilt)
    return np.array([[c, s, 0], [-s * b, c * b, a], [s * a, -c * a, b]])


def draw(points, normals, triangles, width, height, scale):
    """RGBA of an orthographic view; coordinates are those of the camera."""
    depth = np.full((height, width), -np.inf)
    facing = np.zeros((height, width, 3))
    x, y = points[:, 0] * scale + width / 2, height / 2 - points[:, 1] * scale
    for a, b, c in triangles:
        left, right = int(min(x[a], x[b], x[c])), int(max(x[a], x[b], x[c])) + 1
        top, bottom = int(min(y[a], y[b], y[c])), int(max(y[a], y[b], y[c])) + 1
        left, right = max(left, 0), min(right, width - 1)
        top, bottom = max(top, 0), min(bottom, height - 1)
        area = (x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a])
        if area >= 0 or left > right or top > bottom:  # Seen from behind, or outside.
            continue
        at_x, at_y = np.meshgrid(np.arange(left, right + 1), np.arange(top, bottom + 1))
        across = np.cross(points[b] - points[a], points[c] - points[a])
        across /= max(np.linalg.norm(across), 1e-300)
        at_a, at_b, at_c = (normals[k] if normals[k] @ across > CREASE else across for k in (a, b, c))
        v = ((at_x - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (at_y - y[a])) / area
        w = ((x[b] - x[a]) * (at_y - y[a]) - (at_x - x[a]) * (y[b] - y[a])) / area
        u = 1 - v - w
        here = u * points[a, 2] + v * points[b, 2] + w * points[c, 2]
        window = (slice(top, bottom + 1), slice(left, right + 1))
        nearer = (u >= 0) & (v >= 0) & (w >= 0) & (here > depth[window])
        depth[window][nearer] = here[nearer]
        mixed = u[..., None] * at_a + v[..., None] * at_b + w[..., None] * at_c
        facing[window][nearer] = mixed[nearer]
    return shade(facing, depth > -np.inf)


def shade(facing, is_body):
    facing = facing / np.maximum(np.linalg.norm(facing, axis=2, keepdims=True), 1e-9)
    diffuse = np.clip(facing @ LIGHT, 0, 1)[..., None]
    half = LIGHT + [0, 0, 1]
    shine = np.clip(facing @ (half / np.linalg.norm(half)), 0, 1)[..., None] ** 60
    rim = (1 - np.clip(facing[..., 2:], 0, 1)) ** 3
    colour = BODY * (0.35 + 0.75 * diffuse) + 0.35 * shine + 0.25 * rim * SKY
    return np.concatenate([np.clip(colour, 0, 1), is_body[..., None]], axis=2)


def shrunk(image):
    """The mean over blocks of OVERSAMPLING x OVERSAMPLING pixels. Changes `image`."""
    height, width, _ = image.shape
    image[..., :3] *= image[..., 3:]
    blocks = image.reshape(height // OVERSAMPLING, OVERSAMPLING, width // OVERSAMPLING,
                           OVERSAMPLING, 4).mean(axis=(1, 3))
    blocks[..., :3] /= np.maximum(blocks[..., 3:], 1e-9)
    return blocks


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("surfaces", nargs="+", help="OBJ files of partiemc replay --surface")
    parser.add_argument("picture", help="PNG file to write")
    parser.add_argument("--width", type=int, default=1000, help="Pixels of the whole picture")
    parser.add_argument("--turn", type=float, default=25, help="Degrees around the vertical")
    parser.add_argument("--tilt", type=float, default=20, help="Degrees from above")
    parser.add_argument("--up", default="z", choices=["y", "z"], help="The axis that points up")
    options = parser.parse_args()
    surfaces = [read_obj(path) for path in options.surfaces]
    if options.up == "y":
        swap = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
        surfaces = [(points @ swap.T, normals @ swap.T, triangles)
                    for points, normals, triangles in surfaces]
    turned = camera(np.radians(options.turn), np.radians(options.tilt))
    surfaces = [(points @ turned.T, normals @ turned.T, triangles)
                for points, normals, triangles in surfaces]
    low = np.min([points.min(axis=0) for points, _, _ in surfaces], axis=0)
    high = np.max([points.max(axis=0) for points, _, _ in surfaces], axis=0)
    width = options.width // len(surfaces) * OVERSAMPLING
    scale = 0.94 * width / (high - low)[0]
    height = int(scale * (high - low)[1] / 0.9 / OVERSAMPLING) * OVERSAMPLING
    middle = (low + high) / 2
    panels = [shrunk(draw(points - middle, normals, triangles, width, height, scale))
              for points, normals, triangles in surfaces]
    matplotlib.image.imsave(options.picture, np.concatenate(panels, axis=1))


if __name__ == "__main__":
    main()
