// What one frame leaves for the next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "partiemc/result.h"

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
  std::uint32_t outer = kNoRing;  ///< Of a hole: index of its outer ring, where that is known.
  double velocity_x = 0, velocity_y = 0;  ///< Mean of its particles, world units per time; 0: none.

  friend bool operator==(const KnownRing&, const KnownRing&) = default;
};

/// Neighbouring nodes of one row of the lattice, `first` to `last`, that lay inside of an outer
/// ring of the last frame, or in the void of a hole next to its ring.
struct NodeRun {
  std::int32_t row = 0, first = 0, last = 0;  ///< In cells from the origin.
  std::uint32_t ring = 0;                     ///< Index in RingHistory::rings.

  friend bool operator==(const NodeRun&, const NodeRun&) = default;
};

/// At most this many particles of an outer ring are remembered.
inline constexpr std::uint32_t kMaxSamples = 16;

/// A particle of the last frame, by a hash of its id that no other id has, and where it was.
struct ParticleSample {
  std::uint64_t hash = 0;
  std::int32_t column = 0, row = 0;  ///< The nearest node, in cells from the origin.
  std::uint32_t ring = 0;            ///< Index in RingHistory::rings of an outer ring.

  friend bool operator==(const ParticleSample&, const ParticleSample&) = default;
};

/// What is needed to tell which ring of the next frame continues which ring of this one. Its size
/// follows the length of the outline: a run has two ends on it, a ring has a bounded number of
/// samples.
struct RingHistory {
  std::uint64_t identities_given = 0;   ///< They are 1 to this number; none is given twice.
  std::optional<double> time;           ///< Of the last frame; finite.
  std::vector<KnownRing> rings;         ///< By identity.
  std::vector<NodeRun> runs;            ///< By row, then column; disjoint. Each ring has one.
  std::vector<ParticleSample> samples;  ///< By hash. Of a ring those of the least hashes.

  friend bool operator==(const RingHistory&, const RingHistory&) = default;
};

/// Everything that a stream remembers between frames, and nothing else. A default-constructed
/// State is that of a stream that has seen no frame. Reconstruction is a pure function of frame
/// and state, so that a stream goes on from a restored State bit for bit as if it had never
/// stopped.
struct State {
  /// Lattice spacing in world units: set by a given spacing, or by the first frame whose particles
  /// agree on one; never changed afterwards. Frames before that one leave nothing behind.
  std::optional<double> cell_size;
  /// Spacing in use, world units.
  std::optional<double> spacing;
  /// How far the last frame's outline was moved to match its area, in spacings (core/METHOD.md,
  /// "The default placement", step 4).
  std::optional<double> area_offset;
  /// Normals of the last frame's active cells, ordered by row, then column. At most one per cell.
  std::vector<CellNormal> normals;
  RingHistory history;
  /// The same of each section (ReconstructionParameters::sections).
  std::vector<State> sections;

  friend bool operator==(const State&, const State&) = default;
};

/// Bytes with a version and a checksum; the same on every machine. Size: 88 bytes, 16 per normal,
/// 32 per ring, 16 per run and 20 per sample; with sections 24 bytes, and 8 and the state of each.
std::string Serialize(const State& state);

/// The number of them, without writing any.
std::size_t SerializedBytes(const State& state);

/// The state that Serialize wrote. Errors: INVALID_ARGUMENT (reason CORRUPT_STATE) for anything
/// else, other versions included; bytes are untrusted, every count is checked against their number
/// before it is believed.
absl::StatusOr<State> ParseState(std::string_view bytes);

}  // namespace partiemc
