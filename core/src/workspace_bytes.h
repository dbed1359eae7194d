// How much memory a frame takes.
#pragma once

#include <cstdint>

namespace partiemc {

/// What the memory of a frame follows.
struct FrameSize {
  std::uint64_t particles = 0;
  std::uint64_t tiles = 0;
  std::uint64_t segments = 0;    ///< Of the isoline, through one cell each.
  std::uint64_t grid_cells = 0;  ///< Interior cells, where the fill is `grid`; else 0.
};

/// No less than what a new Workspace, Result and State hold after frames of this size, and not much
/// more (tests/core/allocation_test.cc: up to 2.2 times as much, where it is more than a few MB).
std::uint64_t WorkspaceBytes(const FrameSize& size);

}  // namespace partiemc
