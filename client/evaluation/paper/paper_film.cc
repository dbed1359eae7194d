#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_format.h"
#include "client/evaluation/paper/paper_parts.h"
#include "partiemc/reconstructor.h"

namespace partiemc::evaluation {
namespace {

constexpr std::size_t kRepetitions = 3;  // Of timed runs: the median of three sheds one hiccup.
constexpr std::size_t kFilmShots = 4;

constexpr std::array<std::pair<Placement, Fill>, 6> kFilmRuns = {{
    {Placement::kMarchingSquares, Fill::kGrid},
    {Placement::kQef, Fill::kGrid},
    {Placement::kFarthestParticle, Fill::kGrid},
    {Placement::kFarthestParticle, Fill::kGreedy},
    {Placement::kVirtualPlane, Fill::kGrid},
    {Placement::kVirtualPlane, Fill::kGreedy},
}};

// Processor time of the calling thread: unlike wall clock, the same on a machine that is shared.
double ThreadMilliseconds() {
  timespec now = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

absl::StatusOr<std::vector<Result>> Timed(const Sequence& film, const Method& method,
                                          double& milliseconds) {
  ReconstructionParameters parameters = method.parameters;
  parameters.spacing = film.spacing;
  const auto reconstructor = CreateVariant(parameters, method.variant);
  if (!reconstructor.ok()) return reconstructor.status();
  std::vector<Result> results(film.frames.size());
  Workspace workspace;
  std::array<double, kRepetitions> means;
  for (double& mean : means) {
    State state;
    const double begin = ThreadMilliseconds();
    for (std::size_t t = 0; t < results.size(); ++t) {
      const Frame frame{.positions = std::span<const double>(film.frames[t].positions),
                        .volumes = film.frames[t].volumes};
      const absl::Status status = reconstructor->Reconstruct(frame, state, workspace, results[t]);
      if (!status.ok()) return status;
    }
    mean = (ThreadMilliseconds() - begin) / static_cast<double>(results.size());
  }
  std::sort(means.begin(), means.end());
  milliseconds = means[kRepetitions / 2];
  return results;
}

void TakeShots(const Sequence& film, const std::vector<Result>& results, PaperRuns& runs) {
  std::array<std::size_t, kFilmShots> frames;
  for (std::size_t k = 0; k < kFilmShots; ++k) {
    frames[k] = k * (results.size() - 1) / (kFilmShots - 1);
    const Result& result = results[frames[k]];
    Shot shot = ShotOf(absl::StrFormat("frame %d", frames[k]), film, frames[k], result);
    shot.mesh = result.mesh;
    shot.truth = {};
    shot.caption = absl::StrFormat("%d triangles, %d before merging", result.statistics.triangles,
                                   result.statistics.triangles_grid);
    runs.film_shots.push_back(std::move(shot));
  }
  runs.film_conditions = {frames[1], frames[3]};
}

}  // namespace

absl::Status RunPaperFilm(const PaperInput& input, PaperRuns& runs) {
  for (const auto& [placement, fill] : kFilmRuns) {
    FilmRun run{.placement = placement, .fill = fill};
    const auto results = Timed(input.film, PaperMethod(placement, fill), run.milliseconds);
    if (!results.ok()) return results.status();
    for (const Result& result : *results) {
      run.triangles.push_back(static_cast<double>(result.statistics.triangles));
      run.ring_digests.push_back(DigestRings(result.rings));
    }
    if (placement == Placement::kVirtualPlane && fill == Fill::kGreedy)
      TakeShots(input.film, *results, runs);
    runs.film.push_back(std::move(run));
    if (const absl::Status status = Advance(input, input.film.frames.size()); !status.ok())
      return status;
  }
  return absl::OkStatus();
}

std::size_t PaperFilmRuns() { return kFilmRuns.size(); }

double FilmRun::MeanTriangles() const {
  return std::accumulate(triangles.begin(), triangles.end(), 0.0) /
         static_cast<double>(triangles.size());
}

double FilmRun::TriangleDeviation() const {
  const double mean = MeanTriangles();
  double sum = 0;
  for (const double count : triangles) sum += (count - mean) * (count - mean);
  return std::sqrt(sum / static_cast<double>(triangles.size()));
}

}  // namespace partiemc::evaluation
