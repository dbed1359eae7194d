#include "client/cli/replay/looped_input.h"

#include <utility>

namespace partiemc::client {

absl::StatusOr<bool> LoopedInput::Next(RecordedFrame& frame) {
  auto more = frames_->Next(frame);
  if (!more.ok() || *more) return more;
  auto again = OpenInput(input_, options_);
  if (!again.ok()) return again.status();
  frames_ = std::move(again->frames);
  return frames_->Next(frame);
}

}  // namespace partiemc::client
