#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "client/evaluation/paper/paper_parts.h"
#include "partiemc/validate.h"

namespace partiemc::evaluation {
namespace {

constexpr double kSmallestCell = 0.25, kLargestCell = 4;  // Spacings: what the core takes.

// A sequence of one frame of another, without its motion.
Sequence OneFrame(const Sequence& sequence, std::size_t frame) {
  Sequence one = sequence;
  one.frames = {sequence.frames[frame]};
  one.motion = nullptr;
  return one;
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

absl::Status RunGrid(const PaperInput& input, const Evaluator& frame, Placement placement,
                     int cells, double side, Outline& contour, PaperRuns& runs) {
  const double spacing = frame.sequence().spacing;
  GridRun run{.placement = placement, .cells = cells};
  run.cell_size = CellSize(side, cells, spacing);
  std::uint64_t digest = 0;
  for (const Fill fill : {Fill::kGrid, Fill::kGreedy}) {
    const auto results = frame.Reconstruct(PaperMethod(placement, fill, run.cell_size), {});
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
    if (placement == Placement::kVirtualPlane) runs.grid_shots.push_back(shot);
    if (fill == Fill::kGreedy) {
      contour = OutlineOf(result.rings);
      shot.title = absl::StrFormat("%s, %d x %d", std::string(Name(placement)), cells, cells);
      shot.caption = absl::StrFormat("area %.5g, %d vertices", run.area, result.rings.PointCount());
      shot.particles = frame.sequence().frames[0].positions;
      shot.mesh = {};
      runs.resolution_shots.push_back(std::move(shot));
    }
  }
  runs.grids.push_back(run);
  return Advance(input, 2);
}

absl::Status RunFill(const PaperInput& input, const Evaluator& scene, int cells, PaperRuns& runs) {
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
    const auto results =
        scene.Reconstruct(PaperMethod(Placement::kVirtualPlane, fill, cell_size), {});
    if (!results.ok()) return results.status();
    row.*triangles = static_cast<double>(results->front().statistics.triangles);
    const std::size_t t_junctions = CountTJunctions(results->front());
    if (fill == Fill::kGreedy) row.greedy_t_junctions = t_junctions;
    if (fill == Fill::kConforming) row.conforming_t_junctions = t_junctions;
    const std::uint64_t now = DigestRings(results->front().rings);
    row.same_rings = row.same_rings && (fill == Fill::kGrid || now == digest);
    digest = now;
  }
  runs.fills.push_back(std::move(row));
  return Advance(input, fills.size());
}

}  // namespace

absl::Status RunPaperGrids(const PaperInput& input, PaperRuns& runs) {
  // From the middle back to a frame that is small enough for the coarsest cells of the core.
  std::size_t serial = input.film.frames.size();
  double side = 0;
  do {
    serial /= 2;
    const Evaluator candidate(OneFrame(input.film, serial));
    const auto usual = candidate.Reconstruct(PaperMethod(Placement::kVirtualPlane), {});
    if (!usual.ok()) return usual.status();
    side = SquareSide(usual->front().rings);
  } while (serial > 0 && side > kPaperGrids.front() * kLargestCell * input.film.spacing);
  runs.grid_frame = serial;
  const Evaluator frame(OneFrame(input.film, serial));
  std::size_t row = 0;
  for (const Placement placement : {Placement::kFarthestParticle, Placement::kVirtualPlane}) {
    std::array<Outline, kPaperGrids.size()> contours;
    for (std::size_t k = 0; k < kPaperGrids.size(); ++k) {
      const auto status = RunGrid(input, frame, placement, kPaperGrids[k], side, contours[k], runs);
      if (!status.ok()) return status;
    }
    const double spacing = input.film.spacing;
    runs.resolution_deviation[row++] =
        Compare(Curve(contours[0], spacing), Curve(contours[1], spacing));
  }
  return absl::OkStatus();
}

absl::Status RunPaperFills(const PaperInput& input, PaperRuns& runs) {
  for (const std::string_view shape : input.shapes) {
    const Sequence scene = MakeScene(
        {.name = std::string(shape), .shape = std::string(shape), .seed = kPaperSeed + 2});
    const Evaluator frame(OneFrame(scene, 0));
    for (const int cells : kPaperGrids) {
      if (const auto status = RunFill(input, frame, cells, runs); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

}  // namespace partiemc::evaluation
