#include "client/evaluation/paper/paper.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "client/evaluation/paper/paper_parts.h"
#include "partiemc/arena.h"

namespace partiemc::evaluation {

Method PaperMethod(Placement placement, Fill fill, double cell_size) {
  return {std::string(Name(placement)),
          {.placement = placement, .fill = fill, .cell_size = cell_size}};
}

Shot ShotOf(std::string title, const Sequence& sequence, std::size_t frame, const Result& result) {
  return {.title = std::move(title),
          .spacing = sequence.spacing,
          .particles = sequence.frames[frame].positions,
          .truth = sequence.frames[frame].truth,
          .rings = result.rings};
}

absl::Status Advance(const PaperInput& input, std::size_t frames) {
  return input.progress(frames) ? absl::OkStatus() : absl::CancelledError("interrupted");
}

const FilmRun& PaperRuns::FilmOf(Placement placement, Fill fill) const {
  return *std::ranges::find_if(
      film, [&](const FilmRun& run) { return run.placement == placement && run.fill == fill; });
}

const GridRun& PaperRuns::GridOf(Placement placement, int cells) const {
  return *std::ranges::find_if(
      grids, [&](const GridRun& run) { return run.placement == placement && run.cells == cells; });
}

std::size_t PaperFrameTotal(const Sequence& film, std::span<const std::string_view> shapes) {
  const std::size_t scene_frames = SceneRecipe{}.frames;
  return PaperFilmRuns() * film.frames.size() +
         kFigurePlacements.size() * scene_frames * (1 + kShares.size()) +
         2 * kPaperGrids.size() * 2 + shapes.size() * kPaperGrids.size() * 4;
}

Sequence DefaultFilm() {
  return MakeScene({.name = "merging discs",
                    .group = Group::kTopology,
                    .shape = "discs",
                    .seed = kPaperSeed + 3,
                    .particles = 1500,
                    .frames = 16});
}

absl::StatusOr<PaperRuns> RunPaper(const Sequence& film, std::span<const std::string_view> shapes,
                                   const StudyProgress& progress) {
  const PaperInput input{film, shapes, progress};
  PaperRuns runs{.film_name = film.name, .film_frames = film.frames.size()};
  absl::Status status;
  Arena(1).Execute([&] {
    for (const auto part :
         {RunPaperFilm, RunPaperFeatures, RunPaperThinned, RunPaperGrids, RunPaperFills}) {
      if (status = part(input, runs); !status.ok()) return;
    }
  });
  if (!status.ok()) return status;
  return runs;
}

}  // namespace partiemc::evaluation
