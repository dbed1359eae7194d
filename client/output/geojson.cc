#include <cmath>
#include <vector>

#include "client/output/formats.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

/// Twice the signed area relative to the first point, which keeps the sign far from the origin.
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

void AppendTime(std::string& out, double time) {
  if (std::isfinite(time)) {
    AppendNumber(out, time);
  } else {
    out += "null";  // JSON has no infinity and no NaN.
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
  AppendTime(out, frame.time);
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
  AppendTime(out, frame.time);
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
