#include "wire/result_parts.h"

#include <cmath>
#include <cstring>
#include <limits>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "wire/bytes.h"

namespace partiemc::wire {
namespace {

// Largest error of relative coordinates, in spacings: a hundredth of the accuracy of the outline.
constexpr double kMaxRelativeShift = 1e-4;

absl::Status MovedTooFar(absl::string_view field, std::size_t point, double shift) {
  return ViolationError(absl::StatusCode::kOutOfRange,
                        {std::string(kReasonResolution), absl::StrCat(field, "[", point, "]"),
                         absl::StrCat("moved by ", ShortestNumber(shift), " spacings"),
                         absl::StrCat("must move by at most ", ShortestNumber(kMaxRelativeShift),
                                      " spacings; ask for COORDINATE_FORMAT_FLOAT64")});
}

absl::Status AssignRelative(std::span<const double> points, const PointFormat& format,
                            double spacing, absl::string_view field, std::string& bytes) {
  bytes.resize(points.size() * sizeof(float));
  const double limit = kMaxRelativeShift * spacing;
  const std::size_t components = format.components;
  for (std::size_t i = 0; i + components <= points.size(); i += components) {
    double squares = 0;
    for (std::size_t axis = 0; axis < components; ++axis) {
      const double wanted = points[i + axis], origin = format.origin[axis];
      const auto relative = static_cast<float>(wanted - origin);
      std::memcpy(bytes.data() + (i + axis) * sizeof(float), &relative, sizeof(float));
      const double shift = origin + relative - wanted;
      squares += shift * shift;
    }
    // This form of the comparison refuses NaN, too.
    if (const double shift = std::sqrt(squares); !(shift <= limit)) {
      return MovedTooFar(field, i / components, shift / spacing);
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status Lost(absl::string_view field, absl::string_view rule) {
  return absl::DataLossError(absl::StrCat(field, " of the server's answer ", rule));
}

Origin MiddleOf(std::span<const std::span<const double>> arrays, std::size_t components) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Origin middle{};
  for (std::size_t axis = 0; axis < components; ++axis) {
    double low = kInfinity, high = -kInfinity;
    for (const std::span<const double> points : arrays) {
      for (std::size_t i = axis; i < points.size(); i += components) {
        low = std::min(low, points[i]);
        high = std::max(high, points[i]);
      }
    }
    if (low <= high) middle[axis] = low + (high - low) / 2;
  }
  return middle;
}

Origin OriginOf(const v1::ReconstructedFrame& message) {
  return {message.origin_x(), message.origin_y(), message.origin_z()};
}

void SetOrigin(const Origin& origin, v1::ReconstructedFrame& message) {
  message.set_origin_x(origin[0]);
  message.set_origin_y(origin[1]);
  message.set_origin_z(origin[2]);
}

absl::Status EncodePoints(std::span<const double> points, const PointFormat& format, double spacing,
                          absl::string_view field, std::string& bytes) {
  if (format.format == v1::COORDINATE_FORMAT_FLOAT32_RELATIVE) {
    return AssignRelative(points, format, spacing, field, bytes);
  }
  AssignBytes(points, bytes);
  return absl::OkStatus();
}

absl::Status DecodePoints(const std::string& bytes, const PointFormat& format,
                          absl::string_view field, std::vector<double>& points) {
  const bool relative = format.format == v1::COORDINATE_FORMAT_FLOAT32_RELATIVE;
  const std::size_t point_bytes = format.components * (relative ? sizeof(float) : sizeof(double));
  if (bytes.size() % point_bytes != 0) {
    return Lost(
        field, absl::StrCat("has ", bytes.size(), " bytes, which is no multiple of ", point_bytes));
  }
  if (relative) {
    const auto values = ViewBytes<float>(bytes);
    points.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      points[i] = format.origin[i % format.components] + double{values[i]};
    }
  } else {
    CopyBytes(bytes, points);
  }
  if (!std::all_of(points.begin(), points.end(), [](double v) { return std::isfinite(v); })) {
    return Lost(field, "has a coordinate that is not finite");
  }
  return absl::OkStatus();
}

void EncodeAttributes(std::span<const AttributeValues> attributes, std::size_t points,
                      NamedAttributes& messages) {
  Resize(messages, attributes.size());
  for (std::size_t k = 0; k < attributes.size(); ++k) {
    const AttributeValues& from = attributes[k];
    v1::NamedAttribute& to = messages[static_cast<int>(k)];
    to.set_name(from.name);
    to.set_components(static_cast<std::uint32_t>(from.components));
    // Without points, `values` may be empty.
    AssignBytes(
        std::span(from.values).first(std::min(from.values.size(), points * from.components)),
        *to.mutable_values());
  }
}

absl::Status CheckAttributes(absl::string_view of, const NamedAttributes& messages,
                             std::size_t points) {
  for (int k = 0; k < messages.size(); ++k) {
    const std::uint64_t components = messages[k].components();
    if (components < 1 || components > 3 ||
        messages[k].values().size() != points * components * sizeof(float)) {
      return Lost(absl::StrCat(of, ".attributes[", k, "]"),
                  absl::StrCat("must have 1 to 3 floats for each of the ", points, " points"));
    }
  }
  return absl::OkStatus();
}

void DecodeAttributes(const NamedAttributes& messages, std::vector<AttributeValues>& attributes) {
  attributes.resize(static_cast<std::size_t>(messages.size()));
  for (std::size_t k = 0; k < attributes.size(); ++k) {
    const v1::NamedAttribute& from = messages[static_cast<int>(k)];
    attributes[k].name = from.name();
    attributes[k].components = static_cast<int>(from.components());
    CopyBytes(from.values(), attributes[k].values);
  }
}

}  // namespace partiemc::wire
