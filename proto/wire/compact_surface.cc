#include "wire/compact_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#define MESHOPTIMIZER_NO_WRAPPERS
#include <meshoptimizer.h>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc::wire {
namespace {

// Sets the codec versions that PROTOCOL.md requires. They are global variables of meshoptimizer, so
// they are set before any thread encodes.
[[maybe_unused]] const bool kVersionsAreSet = [] {
  meshopt_encodeVertexVersion(0);
  meshopt_encodeIndexVersion(1);
  return true;
}();

// Minimum number of steps (units of rounded coordinates) per particle spacing. Rounding then moves
// a point by at most .0009 spacings.
constexpr double kSteps = 1024;
constexpr double kMostSteps = 1 << 30;

// Bytes and bits of a normal for the octahedral filter of meshoptimizer.
constexpr std::size_t kNormalBytes = 4;
constexpr int kNormalBits = 8;

// The vertex codec stores at least 2 bits for 16 bytes.
constexpr std::size_t kMostExpansion = 64;

// Most bytes of a decompressed array.
constexpr std::size_t kMostArrayBytes = std::size_t{1} << 30;

const unsigned char* Data(const std::string& bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}
unsigned char* Data(std::string& bytes) { return reinterpret_cast<unsigned char*>(bytes.data()); }

template <typename T>
void EncodeVertices(std::span<const T> values, std::size_t vertex_bytes, std::string& bytes) {
  const std::size_t count = values.size_bytes() / vertex_bytes;
  bytes.resize(meshopt_encodeVertexBufferBound(count, vertex_bytes));
  bytes.resize(
      meshopt_encodeVertexBuffer(Data(bytes), bytes.size(), values.data(), count, vertex_bytes));
}

template <typename T>
absl::Status DecodeVertices(const std::string& bytes, std::size_t count, std::size_t vertex_bytes,
                            absl::string_view field, std::vector<T>& values) {
  if (count * vertex_bytes / kMostExpansion > bytes.size()) {
    return Lost(field, absl::StrCat("has ", bytes.size(), " bytes, too few for ", count,
                                    " compressed points"));
  }
  if (count * vertex_bytes > kMostArrayBytes) {
    return Lost(field, absl::StrCat("has ", count, " points, which take more than ",
                                    kMostArrayBytes, " bytes"));
  }
  values.resize(count * vertex_bytes / sizeof(T));
  if (meshopt_decodeVertexBuffer(values.data(), count, vertex_bytes, Data(bytes), bytes.size()) !=
      0) {
    return Lost(field, absl::StrCat("does not decompress to ", count, " points"));
  }
  return absl::OkStatus();
}

// The order of points and triangles in the message.
struct Order {
  std::vector<std::uint32_t> points;     // The point of the surface for each point of the message.
  std::vector<std::uint32_t> triangles;  // Indices of points of the message.
};

// Orders the triangles of each shell so that neighbours follow each other, and its points by their
// first use.
Order OrderOf(const Surface& surface) {
  Order order;
  order.points.reserve(surface.PointCount());
  order.triangles.resize(surface.triangles.size());
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> local, place;
  for (std::size_t k = 0; k < surface.ShellCount(); ++k) {
    const std::uint32_t first_point = surface.point_offsets[k];
    const std::size_t points = surface.point_offsets[k + 1] - first_point;
    const std::size_t begin = 3 * std::size_t{surface.triangle_offsets[k]};
    const std::size_t end = 3 * std::size_t{surface.triangle_offsets[k + 1]};
    local.assign(surface.triangles.begin() + static_cast<std::ptrdiff_t>(begin),
                 surface.triangles.begin() + static_cast<std::ptrdiff_t>(end));
    for (std::uint32_t& point : local) point -= first_point;
    meshopt_optimizeVertexCache(order.triangles.data() + begin, local.data(), local.size(), points);
    place.assign(points, kUnused);
    for (std::size_t i = begin; i < end; ++i) {
      std::uint32_t& point = order.triangles[i];
      if (place[point] == kUnused) {
        place[point] = static_cast<std::uint32_t>(order.points.size());
        order.points.push_back(first_point + point);
      }
      point = place[point];
    }
  }
  return order;
}

// The triangles of the message that are cuts of the surface.
std::vector<std::uint32_t> CutsOf(const Surface& surface, const Order& order) {
  std::vector<std::uint32_t> cuts;
  if (surface.cuts.empty()) return cuts;
  // Triangles are recognised by their points.
  const auto key = [](std::array<std::uint32_t, 3> points) {
    std::sort(points.begin(), points.end());
    return points;
  };
  std::vector<std::array<std::uint32_t, 3>> known;
  for (const std::uint32_t cut : surface.cuts) {
    const std::uint32_t* const points = &surface.triangles[3 * std::size_t{cut}];
    known.push_back(key({points[0], points[1], points[2]}));
  }
  std::sort(known.begin(), known.end());
  for (std::size_t t = 0; t < surface.TriangleCount(); ++t) {
    const std::uint32_t* const points = &order.triangles[3 * t];
    const auto of_surface =
        key({order.points[points[0]], order.points[points[1]], order.points[points[2]]});
    if (!std::binary_search(known.begin(), known.end(), of_surface)) continue;
    cuts.push_back(static_cast<std::uint32_t>(t));
  }
  return cuts;
}

absl::Status EncodeRounded(std::span<const double> points, std::span<const std::uint32_t> order,
                           const Origin& origin, double step, std::string& bytes) {
  std::vector<std::int32_t> rounded(3 * order.size());
  for (std::size_t i = 0; i < rounded.size(); ++i) {
    const std::size_t point = order[i / 3], axis = i % 3;
    const double steps = std::round((points[3 * point + axis] - origin[axis]) / step);
    // This form of the comparison refuses NaN, too.
    if (!(std::abs(steps) <= kMostSteps)) {
      return ViolationError(
          absl::StatusCode::kOutOfRange,
          {std::string(kReasonResolution), absl::StrCat("surface.points[", point, "]"),
           absl::StrCat(ShortestNumber(std::abs(steps)), " steps of ", ShortestNumber(step)),
           absl::StrCat("must be at most ", ShortestNumber(kMostSteps),
                        " steps from the middle; ask for COORDINATE_FORMAT_FLOAT64")});
    }
    rounded[i] = static_cast<std::int32_t>(steps);
  }
  EncodeVertices(std::span<const std::int32_t>(rounded), 3 * sizeof(std::int32_t), bytes);
  return absl::OkStatus();
}

void EncodeNormals(std::span<const float> normals, std::span<const std::uint32_t> order,
                   std::string& bytes) {
  std::vector<float> padded(4 * order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      padded[4 * i + axis] = normals[3 * std::size_t{order[i]} + axis];
    }
  }
  std::vector<std::int8_t> folded(kNormalBytes * order.size());
  meshopt_encodeFilterOct(folded.data(), order.size(), kNormalBytes, kNormalBits, padded.data());
  EncodeVertices(std::span<const std::int8_t>(folded), kNormalBytes, bytes);
}

