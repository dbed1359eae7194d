#include "evaluation/paper.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numeric>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include "evaluation/random.h"
#include "partiemc/arena.h"
#include "partiemc/reconstructor.h"
#include "partiemc/validate.h"

namespace partiemc::evaluation {
namespace {

constexpr std::size_t kRepetitions = 3;  // Of timed runs: the median of three sheds one hiccup.
constexpr std::array<int, 2> kGrids = {32, 64};
constexpr double kSmallestCell = 0.25, kLargestCell = 4;  // Spacings: what the core takes.
constexpr std::size_t kFilmShots = 4;
constexpr std::uint64_t kSeed = 5'310;  // Of the figures' scenes: of no set.

constexpr std::array<std::pair<Placement, Fill>, 6> kFilmRuns = {{
    {Placement::kMarchingSquares, Fill::kGrid},
    {Placement::kQef, Fill::kGrid},
    {Placement::kFarthestParticle, Fill::kGrid},
    {Placement::kFarthestParticle, Fill::kGreedy},
    {Placement::kVirtualPlane, Fill::kGrid},
    {Placement::kVirtualPlane, Fill::kGreedy},
}};

Method MethodOf(Placement placement, Fill fill = Fill::kGreedy, double cell_size = 1) {
  return {std::string(Name(placement)),
          {.placement = placement, .fill = fill, .cell_size = cell_size}};
}

Sequence OneFrame(const Sequence& sequence, std::size_t frame) {
  Sequence one = sequence;
  one.frames = {sequence.frames[frame]};
  one.motion = nullptr;
  return one;
}

// A random part of the particles, the same ones in all frames.
Sequence Thinned(const Sequence& sequence, double share) {
  Sequence thinned = sequence;
  Random random(kSeed);
  std::vector<std::size_t> order(sequence.frames.front().ParticleCount());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t k = order.size(); k > 1; --k) std::swap(order[k - 1], order[random.Below(k)]);
  order.resize(static_cast<std::size_t>(std::lround(share * static_cast<double>(order.size()))));
  for (SequenceFrame& frame : thinned.frames) {
    const std::vector<double> all = std::exchange(frame.positions, {});
    for (const std::size_t k : order) {
      frame.positions.insert(frame.positions.end(), {all[2 * k], all[2 * k + 1]});
    }
    const auto count = static_cast<double>(order.size());
    frame.volumes.assign(order.size(), static_cast<float>(frame.area / count));
    frame.ids.clear();
    frame.velocities.clear();
  }
  const SequenceFrame& first = thinned.frames.front();
  thinned.spacing = std::sqrt(first.area / static_cast<double>(order.size()));
  return thinned;
}

Shot ShotOf(std::string title, const Sequence& sequence, std::size_t frame, const Result& result) {
  return {.title = std::move(title),
          .spacing = sequence.spacing,
          .particles = sequence.frames[frame].positions,
          .truth = sequence.frames[frame].truth,
          .rings = result.rings};
}

// Side of the bounding square of a closed curve, world units.
double SquareSide(std::span<const double> points) {
  std::array<double, 2> low = {points[0], points[1]}, high = low;
  for (std::size_t k = 0; k < points.size(); ++k) {
    low[k % 2] = std::min(low[k % 2], points[k]);
    high[k % 2] = std::max(high[k % 2], points[k]);
  }
  return std::max(high[0] - low[0], high[1] - low[1]);
}

// Of the ring that encloses most: spray would make the square as large as the scene.
double SquareSide(const Rings& rings) {
  std::size_t largest = 0;
  for (std::size_t k = 1; k < rings.RingCount(); ++k) {
    if (rings.measures[k].area > rings.measures[largest].area) largest = k;
  }
  return rings.RingCount() == 0 ? 1 : SquareSide(rings.RingPoints(largest));
}

// Lattice spacing for so many cells across `side`, within the range that the core takes.
double CellSize(double side, int cells, double spacing) {
  return std::clamp(side / cells / spacing, kSmallestCell, kLargestCell);
}

// Processor time of the calling thread: unlike wall clock, the same on a machine that is shared.
double ThreadMilliseconds() {
  timespec now = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

class PaperRunner {
 public:
  PaperRunner(const Sequence& film, std::span<const std::string_view> shapes,
              const StudyProgress& progress)
      : film_(film), shapes_(shapes), progress_(progress) {}

  absl::StatusOr<PaperRuns> Run() {
    runs_.film_name = film_.name;
    runs_.film_frames = film_.frames.size();
    for (const auto part :
         {&PaperRunner::RunFilm, &PaperRunner::RunFeatures, &PaperRunner::RunThinned,
          &PaperRunner::RunGrids, &PaperRunner::RunFills}) {
      if (const absl::Status status = (this->*part)(); !status.ok()) return status;
    }
    return std::move(runs_);
  }

 private:
  absl::Status Done(std::size_t frames) const {
    return progress_(frames) ? absl::OkStatus() : absl::CancelledError("interrupted");
  }

  absl::Status RunFilm();
  absl::StatusOr<std::vector<Result>> Timed(const Method& method, double& milliseconds) const;
  void TakeFilmShots(const std::vector<Result>& results);
  absl::Status RunFeatures();
  absl::Status RunThinned();
  absl::Status RunGrids();
  absl::Status RunGrid(const Evaluator& frame, Placement placement, int cells, double side,
                       Outline& contour);
  absl::Status RunFills();
  absl::Status RunFill(const Evaluator& scene, int cells);

  const Sequence& film_;
  std::span<const std::string_view> shapes_;
  const StudyProgress& progress_;
  PaperRuns runs_;
};

absl::StatusOr<std::vector<Result>> PaperRunner::Timed(const Method& method,
                                                       double& milliseconds) const {
  ReconstructionParameters parameters = method.parameters;
  parameters.spacing = film_.spacing;
  const auto reconstructor = Reconstructor::Create(parameters);
  if (!reconstructor.ok()) return reconstructor.status();
  std::vector<Result> results(film_.frames.size());
  Workspace workspace;
  std::array<double, kRepetitions> means;
  for (double& mean : means) {
    State state;
    const double begin = ThreadMilliseconds();
    for (std::size_t t = 0; t < results.size(); ++t) {
      const Frame frame{.positions = std::span<const double>(film_.frames[t].positions),
                        .volumes = film_.frames[t].volumes};
      const absl::Status status = reconstructor->Reconstruct(frame, state, workspace, results[t]);
      if (!status.ok()) return status;
    }
    mean = (ThreadMilliseconds() - begin) / static_cast<double>(results.size());
  }
  std::sort(means.begin(), means.end());
  milliseconds = means[kRepetitions / 2];
  return results;
}

absl::Status PaperRunner::RunFilm() {
  for (const auto& [placement, fill] : kFilmRuns) {
    FilmRun run{.placement = placement, .fill = fill};
    const auto results = Timed(MethodOf(placement, fill), run.milliseconds);
    if (!results.ok()) return results.status();
    for (const Result& result : *results) {
      run.triangles.push_back(static_cast<double>(result.statistics.triangles));
      run.ring_digests.push_back(DigestRings(result.rings));
    }
    if (placement == Placement::kVirtualPlane && fill == Fill::kGreedy) TakeFilmShots(*results);
    runs_.film.push_back(std::move(run));
    if (const absl::Status status = Done(film_.frames.size()); !status.ok()) return status;
  }
  return absl::OkStatus();
}

void PaperRunner::TakeFilmShots(const std::vector<Result>& results) {
  std::array<std::size_t, kFilmShots> frames;
  for (std::size_t k = 0; k < kFilmShots; ++k) {
    frames[k] = k * (results.size() - 1) / (kFilmShots - 1);
    const Result& result = results[frames[k]];
    Shot shot = ShotOf(absl::StrFormat("frame %d", frames[k]), film_, frames[k], result);
    shot.mesh = result.mesh;
    shot.truth = {};
    shot.caption = absl::StrFormat("%d triangles, %d before merging", result.statistics.triangles,
                                   result.statistics.triangles_grid);
    runs_.film_shots.push_back(std::move(shot));
  }
  runs_.film_conditions = {frames[1], frames[3]};
}

absl::Status PaperRunner::RunFeatures() {
  const Evaluator scene(
      MakeScene(
          {.name = "star", .shape = "star", .seed = kSeed, .pace = Pace::kDrift, .particles = 700}),
      true);
  for (const Placement placement : kFigurePlacements) {
    const Method method = MethodOf(placement);
    auto row = scene.Run(method, {});
    const auto results = scene.Reconstruct(method, {});
    if (!row.ok() || !results.ok()) return row.ok() ? results.status() : row.status();
    Shot shot = ShotOf(method.name, scene.sequence(), 0, results->front());
    shot.caption = absl::StrFormat("area %+.2f %%, Hausdorff %.2f h",
                                   100 * row->frames[0].area_error, row->frames[0].truth.hausdorff);
    runs_.features.push_back(*std::move(row));
    runs_.feature_shots.push_back(std::move(shot));
    if (const auto status = Done(scene.sequence().frames.size()); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status PaperRunner::RunThinned() {
  const Sequence whole = MakeScene({.name = "ell", .shape = "ell", .seed = kSeed + 1});
  for (const double share : kShares) {
    const Evaluator scene(Thinned(whole, share));
    for (const Placement placement : kFigurePlacements) {
      const Method method = MethodOf(placement);
      auto row = scene.Run(method, {});
      const auto results = scene.Reconstruct(method, {});
      if (!row.ok() || !results.ok()) return row.ok() ? results.status() : row.status();
      const double ratio = scene.sequence().spacing / whole.spacing;
      Shot shot = ShotOf(absl::StrFormat("%s, %.0f %%", method.name, 100 * share), scene.sequence(),
                         0, results->front());
      shot.caption = absl::StrFormat("Hausdorff %.2f h", row->frames[0].truth.hausdorff * ratio);
      runs_.thinned.push_back({share, *std::move(row), ratio});
      runs_.thinned_shots.push_back(std::move(shot));
      if (const auto status = Done(whole.frames.size()); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

absl::Status PaperRunner::RunGrid(const Evaluator& frame, Placement placement, int cells,
                                  double side, Outline& contour) {
  const double spacing = frame.sequence().spacing;
  GridRun run{.placement = placement, .cells = cells};
  run.cell_size = CellSize(side, cells, spacing);
  std::uint64_t digest = 0;
  for (const Fill fill : {Fill::kGrid, Fill::kGreedy}) {
    const auto results = frame.Reconstruct(MethodOf(placement, fill, run.cell_size), {});
    if (!results.ok()) return results.status();
    const Result& result = results->front();
    const auto triangles = static_cast<double>(result.statistics.triangles);
    (fill == Fill::kGrid ? run.grid : run.greedy) = triangles;
    run.area = result.statistics.area;
    run.same_rings = DigestRings(result.rings) == digest;
    digest = DigestRings(result.rings);
    Shot shot = ShotOf(absl::StrFormat("%d x %d, %s", cells, cells, std::string(Name(fill))),
                       frame.sequence(), 0, result);
    shot.mesh = result.mesh;
    shot.particles.clear();
    shot.truth = {};
    shot.caption = absl::StrFormat("%.0f triangles, cell %.2f h", triangles, run.cell_size);
    if (placement == Placement::kVirtualPlane) runs_.grid_shots.push_back(shot);
    if (fill == Fill::kGreedy) {
      contour = OutlineOf(result.rings);
      shot.title = absl::StrFormat("%s, %d x %d", std::string(Name(placement)), cells, cells);
      shot.caption = absl::StrFormat("area %.5g, %d vertices", run.area, result.rings.PointCount());
      shot.particles = frame.sequence().frames[0].positions;
      shot.mesh = {};
      runs_.resolution_shots.push_back(std::move(shot));
    }
  }
  runs_.grids.push_back(run);
  return Done(2);
}

absl::Status PaperRunner::RunGrids() {
  // From the middle back to a frame that is small enough for the coarsest cells of the core.
  std::size_t serial = film_.frames.size();
  double side = 0;
  do {
    serial /= 2;
    const Evaluator candidate(OneFrame(film_, serial));
    const auto usual = candidate.Reconstruct(MethodOf(Placement::kVirtualPlane), {});
    if (!usual.ok()) return usual.status();
    side = SquareSide(usual->front().rings);
  } while (serial > 0 && side > kGrids.front() * kLargestCell * film_.spacing);
  runs_.grid_frame = serial;
  const Evaluator frame(OneFrame(film_, serial));
  std::size_t row = 0;
  for (const Placement placement : {Placement::kFarthestParticle, Placement::kVirtualPlane}) {
    std::array<Outline, kGrids.size()> contours;
    for (std::size_t k = 0; k < kGrids.size(); ++k) {
      const auto status = RunGrid(frame, placement, kGrids[k], side, contours[k]);
      if (!status.ok()) return status;
    }
    const double spacing = film_.spacing;
    runs_.resolution_deviation[row++] =
        Compare(Curve(contours[0], spacing), Curve(contours[1], spacing));
  }
  return absl::OkStatus();
}

absl::Status PaperRunner::RunFill(const Evaluator& scene, int cells) {
  FillRow row{.shape = scene.sequence().shape, .cells = cells, .same_rings = true};
  const Sequence& sequence = scene.sequence();
  std::vector<double> points;
  for (const Point& p : sequence.frames[0].truth.points) points.insert(points.end(), {p.x, p.y});
  const double cell_size = CellSize(SquareSide(points), cells, sequence.spacing);
  const std::array<std::pair<Fill, double FillRow::*>, 4> fills = {{
      {Fill::kGrid, &FillRow::grid},
      {Fill::kGreedy, &FillRow::greedy},
      {Fill::kConforming, &FillRow::conforming},
      {Fill::kPolygon, &FillRow::polygon},
  }};
  std::uint64_t digest = 0;
  for (const auto& [fill, triangles] : fills) {
    const auto results = scene.Reconstruct(MethodOf(Placement::kVirtualPlane, fill, cell_size), {});
    if (!results.ok()) return results.status();
    row.*triangles = static_cast<double>(results->front().statistics.triangles);
    const std::size_t t_junctions = CountTJunctions(results->front());
    if (fill == Fill::kGreedy) row.greedy_t_junctions = t_junctions;
    if (fill == Fill::kConforming) row.conforming_t_junctions = t_junctions;
    const std::uint64_t now = DigestRings(results->front().rings);
    row.same_rings = row.same_rings && (fill == Fill::kGrid || now == digest);
    digest = now;
  }
  runs_.fills.push_back(std::move(row));
  return Done(fills.size());
}

absl::Status PaperRunner::RunFills() {
  for (const std::string_view shape : shapes_) {
    const Sequence scene =
        MakeScene({.name = std::string(shape), .shape = std::string(shape), .seed = kSeed + 2});
    const Evaluator frame(OneFrame(scene, 0));
    for (const int cells : kGrids) {
      if (const auto status = RunFill(frame, cells); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

}  // namespace

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
  return kFilmRuns.size() * film.frames.size() +
         kFigurePlacements.size() * scene_frames * (1 + kShares.size()) + 2 * kGrids.size() * 2 +
         shapes.size() * kGrids.size() * 4;
}

Sequence DefaultFilm() {
  return MakeScene({.name = "merging discs",
                    .group = Group::kTopology,
                    .shape = "discs",
                    .seed = kSeed + 3,
                    .particles = 1500,
                    .frames = 16});
}

absl::StatusOr<PaperRuns> RunPaper(const Sequence& film, std::span<const std::string_view> shapes,
                                   const StudyProgress& progress) {
  absl::StatusOr<PaperRuns> runs;
  Arena(1).Execute([&] { runs = PaperRunner(film, shapes, progress).Run(); });
  return runs;
}

}  // namespace partiemc::evaluation
