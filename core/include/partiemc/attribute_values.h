// The attributes of a frame at the points of a result.
#pragma once

#include <string>
#include <vector>

namespace partiemc {

/// An attribute of the frame (Frame::attributes), interpolated to the vertices.
struct AttributeValues {
  std::string name;
  int components = 1;
  /// Interleaved, `components` per vertex. For outlines first the points of the rings, then the
  /// other points of the mesh in the order of Mesh::points; for surfaces in the order of
  /// Surface::points.
  std::vector<float> values;

  friend bool operator==(const AttributeValues&, const AttributeValues&) = default;
};

}  // namespace partiemc
