// What is evaluated: a sequence of particle frames, synthetic with exact truth, or recorded.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/evaluation/scenes/motion.h"
#include "client/evaluation/scenes/outline.h"

namespace partiemc::evaluation {

/// What makes a sequence hard.
enum class Group : std::uint8_t {
  kRigid,      ///< Rigid motion, from sub-cell drift to steps of many cells.
  kNoise,      ///< Rigid motion and, in each frame, new noise on every particle.
  kThinned,    ///< Rigid motion of a random part of the particles.
  kDeformed,   ///< Incompressible flow.
  kTopology,   ///< Bodies that merge or split.
  kRagged,     ///< Rigid motion of random darts.
  kGrowth,     ///< A region that grows by new particles.
  kRecording,  ///< Recorded; little of the truth is known.
};
inline constexpr std::size_t kGroupCount = 8;

std::string_view Name(Group group);

struct SequenceFrame {
  double time = 0;
  std::vector<double> positions;   ///< x, y per particle, world units.
  std::vector<float> volumes;      ///< Area per particle: in scenes exact area / particles.
  std::vector<std::uint64_t> ids;  ///< Of a particle the same in all frames; empty: not known.
  std::vector<double> velocities;  ///< x, y per particle; empty where there are none.
  Outline truth;                   ///< The true boundary; empty where it is not known.
  double area = 0;                 ///< Of the true region; in recordings the sum of volumes, or 0.

  std::size_t ParticleCount() const { return positions.size() / 2; }
};

/// A rigid straight wall, in world units.
struct Wall {
  Point from, to;
};

struct Sequence {
  std::string name;  ///< Unique within a set.
  Group group = Group::kRigid;
  std::string shape;
  std::string sampler;  ///< How its particles lie, by name; empty in recordings.
  std::uint64_t seed = 0;

  /// Spacing in world units: of the particles before they were thinned, and the one at which N h^2
  /// is the area of the first frame. Equal to a percent but in the group `thinned`. Metrics are in
  /// units of the second.
  double original_spacing = 1;
  double spacing = 1;

  /// Whether the sequence counts in comparisons; otherwise it is reported only (30 % of the
  /// particles, where no method is stable).
  bool judged = true;

  std::vector<SequenceFrame> frames;

  std::vector<Wall> walls;  ///< That are known, of recordings.
  bool whole = true;        ///< Whether areas are compared: no spray that outlines do not hold.

  SharedMotion motion;               ///< Of scenes: how the region's points move. Null: recorded.
  bool truth_follows_motion = true;  ///< False where outlines appear or vanish (topology).

  /// Whether particles have ids in any frame.
  bool HasIds() const {
    return std::ranges::any_of(frames, [](const SequenceFrame& f) { return !f.ids.empty(); });
  }
};

/// The second reference, in world units: the curve half a spacing inside the true boundary, on
/// which the outermost centres lie. Empty where it is not well-defined (erosion.h) and in
/// recordings.
Outline OutermostCenters(const Sequence& sequence, std::size_t frame);

}  // namespace partiemc::evaluation
