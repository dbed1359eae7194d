#include <array>
#include <cmath>

#include "client/output/formats/binary.h"
#include "client/output/formats/file_mesh.h"
#include "client/output/formats/formats.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

using Direction = std::array<double, 3>;

// The unit normal of a triangle; (0, 0, 0) if its area is 0 in double precision.
Direction FacetNormal(std::span<const double> points, std::span<const std::uint32_t> corners) {
  std::array<Direction, 2> sides;
  for (std::size_t side = 0; side < 2; ++side) {
    for (std::size_t c = 0; c < 3; ++c) {
      sides[side][c] =
          points[std::size_t{3} * corners[side + 1] + c] - points[std::size_t{3} * corners[0] + c];
    }
  }
  Direction normal;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t i = (c + 1) % 3, j = (c + 2) % 3;
    normal[c] = sides[0][i] * sides[1][j] - sides[0][j] * sides[1][i];
  }
  const double length = std::hypot(normal[0], normal[1], normal[2]);
  if (length == 0) return {};
  for (double& component : normal) component /= length;
  return normal;
}

}  // namespace

std::string EncodeStl(const FrameRecord& frame) {
  const FileMesh mesh(frame);
  const std::span<const double> points = mesh.points();
  std::string out = Concat("PartiEMC frame ", frame.index, ", time ", frame.time);
  out.resize(80, ' ');
  Put(static_cast<std::uint32_t>(mesh.TriangleCount()), out);
  for (std::size_t k = 0; k < mesh.triangles().size(); k += 3) {
    const auto corners = mesh.triangles().subspan(k, 3);
    const Direction normal = mesh.surface() ? FacetNormal(points, corners) : Direction{0, 0, 1};
    for (const double component : normal) Put(static_cast<float>(component), out);
    for (const std::size_t corner : corners) {
      for (std::size_t c = 0; c < 3; ++c) Put(static_cast<float>(points[3 * corner + c]), out);
    }
    Put(std::uint16_t{0}, out);
  }
  return out;
}

}  // namespace partiemc::client
