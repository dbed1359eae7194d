#include "client/output/surface_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <span>
#include <vector>

#include "partiemc/surface_reconstructor.h"

namespace partiemc::client {
namespace {

bool IsInside(double x, double y, double z) {
  const double from_centre = std::hypot(x, y, z);
  const bool ball = from_centre < 6 && from_centre > 3;
  const bool torus = std::hypot(std::hypot(x - 18, y) - 6, z) < 2.5;
  return ball || torus;
}

}  // namespace

Surface HollowBallAndTorus(double shift) {
  std::vector<double> positions;
  std::vector<float> heights, places;
  for (int i = -8; i <= 28; ++i) {
    for (int j = -10; j <= 10; ++j) {
      for (int k = -8; k <= 8; ++k) {
        if (!IsInside(i, j, k)) continue;
        positions.insert(positions.end(),
                         {i + shift, static_cast<double>(j), static_cast<double>(k)});
        heights.push_back(static_cast<float>(k));
        places.insert(places.end(),
                      {static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)});
      }
    }
  }
  const std::vector<Attribute> attributes = {{"height", 1, heights}, {"a,b", 3, places}};
  Surface surface;
  SurfaceWorkspace workspace;
  const absl::Status status = SurfaceReconstructor::Create({.spacing = 1})
                                  ->Reconstruct({.positions = std::span<const double>(positions),
                                                 .components = 3,
                                                 .attributes = attributes},
                                                workspace, surface);
  if (!status.ok()) {
    std::cerr << status << "\n";
    std::abort();
  }
  return surface;
}

Surface WithCuts(Surface surface) {
  for (std::uint32_t k = 0; k < surface.TriangleCount(); ++k) {
    const auto corners = std::span(surface.triangles).subspan(std::size_t{3} * k, 3);
    if (std::ranges::all_of(corners, [&](auto corner) {
          return surface.points[std::size_t{3} * corner + 2] > 2;
        })) {
      surface.cuts.push_back(k);
    }
  }
  return surface;
}

}  // namespace partiemc::client
