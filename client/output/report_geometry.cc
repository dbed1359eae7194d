#include "client/output/report_geometry.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include "client/output/color_map.h"
#include "client/output/formats.h"

namespace partiemc::client {
namespace {

// Steps per spacing. Finer than visible, and differences between neighbours fit two bytes.
constexpr double kStepsPerSpacing = 128;

// Steps across a frame without a spacing.
constexpr double kStepsPerFrame = 65536;

// Limit on steps across a frame, because the decoder adds differences in 32 bits.
constexpr double kMaxSteps = 1 << 28;

// Height of the rows in which particles are sorted, in steps: two spacings.
constexpr std::int64_t kParticleRow = 2 * static_cast<std::int64_t>(kStepsPerSpacing);

class Encoder {
 public:
  explicit Encoder(const FrameRecord& frame) {
    Box box;
    box.Include(frame.result.rings.points);
    box.Include(frame.result.mesh.points);
    for (const std::size_t k : frame.sections_in_plane) {
      box.Include(frame.result.sections[k].rings.points);
    }
    for (std::size_t k = 0; k + 1 < frame.particles.size(); k += 2) {
      if (std::isfinite(frame.particles[k]) && std::isfinite(frame.particles[k + 1])) {
        box.Include(frame.particles[k], frame.particles[k + 1]);
      }
    }
    if (box.Empty()) box.Include(0, 0);
    origin_x_ = box.min_x;
    origin_y_ = box.min_y;
    const double spacing = frame.result.statistics.spacing;
    step_ = spacing > 0 ? spacing / kStepsPerSpacing : box.Side() / kStepsPerFrame;
    step_ = std::max(step_, box.Side() / kMaxSteps);
    if (!(step_ > 0)) step_ = 1;
    Float64(origin_x_);
    Float64(origin_y_);
    Float64(step_);
  }

  void Count(std::uint64_t value) {
    while (value >= 0x80) {
      out_ += static_cast<char>(value | 0x80);
      value >>= 7;
    }
    out_ += static_cast<char>(value);
  }

  void Byte(std::uint8_t value) { out_ += static_cast<char>(value); }

  void Signed(std::int64_t value) {
    Count((static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63));
  }

  std::pair<std::int64_t, std::int64_t> Quantise(double x, double y) const {
    return {std::llround((x - origin_x_) / step_), std::llround((y - origin_y_) / step_)};
  }

  void Point(std::pair<std::int64_t, std::int64_t> point) {
    Signed(point.first - last_.first);
    Signed(point.second - last_.second);
    last_ = point;
  }

  void Points(std::span<const double> points) {
    for (std::size_t k = 0; k < points.size(); k += 2) Point(Quantise(points[k], points[k + 1]));
  }

  std::string Take() { return std::move(out_); }

 private:
  void Float64(double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (int shift = 0; shift < 64; shift += 8) out_ += static_cast<char>(bits >> shift);
  }