absl::Status DecodeNormals(const std::string& bytes, std::size_t points,
                           std::vector<float>& normals) {
  std::vector<std::int8_t> folded;
  auto status = DecodeVertices(bytes, points, kNormalBytes, "surface.normals", folded);
  if (!status.ok()) return status;
  meshopt_decodeFilterOct(folded.data(), points, kNormalBytes);
  normals.resize(3 * points);
  for (std::size_t i = 0; i < points; ++i) {
    const std::int8_t* const normal = folded.data() + kNormalBytes * i;
    const double x = normal[0], y = normal[1], z = normal[2];
    const double length = std::sqrt(x * x + y * y + z * z);
    if (length == 0) return Lost("surface.normals", "has a normal of length 0");
    normals[3 * i] = static_cast<float>(x / length);
    normals[3 * i + 1] = static_cast<float>(y / length);
    normals[3 * i + 2] = static_cast<float>(z / length);
  }
  return absl::OkStatus();
}

void EncodeValues(std::span<const AttributeValues> attributes, std::span<const std::uint32_t> order,
                  NamedAttributes& messages) {
  Resize(messages, attributes.size());
  std::vector<float> values;
  for (std::size_t k = 0; k < attributes.size(); ++k) {
    const AttributeValues& from = attributes[k];
    const auto components = static_cast<std::size_t>(from.components);
    values.resize(components * order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      std::copy_n(from.values.begin() + static_cast<std::ptrdiff_t>(components * order[i]),
                  components, values.begin() + static_cast<std::ptrdiff_t>(components * i));
    }
    v1::NamedAttribute& to = messages[static_cast<int>(k)];
    to.set_name(from.name);
    to.set_components(static_cast<std::uint32_t>(from.components));
    EncodeVertices(std::span<const float>(values), components * sizeof(float),
                   *to.mutable_values());
  }
}

