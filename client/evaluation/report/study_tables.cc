#include "client/evaluation/report/study_tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

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
    case Metric::kAreaErrorSize:
      return "area error";
    case Metric::kWallRoughness:
      return "wall roughness";
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

Cell IntervalCell(const Ratio& ratio) {
  if (std::isnan(ratio.value)) return {"-"};
  return {absl::StrCat(Fixed(ratio.low, 3), "..", Fixed(ratio.high, 3))};
}

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
  Table table{Title("geometric means of ratios to marching squares", selection),
              "Every sequence counts alike; below 1 is better. 95 % bootstrap interval; ratio of "
              "the means; sequences won / tied (1 %) / lost.",
              JudgedHeads(selection),
              {}};
  const auto baseline = study.Of(kBaseline, selection.knowledge, selection.recordings);
  ForMethods(study, selection, [&](const std::string& name, std::span<const Row> rows) {
    if (name == kBaseline) return;
    TableRow ratio{name, {}}, interval{"95 % interval", {}, true};
    TableRow means{"ratio of means", {}, true}, verdicts{"won / tied / lost", {}, true};
    for (const Metric metric : JudgedMetrics(selection.recordings)) {
      const Comparison comparison = CompareRows(rows, baseline, metric);
      const Verdict& verdict = comparison.verdict;
      ratio.cells.push_back(RatioCell(comparison.ratio.value, 1));
      interval.cells.push_back(IntervalCell(comparison.ratio));
      means.cells.push_back({Fixed(comparison.ratio_of_means, 3)});
      verdicts.cells.push_back(
          {std::isnan(comparison.ratio.value)
               ? "-"
               : absl::StrCat(verdict.wins, "/", verdict.ties, "/", verdict.losses)});
    }
    for (TableRow* row : {&ratio, &interval, &means, &verdicts}) {
      table.rows.push_back(std::move(*row));
    }
  });
  return table;
}

