// Hand-made results and their files.
#pragma once

#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include "client/output/frame_writer.h"
#include "gtest/gtest.h"
#include "support/temporary_folder.h"

namespace partiemc::client {

inline std::string ReadFile(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Twice the signed area of interleaved points.
inline double TwiceArea(std::span<const double> ring) {
  double sum = 0;
  for (std::size_t k = 0, j = ring.size() - 2; k < ring.size(); j = k, k += 2) {
    sum += ring[j] * ring[k + 1] - ring[k] * ring[j + 1];
  }
  return sum;
}

/// Appends a ring with measures and, as normals, unit vectors away from its centroid.
inline void AddRing(Rings& rings, const std::vector<double>& points, std::uint32_t outer,
                    std::uint64_t particles = 0, std::uint64_t identity = 0) {
  if (rings.offsets.empty()) rings.offsets.push_back(0);
  RingMeasures measures;
  measures.area = TwiceArea(points) / 2;
  for (std::size_t k = 0; k < points.size(); k += 2) {
    const std::size_t next = (k + 2) % points.size();
    measures.perimeter += std::hypot(points[next] - points[k], points[next + 1] - points[k + 1]);
    measures.centroid_x += points[k] / static_cast<double>(points.size() / 2);
    measures.centroid_y += points[k + 1] / static_cast<double>(points.size() / 2);
  }
  measures.particle_count = particles;
  measures.identity = identity;
  for (std::size_t k = 0; k < points.size(); k += 2) {
    const double x = points[k] - measures.centroid_x, y = points[k + 1] - measures.centroid_y;
    rings.normals.push_back(static_cast<float>(x / std::hypot(x, y)));
    rings.normals.push_back(static_cast<float>(y / std::hypot(x, y)));
  }
  rings.points.insert(rings.points.end(), points.begin(), points.end());
  rings.offsets.push_back(static_cast<std::uint32_t>(rings.points.size() / 2));
  rings.outer_of.push_back(outer);
  rings.measures.push_back(measures);
}

/// A 4 x 4 square with a 1 x 1 hole and 8 triangles, and a separate triangle: three rings, area
/// 15 + 0.5.
inline Result SquareWithHoleAndIsland() {
  Result result;
  AddRing(result.rings, {0, 0, 4, 0, 4, 4, 0, 4}, kNoRing, 150, 7);
  AddRing(result.rings, {10, 0, 11, 0, 10, 1}, kNoRing, 5, 9);
  AddRing(result.rings, {1, 1, 1, 2, 2, 2, 2, 1}, 0);
  result.rings.parents = {3, 7};  // The square continues, merged with ring 3.
  result.rings.parent_offsets = {0, 2, 2, 2};
  result.mesh.points = result.rings.points;
  result.mesh.triangles = {0, 1, 10, 0, 10, 7, 1, 2, 9, 1, 9, 10, 2, 3,
                           8, 2, 8,  9, 3,  0, 7, 3, 7, 8, 4, 5,  6};
  result.mesh.classes.assign(9, TriangleClass::kBoundary);
  result.mesh.classes[2] = TriangleClass::kInterior;
  FrameStatistics& statistics = result.statistics;
  statistics.particles = 155;
  statistics.triangles = 9;
  statistics.triangles_grid = 36;
  statistics.spacing = 0.1;
  statistics.cell_size = 0.1;
  for (const RingMeasures& measures : result.rings.measures) {
    statistics.area += measures.area;
    statistics.perimeter += measures.perimeter;
  }
  return result;
}

/// A square whose bottom lies on a wall.
inline Result SquareOnFloor() {
  Result result;
  AddRing(result.rings, {0, 0, 2, 0, 2, 2, 0, 2}, kNoRing);
  result.rings.normals.clear();
  result.rings.wetted = {0};
  result.rings.contacts = {0, 1};
  result.rings.contact_angles = {std::numbers::pi_v<float> / 2, std::numbers::pi_v<float> / 4};
  return result;
}

/// The square with hole and island, with a linear field and a vector at every point.
inline Result WithAttributes() {
  Result result = SquareWithHoleAndIsland();
  AttributeValues height{"height", 1, {}}, place{"a,b", 2, {}};
  for (std::size_t k = 0; k < result.mesh.points.size(); k += 2) {
    height.values.push_back(static_cast<float>(result.mesh.points[k + 1]));
    place.values.push_back(static_cast<float>(result.mesh.points[k]));
    place.values.push_back(static_cast<float>(result.mesh.points[k + 1]));
  }
  result.attributes = {height, place};
  return result;
}

/// The bytes of a frame's file; fails the test if it is refused.
inline std::string Encode(FrameFormat format, const FrameRecord& frame,
                          const FrameWriterOptions& options = {}) {
  auto bytes = EncodeFrame(format, frame, options);
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  return bytes.value_or("");
}

/// How often a word stands in a text.
inline std::size_t CountOf(const std::string& text, const std::string& word) {
  std::size_t count = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    ++count;
  }
  return count;
}

}  // namespace partiemc::client
