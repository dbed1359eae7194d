#include "client/cli/evaluate.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>
#include <span>
#include <system_error>
#include <thread>
#include <utility>

#include "CLI/CLI.hpp"
#include "client/cli/console.h"
#include "client/cli/evaluate_recording.h"
#include "client/evaluation/report/report.h"
#include "client/evaluation/scenes/scenes.h"
#include "client/evaluation/scenes/shapes.h"
#include "client/output/atomic_file.h"
#include "client/output/progress.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

using evaluation::Evaluation;
using evaluation::StudyMethod;
using evaluation::StudyPlan;

std::vector<StudyMethod> AllMethods(bool steps, bool sensitivity) {
  std::vector<StudyMethod> methods = evaluation::StudyMethods();
  if (steps) {
    for (StudyMethod& method : evaluation::StepMethods()) methods.push_back(std::move(method));
  }
  if (sensitivity) {
    for (StudyMethod& method : evaluation::SensitivityMethods()) {
      methods.push_back(std::move(method));
    }
  }
  return methods;
}

// The named ones; the four placements are what the paper's tables need, and always stay.
absl::StatusOr<std::vector<StudyMethod>> MethodsOf(const EvaluateFlags& flags) {
  std::vector<StudyMethod> methods = AllMethods(flags.steps, flags.sensitivity);
  std::string known;
  for (const StudyMethod& method : methods) {
    AppendAll(known, known.empty() ? "" : ", ", method.method.name);
  }
  std::set<std::string> wanted(flags.methods.begin(), flags.methods.end());
  for (const std::string& name : wanted) {
    if (std::ranges::none_of(methods, [&](const auto& m) { return m.method.name == name; })) {
      return absl::InvalidArgumentError(
          Concat("--methods: '", OneLine(name), "'; must be some of ", known));
    }
  }
  if (wanted.empty()) return methods;
  for (const Placement placement : AllPlacements()) wanted.emplace(Name(placement));
  std::erase_if(methods, [&](const auto& m) { return !wanted.contains(m.method.name); });
  return methods;
}

absl::StatusOr<StudyPlan> PlanOf(const EvaluateFlags& flags, std::vector<std::string>& notes) {
  StudyPlan plan;
  auto methods = MethodsOf(flags);
  if (!methods.ok()) return methods.status();
  plan.methods = *std::move(methods);
  plan.recipes = evaluation::Set(flags.set);
  std::vector<std::string> recordings = flags.recordings;
  if (!flags.recordings_dir.empty()) {
    auto found = RecordingsIn(flags.recordings_dir);
    if (!found.ok()) return found.status();
    recordings.insert(recordings.end(), found->begin(), found->end());
  }
  for (const std::string& input : recordings) {
    auto recording = ReadRecording(input, flags.sequence, notes);
    if (!recording.ok()) return recording.status();
    plan.recordings.push_back(*std::move(recording));
  }
  plan.ids = flags.ids;
  if (flags.volumes) plan.told.front() = evaluation::Knowledge::kVolumes;
  plan.threads = flags.threads > 0 ? static_cast<std::size_t>(flags.threads)
                                   : std::max(1u, std::thread::hardware_concurrency());
  return plan;
}

absl::Status MakeDirectory(const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (!error) return absl::OkStatus();
  return absl::FailedPreconditionError(
      Concat("--output-dir: ", directory.string(), ": cannot be made: ", error.message()));
}

