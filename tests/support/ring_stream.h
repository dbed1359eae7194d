// A stream of frames through the core, with its rings by position.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "support/particles.h"

namespace partiemc::support {

/// With spacing 1 by default.
class RingStream {
 public:
  explicit RingStream(ReconstructionParameters parameters = {})
      : reconstructor_(*Reconstructor::Create(WithSpacing(parameters))) {}

  /// Fails the test if the frame is refused.
  const Rings& Next(const Frame& frame) {
    const absl::Status status = reconstructor_.Reconstruct(frame, state_, workspace_, result_);
    EXPECT_TRUE(status.ok()) << status;
    return result_.rings;
  }
  const Rings& Next(const Particles& particles) { return Next(particles.AsFrame()); }
  absl::Status Try(const Particles& particles) {
    return reconstructor_.Reconstruct(particles.AsFrame(), state_, workspace_, result_);
  }
  const Result& result() const { return result_; }
  const Rings& rings() const { return result_.rings; }
  State& state() { return state_; }
  const State& state() const { return state_; }

  /// The outer ring, or the hole, whose centroid is nearest to (x, y).
  std::size_t Ring(double x, double y, bool hole = false) const {
    std::size_t nearest = rings().RingCount();
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t ring = 0; ring < rings().RingCount(); ++ring) {
      const RingMeasures& measures = rings().measures[ring];
      const double distance = std::hypot(measures.centroid_x - x, measures.centroid_y - y);
      if ((rings().outer_of[ring] != kNoRing) != hole || distance >= least) continue;
      least = distance;
      nearest = ring;
    }
    return nearest;
  }
  std::uint64_t Identity(double x, double y, bool hole = false) const {
    return rings().measures[Ring(x, y, hole)].identity;
  }
  std::vector<std::uint64_t> Parents(double x, double y, bool hole = false) const {
    const auto parents = rings().ParentsOf(Ring(x, y, hole));
    return {parents.begin(), parents.end()};
  }

 private:
  static ReconstructionParameters WithSpacing(ReconstructionParameters parameters) {
    if (!parameters.spacing) parameters.spacing = 1.0;
    return parameters;
  }

  Reconstructor reconstructor_;
  State state_;
  Workspace workspace_;
  Result result_;
};

/// Sends one frame, which must be refused and change nothing. Returns the broken rule.
inline std::optional<Violation> RefusalOf(const ReconstructionParameters& parameters,
                                          const Particles& particles) {
  RingStream stream(parameters);
  const absl::Status status = stream.Try(particles);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
  EXPECT_EQ(stream.rings().RingCount(), 0u);
  EXPECT_EQ(stream.state(), State());
  return FindViolation(status);
}

}  // namespace partiemc::support
