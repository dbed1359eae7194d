#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "client/evaluation/paper/paper_parts.h"
#include "client/evaluation/scenes/random.h"

namespace partiemc::evaluation {
namespace {

// A random part of the particles, the same ones in all frames.
Sequence Thinned(const Sequence& sequence, double share) {
  Sequence thinned = sequence;
  Random random(kPaperSeed);
  std::vector<std::size_t> order(sequence.frames.front().ParticleCount());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t k = order.size(); k > 1; --k) std::swap(order[k - 1], order[random.Below(k)]);
  order.resize(static_cast<std::size_t>(std::lround(share * static_cast<double>(order.size()))));
  for (SequenceFrame& frame : thinned.frames) {
    const std::vector<double> all = std::exchange(frame.positions, {});
    for (const std::size_t k : order) {
      frame.positions.insert(frame.positions.end(), {all[2 * k], all[2 * k + 1]});
    }
    const auto count = static_cast<double>(order.size());
    frame.volumes.assign(order.size(), static_cast<float>(frame.area / count));
    frame.ids.clear();
    frame.velocities.clear();
  }
  const SequenceFrame& first = thinned.frames.front();
  thinned.spacing = std::sqrt(first.area / static_cast<double>(order.size()));
  return thinned;
}

}  // namespace

absl::Status RunPaperFeatures(const PaperInput& input, PaperRuns& runs) {
  const Evaluator scene(MakeScene({.name = "star",
                                   .shape = "star",
                                   .seed = kPaperSeed,
                                   .pace = Pace::kDrift,
                                   .particles = 700}),
                        true);
  for (const Placement placement : kFigurePlacements) {
    const Method method = PaperMethod(placement);
    auto row = scene.Run(method, {});
    const auto results = scene.Reconstruct(method, {});
    if (!row.ok() || !results.ok()) return row.ok() ? results.status() : row.status();
    Shot shot = ShotOf(method.name, scene.sequence(), 0, results->front());
    shot.caption = absl::StrFormat("area %+.2f %%, Hausdorff %.2f h",
                                   100 * row->frames[0].area_error, row->frames[0].truth.hausdorff);
    runs.features.push_back(*std::move(row));
    runs.feature_shots.push_back(std::move(shot));
    if (const auto status = Advance(input, scene.sequence().frames.size()); !status.ok())
      return status;
  }
  return absl::OkStatus();
}

absl::Status RunPaperThinned(const PaperInput& input, PaperRuns& runs) {
  const Sequence whole = MakeScene({.name = "ell", .shape = "ell", .seed = kPaperSeed + 1});
  for (const double share : kShares) {
    const Evaluator scene(Thinned(whole, share));
    for (const Placement placement : kFigurePlacements) {
      const Method method = PaperMethod(placement);
      auto row = scene.Run(method, {});
      const auto results = scene.Reconstruct(method, {});
      if (!row.ok() || !results.ok()) return row.ok() ? results.status() : row.status();
      const double ratio = scene.sequence().spacing / whole.spacing;
      Shot shot = ShotOf(absl::StrFormat("%s, %.0f %%", method.name, 100 * share), scene.sequence(),
                         0, results->front());
      shot.caption = absl::StrFormat("Hausdorff %.2f h", row->frames[0].truth.hausdorff * ratio);
      runs.thinned.push_back({share, *std::move(row), ratio});
      runs.thinned_shots.push_back(std::move(shot));
      if (const auto status = Advance(input, whole.frames.size()); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

}  // namespace partiemc::evaluation
