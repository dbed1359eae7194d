// The parts of RunPaper: each makes some of the paper's tables and figures anew.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "client/evaluation/paper/paper.h"

namespace partiemc::evaluation {

/// What RunPaper was called with.
struct PaperInput {
  const Sequence& film;
  std::span<const std::string_view> shapes;
  const StudyProgress& progress;
};

/// Seed of the figures' scenes, which are of no set.
inline constexpr std::uint64_t kPaperSeed = 5'310;

/// Cells across a bounding square.
inline constexpr std::array<int, 2> kPaperGrids = {32, 64};

/// Each part adds to `runs`. Errors: those of Reconstructor; CANCELLED if progress says so.

/// Placements and fills over the film, timed: Tables 1-2, Figures 12 and 14.
absl::Status RunPaperFilm(const PaperInput& input, PaperRuns& runs);
/// A shape with sharp features: Figure 5.
absl::Status RunPaperFeatures(const PaperInput& input, PaperRuns& runs);
/// A shape of fewer and fewer particles: Figures 6 and 10.
absl::Status RunPaperThinned(const PaperInput& input, PaperRuns& runs);
/// Two grids over one frame of the film: Figures 11 and 13.
absl::Status RunPaperGrids(const PaperInput& input, PaperRuns& runs);
/// Triangles of all fills, by shape and grid.
absl::Status RunPaperFills(const PaperInput& input, PaperRuns& runs);

/// How often RunPaperFilm goes over the film, as progress counts it.
std::size_t PaperFilmRuns();

/// Called by its placement's name. Cell size in spacings.
Method PaperMethod(Placement placement, Fill fill = Fill::kGreedy, double cell_size = 1);

/// Particles, truth and rings of a frame; no mesh and no caption.
Shot ShotOf(std::string title, const Sequence& sequence, std::size_t frame, const Result& result);

/// Reports frames that are done; CANCELLED if progress says so.
absl::Status Advance(const PaperInput& input, std::size_t frames);

}  // namespace partiemc::evaluation
