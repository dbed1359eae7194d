#include "space/cell_loops.h"

#include <vector>

namespace partiemc::space {
namespace {

constexpr CellLoops Trace(unsigned corners) {
  // By edge of a crossing where a curve starts: the edge where the curve ends, and its face.
  constexpr int kNone = -1;
  std::array<int, kMostCrossings> next{}, face_of{};
  next.fill(kNone);
  CellLoops loops;
  for (int face = 0; face < 6; ++face) {
    const std::array<int, 4> at = CornersOfFace(face);
    const auto is_inside = [&](int k) { return (corners >> at[k & 3] & 1) != 0; };
    for (int first = 0; first < 4; ++first) {
      if (!is_inside(first) || is_inside(first + 3)) continue;
      int last = first;
      while (is_inside(last + 1)) ++last;
      const int start = EdgeBetween(at[first], at[(first + 3) & 3]);
      next[start] = EdgeBetween(at[last & 3], at[(last + 1) & 3]);
      face_of[start] = face;
    }
  }
  int step = 0;
  for (int start = 0; start < kMostCrossings; ++start) {
    if (next[start] == kNone) continue;
    for (int edge = start; next[edge] != kNone;) {
      loops.edge[step] = static_cast<std::uint8_t>(edge);
      loops.face[step] = static_cast<std::uint8_t>(face_of[edge]);
      loops.loop_of[step] = loops.loop_of_edge[edge] = loops.loops;
      ++step;
      const int to = next[edge];
      next[edge] = kNone;
      edge = to;
    }
    loops.first[++loops.loops] = static_cast<std::uint8_t>(step);
  }
  return loops;
}

/// Whether two edges lie on one face.
bool ShareFace(int a, int b) {
  for (int face = 0; face < 6; ++face) {
    const auto lies_on = [&](int edge) {
      const int axis = face / 2;
      return AxisOfEdge(edge) != axis && (LowCornerOfEdge(edge) >> axis & 1) == (face & 1);
    };
    if (lies_on(a) && lies_on(b)) return true;
  }
  return false;
}

/// Triangulates the polygon of the steps [first, last] of a loop, closed by a side from last to
/// first. Returns false if every triangulation has a diagonal on a face.
bool Triangulate(const CellLoops& loops, int base, int size, int first, int last,
                 LoopTriangles& triangles) {
  if (last - first < 2) return true;
  const auto is_free = [&](int a, int b) {
    const bool is_side = b - a == 1 || (a == 0 && b == size - 1);
    return is_side || !ShareFace(loops.edge[base + a], loops.edge[base + b]);
  };
  for (int middle = first + 1; middle < last; ++middle) {
    if (!is_free(first, middle) || !is_free(middle, last)) continue;
    const std::uint8_t before = triangles.count;
    triangles.corners[triangles.count++] = {static_cast<std::uint8_t>(first),
                                            static_cast<std::uint8_t>(middle),
                                            static_cast<std::uint8_t>(last)};
    if (Triangulate(loops, base, size, first, middle, triangles) &&
        Triangulate(loops, base, size, middle, last, triangles)) {
      return true;
    }
    triangles.count = before;
  }
  return false;
}

using CaseTriangles = std::array<LoopTriangles, kMostLoops>;

const std::array<CaseTriangles, 256>& TheTriangles() {
  static const std::array<CaseTriangles, 256> table = [] {
    std::array<CaseTriangles, 256> triangles;
    for (unsigned corners = 0; corners < 256; ++corners) {
      const CellLoops& loops = LoopsOf(corners);
      for (int loop = 0; loop < loops.loops; ++loop) {
        const int first = loops.first[loop];
        const int size = loops.first[loop + 1] - first;
        Triangulate(loops, first, size, 0, size - 1, triangles[corners][loop]);
      }
    }
    return triangles;
  }();
  return table;
}

}  // namespace

// Initialised at compile time, so that no call has to check whether the table exists.
constinit const std::array<CellLoops, 256> kCellLoops = [] {
  std::array<CellLoops, 256> table;
  for (unsigned corners = 0; corners < 256; ++corners) table[corners] = Trace(corners);
  return table;
}();

const LoopTriangles& TrianglesOf(unsigned corners, int loop) {
  return TheTriangles()[corners][loop];
}

}  // namespace partiemc::space
