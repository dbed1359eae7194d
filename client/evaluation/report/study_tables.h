// What a study found, as tables.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "client/evaluation/metrics/compare.h"
#include "client/evaluation/metrics/study.h"
#include "client/evaluation/paper/paper.h"
#include "client/evaluation/report/table.h"

namespace partiemc::evaluation {

/// The metrics that methods are judged by, in the order of the tables: of scenes against the truth,
/// of recordings what is known of each, beside all jitter that where the motion is known.
inline constexpr std::array kSceneMetrics = {
    Metric::kHausdorff,     Metric::kMeanDeviation,   Metric::kBias,
    Metric::kAreaDeviation, Metric::kHausdorffJitter, Metric::kMeanJitter};
inline constexpr std::array kRecordingMetrics = {
    Metric::kMeanDeviation,   Metric::kAreaErrorSize, Metric::kAreaDeviation,
    Metric::kHausdorffJitter, Metric::kMeanJitter,    Metric::kKnownHausdorffJitter,
    Metric::kKnownMeanJitter, Metric::kWallRoughness};
inline constexpr std::span<const Metric> JudgedMetrics(bool recordings) {
  return recordings ? std::span<const Metric>(kRecordingMetrics) : kSceneMetrics;
}

/// Which of JudgedMetrics() says what is worst: mean deviation of scenes, mean jitter where the
/// motion is known of recordings.
inline constexpr std::size_t WorstBy(bool recordings) { return recordings ? 6 : 1; }

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

/// Geometric means of the ratios to the baseline, with interval, ratio of means and win/tie/loss. A
/// ratio above 1 is an alert.
Table RatioTable(const Study& study, const Selection& selection);

/// What each step of `virtual-plane` is worth: its ratios to the baseline, and those with a step
/// switched off in turn. Without rows if the study has no such methods.
Table StepTable(const Study& study, const Selection& selection);

/// Geometric means of one method's ratios by group or sampler, with intervals, or the ratios of its
/// sequences; worst first, all of them together last. A ratio above 1 is an alert.
Table PartTable(const Study& study, const Selection& selection, std::string_view method, By by);

/// The sequences of one method with a ratio above kLossRatio in any metric but the area bias, worst
/// first; their other ratios stay empty.
Table LossTable(const Study& study, const Selection& selection, std::string_view method);

/// Mean deviation of one method by sequence beside the baseline's, in spacings, worst first: what
/// the set of discs is for.
Table DeviationTable(const Study& study, const Selection& selection, std::string_view method);

/// What one method is worth where, worst first: by group, by sampler and the losses; of recordings
/// by sequence; by sequence and sampler where all sequences are of one group.
std::vector<Table> DetailTables(const Study& study, const Selection& selection,
                                std::string_view method);

/// Distances of nearest neighbours, mean and standard deviation over the particles of a frame: by
/// sampler the mean over its frames, by recording of its first, middle and last frame.
Table NeighbourTable(const Study& study);

/// The paper's Tables 1 to 4, its figures beside ours.
std::vector<Table> PaperTables(const Study& study, const PaperRuns& runs);

/// Triangles by fill, and what each saves, at both grids.
Table FillTable(std::span<const FillRow> fills);

}  // namespace partiemc::evaluation
