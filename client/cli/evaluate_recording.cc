#include "client/cli/evaluate_recording.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <span>
#include <system_error>
#include <utility>

#include "client/cli/input_source.h"
#include "client/evaluation/metrics/recorded_truth.h"
#include "client/output/text.h"
#include "partiemc/reconstructor.h"

namespace partiemc::client {
namespace {

evaluation::SequenceFrame FrameOf(const RecordedFrame& recorded) {
  evaluation::SequenceFrame frame;
  frame.time = recorded.time.value_or(static_cast<double>(recorded.index));
  frame.positions = recorded.positions;
  frame.volumes = recorded.volumes;
  frame.ids = recorded.ids;
  frame.velocities.assign(recorded.velocities.begin(), recorded.velocities.end());
  frame.area = std::accumulate(recorded.volumes.begin(), recorded.volumes.end(), 0.0);
  return frame;
}

// The spacing that a stream without one would use; 0 where the frame's particles agree on none.
absl::StatusOr<double> EstimatedSpacing(const evaluation::SequenceFrame& frame) {
  const auto reconstructor = Reconstructor::Create({.fill = Fill::kNone});
  if (!reconstructor.ok()) return reconstructor.status();
  State state;
  Workspace workspace;
  Result result;
  const absl::Status status = reconstructor->Reconstruct(
      {.positions = std::span<const double>(frame.positions)}, state, workspace, result);
  if (!status.ok()) return status;
  return state.spacing.value_or(0);
}

// What the file beside the recording says of it, if there is one: NAME.truth for NAME.pemc.
absl::Status AddKnownTruth(const std::string& input, evaluation::Sequence& sequence) {
  const auto path = std::filesystem::path(input).replace_extension(".truth");
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::OkStatus();
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const absl::Status status = evaluation::AddTruth(text, sequence);
  return status.ok() ? status
                     : absl::FailedPreconditionError(
                           Concat(path.string(), ": ", std::string(status.message())));
}

}  // namespace

absl::StatusOr<std::vector<std::string>> RecordingsIn(const std::string& directory) {
  std::vector<std::string> recordings;
  std::error_code error;
  for (std::filesystem::directory_iterator file(directory, error), end; !error && file != end;
       file.increment(error)) {
    if (file->path().extension() == ".pemc") recordings.push_back(file->path().string());
  }
  if (error) return absl::FailedPreconditionError(Concat(directory, ": ", error.message()));
  if (recordings.empty()) {
    return absl::FailedPreconditionError(Concat(directory, ": holds no .pemc file"));
  }
  std::ranges::sort(recordings);
  return recordings;
}

absl::StatusOr<evaluation::Sequence> ReadRecording(const std::string& input,
                                                   const SequenceOptions& options,
                                                   std::vector<std::string>& notes) {
  const auto source = OpenInput(input, options);
  if (!source.ok()) return source.status();
  evaluation::Sequence sequence;
  sequence.name = BaseName(input);
  sequence.group = evaluation::Group::kRecording;
  sequence.shape = sequence.name;
  RecordedFrame frame;
  while (true) {
    const auto more = source->frames->Next(frame);
    if (!more.ok()) return more.status();
    if (!*more) break;
    sequence.frames.push_back(FrameOf(frame));
  }
  if (sequence.frames.size() < 2) {
    return absl::FailedPreconditionError(
        Concat(input, ": has ", sequence.frames.size(),
               " frames to evaluate; must be two or more, look at --frames"));
  }
  if (source->spacing) {
    sequence.spacing = *source->spacing;
  } else {
    const auto spacing = EstimatedSpacing(sequence.frames.front());
    if (!spacing.ok()) return spacing.status();
    if (!(*spacing > 0)) {
      return absl::FailedPreconditionError(
          Concat(input,
                 ": its first frame has no body of particles to take a spacing from; begin "
                 "later by --frames, or give one to `partiemc convert --spacing`"));
    }
    sequence.spacing = *spacing;
    notes.push_back(Concat(sequence.name, ": has no spacing; ", *spacing,
                           " was estimated from its first frame"));
  }
  sequence.original_spacing = sequence.spacing;
  if (const absl::Status status = AddKnownTruth(input, sequence); !status.ok()) return status;
  for (const std::string& notice : source->frames->notices()) notes.push_back(notice);
  return sequence;
}

}  // namespace partiemc::client
