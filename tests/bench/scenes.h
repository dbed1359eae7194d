// The reference scenes: seeded, the same particles on every machine (no libm function but sqrt).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "partiemc/frame.h"
#include "support/random.h"

namespace partiemc::bench {

/// Frames of one particle set, x and y interleaved, in the order in which they are played, over
/// and over again.
struct Scene {
  using Positions = std::variant<std::vector<float>, std::vector<double>>;

  std::string name;  ///< As it appears in the names of metrics: "1m".
  double spacing = 1;
  std::vector<Positions> frames;
  // The same in all frames; empty: none.
  std::vector<float> volumes;
  std::vector<float> phases;

  /// Positions and volumes of frame `index` of the endless sequence; a view.
  Frame At(std::size_t index) const;
  std::size_t ParticleCount() const { return At(0).ParticleCount(); }
  std::size_t FrameBytes() const;
};

/// A body with a wavy outline and six holes around the origin, of exactly `count` particles. They
/// lie on the lattice of spacing 1, jittered by up to 0.15, in shuffled order. The body sways by
/// 0.05 over four frames, so that consecutive frames differ. Positions are float.
Scene Blob(const std::string& name, std::size_t count);

/// A thousand discs of count / 1000 particles, scattered over a square box of ten thousand times
/// their area, with the jitter, order and sway of Blob. Positions are double: at such distances a
/// float does not resolve the jitter.
Scene Islands(const std::string& name, std::size_t count);

/// The blob of about `count` particles, a share of which gave way to large ones: `is_large` chooses
/// squares of `ratio` x `ratio` nodes by the middle of the square, in units of the blob's radius.
/// The particle in the middle of such a square has its area as volume.
Scene SizedBlob(const std::string& name, std::size_t count, int ratio,
                const std::function<bool(support::Random&, double x, double y)>& is_large);

/// A rectangle of `columns` x `rows` particles with the origin in the middle of its left side, and
/// the jitter, order and sway of Blob.
Scene Layer(const std::string& name, int columns, int rows);

/// The frames of a recording, with its own spacing.
absl::StatusOr<Scene> Recorded(const std::string& name, const std::string& path);

/// The particles of `partiemc load`.
Scene Load(const std::string& name, int count);

/// Every scene of the benchmark.
struct Scenes {
  std::vector<Scene> blobs;  ///< "10k", "100k", "1m", and, unless the run is quick, "4m".
  Scene islands_1m;
  Scene blob_1024;  ///< Fits into 1024 x 1024 nodes.
  Scene dam_break;  ///< The bundled recording.
  Scene load_1m;
};
absl::StatusOr<Scenes> MakeScenes(bool quick);

/// Ids 0, 1, 2, ... for the largest frame of the scene, in an order unrelated to the positions, as
/// of a simulator that sorts its particles from time to time.
std::vector<std::uint64_t> ShuffledIds(const Scene& scene);

/// The float positions of a scene's first frame. Requires: a scene of floats.
std::span<const float> FloatPositions(const Scene& scene);

}  // namespace partiemc::bench
