#include "evaluation/report/study_tables.h"

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "evaluation/compare.h"

namespace partiemc::evaluation {
namespace {

std::string Told(Knowledge knowledge) {
  switch (knowledge) {
    case Knowledge::kVolumes:
      return "volumes given";
    case Knowledge::kSpacing:
      return "spacing given";
    case Knowledge::kNothing:
      return "nothing given";
  }
  return "";
}

std::string Title(const char* what, const Selection& selection) {
  return absl::StrCat(selection.recordings ? "Recordings: " : "Synthetic sequences: ", what, ", ",
                      Told(selection.knowledge));
}

std::string_view Head(Metric metric) {
  switch (metric) {
    case Metric::kHausdorff:
      return "Hausdorff";
    case Metric::kMeanDeviation:
      return "mean deviation";
    case Metric::kBias:
      return "area bias";
    case Metric::kAreaDeviation:
      return "area deviation";
    case Metric::kHausdorffJitter:
      return "Hausdorff jitter";
    case Metric::kMeanJitter:
      return "mean jitter";
    case Metric::kKnownHausdorffJitter:
      return "Hausdorff jitter, motion known";
    case Metric::kKnownMeanJitter:
      return "mean jitter, motion known";
    default:
      return Name(metric);
  }
}

std::vector<std::string> JudgedHeads(const Selection& selection) {
  std::vector<std::string> heads;
  for (const Metric metric : JudgedMetrics(selection.recordings)) heads.emplace_back(Head(metric));
  return heads;
}

// Calls row(method, its rows) for every method that has rows.
template <typename EachMethod>
void ForMethods(const Study& study, const Selection& selection, EachMethod row) {
  for (const StudyMethod& method : study.methods) {
    if (method.is_step) continue;
    const auto rows = study.Of(method.method.name, selection.knowledge, selection.recordings);
    if (!rows.empty()) row(method.method.name, rows);
  }
}

Cell RatioCell(double ratio, double alert_above) { return {Fixed(ratio, 3), ratio > alert_above}; }

}  // namespace

Table MeansTable(const Study& study, const Selection& selection) {
  Table table{Title("means", selection),
              "Lengths in spacings, areas relative; over the judged sequences.",
              JudgedHeads(selection),
              {}};
  table.heads.push_back("signed area error");
  if (selection.recordings) table.heads.push_back("share with known motion");
  ForMethods(study, selection, [&](const std::string& name, std::span<const Row> rows) {
    TableRow& row = table.rows.emplace_back(TableRow{name, {}});
    for (const Metric metric : JudgedMetrics(selection.recordings)) {
      row.cells.push_back({Fixed(MeanOver(rows, metric), 5)});
    }
    row.cells.push_back({Fixed(MeanOver(rows, Metric::kAreaError), 5)});
    if (selection.recordings) row.cells.push_back({Fixed(MeanOver(rows, Metric::kKnownShare), 3)});
  });
  return table;
}

Table OtherMeansTable(const Study& study, const Selection& selection) {
  struct Column {
    const char* head;
    Metric metric;
    int digits;
    bool defect;
  };
  constexpr Column kColumns[] = {
      {"centres: Hausdorff", Metric::kCenterHausdorff, 4, false},
      {"mean", Metric::kCenterMean, 4, false},
      {"triangles", Metric::kTriangles, 0, false},
      {"std of triangles", Metric::kTriangleDeviation, 1, false},
      {"vertices", Metric::kVertices, 0, false},
      {"crossings", Metric::kSelfIntersections, 2, true},
      {"folds", Metric::kFolds, 2, true},
      {"spurious", Metric::kSpuriousComponents, 3, true},
      {"components off", Metric::kComponentError, 3, false},
      {"holes off", Metric::kHoleError, 3, false},
      {"wrong normals", Metric::kWrongNormals, 4, false},
  };
  Table table{Title("counts, defects and the second reference", selection),
              "Per frame; defects are marked.",
              {},
              {}};
  for (const Column& column : kColumns) table.heads.push_back(column.head);
  ForMethods(study, selection, [&](const std::string& name, std::span<const Row> rows) {
    TableRow& row = table.rows.emplace_back(TableRow{name, {}});
    for (const Column& column : kColumns) {
      const double mean = MeanOver(rows, column.metric);
      row.cells.push_back({Fixed(mean, column.digits), column.defect && mean > 0});
    }
  });
  return table;
}

Table StageTable(const Study& study, const Selection& selection) {
  Table table{Title("milliseconds by stage", selection),
              "Per frame, one thread, wall clock while other sequences ran beside it.",
              {},
              {}};
  for (const std::string_view stage : kStageNames) table.heads.emplace_back(stage);
  table.heads.push_back("all");
  ForMethods(study, selection, [&](const std::string& name, std::span<const Row> rows) {
    std::array<double, kStageCount + 1> sums = {};
    double frames = 0;
    for (const Row& row : rows) {
      if (!row.judged) continue;
      for (const FrameNumbers& frame : row.frames) {
        for (std::size_t k = 0; k < kStageCount; ++k) {
          sums[k] += frame.stage_ms[k];
          sums[kStageCount] += frame.stage_ms[k];
        }
      }
      frames += static_cast<double>(row.frames.size());
    }
    TableRow& line = table.rows.emplace_back(TableRow{name, {}});
    for (const double sum : sums) line.cells.push_back({Fixed(sum / frames, 3)});
  });
  return table;
}

Table RatioTable(const Study& study, const Selection& selection) {
  Table table{Title("ratios of means to marching squares", selection),
              "Below 1 is better. 95 % bootstrap interval; sequences won / tied (1 %) / lost.",
              JudgedHeads(selection),
              {}};
  const auto baseline = study.Of(kBaseline, selection.knowledge, selection.recordings);
  ForMethods(study, selection, [&](const std::string& name, std::span<const Row> rows) {
    if (name == kBaseline) return;
    TableRow ratio{name, {}}, interval{"95 % interval", {}, true};
    TableRow verdicts{"won / tied / lost", {}, true};
    for (const Metric metric : JudgedMetrics(selection.recordings)) {
      const Comparison comparison = CompareRows(rows, baseline, metric);
      ratio.cells.push_back(RatioCell(comparison.ratio.value, 1));
      const bool absent = std::isnan(comparison.ratio.value);
      interval.cells.push_back({absent ? "-"
                                       : absl::StrCat(Fixed(comparison.ratio.low, 3), "..",
                                                      Fixed(comparison.ratio.high, 3))});
      const Verdict& verdict = comparison.verdict;
      verdicts.cells.push_back(
          {absent ? "-" : absl::StrCat(verdict.wins, "/", verdict.ties, "/", verdict.losses)});
    }
    for (TableRow* row : {&ratio, &interval, &verdicts}) table.rows.push_back(std::move(*row));
  });
  return table;
}

Table StepTable(const Study& study, const Selection& selection) {
  Table table{Title("ratios of virtual-plane with a step switched off", selection),
              "To marching squares; marked where the method is better without the step by 1 %.",
              JudgedHeads(selection),
              {}};
  const auto baseline = study.Of(kBaseline, selection.knowledge, selection.recordings);
  const std::string whole(Name(Placement::kVirtualPlane));
  const auto whole_rows = study.Of(whole, selection.knowledge, selection.recordings);
  const auto ratio = [&](std::span<const Row> rows, Metric metric) {
    return RatioOfMeans(MatchPairs(rows, baseline, metric));
  };
  for (const StudyMethod& method : study.methods) {
    const std::string& name = method.method.name;
    const auto rows = study.Of(name, selection.knowledge, selection.recordings);
    if ((!method.is_step && name != whole) || rows.empty()) continue;
    TableRow& row = table.rows.emplace_back(TableRow{name, {}});
    for (const Metric metric : JudgedMetrics(selection.recordings)) {
      const double without = ratio(rows, metric);
      row.cells.push_back(
          {Fixed(without, 3), without < (1 - kTieShare) * ratio(whole_rows, metric)});
    }
  }
  if (table.rows.size() < 2) table.rows.clear();
  return table;
}

Table GroupTable(const Study& study, const Selection& selection, std::string_view method) {
  Table table{Title("ratios by group", selection) + ", " + std::string(method),
              "A group that loses more than 5 % is marked.",
              JudgedHeads(selection),
              {}};
  const auto rows = study.Of(method, selection.knowledge, selection.recordings);
  const auto baseline = study.Of(kBaseline, selection.knowledge, selection.recordings);
  std::vector<Comparison> comparisons;
  for (const Metric metric : JudgedMetrics(selection.recordings)) {
    comparisons.push_back(CompareRows(rows, baseline, metric));
  }
  for (std::size_t k = 0; k < kGroupCount; ++k) {
    const auto group = static_cast<Group>(k);
    if (MatchPairs(rows, baseline, Metric::kAreaError, group).empty()) continue;
    TableRow& row = table.rows.emplace_back(TableRow{std::string(Name(group)), {}});
    for (const Comparison& comparison : comparisons) {
      row.cells.push_back(RatioCell(comparison.group_ratios[k], kGroupLossRatio));
    }
  }
  return table;
}

Table SequenceTable(const Study& study, const Selection& selection, std::string_view method) {
  Table table{Title("ratios by sequence", selection) + ", " + std::string(method),
              "More than 5 % lost is marked.",
              JudgedHeads(selection),
              {}};
  const auto rows = study.Of(method, selection.knowledge, selection.recordings);
  if (selection.recordings) table.heads.push_back("share with known motion");
  const auto baseline = study.Of(kBaseline, selection.knowledge, selection.recordings);
  for (const Row& row : rows) {
    TableRow& line = table.rows.emplace_back(TableRow{row.sequence, {}});
    for (const Metric metric : JudgedMetrics(selection.recordings)) {
      const auto pairs = MatchPairs(std::span(&row, 1), baseline, metric);
      line.cells.push_back(RatioCell(RatioOfMeans(pairs), kGroupLossRatio));
    }
    if (selection.recordings) line.cells.push_back({Fixed(row[Metric::kKnownShare], 3)});
  }
  return table;
}

Table FillTable(std::span<const FillRow> fills) {
  Table table{
      "Triangles by fill, virtual-plane",
      "One frame of about 1,000 particles; N cells across the shape's bounding square.",
      {"grid", "greedy", "conforming", "polygon", "greedy saves", "conforming saves",
       "polygon saves", "conforming / greedy", "T-junctions of greedy", "of conforming", "rings"},
      {}};
  const auto percent = [](double part, double whole) {
    return Cell{absl::StrFormat("%.1f %%", 100 * (1 - part / whole))};
  };
  for (const int cells : {32, 64}) {
    double grid = 0, greedy = 0, conforming = 0, polygon = 0, count = 0;
    for (const FillRow& fill : fills) {
      if (fill.cells != cells) continue;
      table.rows.push_back({absl::StrFormat("%s, %d x %d", fill.shape, cells, cells),
                            {{Fixed(fill.grid, 0)},
                             {Fixed(fill.greedy, 0)},
                             {Fixed(fill.conforming, 0)},
                             {Fixed(fill.polygon, 0)},
                             percent(fill.greedy, fill.grid),
                             percent(fill.conforming, fill.grid),
                             percent(fill.polygon, fill.grid),
                             {Fixed(fill.conforming / fill.greedy, 2)},
                             {Fixed(static_cast<double>(fill.greedy_t_junctions), 0)},
                             {Fixed(static_cast<double>(fill.conforming_t_junctions), 0),
                              fill.conforming_t_junctions > 0},
                             {fill.same_rings ? "equal" : "differ", !fill.same_rings}}});
      grid += 1;
      greedy += fill.greedy / fill.grid;
      conforming += fill.conforming / fill.grid;
      polygon += fill.polygon / fill.grid;
      count += 1;
    }
    if (count == 0) continue;
    table.rows.push_back({absl::StrFormat("mean, %d x %d", cells, cells),
                          {{""},
                           {""},
                           {""},
                           {""},
                           percent(greedy, grid),
                           percent(conforming, grid),
                           percent(polygon, grid),
                           {Fixed(conforming / greedy, 2)},
                           {""},
                           {""},
                           {""}}});
  }
  return table;
}

}  // namespace partiemc::evaluation
