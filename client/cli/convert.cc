#include "client/cli/convert.h"

#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include "CLI/CLI.hpp"
#include "client/cli/console.h"
#include "client/cli/input_source.h"
#include "client/cli/replay_parameters.h"
#include "client/output/progress.h"
#include "client/output/text.h"
#include "client/recording/recording.h"

namespace partiemc::client {
namespace {

struct CopyEnd {
  ExitCode code = kGood;
  std::string error;  // Empty for kGood.
};

CopyEnd CopyFrames(Sequence& input, RecordingWriter& writer, Progress& progress) {
  RecordedFrame frame;
  while (!Interrupted()) {
    const auto more = input.Next(frame);
    if (!more.ok()) return {kInput, OneLine(more.status())};
    if (!*more) return {};
    const absl::Status added = writer.Add(frame);
    if (!added.ok()) {
      return {added.code() == absl::StatusCode::kInvalidArgument ? kInput : kFailed,
              OneLine(added)};
    }
    progress.Update(writer.frame_count());
  }
  return {kInterrupted, "interrupted; nothing was written"};
}

}  // namespace

CLI::App* AddConvert(CLI::App& app, ConvertFlags& flags) {
  CLI::App* verb = app.add_subcommand("convert", "Turn any input into a recording (.pemc)");
  verb->add_option("INPUT", flags.input, "File, directory or quoted pattern of particle frames")
      ->type_name("")
      ->required();
  verb->add_option("OUTPUT", flags.output, "Recording to write: FILE.pemc")
      ->type_name("")
      ->required();
  verb->add_option("--select", flags.sequence.select,
                   "Keep the particles with COLUMN=VALUE: type=1")
      ->type_name("COLUMN=VALUE")
      ->allow_extra_args(false);
  verb->add_option("--columns", flags.sequence.columns,
                   "Columns of the positions: x,y or 2,3; of HDF5 datasets: GROUP/x,GROUP/y")
      ->type_name("NAMES");
  AddAttributesFlag(*verb, flags.sequence,
                    "Particle attributes to keep: column names, or arrays of two or three "
                    "components; a recording keeps all of its attributes");
  AddTimeFlags(*verb, flags.sequence);
  verb->add_option("--frames", flags.sequence.frames, "Frames A to B - 1, counted from 0: A:B")
      ->type_name("A:B");
  AddExpansionFlag(*verb, flags.sequence);
  verb->add_option("--spacing", flags.spacing,
                   "Particle spacing in world units, stored in the recording")
      ->type_name("S");
  verb->add_option("--title", flags.title, "Title to store in the recording")->type_name("TEXT");
  verb->add_flag(
      "--in-space", flags.sequence.in_space,
      "Keep all three coordinates of particles in 3D, for `partiemc replay --surface` or "
      "`--slice`");
  verb->add_flag("--float64", flags.float64, "Store positions as float64 instead of float32");
  verb->add_option("--compression-level", flags.compression_level, "1 (fast) to 19 (small)")
      ->check(CLI::Range(1, 19))
      ->capture_default_str();
  verb->add_flag("--quiet", flags.quiet, "No progress");
  verb->footer(
      "Examples:\n"
      "  partiemc convert frames/ dam_break.pemc --spacing 0.0303\n"
      "  partiemc convert drum.lammpstrj.gz drum.pemc --select type=1 --frames 0:100\n"
      "  partiemc convert 'tank_*.vtu' tank.pemc --in-space --spacing 0.02\n"
      "A recording holds time, position, id, volume, velocity and --attributes of the particles,\n"
      "and orthogonal periodic boxes. It is compressed. If it is truncated, only its last frames\n"
      "are lost.");
  verb->parse_complete_callback([&flags] {
    if (!std::string_view(flags.output).ends_with(".pemc")) {
      throw CLI::ValidationError(
          Concat("OUTPUT: '", flags.output, "'; must end in .pemc, the format of recordings"));
    }
    if (!flags.spacing.empty() && !PositiveNumber(flags.spacing)) {
      throw CLI::ValidationError(
          Concat("--spacing: '", flags.spacing, "'; must be a positive length"));
    }
  });
  return verb;
}

int Convert(const ConvertFlags& flags) {
  const auto input = OpenInput(flags.input, flags.sequence);
  if (!input.ok()) {
    const bool wrong_flag = input.status().code() == absl::StatusCode::kInvalidArgument;
    return Complain(wrong_flag ? kUsage : kInput, input.status());
  }
  if (const auto kept = CheckKeepsInput(flags.input, *input->frames, {flags.output}); !kept.ok()) {
    return Complain(kUsage, kept);
  }
  CatchInterrupts();  // Before the first temporary file exists.
  const auto writer = RecordingWriter::Create(
      flags.output,
      {.spacing = flags.spacing.empty() ? input->spacing : PositiveNumber(flags.spacing),
       .title = flags.title.empty() ? BaseName(flags.input) : flags.title},
      {.float64 = flags.float64, .compression_level = flags.compression_level});
  if (!writer.ok()) return Complain(kFailed, writer.status());

  Progress::Options progress_options = Progress::ForStandardError();
  progress_options.quiet = flags.quiet;
  progress_options.total = input->frames->FrameCount();
  Progress progress(std::move(progress_options));
  const CopyEnd ended = CopyFrames(*input->frames, **writer, progress);
  progress.Finish();
  PrintNotices(*input->frames, flags.quiet);
  if (ended.code != kGood) return Complain(ended.code, ended.error);
  if ((*writer)->frame_count() == 0) {
    return Complain(kInput, Concat(flags.input, ": has no frame to convert; check --frames"));
  }
  const absl::Status finished = (*writer)->Finish();
  if (!finished.ok()) return Complain(kFailed, finished);
  if (!flags.quiet) {
    std::error_code unknown;
    const auto bytes = std::filesystem::file_size(flags.output, unknown);
    std::fputs(Concat(flags.output, ": ", (*writer)->frame_count(), " frames, ",
                      unknown ? 0 : bytes, " bytes\n")
                   .c_str(),
               stdout);
  }
  return kGood;
}

}  // namespace partiemc::client