absl::Status DecodeValues(const NamedAttributes& messages, std::size_t points,
                          std::vector<AttributeValues>& attributes) {
  attributes.resize(static_cast<std::size_t>(messages.size()));
  for (std::size_t k = 0; k < attributes.size(); ++k) {
    const v1::NamedAttribute& from = messages[static_cast<int>(k)];
    const std::string field = absl::StrCat("surface.attributes[", k, "]");
    if (from.components() < 1 || from.components() > 3) {
      return Lost(field, "must have 1 to 3 components");
    }
    attributes[k].name = from.name();
    attributes[k].components = static_cast<int>(from.components());
    auto status = DecodeVertices(from.values(), points, from.components() * sizeof(float), field,
                                 attributes[k].values);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

// The largest power of two that is at most `spacing` / kSteps: its multiples are exact. A spacing
// of 0 means that there are no points.
double StepOf(double spacing) {
  return spacing > 0 ? std::ldexp(1.0, std::ilogb(spacing / kSteps)) : 1;
}

}  // namespace

absl::Status EncodeCompact(const Surface& surface, const Origin& origin, double spacing,
                           bool has_normals, v1::Surface& message) {
  const Order order = OrderOf(surface);
  message.set_step(StepOf(spacing));
  std::string& triangles = *message.mutable_triangles();
  triangles.resize(meshopt_encodeIndexBufferBound(order.triangles.size(), surface.PointCount()));
  triangles.resize(meshopt_encodeIndexBuffer(Data(triangles), triangles.size(),
                                             order.triangles.data(), order.triangles.size()));
  const std::vector<std::uint32_t> cuts = CutsOf(surface, order);
  message.mutable_cuts()->assign(reinterpret_cast<const char*>(cuts.data()),
                                 cuts.size() * sizeof(std::uint32_t));
  if (has_normals) {
    EncodeNormals(surface.normals, order.points, *message.mutable_normals());
  } else {
    message.clear_normals();
  }
  EncodeValues(surface.attributes, order.points, *message.mutable_attributes());
  return EncodeRounded(surface.points, order.points, origin, message.step(),
                       *message.mutable_points());
}

absl::Status DecodeCompact(const v1::Surface& message, const Origin& origin, Surface& surface) {
  const std::size_t points = surface.point_offsets.back();
  const std::size_t triangles = surface.triangle_offsets.back();
  const double step = message.step();
  if (!(step > 0) || !std::isfinite(step * kMostSteps)) {
    return Lost("surface.step", "is no length");
  }
  std::vector<std::int32_t> rounded;
  auto status =
      DecodeVertices(message.points(), points, 3 * sizeof(std::int32_t), "surface.points", rounded);
  if (!status.ok()) return status;
  surface.points.resize(rounded.size());
  for (std::size_t i = 0; i < rounded.size(); ++i) {
    surface.points[i] = origin[i % 3] + step * rounded[i];
    if (!std::isfinite(surface.points[i])) {
      return Lost("surface.points", "has a coordinate that is not finite");
    }
  }
  // The index codec stores at least a byte per triangle.
  if (triangles > message.triangles().size()) {
    return Lost("surface.triangles", absl::StrCat("has ", message.triangles().size(),
                                                  " bytes, too few for ", triangles, " triangles"));
  }
  surface.triangles.resize(3 * triangles);
  if (meshopt_decodeIndexBuffer(surface.triangles.data(), surface.triangles.size(),
                                sizeof(std::uint32_t), Data(message.triangles()),
                                message.triangles().size()) != 0) {
    return Lost("surface.triangles",
                absl::StrCat("does not decompress to ", triangles, " triangles"));
  }
  surface.normals.clear();
  if (!message.normals().empty()) {
    status = DecodeNormals(message.normals(), points, surface.normals);
    if (!status.ok()) return status;
  }
  return DecodeValues(message.attributes(), points, surface.attributes);
}

}  // namespace partiemc::wire
