#include "cli/evaluate_recording.h"

#include <numeric>
#include <span>
#include <utility>

#include "cli/input_source.h"
#include "output/text.h"
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

// The spacing that a stream without one would use.
absl::StatusOr<double> EstimatedSpacing(const evaluation::SequenceFrame& frame) {
  const auto reconstructor = Reconstructor::Create({.fill = Fill::kNone});
  if (!reconstructor.ok()) return reconstructor.status();
  State state;
  Workspace workspace;
  Result result;
  const absl::Status status = reconstructor->Reconstruct(
      {.positions = std::span<const double>(frame.positions)}, state, workspace, result);
  if (!status.ok()) return status;
  return result.statistics.spacing;
}

}  // namespace

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
                 ": its first frame has no two particles to take a spacing from; begin "
                 "later by --frames, or give one to `partiemc convert --spacing`"));
    }
    sequence.spacing = *spacing;
    notes.push_back(Concat(sequence.name, ": has no spacing; ", *spacing,
                           " was estimated from its first frame"));
  }
  sequence.original_spacing = sequence.spacing;
  for (const std::string& notice : source->frames->notices()) notes.push_back(notice);
  return sequence;
}

}  // namespace partiemc::client