Table StepTable(const Study& study, const Selection& selection) {
  Table table{Title("geometric means of virtual-plane with a step switched off", selection),
              "To marching squares; marked where the method is better without the step by 1 %.",
              JudgedHeads(selection),
              {}};
  const auto baseline = study.Of(kBaseline, selection.knowledge, selection.recordings);
  const std::string whole(Name(Placement::kVirtualPlane));
  const auto whole_rows = study.Of(whole, selection.knowledge, selection.recordings);
  const auto ratio = [&](std::span<const Row> rows, Metric metric) {
    return GeometricMean(MatchPairs(rows, baseline, metric));
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

Table PartTable(const Study& study, const Selection& selection, std::string_view method, By by) {
  constexpr const char* kWhat[] = {"geometric means by group", "geometric means by sampler",
                                   "ratios by sequence"};
  const auto metrics = JudgedMetrics(selection.recordings);
  const std::size_t worst_by = WorstBy(selection.recordings);
  Table table{Title(kWhat[static_cast<int>(by)], selection) + ", " + std::string(method),
              absl::StrCat("To marching squares; worst first by ",
                           std::string(Head(metrics[worst_by])), ". Above 1 is marked."),
              JudgedHeads(selection),
              {}};
  table.heads.push_back("sequences");
  const auto rows = study.Of(method, selection.knowledge, selection.recordings);
  const auto baseline = study.Of(kBaseline, selection.knowledge, selection.recordings);
  std::vector<Part> parts = CompareParts(rows, baseline, metrics, worst_by, by);
  Part all{"all", 0, {}};
  for (const Part& part : parts) all.sequences += part.sequences;
  for (const Metric metric : metrics)
    all.ratios.push_back(CompareRows(rows, baseline, metric).ratio);
  parts.push_back(std::move(all));
  for (const Part& part : parts) {
    TableRow ratios{part.name, {}}, intervals{"95 % interval", {}, true};
    for (const Ratio& ratio : part.ratios) {
      ratios.cells.push_back(RatioCell(ratio.value, 1));
      intervals.cells.push_back(IntervalCell(ratio));
    }
    ratios.cells.push_back({absl::StrCat(part.sequences)});
    intervals.cells.push_back({""});
    table.rows.push_back(std::move(ratios));
    if (part.sequences > 1) table.rows.push_back(std::move(intervals));
  }
  return table;
}

Table LossTable(const Study& study, const Selection& selection, std::string_view method) {
  Table table{Title("sequences above 1.25", selection) + ", " + std::string(method),
              "Ratios to marching squares; below 1.25 empty. Worst first.",
              {},
              {}};
  std::vector<Metric> metrics;
  for (const Metric metric : JudgedMetrics(selection.recordings)) {
    if (metric == Metric::kBias) continue;
    metrics.push_back(metric);
    table.heads.emplace_back(Head(metric));
  }
  const auto rows = study.Of(method, selection.knowledge, selection.recordings);
  const auto baseline = study.Of(kBaseline, selection.knowledge, selection.recordings);
  struct Loss {
    double worst;
    TableRow row;
  };
  std::vector<Loss> losses;
  for (const Part& part : CompareParts(rows, baseline, metrics, 0, By::kSequence)) {
    Loss loss{0, {part.name, {}}};
    for (const Ratio& ratio : part.ratios) {
      const bool lost = ratio.value > kLossRatio;
      if (lost) loss.worst = std::max(loss.worst, ratio.value);
      loss.row.cells.push_back({lost ? Fixed(ratio.value, 2) : ""});
    }
    if (loss.worst > 0) losses.push_back(std::move(loss));
  }
  std::ranges::stable_sort(losses, std::ranges::greater(), &Loss::worst);
  for (Loss& loss : losses) table.rows.push_back(std::move(loss.row));
  return table;
}

Table DeviationTable(const Study& study, const Selection& selection, std::string_view method) {
  Table table{Title("mean deviation by sequence", selection) + ", " + std::string(method),
              "In spacings; worst first. A ratio above 1 is marked.",
              {std::string(method), std::string(kBaseline), "ratio"},
              {}};
  const auto rows = study.Of(method, selection.knowledge, selection.recordings);
  const auto baseline = study.Of(kBaseline, selection.knowledge, selection.recordings);
  constexpr std::array kMetric = {Metric::kMeanDeviation};
  const auto add = [&](const std::string& name, std::span<const Row> of, double ratio) {
    const std::vector<Pair> pairs = MatchPairs(of, baseline, kMetric[0]);
    Pair means;
    for (const Pair& pair : pairs) {
      means.method += pair.method / static_cast<double>(pairs.size());
      means.baseline += pair.baseline / static_cast<double>(pairs.size());
    }
    table.rows.push_back(
        {name, {{Fixed(means.method, 4)}, {Fixed(means.baseline, 4)}, RatioCell(ratio, 1)}});
  };
  for (const Part& part : CompareParts(rows, baseline, kMetric, 0, By::kSequence)) {
    const auto row = std::ranges::find(rows, part.name, &Row::sequence);
    add(part.name, std::span(&*row, 1), part.ratios[0].value);
  }
  add("mean (ratio: geometric)", rows, CompareRows(rows, baseline, kMetric[0]).ratio.value);
  return table;
}

std::vector<Table> DetailTables(const Study& study, const Selection& selection,
                                std::string_view method) {
  if (selection.recordings) return {PartTable(study, selection, method, By::kSequence)};
  std::vector<Table> tables;
  const auto rows = study.Of(method, selection.knowledge, false);
  const bool one_group =
      std::ranges::all_of(rows, [&](const Row& row) { return row.group == rows.front().group; });
  tables.push_back(one_group ? DeviationTable(study, selection, method)
                             : PartTable(study, selection, method, By::kGroup));
  tables.push_back(PartTable(study, selection, method, By::kSampler));
  tables.push_back(LossTable(study, selection, method));
  return tables;
}

Table NeighbourTable(const Study& study) {
  Table table{"Nearest neighbours",
              "In spacings, those beyond two left out. Samplers: mean over all frames; recordings: "
              "of one frame.",
              {"mean", "standard deviation"},
              {}};
  const auto add = [&](std::string name, const NeighbourDistances& distances) {
    table.rows.push_back(
        {std::move(name), {{Fixed(distances.mean, 3)}, {Fixed(distances.deviation, 3)}}});
  };
  struct Sum {
    std::string sampler;
    NeighbourDistances total;
    double frames = 0;
  };
  std::vector<Sum> sums;
  for (const Row& row : study.Of(kBaseline, study.told.front(), false)) {
    auto sum = std::ranges::find(sums, row.sampler, &Sum::sampler);
    if (sum == sums.end()) sum = sums.insert(sum, {row.sampler, {}, 0});
    for (const FrameNumbers& frame : row.frames) {
      sum->total.mean += frame.neighbours.mean;
      sum->total.deviation += frame.neighbours.deviation;
      sum->frames += 1;
    }
  }
  for (const Sum& sum : sums) {
    add(sum.sampler, {sum.total.mean / sum.frames, sum.total.deviation / sum.frames});
  }
  for (const Row& row : study.Of(kBaseline, study.told.front(), true)) {
    const std::size_t last = row.frames.size() - 1;
    for (const auto& [when, frame] :
         {std::pair{"first", std::size_t{0}}, {"middle", last / 2}, {"last", last}}) {
      add(absl::StrCat(row.sequence, ", ", when, " frame"), row.frames[frame].neighbours);
    }
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
