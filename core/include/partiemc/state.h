// What one frame leaves for the next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace partiemc {

/// The normal of an active cell of the last frame (paper, Eq. 11).
struct CellNormal {
  std::int32_t column = 0, row = 0;  ///< The cell's lower left node, in cells from the origin.
  float x = 0, y = 0;                ///< Unit length, outward.

  friend bool operator==(const CellNormal&, const CellNormal&) = default;
};

/// Everything that a stream remembers between frames, and nothing else. A default-constructed
/// State is that of a stream that has seen no frame. Reconstruction is a pure function of frame
/// and state, so that a stream goes on from a restored State bit for bit as if it had never
/// stopped.
struct State {
  /// Lattice spacing in world units: set by the first frame with two distinct positions (or by a
  /// given spacing), never changed afterwards.
  std::optional<double> cell_size;
  /// Spacing in use, world units.
  std::optional<double> spacing;
  /// Normals of the last frame's active cells, ordered by row, then column. At most one per cell.
  std::vector<CellNormal> normals;

  friend bool operator==(const State&, const State&) = default;
};

/// Bytes with a version and a checksum; the same on every machine. Size: 40 bytes and 16 per
/// normal.
std::string Serialize(const State& state);

/// The state that Serialize wrote. Errors: INVALID_ARGUMENT (reason CORRUPT_STATE) for anything
/// else; bytes are untrusted, every count is checked against their number before it is believed.
absl::StatusOr<State> ParseState(std::string_view bytes);

}  // namespace partiemc
