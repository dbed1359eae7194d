// The runs behind the paper's tables and figures: what it shows, made anew from our own scenes.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/evaluation/metrics/study.h"

namespace partiemc::evaluation {

/// One frame as it is drawn.
struct Shot {
  std::string title;    ///< Method, share, grid, frame: what tells it from its neighbours.
  std::string caption;  ///< Numbers of this very frame.
  double spacing = 1;   ///< World units.
  std::vector<double> particles;  ///< x, y each.
  Outline truth;                  ///< Empty where it is not known or not to be drawn.
  Rings rings;
  Mesh mesh;  ///< Empty: the inside is filled plainly.
};

/// A row of a small scene of its own, with what it was run on.
struct ShareRow {
  double share = 1;  ///< Of the particles.
  Row row;
  double spacing_ratio =
      1;  ///< Spacing at this share / at 100 %: turns the row's into common units.
};

/// One placement and fill over the film.
struct FilmRun {
  Placement placement = Placement::kVirtualPlane;
  Fill fill = Fill::kGreedy;
  double milliseconds = 0;  ///< Processor time per frame, one thread: the median of repetitions.
  std::vector<double> triangles;
  std::vector<std::uint64_t> ring_digests;

  double MeanTriangles() const;
  double TriangleDeviation() const;  ///< Standard deviation over the frames.
};

/// One grid over one frame of the film.
struct GridRun {
  Placement placement = Placement::kVirtualPlane;
  int cells = 32;               ///< Across the bounding square.
  double cell_size = 1;         ///< Spacings.
  double grid = 0, greedy = 0;  ///< Triangles.
  double area = 0;              ///< World units squared.
  bool same_rings = false;      ///< Between the two fills, bit for bit.
};

/// Triangles of one synthetic shape by fill, for a grid of so many cells across its bounding
/// square.
struct FillRow {
  std::string shape;
  int cells = 32;
  double grid = 0, greedy = 0, conforming = 0, polygon = 0;
  std::size_t greedy_t_junctions = 0, conforming_t_junctions = 0;
  bool same_rings = false;  ///< Between all fills, bit for bit.
};

struct PaperRuns {
  std::string film_name;
  std::size_t film_frames = 0;
  std::vector<FilmRun> film;                        ///< Tables 1-2, Figure 14; see FilmOf.
  std::vector<Shot> film_shots;                     ///< Figure 12.
  std::array<std::size_t, 2> film_conditions = {};  ///< Frames of Table 1.
  std::vector<Row> features;  ///< Figure 5: marching squares, the paper's method, ours.
  std::vector<Shot> feature_shots;
  std::vector<ShareRow> thinned;  ///< Figures 6 and 10.
  std::vector<Shot> thinned_shots;
  std::size_t grid_frame = 0;          ///< Of the film: the frame of Figures 11 and 13.
  std::vector<GridRun> grids;          ///< Figures 11 and 13.
  std::vector<Shot> grid_shots;        ///< Figure 11: 32 grid, 32 greedy, 64 grid, 64 greedy.
  std::vector<Shot> resolution_shots;  ///< Figure 13: both placements at 32 and at 64.
  std::array<Deviation, 2> resolution_deviation;  ///< Spacings: 32 to 64, farthest, virtual-plane.
  std::vector<FillRow> fills;

  const FilmRun& FilmOf(Placement placement, Fill fill) const;
  const GridRun& GridOf(Placement placement, int cells) const;
};

/// Shares of the particles in Figures 6 and 10, largest first.
inline constexpr std::array<double, 4> kShares = {1.0, 0.8, 0.5, 0.3};

/// Placements that stand beside each other in figures: the baseline, the paper's, the default.
inline constexpr std::array<Placement, 3> kFigurePlacements = {
    Placement::kMarchingSquares, Placement::kFarthestParticle, Placement::kVirtualPlane};

/// What RunPaper reports to `progress` in all, in the same units as FrameTotal.
std::size_t PaperFrameTotal(const Sequence& film, std::span<const std::string_view> shapes);

/// A film of our own for studies without a recording: two bodies that merge.
Sequence DefaultFilm();

/// Runs them all, in the calling thread and with one oneTBB thread, so that times mean something.
/// The scenes are of the tuning shapes with seeds of their own; `shapes` are those of the fills.
/// Errors: those of Reconstructor; CANCELLED if `progress` says so.
absl::StatusOr<PaperRuns> RunPaper(const Sequence& film, std::span<const std::string_view> shapes,
                                   const StudyProgress& progress);

}  // namespace partiemc::evaluation
