// The loops of crossings in a cell, for each of the 256 cases of inside and outside corners.
//
// Corner c lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge 4 a + u + 2 v runs along axis a; u and v
// are its coordinates along the axes a + 1 and a + 2. Face 2 a + s is perpendicular to axis a at
// coordinate s.
//
// On each face, inside corners that are not neighbours are separated. A curve on a face joins two
// crossings. The curves of a cell form loops, which run counter-clockwise as seen from the outside
// of the body. The cell on the other side of a face has the same curves reversed.
#pragma once

#include <array>
#include <cstdint>

namespace partiemc::space {

inline constexpr int kMostCrossings = 12;
inline constexpr int kMostLoops = 4;

/// The loops of one case, as steps, loop by loop. Step n is the curve on the face `face[n]` from
/// the crossing of `edge[n]` to the crossing of the next step of its loop.
struct CellLoops {
  std::uint8_t loops = 0;
  std::array<std::uint8_t, kMostLoops + 1> first{};  ///< Loop m has steps [first[m], first[m + 1]).
  std::array<std::uint8_t, kMostCrossings> edge{}, face{};
  std::array<std::uint8_t, kMostCrossings> loop_of{};       ///< By step.
  std::array<std::uint8_t, kMostCrossings> loop_of_edge{};  ///< By edge, if it is crossed.

  int Steps() const { return first[loops]; }
  /// The step after `step` in its loop.
  int Next(int step) const {
    const int loop = loop_of[step];
    return step + 1 < first[loop + 1] ? step + 1 : first[loop];
  }
};

extern const std::array<CellLoops, 256> kCellLoops;

/// The loops of the case whose bit c is set if corner c is inside.
inline const CellLoops& LoopsOf(unsigned corners) { return kCellLoops[corners]; }

/// Triangles between the crossings of one loop. No diagonal lies on a face of the cell. Corners are
/// indices of steps, relative to the first step of the loop.
struct LoopTriangles {
  std::uint8_t count = 0;
  std::array<std::array<std::uint8_t, 3>, kMostCrossings - 2> corners{};
};

/// The triangles of marching cubes for a loop of up to six crossings of a case.
const LoopTriangles& TrianglesOf(unsigned corners, int loop);

/// The axis of an edge and its lower corner; EdgeAt returns the edge that has both.
constexpr int AxisOfEdge(int edge) { return edge / 4; }
constexpr int LowCornerOfEdge(int edge) {
  const int axis = edge / 4;
  return (edge & 1) << (axis + 1) % 3 | (edge >> 1 & 1) << (axis + 2) % 3;
}
constexpr int EdgeAt(int axis, int low_corner) {
  return 4 * axis + (low_corner >> (axis + 1) % 3 & 1) + 2 * (low_corner >> (axis + 2) % 3 & 1);
}

/// The same edge in the cell on the other side of a face.
constexpr int EdgeAcross(int edge, int face) {
  return EdgeAt(AxisOfEdge(edge), LowCornerOfEdge(edge) ^ 1 << face / 2);
}

/// The corners of a face, counter-clockwise as seen from outside of the cell.
constexpr std::array<int, 4> CornersOfFace(int face) {
  const int axis = face / 2, side = face & 1;
  const int b = 1 << (axis + 1) % 3, c = 1 << (axis + 2) % 3, base = side << axis;
  if (side == 1) return {base, base | b, base | b | c, base | c};
  return {base, base | c, base | b | c, base | b};
}

/// The edge between two neighbouring corners.
constexpr int EdgeBetween(int a, int b) {
  const int difference = a ^ b;
  return EdgeAt(difference == 1 ? 0 : difference == 2 ? 1 : 2, a & b);
}

}  // namespace partiemc::space
