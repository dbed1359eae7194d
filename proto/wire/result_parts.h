// Encodes and decodes coordinates and attributes, for outlines and for surfaces.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "partiemc/attribute_values.h"
#include "partiemc/v1/reconstruction.pb.h"

namespace partiemc::wire {

/// DATA_LOSS, because `field` of a server's response breaks `rule`.
absl::Status Lost(absl::string_view field, absl::string_view rule);

using Origin = std::array<double, 3>;

/// The centre of the bounding box of all points in `arrays`, which minimises the largest relative
/// coordinate; zeros without points. Points have `components` coordinates, at most 3.
Origin MiddleOf(std::span<const std::span<const double>> arrays, std::size_t components);

Origin OriginOf(const v1::ReconstructedFrame& message);
void SetOrigin(const Origin& origin, v1::ReconstructedFrame& message);

/// The format and scale of the points of a result.
struct PointFormat {
  v1::CoordinateFormat format;  ///< Any value except FLOAT32_RELATIVE means FLOAT64.
  Origin origin;
  std::size_t components;  ///< 2 or 3.
};

/// Writes points. `field` names them in errors. Errors: OUT_OF_RANGE with a Violation (RESOLUTION)
/// if float32 would move a point by more than 1e-4 spacings.
absl::Status EncodePoints(std::span<const double> points, const PointFormat& format, double spacing,
                          absl::string_view field, std::string& bytes);
/// Errors: DATA_LOSS for a wrong number of bytes and for coordinates that are not finite.
absl::Status DecodePoints(const std::string& bytes, const PointFormat& format,
                          absl::string_view field, std::vector<double>& points);

/// Resizes a repeated field. Existing elements keep their contents and buffers.
template <typename Repeated>
void Resize(Repeated& messages, std::size_t size) {
  while (messages.size() > static_cast<int>(size)) messages.RemoveLast();
  while (messages.size() < static_cast<int>(size)) messages.Add();
}

using NamedAttributes = google::protobuf::RepeatedPtrField<v1::NamedAttribute>;

/// Writes the attributes of the first `points` vertices.
void EncodeAttributes(std::span<const AttributeValues> attributes, std::size_t points,
                      NamedAttributes& messages);
/// Errors: DATA_LOSS for a wrong number of components or bytes. `of`: "rings", "mesh" or "surface".
absl::Status CheckAttributes(absl::string_view of, const NamedAttributes& messages,
                             std::size_t points);
/// Requires: CheckAttributes.
void DecodeAttributes(const NamedAttributes& messages, std::vector<AttributeValues>& attributes);

}  // namespace partiemc::wire
