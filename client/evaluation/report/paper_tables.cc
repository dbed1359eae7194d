// The paper's Tables 1 to 4 beside ours.
#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/evaluation/paper/claims.h"
#include "client/evaluation/report/study_tables.h"

namespace partiemc::evaluation {
namespace {

// A row of the paper, or one of ours that the paper does not have.
struct Line {
  std::string name;
  const PaperRow* paper;
  Placement placement;
  Fill fill;
};

std::vector<Line> Lines(const std::vector<PaperRow>& paper) {
  std::vector<Line> lines;
  for (const PaperRow& row : paper) {
    lines.push_back({absl::StrFormat("%s: %s, %s", std::string(row.method),
                                     std::string(Name(row.placement)), std::string(Name(row.fill))),
                     &row, row.placement, row.fill});
  }
  for (const Fill fill : {Fill::kGrid, Fill::kGreedy}) {
    lines.push_back({absl::StrFormat("our default: virtual-plane, %s", std::string(Name(fill))),
                     nullptr, Placement::kVirtualPlane, fill});
  }
  return lines;
}

Cell PaperCell(const Line& line, double PaperRow::*field, int digits) {
  return {line.paper == nullptr ? "-" : Fixed(line.paper->*field, digits)};
}

Cell Percent(double part, double whole) {
  return {absl::StrFormat("%.1f %%", 100 * (1 - part / whole))};
}

Table MergingTable(const PaperRuns& runs) {
  Table table{
      "Table 1: triangles before and after greedy merging",
      absl::StrCat("Measured: two frames of ", runs.film_name, ", virtual-plane."),
      {"paper: not applied", "applied", "fewer", "measured: not applied", "applied", "fewer"},
      {}};
  const FilmRun& grid = runs.FilmOf(Placement::kVirtualPlane, Fill::kGrid);
  const FilmRun& greedy = runs.FilmOf(Placement::kVirtualPlane, Fill::kGreedy);
  for (std::size_t k = 0; k < 2; ++k) {
    const PaperCondition& paper = kPaperConditions[k];
    const std::size_t t = runs.film_conditions[k];
    table.rows.push_back(
        {absl::StrFormat("Figure 12 (%s), our frame %d", k == 0 ? "left" : "right", t),
         {{Fixed(paper.before, 0)},
          {Fixed(paper.after, 0)},
          Percent(paper.after, paper.before),
          {Fixed(grid.triangles[t], 0)},
          {Fixed(greedy.triangles[t], 0)},
          Percent(greedy.triangles[t], grid.triangles[t])}});
  }
  return table;
}

Table EfficiencyTable(const PaperRuns& runs, const std::vector<Line>& lines) {
  Table table{"Table 2: efficiency",
              absl::StrCat("Measured: all frames of ", runs.film_name,
                           ", processor time of one thread. The paper's times hold its browser and "
                           "drawing: compare the ratios."),
              {"paper: ms", "fps", "triangles", "/ MS", "measured: ms", "fps", "triangles", "/ MS"},
              {}};
  const double paper_squares = lines.front().paper->frame_ms;
  const double squares = runs.FilmOf(Placement::kMarchingSquares, Fill::kGrid).milliseconds;
  for (const Line& line : lines) {
    const FilmRun& run = runs.FilmOf(line.placement, line.fill);
    table.rows.push_back(
        {line.name,
         {PaperCell(line, &PaperRow::frame_ms, 1),
          PaperCell(line, &PaperRow::fps, 1),
          PaperCell(line, &PaperRow::triangles, 0),
          {line.paper == nullptr ? "-" : Fixed(line.paper->frame_ms / paper_squares, 2)},
          {Fixed(run.milliseconds, 3)},
          {Fixed(1000 / run.milliseconds, 0)},
          {Fixed(run.MeanTriangles(), 0)},
          {Fixed(run.milliseconds / squares, 2)}}});
  }
  return table;
}

Table AccuracyTable(const Study& study, const std::vector<Line>& lines) {
  Table table{"Table 3: boundary accuracy",
              "Measured: means over the synthetic sequences, in spacings; the paper names no unit, "
              "so compare the ratios to marching squares in brackets.",
              {"paper: Hausdorff", "mean", "true boundary: Hausdorff", "mean",
               "outermost centres: Hausdorff", "mean"},
              {}};
  const auto mean = [&](Placement placement, Metric metric) {
    return MeanOver(study.Of(Name(placement), study.told.front(), false), metric);
  };
  const auto with_ratio = [](double value, double squares, int digits) {
    return Cell{absl::StrFormat("%s (%s)", Fixed(value, digits), Fixed(value / squares, 2))};
  };
  const PaperRow& squares = *lines.front().paper;
  for (const Line& line : lines) {
    TableRow& row = table.rows.emplace_back(TableRow{line.name, {}});
    for (double PaperRow::*field : {&PaperRow::hausdorff, &PaperRow::mean_deviation}) {
      row.cells.push_back(
          line.paper == nullptr ? Cell{"-"} : with_ratio(line.paper->*field, squares.*field, 3));
    }
    for (const Metric metric : {Metric::kHausdorff, Metric::kMeanDeviation,
                                Metric::kCenterHausdorff, Metric::kCenterMean}) {
      row.cells.push_back(
          with_ratio(mean(line.placement, metric), mean(Placement::kMarchingSquares, metric), 4));
    }
  }
  return table;
}

Table StabilityTable(const Study& study, const PaperRuns& runs, const std::vector<Line>& lines) {
  Table table{"Table 4: stability over time",
              absl::StrCat("Measured: area deviation (Eq. 30) over the synthetic sequences, where "
                           "the true area is known",
                           study.HasRecordings() ? ", and over the recordings" : "",
                           "; triangles over the frames of ", runs.film_name, "."),
              {"paper: area deviation", "std of triangles", "measured: area deviation"},
              {}};
  if (study.HasRecordings()) table.heads.push_back("recordings");
  table.heads.push_back("std of triangles");
  for (const Line& line : lines) {
    TableRow& row = table.rows.emplace_back(TableRow{line.name, {}});
    row.cells = {PaperCell(line, &PaperRow::area_deviation, 3),
                 PaperCell(line, &PaperRow::triangle_deviation, 1)};
    for (const bool recordings : {false, true}) {
      if (recordings && !study.HasRecordings()) continue;
      const auto rows = study.Of(Name(line.placement), study.told.front(), recordings);
      row.cells.push_back({Fixed(MeanOver(rows, Metric::kAreaDeviation), 5)});
    }
    const FilmRun& run = runs.FilmOf(line.placement, line.fill);
    row.cells.push_back({Fixed(run.TriangleDeviation(), 1)});
  }
  return table;
}

}  // namespace

std::vector<Table> PaperTables(const Study& study, const PaperRuns& runs) {
  const std::vector<PaperRow> paper = PaperRows();
  const std::vector<Line> lines = Lines(paper);
  return {MergingTable(runs), EfficiencyTable(runs, lines), AccuracyTable(study, lines),
          StabilityTable(study, runs, lines)};
}

}  // namespace partiemc::evaluation
