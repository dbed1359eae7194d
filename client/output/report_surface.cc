#include "client/output/report_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "client/output/report_bytes.h"
#include "partiemc/surface_level.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "wire/codec.h"

namespace partiemc::client {
namespace {

using Steps = std::array<std::int64_t, 3>;

// Rounding steps of particles per spacing; finer ones are not visible.
constexpr double kParticleStepsPerSpacing = 32;

// Steps across a frame without a spacing.
constexpr double kParticleStepsPerFrame = 16384;

// Limit on steps across a frame, because the decoder adds differences in 32 bits.
constexpr double kMostParticleSteps = 1 << 28;

// Side of the columns in which particles are sorted, in steps: two spacings.
constexpr std::int64_t kParticleColumn = 2 * static_cast<std::int64_t>(kParticleStepsPerSpacing);

/// The surface that the report shows, with at most `max_triangles` triangles; empty if it cannot be
/// simplified to this number.
Surface ShownSurface(const FrameRecord& frame, std::size_t max_triangles) {
  Surface surface = *frame.surface;
  surface.normals.clear();  // The page computes them from the triangles.
  if (surface.TriangleCount() <= max_triangles) return surface;
  const double spacing = frame.result.statistics.spacing;
  if (!(spacing > 0) || max_triangles == 0 ||
      !MakeLevel({.max_triangles = max_triangles}, spacing, SurfaceOrigin::kUnknown, nullptr,
                 surface)
           .ok() ||
      surface.TriangleCount() > max_triangles) {
    return {};
  }
  return surface;
}

v1::ReconstructedFrame Message(const FrameRecord& frame, Surface surface) {
  Result result;
  result.surface = std::move(surface);
  result.statistics = frame.result.statistics;
  result.sections = frame.result.sections;
  v1::ReconstructedFrame message;
  // Sections have rings, but no meshes.
  const wire::Outputs outputs = {.mesh = false, .coordinates = wire::Coordinates::kCompact};
  if (!wire::EncodeResult(result, {frame.stages_ms, frame.total_ms}, outputs, message).ok()) {
    message.Clear();  // Coordinates are too far apart.
  }
  return message;
}

class Particles {
 public:
  Particles(std::span<const double> positions, double spacing) : positions_(positions) {
    std::array<double, 3> high;
    high.fill(-kInfinity);
    for (std::size_t k = 0; k < positions.size() / 3; ++k) {
      if (!IsFinite(k)) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        origin_[axis] = std::min(origin_[axis], positions[3 * k + axis]);
        high[axis] = std::max(high[axis], positions[3 * k + axis]);
      }
    }
    double side = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (high[axis] > origin_[axis]) side = std::max(side, high[axis] - origin_[axis]);
    }
    step_ =
        std::max(spacing > 0 ? spacing / kParticleStepsPerSpacing : side / kParticleStepsPerFrame,
                 side / kMostParticleSteps);
    if (!(step_ > 0) || !std::isfinite(step_)) step_ = 1;
  }

  /// An even selection of at most `most` particles. They are sorted in columns along x, two
  /// spacings wide, so that differences between successive particles are small.
  std::vector<Steps> Selection(std::size_t most) const {
    const std::size_t count = positions_.size() / 3;
    const std::size_t shown = std::min(count, most);
    std::vector<Steps> steps;
    steps.reserve(shown);
    for (std::size_t k = 0; k < shown; ++k) {
      const std::size_t particle = shown == count ? k : k * count / shown;
      if (IsFinite(particle)) steps.push_back(StepsOf(particle));
    }
    std::sort(steps.begin(), steps.end(), [](const Steps& a, const Steps& b) {
      const auto key = [](const Steps& at) {
        return Steps{at[2] / kParticleColumn, at[1] / kParticleColumn, at[0]};
      };
      const Steps first = key(a), second = key(b);
      return first != second ? first < second : a < b;
    });
    return steps;
  }

  void Encode(std::span<const Steps> shown, ReportBytes& bytes) const {
    for (const double coordinate : origin_) bytes.Float64(coordinate);
    bytes.Float64(step_);
    bytes.Count(shown.size());
    Steps last = {0, 0, 0};
    for (const Steps& at : shown) {
      for (std::size_t axis = 0; axis < 3; ++axis) bytes.Signed(at[axis] - last[axis]);
      last = at;
    }
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  bool IsFinite(std::size_t k) const {
    return std::isfinite(positions_[3 * k]) && std::isfinite(positions_[3 * k + 1]) &&
           std::isfinite(positions_[3 * k + 2]);
  }

  Steps StepsOf(std::size_t k) const {
    Steps steps;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double from_origin = (positions_[3 * k + axis] - origin_[axis]) / step_;
      // The difference of extreme coordinates may be infinite.
      steps[axis] = std::llround(std::min(from_origin, kMostParticleSteps));
    }
    return steps;
  }

  const std::span<const double> positions_;
  std::array<double, 3> origin_ = {kInfinity, kInfinity, kInfinity};
  double step_ = 1;
};

}  // namespace

ReportSurface EncodeReportSurface(const FrameRecord& frame, const ReportSurfaceOptions& options) {
  const v1::ReconstructedFrame message = Message(frame, ShownSurface(frame, options.max_triangles));
  ReportSurface shown;
  if (message.surface().triangle_offsets().size() > sizeof(std::uint32_t)) {
    std::uint32_t triangles = 0;
    message.surface().triangle_offsets().copy(
        reinterpret_cast<char*>(&triangles), sizeof triangles,
        message.surface().triangle_offsets().size() - sizeof triangles);
    shown.triangles = triangles;
  }
  ReportBytes bytes;
  bytes.Bytes(message.SerializeAsString());
  const Particles particles(frame.particles_in_space, frame.result.statistics.spacing);
  const std::vector<Steps> selection = particles.Selection(options.max_particles);
  particles.Encode(selection, bytes);
  shown.particles = selection.size();
  shown.bytes = bytes.Take();
  return shown;
}

}  // namespace partiemc::client