  std::string out_;
  double origin_x_ = 0, origin_y_ = 0, step_ = 1;
  std::pair<std::int64_t, std::int64_t> last_ = {0, 0};
};

void EncodeRings(const Rings& rings, Encoder& encoder) {
  encoder.Count(rings.RingCount());
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    encoder.Count(rings.offsets[ring + 1] - rings.offsets[ring]);
    encoder.Count(rings.outer_of[ring] == kNoRing ? 0 : std::uint64_t{rings.outer_of[ring]} + 1);
  }
  encoder.Points(rings.points);
  encoder.Count(rings.normals.size() / 2);
  for (std::size_t k = 0; k + 1 < rings.normals.size(); k += 2) {
    const double turn =
        std::atan2(double{rings.normals[k + 1]}, double{rings.normals[k]}) / (2 * std::numbers::pi);
    encoder.Byte(static_cast<std::uint8_t>(std::lround(turn * 256) & 0xff));
  }
}

void EncodeMesh(const Result& result, std::size_t max_triangles, Encoder& encoder) {
  const Mesh& mesh = result.mesh;
  if (mesh.TriangleCount() > max_triangles || mesh.TriangleCount() == 0) {
    encoder.Count(0);
    encoder.Count(1);
    encoder.Count(0);
    return;
  }
  const bool shared = MeshSharesRingPoints(result);
  const std::span<const double> points =
      std::span(mesh.points).subspan(shared ? result.rings.points.size() : 0);
  encoder.Count(points.size() / 2);
  encoder.Points(points);
  encoder.Count(shared ? 1 : 0);
  encoder.Count(mesh.TriangleCount());
  std::int64_t previous = 0;
  for (std::size_t k = 0; k < mesh.TriangleCount(); ++k) {
    const std::int64_t a = mesh.triangles[3 * k];
    const std::int64_t interior = mesh.classes[k] == TriangleClass::kInterior ? 1 : 0;
    encoder.Signed((a - previous) * 2 + interior);
    encoder.Signed(mesh.triangles[3 * k + 1] - a);
    encoder.Signed(mesh.triangles[3 * k + 2] - a);
    previous = a;
  }
}

/// Encodes at most `max_particles` particles, selected evenly. They are sorted in rows two spacings
/// high, so that differences between successive particles are small.
void EncodeParticles(std::span<const double> particles, std::size_t max_particles,
                     Encoder& encoder) {
  const std::size_t count = particles.size() / 2;
  const std::size_t shown = std::min(count, max_particles);
  std::vector<std::pair<std::int64_t, std::int64_t>> points;
  points.reserve(shown);
  for (std::size_t k = 0; k < shown; ++k) {
    // An even selection of `shown` particles.
    const std::size_t particle = shown == count ? k : k * count / shown;
    const double x = particles[2 * particle], y = particles[2 * particle + 1];
    if (std::isfinite(x) && std::isfinite(y)) points.push_back(encoder.Quantise(x, y));
  }
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return std::tuple(a.second / kParticleRow, a.first, a.second) <
           std::tuple(b.second / kParticleRow, b.first, b.second);
  });
  encoder.Count(points.size());
  for (const auto& point : points) encoder.Point(point);
}

void EncodeIsolines(const FrameRecord& frame, Encoder& encoder) {
  std::uint64_t count = 0;
  for (const std::size_t k : frame.sections_in_plane) {
    count += frame.result.sections[k].rings.RingCount();
  }
  encoder.Count(count);
  for (const std::size_t k : frame.sections_in_plane) {
    const Rings& rings = frame.result.sections[k].rings;
    for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
      encoder.Count(rings.offsets[ring + 1] - rings.offsets[ring]);
    }
  }
  for (const std::size_t k : frame.sections_in_plane) {
    encoder.Points(frame.result.sections[k].rings.points);
  }
}

void EncodeColors(const Result& result, const ReportGeometryOptions& options, Encoder& encoder) {
  const AttributeValues* const attribute = FindAttribute(result, options.color_by);
  if (attribute == nullptr) return encoder.Count(0);
  const std::vector<double> values = MagnitudesOf(*attribute);
  const ValueRange range = RangeOf(values);
  // Values of the rings' points come first. A mesh that shares these points continues them.
  const bool has_mesh = result.mesh.TriangleCount() > 0 &&
                        result.mesh.TriangleCount() <= options.max_triangles &&
                        values.size() == result.mesh.PointCount();
  const std::size_t count = has_mesh ? values.size() : result.rings.PointCount();
  if (count > values.size()) return encoder.Count(0);
  encoder.Count(count);
  for (std::size_t k = 0; k < count; ++k) {
    encoder.Byte(static_cast<std::uint8_t>(std::lround(255 * range.ShareOf(values[k]))));
  }
}

}  // namespace

std::string EncodeReportGeometry(const FrameRecord& frame, const ReportGeometryOptions& options) {
  Encoder encoder(frame);
  EncodeRings(frame.result.rings, encoder);
  EncodeMesh(frame.result, options.max_triangles, encoder);
  EncodeParticles(frame.particles, options.max_particles, encoder);
  EncodeIsolines(frame, encoder);
  EncodeColors(frame.result, options, encoder);
  return encoder.Take();
}

}  // namespace partiemc::client
