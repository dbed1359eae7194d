#include "partiemc/gauges.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/point.h"
#include "gauges/angles.h"
#include "gauges/box_area.h"
#include "gauges/disc_area.h"
#include "gauges/line_crossings.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

constexpr std::size_t kMaxName = 40;
// Limits of numbers and lengths, so that products of four coordinates stay finite.
constexpr double kMaxNumber = 1e69, kMinLength = 1e-60;

using Traits = std::array<GaugeTraits, 7>;

const Traits& Table() {
  static const Traits table = {{
      {GaugeKind::kHeight, "height", {"x"}, {"highest", "lowest", "crossings"}},
      {GaugeKind::kFront, "front", {"dx", "dy"}, {"position", "x", "y"}},
      {GaugeKind::kWetted, "wetted", {"x0", "y0", "x1", "y1"}, {"length"}},
      {GaugeKind::kBox, "box", {"min_x", "min_y", "max_x", "max_y"}, {"area", "x", "y"}},
      {GaugeKind::kContact,
       "contact",
       {"x", "y", "dx", "dy", "reach"},
       {"start_angle", "end_angle", "start", "end"}},
      {GaugeKind::kRepose, "repose", {}, {"left_angle", "right_angle"}},
      {GaugeKind::kPacking,
       "packing",
       {"min_x", "min_y", "max_x", "max_y"},
       {"fraction", "discs", "area"}},
  }};
  return table;
}

absl::Status Bad(std::string_view reason, std::string field, std::string value, std::string rule) {
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(reason), std::move(field), std::move(value), std::move(rule)});
}

template <typename Names>
std::string Listed(const Names& names) {
  std::string text;
  for (const auto& name : names) {
    if (!text.empty()) text += ", ";
    text += name;
  }
  return text;
}

std::string FieldOf(const Gauge& gauge, std::string_view number) {
  std::string field = "gauge " + gauge.name;
  if (!number.empty()) field.append(".").append(number);
  return field;
}

absl::Status CheckDirection(const Gauge& gauge, double x, double y, std::string_view rule) {
  if (std::sqrt(x * x + y * y) >= kMinLength) return absl::OkStatus();
  return Bad(kReasonOutOfRange, FieldOf(gauge, ""), ShortestNumber(x) + ", " + ShortestNumber(y),
             std::string(rule));
}

absl::Status CheckShape(const Gauge& gauge) {
  const std::vector<double>& n = gauge.numbers;
  switch (gauge.kind) {
    case GaugeKind::kHeight:
    case GaugeKind::kRepose:
      return absl::OkStatus();
    case GaugeKind::kFront:
      return CheckDirection(gauge, n[0], n[1], "direction must not be zero");
    case GaugeKind::kWetted:
      return CheckDirection(gauge, n[2] - n[0], n[3] - n[1], "ends must differ");
    case GaugeKind::kBox:
    case GaugeKind::kPacking:
      for (const int k : {0, 1}) {
        if (!(n[k] < n[k + 2])) {
          return Bad(kReasonOutOfRange, FieldOf(gauge, TraitsOf(gauge.kind).numbers[k + 2]),
                     ShortestNumber(n[k + 2]), "must be above " + ShortestNumber(n[k]));
        }
      }
      return absl::OkStatus();
    case GaugeKind::kContact:
      if (!(n[4] > 0)) {
        return Bad(kReasonOutOfRange, FieldOf(gauge, "reach"), ShortestNumber(n[4]),
                   "must be above 0");
      }
      return CheckDirection(gauge, n[2], n[3], "direction must not be zero");
  }
  return absl::OkStatus();
}

std::vector<double> MeasureHeight(const Rings& rings, double x) {
  const std::vector<double> heights = HeightsAt(rings, x);
  if (heights.empty()) return {NAN, NAN, 0};
  return {heights.back(), heights.front(), static_cast<double>(heights.size())};
}

std::vector<double> MeasureFront(const Rings& rings, const Point& direction) {
  const double length = std::sqrt(direction.x * direction.x + direction.y * direction.y);
  std::vector<double> values = {NAN, NAN, NAN};
  for (std::size_t k = 0; k < rings.PointCount(); ++k) {
    const Point p = PointAt(rings.points, k);
    const double position = (direction.x * p.x + direction.y * p.y) / length;
    if (!(position <= values[0])) values = {position, p.x, p.y};
  }
  return values;
}

double LengthInside(const Rings& rings, const Point& from, const Point& to) {
  const Point line{to.x - from.x, to.y - from.y};
  const std::vector<double> crossings = LineCrossings(rings, from, line);
  double inside = 0;
  for (std::size_t k = 0; k + 1 < crossings.size(); k += 2) {
    inside += std::clamp(crossings[k + 1], 0.0, 1.0) - std::clamp(crossings[k], 0.0, 1.0);
  }
  return inside * std::sqrt(line.x * line.x + line.y * line.y);
}

double MeasureWetted(const Rings& rings, const Point& from, const Point& to) {
  // A vertex on the line counts as left of it. Sides of an outline that lie on the line, as on a
  // wall, count in one of the directions.
  return std::max(LengthInside(rings, from, to), LengthInside(rings, to, from));
}

