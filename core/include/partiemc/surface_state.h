// The state of a stream of surfaces: everything that one frame leaves for the next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// In Surface::outer_of, marks a shell that is no cavity.
inline constexpr std::uint32_t kNoShell = std::numeric_limits<std::uint32_t>::max();

/// A shell of the last frame.
struct KnownShell {
  std::uint64_t identity = 0;
  bool is_cavity = false;
  std::uint32_t outer = kNoShell;  ///< For a cavity: the index of its outer shell, if known.
  /// Mean velocity of its particles, world units per time; 0: unknown.
  double velocity_x = 0, velocity_y = 0, velocity_z = 0;

  friend bool operator==(const KnownShell&, const KnownShell&) = default;
};

/// Consecutive lattice nodes along x. In the last frame they were inside a body, or in a cavity
/// next to its shell. Coordinates are in cells from the world's origin.
struct ShellRun {
  std::int32_t layer = 0, row = 0;   ///< z and y.
  std::int32_t first = 0, last = 0;  ///< x, inclusive.
  std::uint32_t shell = 0;           ///< Index in ShellHistory::shells.

  friend bool operator==(const ShellRun&, const ShellRun&) = default;
};

/// A particle of the last frame: a hash of its id, different from the hashes of all other samples,
/// and its position.
struct ShellSample {
  std::uint64_t hash = 0;
  std::int32_t x = 0, y = 0, z = 0;  ///< The nearest node, in cells from the origin.
  std::uint32_t shell = 0;           ///< Its outer shell: an index in ShellHistory::shells.

  friend bool operator==(const ShellSample&, const ShellSample&) = default;
};

/// The data by which the next frame finds which of its shells continue shells of this frame. Their
/// size is proportional to the area of the surface, as in RingHistory.
struct ShellHistory {
  std::uint64_t identities_given = 0;  ///< The largest identity so far. No identity is reused.
  std::optional<double> time;          ///< Time of the last frame, finite.
  std::optional<PeriodicBox> box;      ///< As RingHistory::box.
  std::vector<KnownShell> shells;      ///< Sorted by identity.
  std::vector<ShellRun> runs;  ///< Disjoint; sorted by layer, row, node. At least one per shell.
  /// The up to kMaxSamples particles of each outer shell with the lowest hashes; sorted by hash.
  std::vector<ShellSample> samples;

  friend bool operator==(const ShellHistory&, const ShellHistory&) = default;
};

/// The complete state of a stream of surfaces. A default-constructed SurfaceState is the state
/// before the first frame. A surface is a pure function of frame and state, so a stream that
/// resumes from a restored state gives the same bits as without interruption.
struct SurfaceState {
  std::optional<double> cell_size;  ///< World units. Set by the first frame, then constant.
  ShellHistory history;

  friend bool operator==(const SurfaceState&, const SurfaceState&) = default;
};

/// Writes a state with version and checksum; same bytes on every machine. Size: 64 bytes, 40 per
/// shell, 20 per run, 24 per sample, 48 for a box.
std::string Serialize(const SurfaceState& state);

/// The size of Serialize(state), without writing it.
std::size_t SerializedBytes(const SurfaceState& state);

/// Reads the bytes of Serialize. The bytes may come from an untrusted client: every count is
/// checked against the number of bytes before memory is allocated.
/// Errors: INVALID_ARGUMENT (reason CORRUPT_STATE) for any other bytes and other versions.
absl::StatusOr<SurfaceState> ParseSurfaceState(std::string_view bytes);

}  // namespace partiemc
