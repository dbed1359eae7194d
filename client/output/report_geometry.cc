#include "client/output/report_geometry.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include "client/output/color_map.h"
#include "client/output/formats/file_mesh.h"
#include "client/output/report_bytes.h"

namespace partiemc::client {
namespace {

// Rounding steps per spacing. Smaller steps would not be visible, and differences between
// neighbours fit in two bytes.
constexpr double kStepsPerSpacing = 128;

// Steps across a frame without a spacing.
constexpr double kStepsPerFrame = 65536;

// Limit on steps across a frame, because the decoder adds differences in 32 bits.
constexpr double kMaxSteps = 1 << 28;

// Height of the rows in which particles are sorted, in steps: two spacings.
constexpr std::int64_t kParticleRow = 2 * static_cast<std::int64_t>(kStepsPerSpacing);

class Encoder : public ReportBytes {
 public:
  explicit Encoder(const FrameRecord& frame) {
    Box box;
    box.Include(frame.result.rings.points);
    box.Include(frame.result.mesh.points);
    for (const Result& section : frame.result.sections) box.Include(section.rings.points);
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

  std::pair<std::int64_t, std::int64_t> Quantise(double x, double y) const {
    return {std::llround((x - origin_x_) / step_), std::llround((y - origin_y_) / step_)};
  }

  void Point(std::pair<std::int64_t, std::int64_t> point) {
    Signed(point.first - last_.first);
    Signed(point.second - last_.second);
    last_ = point;
  }

  void Length(double length) { Count(static_cast<std::size_t>(std::llround(length / step_))); }

  void Points(std::span<const double> points) {
    for (std::size_t k = 0; k < points.size(); k += 2) Point(Quantise(points[k], points[k + 1]));
  }

 private:
  double origin_x_ = 0, origin_y_ = 0, step_ = 1;
  std::pair<std::int64_t, std::int64_t> last_ = {0, 0};
};

void EncodeRingPoints(const Rings& rings, Encoder& encoder) {
  encoder.Count(rings.RingCount());
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    encoder.Count(rings.offsets[ring + 1] - rings.offsets[ring]);
    encoder.Count(rings.outer_of[ring] == kNoRing ? 0 : std::uint64_t{rings.outer_of[ring]} + 1);
  }
  encoder.Points(rings.points);
}

void EncodeRings(const Rings& rings, Encoder& encoder) {
  EncodeRingPoints(rings, encoder);
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

/// Indices of at most `max_particles` particles, selected evenly. They are sorted in rows two
/// spacings high, so that differences between successive particles are small.
std::vector<std::size_t> ShownParticles(std::span<const double> particles,
                                        std::size_t max_particles, const Encoder& encoder) {
  const std::size_t count = particles.size() / 2;
  const std::size_t shown = std::min(count, max_particles);
  std::vector<std::tuple<std::int64_t, std::int64_t, std::int64_t, std::size_t>> places;
  places.reserve(shown);
  for (std::size_t k = 0; k < shown; ++k) {
    const std::size_t particle = shown == count ? k : k * count / shown;
    const double x = particles[2 * particle], y = particles[2 * particle + 1];
    if (!std::isfinite(x) || !std::isfinite(y)) continue;
    const auto [column, height] = encoder.Quantise(x, y);
    places.emplace_back(height / kParticleRow, column, height, particle);
  }
  std::sort(places.begin(), places.end());
  std::vector<std::size_t> indices(places.size());
  std::ranges::transform(places, indices.begin(),
                         [](const auto& place) { return std::get<3>(place); });
  return indices;
}

void EncodeParticles(std::span<const double> particles, std::span<const std::size_t> shown,
                     Encoder& encoder) {
  encoder.Count(shown.size());
  for (const std::size_t particle : shown) {
    encoder.Point(encoder.Quantise(particles[2 * particle], particles[2 * particle + 1]));
  }
}

void EncodeSizes(const FrameRecord& frame, std::span<const std::size_t> shown, Encoder& encoder) {
  encoder.Count(frame.are_discs ? 1 : 0);
  encoder.Count(frame.HasParticleSizes() ? shown.size() : 0);
  if (!frame.HasParticleSizes()) return;
  for (const std::size_t particle : shown) encoder.Length(double{frame.particle_sizes[particle]});
}

void EncodeSections(const Result& result, Encoder& encoder) {
  encoder.Count(result.sections.size());
  for (const Result& section : result.sections) EncodeRingPoints(section.rings, encoder);
}

/// Values of `attribute` at the particles of the frame; null if they are unknown.
const AttributeValues* ParticleValues(const FrameRecord& frame, const AttributeValues& attribute) {
  const AttributeValues* const values = frame.particle_color;
  const bool fits = values != nullptr && values->name == attribute.name &&
                    values->components == attribute.components &&
                    values->values.size() / static_cast<std::size_t>(values->components) ==
                        frame.particles.size() / 2;
  return fits ? values : nullptr;
}

void EncodeColors(const FrameRecord& frame, const ReportGeometryOptions& options,
                  std::span<const std::size_t> shown, Encoder& encoder) {
  const Result& result = frame.result;
  const AttributeValues* const attribute = FindAttribute(result, options.color_by);
  if (attribute == nullptr) return encoder.Count(0);
  const std::size_t points =
      attribute->values.size() / static_cast<std::size_t>(attribute->components);
  // The values begin with the points of the rings. If the mesh shares these points, the values of
  // the other points of the mesh follow.
  const bool has_mesh = result.mesh.TriangleCount() > 0 &&
                        result.mesh.TriangleCount() <= options.max_triangles &&
                        points == result.mesh.PointCount();
  const std::size_t count = has_mesh ? points : result.rings.PointCount();
  if (count > points) return encoder.Count(0);
  const AttributeValues* const of_particles = ParticleValues(frame, *attribute);
  encoder.Count(ChannelCount(*attribute));
  for (std::size_t channel = 0; channel < ChannelCount(*attribute); ++channel) {
    const ValueRange range = ReportRange(frame, *attribute, channel);
    const auto share = [&](double value) {
      encoder.Byte(static_cast<std::uint8_t>(std::lround(255 * range.ShareOf(value))));
    };
    const std::vector<double> values = ChannelOf(*attribute, channel);
    encoder.Count(count);
    for (std::size_t k = 0; k < count; ++k) share(values[k]);
    encoder.Count(of_particles == nullptr ? 0 : shown.size());
    if (of_particles == nullptr) continue;
    const std::vector<double> at_particles = ChannelOf(*of_particles, channel);
    for (const std::size_t particle : shown) share(at_particles[particle]);
  }
}

}  // namespace

std::string EncodeReportGeometry(const FrameRecord& frame, const ReportGeometryOptions& options) {
  Encoder encoder(frame);
  EncodeRings(frame.result.rings, encoder);
  EncodeMesh(frame.result, options.max_triangles, encoder);
  const std::vector<std::size_t> shown =
      ShownParticles(frame.particles, options.max_particles, encoder);
  EncodeParticles(frame.particles, shown, encoder);
  EncodeSizes(frame, shown, encoder);
  EncodeSections(frame.result, encoder);
  EncodeColors(frame, options, shown, encoder);
  return encoder.Take();
}

ValueRange ReportRange(const FrameRecord& frame, const AttributeValues& attribute,
                       std::size_t channel) {
  std::vector<double> values = ChannelOf(attribute, channel);
  if (const AttributeValues* particles = ParticleValues(frame, attribute); particles != nullptr) {
    const std::vector<double> more = ChannelOf(*particles, channel);
    values.insert(values.end(), more.begin(), more.end());
  }
  return RangeOf(values);
}

}  // namespace partiemc::client
