// A closed triangle surface while planes cut it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace partiemc::space {

/// A plane parallel to two axes, and the side on which points are kept.
struct AxisPlane {
  int axis = 0;  ///< The coordinate that is constant on the plane: 0, 1, 2 for x, y, z.
  double at = 0;
  bool keeps_above =
      true;              ///< Whether points with a larger coordinate are kept, else smaller ones.
  bool is_wall = false;  ///< A wall; else a face of a periodic box (CutSurface).
};

/// The two axes in a plane, in the order for which a cap lies on the left of its edges.
inline std::array<int, 2> PlaneFrame(const AxisPlane& plane) {
  const int next = (plane.axis + 1) % 3, last = (plane.axis + 2) % 3;
  // The outside is below the plane if the points above it are kept.
  return plane.keeps_above ? std::array{last, next} : std::array{next, last};
}

/// A closed surface: triangles, counter-clockwise as seen from outside, and caps on the planes that
/// have cut it.
struct CutMesh {
  /// An edge of a cap. The cap is on its left, seen from outside of the body.
  struct CapEdge {
    std::uint32_t from, to;
    std::uint32_t shell;  ///< A number as in CutMesh::shell_of.
  };
  struct Cap {
    AxisPlane plane;
    std::vector<CapEdge> edges;
  };
  std::vector<double> points;            ///< x0, y0, z0, x1, ...; may hold unused points.
  std::vector<float> normals;            ///< Per point, interleaved.
  std::vector<std::uint32_t> triangles;  ///< Three point indices each.
  std::vector<std::uint32_t> shell_of;   ///< Per triangle: a number, which its parts inherit.
  std::vector<std::uint8_t> is_clipped;  ///< Per triangle: 1 if it is a part of a cut triangle.
  std::vector<Cap> caps;                 ///< One for each call of CutAtPlane, in the same order.
  /// Set by CapPlanes: cap k has the triangles [cap_offsets[k], cap_offsets[k + 1]). All triangles
  /// outside of caps come before cap_offsets[0]. CutSurface then appends shells that are not cut,
  /// and drops dust. After that, only cap_offsets[0] is valid.
  std::vector<std::uint32_t> cap_offsets;
};

}  // namespace partiemc::space
