// All methods over all sequences: the rows that tables are made of.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/evaluation/metrics/run.h"
#include "client/evaluation/scenes/scenes.h"
#include "client/evaluation/scenes/sequence.h"

namespace partiemc::evaluation {

/// What every ratio is relative to: the first of StudyMethods().
inline constexpr std::string_view kBaseline = "marching-squares";

/// A method in a study.
struct StudyMethod {
  Method method;
  std::string remark;          ///< What is special about it, for people; may be empty.
  bool is_step = false;        ///< The default with a step switched off: a table of its own.
  bool needs_spacing = false;  ///< The same as another one without a spacing: left out there.
};

/// The baseline, the other placements, and two rows of their own: `marching-squares-clean`
/// (with the cleaning of the default) and `virtual-plane-no-volumes` (without its area step).
std::vector<StudyMethod> StudyMethods();

/// `virtual-plane` with each of its steps switched off in turn: "virtual-plane-without-curvature",
/// ...
std::vector<StudyMethod> StepMethods();

/// `virtual-plane` with each of its constants times 0.7 and 1.4: "virtual-plane-0.7-normal-reach",
/// ... They are steps as to tables.
std::vector<StudyMethod> SensitivityMethods();

struct StudyPlan {
  std::vector<SceneRecipe> recipes;
  std::vector<Sequence> recordings;
  std::vector<StudyMethod> methods;  ///< The baseline first.
  std::vector<Knowledge> told = {Knowledge::kSpacing, Knowledge::kNothing};
  bool ids = false;  ///< Tell the ids of scenes, too; see RunOptions.
  std::size_t threads = 1;
};

/// Frames that RunStudy reports in all: each sequence's, once for each run.
std::size_t FrameTotal(const StudyPlan& plan);

struct Study {
  std::vector<StudyMethod> methods;
  std::vector<Knowledge> told;
  std::vector<Row> rows;  ///< By sequence, then method, then knowledge; recordings last.

  /// Rows of one method and knowledge, of recordings or of synthetic sequences.
  std::vector<Row> Of(std::string_view method, Knowledge knowledge, bool recordings) const;
  bool HasRecordings() const;
  /// Whether methods were told ids, in any of the recordings or in the synthetic sequences.
  bool ToldIds(bool recordings) const;
};

/// Mean over the judged rows that have the metric; kAbsent without any.
double MeanOver(std::span<const Row> rows, Metric metric);

/// Told how many more frames are done; from one thread at a time. False ends the study early.
using StudyProgress = std::function<bool(std::size_t frames)>;

/// Runs every method on every sequence, each worker on a sequence of its own with one oneTBB
/// thread. The rows are the same for any number of threads, but for kMilliseconds.
/// Errors: those of Evaluator::Run; CANCELLED if `progress` says so.
absl::StatusOr<Study> RunStudy(StudyPlan plan, const StudyProgress& progress);

}  // namespace partiemc::evaluation
