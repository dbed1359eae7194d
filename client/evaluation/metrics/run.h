// A method over a sequence, in process: one row of metrics, and series over its frames.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/evaluation/metrics/advection.h"
#include "client/evaluation/metrics/metrics.h"
#include "client/evaluation/scenes/sampling.h"
#include "client/evaluation/scenes/sequence.h"
#include "core/internal/research.h"
#include "partiemc/parameters.h"
#include "partiemc/stage.h"

namespace partiemc::evaluation {

/// A configuration under a name.
struct Method {
  std::string name;
  ReconstructionParameters parameters;  ///< `spacing` is set by the run, see Knowledge.
  VirtualPlaneVariant variant = {};
};

/// What a method is told beside the positions.
enum class Knowledge : std::uint8_t {
  kVolumes,  ///< Spacing and volumes per particle, as the sequence has them.
  kSpacing,  ///< Spacing only: every particle stands for its square.
  kNothing,  ///< Positions only; the spacing is estimated.
};

std::string_view Name(Knowledge knowledge);

/// Numbers of a row. Of each frame's number the mean over frames, unless said otherwise.
enum class Metric : std::uint8_t {
  kHausdorff,        ///< To the true boundary, spacings.
  kMeanDeviation,    ///< To the true boundary, spacings.
  kBias,             ///< |mean of the signed relative area errors|.
  kAreaDeviation,    ///< Eq. 29-30 on area / true area (recordings: / sum of volumes), relative
                     ///< to the first frame, mean over the frames after it.
  kHausdorffJitter,  ///< Jitter() of metrics.h, mean over pairs of frames.
  kMeanJitter,
  kKnownHausdorffJitter,  ///< JitterWhereKnown() of metrics.h, frames weighted by their known
                          ///< share; recordings only.
  kKnownMeanJitter,
  kKnownShare,       ///< Of the samples, what those two are taken from.
  kAreaErrorSize,    ///< |relative area error|.
  kWallRoughness,    ///< WallRoughness() of recorded_truth.h.
  kAreaError,        ///< Signed relative area error.
  kCenterHausdorff,  ///< To the curve through the outermost centres, where it is defined.
  kCenterMean,
  kTriangles,
  kTriangleDeviation,  ///< Standard deviation of the triangle counts over frames.
  kTrianglesGrid,      ///< Triangles that `grid` would have.
  kSelfIntersections,
  kFolds,
  kSpuriousComponents,  ///< Outer rings without a particle.
  kComponentError,
  kHoleError,
  kWrongNormals,  ///< Share of vertices.
  kVertices,
  kMilliseconds,  ///< All stages.
};
inline constexpr std::size_t kMetricCount = 25;

std::string_view Name(Metric metric);

inline constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

struct FrameNumbers {
  double area = 0;                      ///< World units squared.
  double area_error = kAbsent;          ///< Signed, relative.
  Deviation truth{kAbsent, kAbsent};    ///< From the true boundary.
  Deviation centers{kAbsent, kAbsent};  ///< From the curve through the outermost centres.
  Deviation jitter{kAbsent, kAbsent};   ///< From the frame before; absent in the first.
  KnownJitter known_jitter{{kAbsent, kAbsent}, kAbsent};  ///< The same; absent in scenes.
  double wall_roughness = kAbsent;                        ///< Spacings; absent without walls.
  NeighbourDistances neighbours;  ///< Of the particles: the same for every method.
  Defects defects;
  std::uint64_t vertices = 0, triangles = 0, triangles_grid = 0;
  std::array<double, kStageCount> stage_ms = {};  ///< Wall clock.
};

struct Row {
  std::string sequence, method, shape, sampler;
  Group group = Group::kRigid;
  bool judged = true;
  Knowledge knowledge = Knowledge::kVolumes;
  bool ids = false;                         ///< Whether the method was told ids.
  std::array<double, kMetricCount> values;  ///< By Metric; kAbsent where there is nothing to say.
  std::vector<FrameNumbers> frames;

  double operator[](Metric metric) const { return values[static_cast<std::size_t>(metric)]; }
};

struct RunOptions {
  Knowledge knowledge = Knowledge::kSpacing;
  /// Tell the ids of scenes, too. Those of recordings are always told: they are what a stream has.
  bool ids = false;
  /// Tell the spacing that the particles had before they were thinned, not the one that they have.
  bool original_spacing = false;
};

/// A sequence with its truth prepared for comparisons, so that several methods share that work.
/// Safe to run from several threads.
class Evaluator {
 public:
  /// `centers`: compare with the curve through the outermost centres too; costs about as much as
  /// all else together.
  explicit Evaluator(Sequence sequence, bool centers = false);

  const Sequence& sequence() const { return sequence_; }

  /// Errors: those of Reconstructor::Create and Reconstruct, with the sequence's name and frame.
  /// Times mean something only if the caller's oneTBB arena has no other work.
  absl::StatusOr<Row> Run(const Method& method, const RunOptions& options) const;

  /// The results themselves, for pictures.
  absl::StatusOr<std::vector<Result>> Reconstruct(const Method& method,
                                                  const RunOptions& options) const;

 private:
  struct Reference {
    Curve truth;
    std::optional<Curve> centers;
    std::optional<SegmentIndex> carried_truth;  ///< Of the frame before; only if it is needed.
  };

  absl::StatusOr<std::vector<Result>> Reconstruct(const Method& method, const RunOptions& options,
                                                  std::vector<FrameNumbers>& numbers) const;
  void Measure(std::size_t frame, const Result& result, const Curve& contour,
               FrameNumbers& numbers) const;
  void MeasureJitter(std::size_t frame, const Outline& before, const Curve& contour,
                     FrameNumbers& numbers) const;
  bool TellsIds(const RunOptions& options) const;
  double TrueArea(std::size_t frame) const;
  Row Summary(const std::vector<FrameNumbers>& numbers) const;

  Sequence sequence_;
  std::vector<NeighbourDistances> neighbours_;  ///< Per frame.
  std::vector<Reference> references_;           ///< Per frame; empty for recordings.
  /// From each frame but the last to the next one; empty for scenes.
  std::vector<std::optional<Advection>> advections_;
};

}  // namespace partiemc::evaluation
