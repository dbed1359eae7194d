// What a study found, as tables.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "evaluation/paper.h"
#include "evaluation/report/table.h"
#include "evaluation/study.h"

namespace partiemc::evaluation {

/// The metrics that methods are judged by, in the order of the tables: of scenes against the truth,
/// of recordings, which have none, beside all jitter that where the motion is known.
inline constexpr std::array<Metric, 6> kSceneMetrics = {
    Metric::kHausdorff,     Metric::kMeanDeviation,   Metric::kBias,
    Metric::kAreaDeviation, Metric::kHausdorffJitter, Metric::kMeanJitter};
inline constexpr std::array<Metric, 6> kRecordingMetrics = {
    Metric::kBias,       Metric::kAreaDeviation,        Metric::kHausdorffJitter,
    Metric::kMeanJitter, Metric::kKnownHausdorffJitter, Metric::kKnownMeanJitter};
inline constexpr const std::array<Metric, 6>& JudgedMetrics(bool recordings) {
  return recordings ? kRecordingMetrics : kSceneMetrics;
}

/// Which rows of a study a table is about. Methods of a step have StepTable only.
struct Selection {
  Knowledge knowledge = Knowledge::kSpacing;
  bool recordings = false;
};

/// Means of the judged metrics over the judged sequences, a row per method.
Table MeansTable(const Study& study, const Selection& selection);

/// Means of everything else: centres, triangles, defects, milliseconds.
Table OtherMeansTable(const Study& study, const Selection& selection);

/// Milliseconds by stage, wall clock, mean over the frames of the judged sequences.
Table StageTable(const Study& study, const Selection& selection);

/// Ratios of means to the baseline, with interval and win/tie/loss. A ratio above 1 is an alert.
Table RatioTable(const Study& study, const Selection& selection);

/// What each step of `virtual-plane` is worth: its ratios to the baseline, and those with a step
/// switched off in turn. Without rows if the study has no such methods.
Table StepTable(const Study& study, const Selection& selection);

/// Ratios of one method by group; more than 5 % lost is an alert.
Table GroupTable(const Study& study, const Selection& selection, std::string_view method);

/// Ratios of one method by sequence: for recordings, of which there are few.
Table SequenceTable(const Study& study, const Selection& selection, std::string_view method);

/// The paper's Tables 1 to 4, its figures beside ours.
std::vector<Table> PaperTables(const Study& study, const PaperRuns& runs);

/// Triangles by fill, and what each saves, at both grids.
Table FillTable(std::span<const FillRow> fills);

}  // namespace partiemc::evaluation
