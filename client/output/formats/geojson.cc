#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "client/output/formats/formats.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

/// Returns twice the signed area. It is computed relative to the first point, so that its sign is
/// also right far from the origin.
double TwiceArea(std::span<const double> ring) {
  double sum = 0;
  for (std::size_t k = 2; k + 3 < ring.size(); k += 2) {
    sum += (ring[k] - ring[0]) * (ring[k + 3] - ring[1]) -
           (ring[k + 2] - ring[0]) * (ring[k + 1] - ring[1]);
  }
  return sum;
}

/// The ring in the given orientation, with the first point repeated at the end.
void AppendRing(std::string& out, std::span<const double> ring, bool counter_clockwise) {
  const double area = TwiceArea(ring);
  const bool backwards = counter_clockwise ? area < 0 : area > 0;
  const std::size_t count = ring.size() / 2;
  out += '[';
  for (std::size_t k = 0; k <= count; ++k) {
    const std::size_t point = (backwards ? count - k : k) % count;
    out += k == 0 ? "[" : ",[";
    AppendNumber(out, ring[2 * point]);
    out += ',';
    AppendNumber(out, ring[2 * point + 1]);
    out += ']';
  }
  out += ']';
}

template <typename Number>
void AppendFinite(std::string& out, Number number) {
  if (std::isfinite(number)) {
    AppendNumber(out, number);
  } else {
    out += "null";  // JSON has no infinity and no NaN.
  }
}

// Appends the mean, least and largest value of each component of each attribute at the vertices of
// the rings `rings_of`.
void AppendAttributes(std::string& out, const FrameRecord& frame,
                      std::span<const std::size_t> rings_of) {
  const Rings& rings = frame.result.rings;
  for (const AttributeValues& attribute : frame.result.attributes) {
    const auto components = static_cast<std::size_t>(attribute.components);
    for (std::size_t c = 0; c < components; ++c) {
      double sum = 0, count = 0;
      float low = std::numeric_limits<float>::infinity(), high = -low;
      for (const std::size_t ring : rings_of) {
        for (std::size_t k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
          const float value = attribute.values[components * k + c];
          sum += value;
          count += 1;
          low = std::min(low, value);
          high = std::max(high, value);
        }
      }
      const std::string name = components == 1 ? attribute.name : Concat(attribute.name, ":", c);
      const auto append = [&](std::string_view figure, auto value) {
        out += ",\"";
        AppendJsonEscaped(out, name);
        AppendAll(out, figure, "\":");
        AppendFinite(out, value);
      };
      append("_mean", sum / count);
      append("_min", low);
      append("_max", high);
    }
  }
}

void AppendFeature(std::string& out, const FrameRecord& frame, std::size_t outer,
                   std::span<const std::size_t> holes) {
  const Rings& rings = frame.result.rings;
  double area = rings.measures[outer].area;
  double perimeter = rings.measures[outer].perimeter;
  for (const std::size_t hole : holes) {
    area += rings.measures[hole].area;
    perimeter += rings.measures[hole].perimeter;
  }
  out += R"({"type":"Feature","properties":{"area":)";
  AppendNumber(out, area);
  out += R"(,"perimeter":)";
  AppendNumber(out, perimeter);
  AppendAll(out, R"(,"particles":)", rings.measures[outer].particle_count, R"(,"ring":)", outer,
            R"(,"identity":)", rings.measures[outer].identity, R"(,"parents":[)");
  bool first = true;
  for (const std::uint64_t parent : rings.ParentsOf(outer)) {
    AppendAll(out, first ? "" : ",", parent);
    first = false;
  }
  AppendAll(out, R"(],"frame":)", frame.index, R"(,"time":)");
  AppendFinite(out, frame.time);
  std::vector<std::size_t> rings_of(holes.begin(), holes.end());
  rings_of.push_back(outer);
  AppendAttributes(out, frame, rings_of);
  out += R"(},"geometry":{"type":"Polygon","coordinates":[)";
  AppendRing(out, rings.RingPoints(outer), true);
  for (const std::size_t hole : holes) {
    out += ',';
    AppendRing(out, rings.RingPoints(hole), false);
  }
  out += "]}}";
}

}  // namespace

std::string EncodeGeoJson(const FrameRecord& frame) {
  const Rings& rings = frame.result.rings;
  std::vector<std::vector<std::size_t>> holes(rings.RingCount());
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    if (rings.outer_of[ring] != kNoRing) holes[rings.outer_of[ring]].push_back(ring);
  }
  std::string out = R"({"type":"FeatureCollection","frame":)";
  AppendNumber(out, frame.index);
  out += R"(,"time":)";
  AppendFinite(out, frame.time);
  out += R"(,"features":[)";
  bool first = true;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    if (rings.outer_of[ring] != kNoRing) continue;
    out += first ? "\n" : ",\n";
    first = false;
    AppendFeature(out, frame, ring, holes[ring]);
  }
  out += "\n]}\n";
  return out;
}

}  // namespace partiemc::client
