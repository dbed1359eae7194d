#include "client/evaluation/metrics/study.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>
#include <utility>

#include "absl/status/status.h"
#include "partiemc/arena.h"

namespace partiemc::evaluation {
namespace {

StudyMethod Plain(Placement placement, std::string remark) {
  Method method{std::string(Name(placement)), {.placement = placement}};
  return {std::move(method), std::move(remark)};
}

bool Applies(const StudyMethod& method, Knowledge knowledge) {
  return knowledge != Knowledge::kNothing || !method.needs_spacing;
}

std::size_t RunsPerSequence(const StudyPlan& plan) {
  std::size_t runs = 0;
  for (const StudyMethod& method : plan.methods) {
    for (const Knowledge knowledge : plan.told) runs += Applies(method, knowledge) ? 1 : 0;
  }
  return runs;
}

// What the workers share. Each takes the next sequence until there is none, or one has failed.
class StudyRunner {
 public:
  StudyRunner(StudyPlan plan, const StudyProgress& progress)
      : plan_(std::move(plan)),
        progress_(progress),
        rows_(plan_.recipes.size() + plan_.recordings.size()) {}

  absl::StatusOr<Study> Run() {
    std::vector<std::thread> workers;
    for (std::size_t k = 1; k < plan_.threads; ++k) workers.emplace_back([this] { Work(); });
    Work();
    for (std::thread& worker : workers) worker.join();
    if (!status_.ok()) return status_;
    Study study{std::move(plan_.methods), std::move(plan_.told), {}};
    for (std::vector<Row>& rows : rows_) {
      std::move(rows.begin(), rows.end(), std::back_inserter(study.rows));
    }
    return study;
  }

 private:
  void Work() {
    Arena arena(1);
    arena.Execute([this] {
      for (std::size_t k = next_++; k < rows_.size() && !ended_; k = next_++) RunSequence(k);
    });
  }

  void RunSequence(std::size_t serial) {
    const std::size_t scenes = plan_.recipes.size();
    const Evaluator evaluator(serial < scenes ? MakeScene(plan_.recipes[serial])
                                              : std::move(plan_.recordings[serial - scenes]),
                              true);
    for (const StudyMethod& method : plan_.methods) {
      for (const Knowledge knowledge : plan_.told) {
        if (ended_ || !Applies(method, knowledge)) continue;
        auto row = evaluator.Run(method.method, {.knowledge = knowledge, .ids = plan_.ids});
        Report(row.status(), evaluator.sequence().frames.size());
        if (row.ok()) rows_[serial].push_back(*std::move(row));
      }
    }
  }

  void Report(const absl::Status& status, std::size_t frames) {
    const std::scoped_lock lock(mutex_);
    if (status_.ok()) status_ = status;
    if (status_.ok() && !progress_(frames)) status_ = absl::CancelledError("interrupted");
    if (!status_.ok()) ended_ = true;
  }

  StudyPlan plan_;
  const StudyProgress& progress_;
  std::vector<std::vector<Row>> rows_;  // By sequence; each is one worker's own.
  std::atomic<std::size_t> next_ = 0;
  std::atomic<bool> ended_ = false;
  std::mutex mutex_;
  absl::Status status_;
};

}  // namespace

std::vector<StudyMethod> StudyMethods() {
  std::vector<StudyMethod> methods = {
      Plain(Placement::kMarchingSquares, "linear interpolation, its own calibration"),
      Plain(Placement::kMarchingSquares, "with the cleaning of the default"),
      Plain(Placement::kQef, "the paper's EMC baseline"),
      Plain(Placement::kFarthestParticle, "the paper's method to the letter"),
      Plain(Placement::kVirtualPlane, "the default"),
      Plain(Placement::kVirtualPlane, "the default without its area step"),
  };
  methods[1].method.name += "-clean";
  methods[1].method.parameters.clean = true;
  methods[5].method.name += "-no-volumes";
  methods[5].method.variant.steps.area = false;
  methods[5].needs_spacing = true;
  return methods;
}

std::vector<StudyMethod> StepMethods() {
  std::vector<StudyMethod> methods;
  for (const NamedStep& step : AllSteps()) {
    methods.push_back(
        Plain(Placement::kVirtualPlane, "without the step " + std::string(step.name)));
    methods.back().method.name += "-without-" + std::string(step.name);
    methods.back().method.variant.steps.*step.value = false;
    methods.back().is_step = true;
    methods.back().needs_spacing = step.value == &VirtualPlaneSteps::area;
  }
  return methods;
}

std::vector<StudyMethod> SensitivityMethods() {
  std::vector<StudyMethod> methods;
  for (const NamedConstant& constant : AllConstants()) {
    for (const auto& [factor, name] : {std::pair(0.7, "0.7"), std::pair(1.4, "1.4")}) {
      const std::string what = std::string(name) + " times " + std::string(constant.name);
      methods.push_back(Plain(Placement::kVirtualPlane, what));
      methods.back().method.name += "-" + std::string(name) + "-" + std::string(constant.name);
      methods.back().method.variant.constants.*constant.value *= factor;
      methods.back().is_step = true;
    }
  }
  return methods;
}

std::size_t FrameTotal(const StudyPlan& plan) {
  std::size_t frames = 0;
  for (const SceneRecipe& recipe : plan.recipes) frames += recipe.frames;
  for (const Sequence& recording : plan.recordings) frames += recording.frames.size();
  return frames * RunsPerSequence(plan);
}

std::vector<Row> Study::Of(std::string_view method, Knowledge knowledge, bool recordings) const {
  std::vector<Row> chosen;
  for (const Row& row : rows) {
    if (row.method == method && row.knowledge == knowledge &&
        (row.group == Group::kRecording) == recordings) {
      chosen.push_back(row);
    }
  }
  return chosen;
}

bool Study::HasRecordings() const {
  return std::ranges::any_of(rows, [](const Row& r) { return r.group == Group::kRecording; });
}

bool Study::ToldIds(bool recordings) const {
  return std::ranges::any_of(rows, [recordings](const Row& row) {
    return row.ids && (row.group == Group::kRecording) == recordings;
  });
}

double MeanOver(std::span<const Row> rows, Metric metric) {
  double sum = 0, count = 0;
  for (const Row& row : rows) {
    if (!row.judged || std::isnan(row[metric])) continue;
    sum += row[metric];
    ++count;
  }
  return count > 0 ? sum / count : kAbsent;
}

absl::StatusOr<Study> RunStudy(StudyPlan plan, const StudyProgress& progress) {
  return StudyRunner(std::move(plan), progress).Run();
}

}  // namespace partiemc::evaluation
