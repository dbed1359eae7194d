// An input that starts over at its end.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/input_source.h"
#include "client/input/sequence.h"

namespace partiemc::client {

/// Repeats the frames of `input` with their recorded times. The time therefore decreases when a new
/// round begins, so the stream ignores velocities between the last frame and the first. Ends if
/// `input` has no frames. Opens `input` for each round; an error of OpenInput is an error of Next.
class LoopedInput final : public Sequence {
 public:
  /// `first` is OpenInput(input, options).
  LoopedInput(InputSource first, std::string input, SequenceOptions options)
      : frames_(std::move(first.frames)), input_(std::move(input)), options_(std::move(options)) {}

  absl::StatusOr<bool> Next(RecordedFrame& frame) override;
  std::optional<std::size_t> FrameCount() override { return std::nullopt; }
  std::string Description() const override { return frames_->Description() + ", in a loop"; }
  const std::vector<std::string>& notices() const override { return frames_->notices(); }
  std::vector<std::string> files() const override { return frames_->files(); }
  std::vector<std::string> losses() const override { return frames_->losses(); }

 private:
  std::unique_ptr<Sequence> frames_;
  const std::string input_;
  const SequenceOptions options_;
};

}  // namespace partiemc::client
