// The state of a stream: everything that one frame leaves for the next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "partiemc/surface_state.h"

namespace partiemc {

/// The normal of an active cell of the last frame (paper, Eq. 11).
struct CellNormal {
  std::int32_t column = 0, row = 0;  ///< The cell's lower left node, in cells from the origin.
  float x = 0, y = 0;                ///< Unit length, outward.

  friend bool operator==(const CellNormal&, const CellNormal&) = default;
};

/// A ring of the last frame.
struct KnownRing {
  std::uint64_t identity = 0;
  bool is_hole = false;
  std::uint32_t outer = kNoRing;  ///< For a hole: the index of its outer ring, if known.
  /// Mean velocity of its particles, world units per time; 0: unknown.
  double velocity_x = 0, velocity_y = 0;

  friend bool operator==(const KnownRing&, const KnownRing&) = default;
};

/// Consecutive lattice nodes of one row, `first` to `last` inclusive. In the last frame they were
/// inside an outer ring, or in the void of a hole, next to the ring of the hole.
struct NodeRun {
  std::int32_t row = 0, first = 0, last = 0;  ///< In cells from the world's origin.
  std::uint32_t ring = 0;                     ///< Index in RingHistory::rings.

  friend bool operator==(const NodeRun&, const NodeRun&) = default;
};

/// Most particle samples of one outer ring or outer shell.
inline constexpr std::uint32_t kMaxSamples = 16;

/// A particle of the last frame: a hash of its id, different from the hashes of all other samples,
/// and its position.
struct ParticleSample {
  std::uint64_t hash = 0;
  std::int32_t column = 0, row = 0;  ///< The nearest node, in cells from the origin.
  std::uint32_t ring = 0;            ///< Its outer ring: an index in RingHistory::rings.

  friend bool operator==(const ParticleSample&, const ParticleSample&) = default;
};

/// The data by which the next frame finds which of its rings continue rings of this frame. Their
/// size is proportional to the length of the outline: both ends of a run lie on the outline, and
/// the number of samples per ring is limited.
struct RingHistory {
  std::uint64_t identities_given = 0;  ///< The largest identity so far. No identity is reused.
  std::optional<double> time;          ///< Time of the last frame, finite.
  /// The box of the last frame (Frame::box), without `wraps`. Absent: the box of the stream.
  std::optional<PeriodicBox> box;
  std::vector<KnownRing> rings;  ///< Sorted by identity.
  std::vector<NodeRun> runs;     ///< Disjoint, by row, then column. Each ring has at least one run.
  /// The up to kMaxSamples particles of each outer ring with the lowest hashes; sorted by hash.
  std::vector<ParticleSample> samples;

  friend bool operator==(const RingHistory&, const RingHistory&) = default;
};

/// The particles of the last frame, if the stream filters noise
/// (ReconstructionParameters::noise_filter).
struct NoiseHistory {
  std::vector<std::uint64_t> ids;  ///< Ascending.
  std::vector<double> given;       ///< Given coordinates, world units: 2 or 3 per particle.
  std::vector<float> offsets;      ///< Filtered minus given coordinates, in cells; as `given`.
  std::optional<PeriodicBox> box;  ///< As RingHistory::box.

  friend bool operator==(const NoiseHistory&, const NoiseHistory&) = default;
};

/// The complete state of a stream. A default-constructed State is the state before the first frame.
/// Reconstruction is a pure function of frame and state, so a stream that resumes from a restored
/// State gives the same bits as without interruption.
struct State {
  /// Lattice spacing in world units. Set by the first frame with a given spacing or with particles
  /// that agree on one, then constant. Earlier frames leave no state.
  std::optional<double> cell_size;
  /// Spacing in use, world units.
  std::optional<double> spacing;
  /// Offset, in spacings, by which the area step last moved an outline (core/METHOD.md, "The
  /// default placement", step 4).
  std::optional<double> area_offset;
  /// Normals of the active cells of the last frame by row, then column; at most one per cell.
  std::vector<CellNormal> normals;
  RingHistory history;
  /// The state of the surface. With Output::kSurface the members above stay empty.
  SurfaceState surface;
  /// One history for all outlines and the surface. Empty without a noise filter, and in the states
  /// of sections.
  NoiseHistory noise;
  /// The states of the sections (ReconstructionParameters::sections).
  std::vector<State> sections;

  friend bool operator==(const State&, const State&) = default;
};

/// Writes a state with version and checksum; same bytes on every machine. Size: 88 bytes, 16 per
/// normal, 32 per ring, 16 per run, 20 per sample. A state with sections takes 24 bytes, and for
/// each outline 8 bytes plus the size of its state. A state of a stream of surfaces does the same,
/// with the surface in place of the first outline. A noise filter adds 48 bytes, and 32 per
/// particle of an outline or 44 per particle in space. Each box of a last frame adds 48 bytes.
std::string Serialize(const State& state);

/// The size of Serialize(state), without writing it.
std::size_t SerializedBytes(const State& state);

/// Reads the bytes of Serialize. The bytes may come from an untrusted client: every count is
/// checked against the number of bytes before memory is allocated.
/// Errors: INVALID_ARGUMENT (reason CORRUPT_STATE) for any other bytes and other versions.
absl::StatusOr<State> ParseState(std::string_view bytes);

}  // namespace partiemc