std::vector<double> MeasurePacking(const Rings& rings, const Point& min, const Point& max,
                                   const Discs& discs) {
  const double area = AreaInBox(rings, min, max).area;
  if (discs.areas.empty() || discs.centres.size() != 2 * discs.areas.size()) {
    return {NAN, NAN, area};
  }
  double sum = 0;
  for (std::size_t k = 0; k < discs.areas.size(); ++k) {
    const double radius = std::sqrt(double{discs.areas[k]} / std::numbers::pi);
    sum += DiscAreaInBox(PointAt(discs.centres, k), radius, min, max);
  }
  return {area > 0 ? sum / area : NAN, sum, area};
}

}  // namespace

std::span<const GaugeTraits> AllGauges() { return Table(); }

const GaugeTraits& TraitsOf(GaugeKind kind) { return Table()[static_cast<std::size_t>(kind)]; }

absl::Status Check(const Gauge& gauge) {
  const bool is_named =
      !gauge.name.empty() && gauge.name.size() <= kMaxName &&
      std::ranges::all_of(gauge.name, [](char c) { return absl::ascii_isalnum(c) || c == '_'; });
  if (!is_named) {
    return Bad(kReasonOutOfRange, "gauge name",
               absl::StrCat("'", gauge.name.substr(0, kMaxName), "'"),
               "must have 1 to 40 of letters, digits and _");
  }
  const GaugeTraits& traits = TraitsOf(gauge.kind);
  if (gauge.numbers.size() != traits.numbers.size()) {
    return Bad(kReasonCount, FieldOf(gauge, ""), absl::StrCat(gauge.numbers.size(), " numbers"),
               traits.numbers.empty() ? "must have none" : "must be " + Listed(traits.numbers));
  }
  for (std::size_t k = 0; k < gauge.numbers.size(); ++k) {
    if (!(std::abs(gauge.numbers[k]) <= kMaxNumber)) {
      return Bad(kReasonNotFinite, FieldOf(gauge, traits.numbers[k]),
                 ShortestNumber(gauge.numbers[k]), "must be finite, at most 1e69");
    }
  }
  return CheckShape(gauge);
}

absl::StatusOr<Gauge> ParseGauge(std::string_view text) {
  const auto bad = [&](std::string rule) {
    return Bad(kReasonOutOfRange, "gauge", absl::StrCat("'", std::string(text.substr(0, 200)), "'"),
               std::move(rule));
  };
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos)
    return bad("must be NAME=KIND:NUMBERS, like level=height:0.5");
  Gauge gauge{.name = std::string(text.substr(0, equals))};
  std::string_view rest = text.substr(equals + 1);
  const std::string_view kind = rest.substr(0, rest.find(':'));
  const bool has_numbers = kind.size() < rest.size();
  rest.remove_prefix(std::min(rest.size(), kind.size() + 1));
  const auto traits = std::ranges::find(Table(), kind, &GaugeTraits::name);
  if (traits == Table().end()) {
    std::vector<std::string_view> names;
    for (const GaugeTraits& one : Table()) names.push_back(one.name);
    return bad("must have one of the kinds " + Listed(names));
  }
  gauge.kind = traits->kind;
  for (bool has_next = has_numbers; has_next;) {
    const std::string_view number = rest.substr(0, rest.find(','));
    has_next = number.size() < rest.size();
    double value = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
    if (error != std::errc() || end != number.data() + number.size()) {
      return bad(traits->numbers.empty()
                     ? absl::StrCat("must have nothing after ", std::string(kind))
                     : absl::StrCat("must have numbers after ", std::string(kind), ":"));
    }
    gauge.numbers.push_back(value);
    rest.remove_prefix(std::min(rest.size(), number.size() + 1));
  }
  if (absl::Status status = Check(gauge); !status.ok()) return status;
  return gauge;
}

std::vector<double> Measure(const Gauge& gauge, const Result& result, const Discs& discs) {
  const std::vector<double>& n = gauge.numbers;
  switch (gauge.kind) {
    case GaugeKind::kHeight:
      return MeasureHeight(result.rings, n[0]);
    case GaugeKind::kFront:
      return MeasureFront(result.rings, {n[0], n[1]});
    case GaugeKind::kWetted:
      return {MeasureWetted(result.rings, {n[0], n[1]}, {n[2], n[3]})};
    case GaugeKind::kBox: {
      const BoxArea box = AreaInBox(result.rings, {n[0], n[1]}, {n[2], n[3]});
      return {box.area, box.centroid.x, box.centroid.y};
    }
    case GaugeKind::kContact:
      return ContactAngles(result, {{n[0], n[1]}, {n[2], n[3]}, n[4]});
    case GaugeKind::kRepose:
      return AnglesOfRepose(result);
    case GaugeKind::kPacking:
      return MeasurePacking(result.rings, {n[0], n[1]}, {n[2], n[3]}, discs);
  }
  return {};
}

std::vector<double> HeightsAt(const Rings& rings, double x) {
  return LineCrossings(rings, {x, 0}, {0, 1});
}

}  // namespace partiemc
