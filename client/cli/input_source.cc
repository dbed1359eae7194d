#include "client/cli/input_source.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "client/cli/console.h"
#include "client/recording/recording.h"
#include "partiemc/spacing.h"

namespace partiemc::client {
namespace {

/// A recording whose volumes come from its attribute of diameters or radii
/// (SequenceOptions::needs_sizes, needs_diameters). Volumes of a recording stay for frames without
/// such an attribute, and with needs_sizes for all frames that have volumes.
class SizedRecording final : public Sequence {
 public:
  SizedRecording(std::unique_ptr<Sequence> recording, bool needs_diameters)
      : recording_(std::move(recording)), needs_diameters_(needs_diameters) {}

  absl::StatusOr<bool> Next(RecordedFrame& frame) override {
    const auto more = recording_->Next(frame);
    frame.volume_column.clear();
    if (!more.ok() || !*more || !(frame.volumes.empty() || needs_diameters_)) return more;
    for (const ParticleAttribute& attribute : frame.attributes) {
      const bool is_diameter = attribute.name == "diameter";
      if (attribute.components != 1 || !(is_diameter || attribute.name == "radius")) continue;
      frame.volume_column = attribute.name;
      frame.volumes.clear();
      for (const float length : attribute.values) {
        const double size = (is_diameter ? 1 : 2) * double{length};
        const double square = size * size;
        // A square of a negative length would be positive.
        frame.volumes.push_back(static_cast<float>(!(size > 0)             ? size
                                                   : frame.components == 3 ? square * size
                                                                           : square));
      }
      break;
    }
    return true;
  }
  std::optional<std::size_t> FrameCount() override { return recording_->FrameCount(); }
  std::string Description() const override { return recording_->Description(); }
  const std::vector<std::string>& notices() const override { return recording_->notices(); }
  std::vector<std::string> files() const override { return recording_->files(); }
  std::vector<std::string> losses() const override { return recording_->losses(); }

 private:
  const std::unique_ptr<Sequence> recording_;
  const bool needs_diameters_;
};

}  // namespace

absl::StatusOr<InputSource> OpenInput(const std::string& input, const SequenceOptions& options) {
  if (!IsRecording(input)) {
    auto sequence = Sequence::Open(input, options);
    if (!sequence.ok()) return sequence.status();
    return InputSource{.frames = *std::move(sequence)};
  }
  const char* refused = !options.select.empty()    ? "--select"
                        : !options.columns.empty() ? "--columns"
                        : !options.times.empty()   ? "--times"
                        : options.time_step        ? "--time-step"
                                                   : nullptr;
  if (refused != nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat(refused, ": ", input,
                     " is a recording, which has no columns and knows its times; leave it out, or "
                     "give it to `partiemc convert` with the original"));
  }
  auto reader =
      RecordingReader::Open(input, options.frames, options.in_space, options.max_expansion);
  if (!reader.ok()) return reader.status();
  const auto spacing = (*reader)->header().spacing;
  if (options.needs_sizes || options.needs_diameters) {
    return InputSource{
        .frames = std::make_unique<SizedRecording>(*std::move(reader), options.needs_diameters),
        .spacing = spacing};
  }
  return InputSource{.frames = *std::move(reader), .spacing = spacing};
}

absl::StatusOr<double> EstimatedSpacing(const std::string& input, const SequenceOptions& options) {
  auto source = OpenInput(input, options);
  if (!source.ok()) return source.status();
  RecordedFrame recorded;
  while (true) {
    const auto more = source->frames->Next(recorded);
    if (!more.ok()) return more.status();
    if (!*more) {
      return absl::InvalidArgumentError(
          "--spacing: absent; must be given, because no frame has two different particles");
    }
    const Frame frame{.positions = std::span<const double>(recorded.positions),
                      .components = recorded.components};
    if (const auto spacing = EstimateSpacing(frame)) {
      char text[32];
      std::snprintf(text, sizeof text, "%.4g", *spacing);
      return std::strtod(text, nullptr);
    }
  }
}

absl::Status CheckKeepsInput(const std::string& input, const Sequence& frames,
                             const std::vector<std::string>& targets) {
  // Resolves symbolic links, because AtomicFile follows them.
  const auto canonical = [](const std::string& file) {
    std::error_code error;
    std::filesystem::path path =
        std::filesystem::weakly_canonical(std::filesystem::absolute(file, error), error);
    return error ? std::filesystem::path(file) : path;
  };
  std::set<std::filesystem::path> kept = {canonical(input)};
  for (const std::string& file : frames.files()) kept.insert(canonical(file));
  for (const std::string& target : targets) {
    if (kept.contains(canonical(target))) {
      return absl::InvalidArgumentError(
          absl::StrCat(target, ": would overwrite the input; choose another path"));
    }
  }
  return absl::OkStatus();
}

void PrintNotices(const Sequence& frames, bool quiet) {
  for (const std::string& notice : quiet ? frames.losses() : frames.notices()) {
    Complain(kGood, notice);
  }
}

CLI::Option* AddAttributesFlag(CLI::App& app, SequenceOptions& options, const std::string& what) {
  return app.add_option("--attributes", options.attributes, what)
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("NAMES");
}

std::vector<CLI::Option*> AddTimeFlags(CLI::App& app, SequenceOptions& options) {
  return {app.add_option("--times", options.times, "CSV file with the times of the frames")
              ->type_name("FILE"),
          app.add_option("--time-step", options.time_step,
                         "Time of one step of a LAMMPS or GSD file: the time of a frame is its "
                         "step times DT")
              ->type_name("DT")};
}

CLI::Option* AddExpansionFlag(CLI::App& app, SequenceOptions& options) {
  return app
      .add_option("--max-expansion", options.max_expansion,
                  "Refuse packed input (.gz, .zst, .pemc) that unpacks to more than 64 MiB and "
                  "RATIO times its size")
      ->check(CLI::Range(1.0, 1e15))
      ->type_name("RATIO")
      ->capture_default_str();
}

std::string BaseName(const std::string& path) {
  std::filesystem::path name = std::filesystem::path(path).lexically_normal();
  if (!name.has_filename()) name = name.parent_path();  // "folder/"
  return name.filename().string();
}

}  // namespace partiemc::client