absl::Status WriteFiles(const std::filesystem::path& directory, const Evaluation& evaluation) {
  const std::pair<const char*, std::string> files[] = {
      {"evaluation.html", EvaluationHtml(evaluation)},
      {"evaluation.csv", EvaluationCsv(evaluation.study)},
      {"evaluation.json", EvaluationJson(evaluation)},
  };
  for (const auto& [name, content] : files) {
    const absl::Status status = WriteFileAtomically(directory / name, content);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

// All runs, under one progress bar.
absl::StatusOr<Evaluation> Measure(const EvaluateFlags& flags, StudyPlan plan) {
  const evaluation::Sequence film =
      plan.recordings.empty() ? evaluation::DefaultFilm() : plan.recordings.front();
  const std::span<const std::string_view> shapes =
      flags.set == "validation" ? evaluation::ValidationShapes() : evaluation::TuningShapes();
  Progress::Options options = Progress::ForStandardError();
  options.quiet = flags.quiet;
  options.total = FrameTotal(plan) + PaperFrameTotal(film, shapes);
  Progress bar(std::move(options));
  std::uint64_t done = 0;
  const evaluation::StudyProgress progress = [&](std::size_t frames) {
    bar.Update(done += frames);
    return !Interrupted();
  };
  Evaluation evaluation{.set = flags.set, .sequences = plan.recipes.size()};
  for (const auto& recording : plan.recordings) evaluation.recordings.push_back(recording.name);
  auto study = RunStudy(std::move(plan), progress);
  if (!study.ok()) return study.status();
  auto paper = RunPaper(film, shapes, progress);
  if (!paper.ok()) return paper.status();
  evaluation.study = *std::move(study);
  evaluation.paper = *std::move(paper);
  evaluation.claims = JudgeClaims(evaluation.study, evaluation.paper);
  return evaluation;
}

}  // namespace

CLI::App* AddEvaluate(CLI::App& app, EvaluateFlags& flags) {
  CLI::App* verb = app.add_subcommand(
      "evaluate", "Measure every method, and check what of the paper reproduces");
  verb->add_option("--set", flags.set, "Synthetic sequences: smoke, tuning, validation or discs")
      ->type_name("NAME")
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(evaluation::kSetNames),
                                                     std::end(evaluation::kSetNames))))
      ->capture_default_str();
  verb->add_option("--recording", flags.recordings,
                   "Recorded frames to measure too, again for each; the first is also the film of "
                   "the paper's figures")
      ->type_name("INPUT")
      ->allow_extra_args(false);
  verb->add_option("--recordings", flags.recordings_dir, "Measure all .pemc files of a folder, too")
      ->type_name("DIR");
  verb->add_option("--frames", flags.sequence.frames,
                   "Frames A to B - 1 of each recording, counted from 0: A:B")
      ->type_name("A:B");
  verb->add_option("--select", flags.sequence.select,
                   "Keep the recordings' particles with COLUMN=VALUE: type=1")
      ->type_name("COLUMN=VALUE")
      ->allow_extra_args(false);
  verb->add_option("--methods", flags.methods,
                   "Rows beside the four placements, separated by commas; all without it")
      ->type_name("NAMES")
      ->delimiter(',')
      ->allow_extra_args(false);
  verb->add_flag("--steps", flags.steps, "Also virtual-plane with each step switched off in turn");
  verb->add_flag("--sensitivity", flags.sensitivity,
                 "Also virtual-plane with each of its constants times 0.7 and 1.4");
  verb->add_flag("--volumes", flags.volumes,
                 "Tell the methods volumes per particle, not the spacing alone");
  verb->add_flag("--ids", flags.ids,
                 "Tell the methods which particle is which in scenes, too; recordings always do");
  verb->add_option("--output-dir", flags.output_dir,
                   "Write evaluation.html, evaluation.csv and evaluation.json here")
      ->type_name("DIR");
  verb->add_option("--threads", flags.threads, "Sequences at a time; one for each processor")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  verb->add_flag("--quiet", flags.quiet, "No progress");
  verb->footer(
      "Examples:\n"
      "  partiemc evaluate --output-dir evaluation\n"
      "  partiemc evaluate --set tuning --steps --recording dam_break.pemc --output-dir tuning\n"
      "The validation set has other shapes and seeds, and is not for choosing anything by it.");
  return verb;
}

int Evaluate(const EvaluateFlags& flags) {
  std::vector<std::string> notes;
  auto plan = PlanOf(flags, notes);
  if (!plan.ok()) {
    const bool wrong_flag = plan.status().code() == absl::StatusCode::kInvalidArgument;
    return Complain(wrong_flag ? kUsage : kInput, plan.status());
  }
  if (!flags.output_dir.empty()) {
    const absl::Status made = MakeDirectory(flags.output_dir);
    if (!made.ok()) return Complain(kFailed, made);
  }
  CatchInterrupts();
  auto evaluation = Measure(flags, *std::move(plan));
  if (!evaluation.ok()) {
    if (Interrupted()) return Complain(kInterrupted, "interrupted; nothing was written");
    return Complain(kInput, evaluation.status());
  }
  evaluation->notes = std::move(notes);
  std::fputs(EvaluationText(*evaluation).c_str(), stdout);
  if (flags.output_dir.empty()) return kGood;
  const absl::Status written = WriteFiles(flags.output_dir, *evaluation);
  return written.ok() ? static_cast<int>(kGood) : Complain(kFailed, written);
}

}  // namespace partiemc::client
