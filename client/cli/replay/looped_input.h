// An input that begins anew when it ends.
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

/// The frames of `input` again and again, as they are recorded: times go back with each round, so
/// that no velocity counts from its last frame to its first. Ends when the input cannot be read any
/// more, or has become empty.
class LoopedInput final : public Sequence {
 public:
  /// `first`: what OpenInput made of the other two.
  LoopedInput(InputSource first, std::string input, SequenceOptions options)
      : frames_(std::move(first.frames)), input_(std::move(input)), options_(std::move(options)) {}

  absl::StatusOr<bool> Next(RecordedFrame& frame) override;
  std::optional<std::size_t> FrameCount() override { return std::nullopt; }
  std::string Description() const override { return frames_->Description() + ", in a loop"; }
  const std::vector<std::string>& notices() const override { return frames_->notices(); }

 private:
  std::unique_ptr<Sequence> frames_;
  const std::string input_;
  const SequenceOptions options_;
};

}  // namespace partiemc::client
