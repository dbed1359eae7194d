// The reference scenes: seeded, the same particles on every machine (no libm function but sqrt).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "partiemc/frame.h"

namespace partiemc::bench {

/// Frames of one particle set, x and y interleaved, in the order in which they are played, over
/// and over again.
struct Scene {
  using Positions = std::variant<std::vector<float>, std::vector<double>>;

  std::string name;  ///< As it appears in the names of metrics: "1m".
  double spacing = 1;
  std::vector<Positions> frames;

  /// Frame `index` of the endless sequence; a view.
  Frame At(std::size_t index) const;
  std::size_t ParticleCount() const { return At(0).ParticleCount(); }
  std::size_t FrameBytes() const;
};

/// A body with a wavy outline and six holes round the origin: the lattice of spacing 1 inside of
/// it, jittered by up to 0.15, exactly `count` particles in shuffled order. It sways by 0.05 over
/// four frames, so that no frame equals the one before. Positions are float.
Scene Blob(const std::string& name, std::size_t count);

/// A thousand discs of a thousandth of `count` particles each, scattered over a square box of ten
/// thousand times their area, likewise jittered, shuffled and swaying. Positions are double: at
/// such a distance a float resolves no jitter.
Scene Islands(const std::string& name, std::size_t count);

/// The frames of a recording, with its own spacing.
absl::StatusOr<Scene> Recorded(const std::string& name, const std::string& path);

/// Everything that is measured on: blobs of the sizes in their names, a thousand islands, a blob
/// that just fits into 1024 x 1024 nodes, and the bundled recording.
struct ReferenceScenes {
  Scene blob_10k, blob_100k, blob_1m;
  Scene blob_4m;  ///< Without frames in a quick run.
  Scene islands_1m;
  Scene blob_1024;
  Scene dam_break;
};
absl::StatusOr<ReferenceScenes> MakeReferenceScenes(bool quick);

/// Ids of all particles that a scene ever has: 0, 1, 2, ... in shuffled order, which is not that in
/// which the particles lie, as in a simulator that sorts them anew now and then.
std::vector<std::uint64_t> ShuffledIds(const Scene& scene);

/// The float positions of a scene's first frame. Requires: a scene of floats.
std::span<const float> FloatPositions(const Scene& scene);

}  // namespace partiemc::bench
