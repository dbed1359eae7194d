// A small model of a stream by PROTOCOL.md, without any server code: the reference for
// StreamStateMachine and Session.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "server/memory_transport.h"

namespace partiemc::server {

/// Reason of a stream's end.
struct StreamEnd {
  absl::StatusCode code = absl::StatusCode::kOk;
  std::string reason;

  friend bool operator==(const StreamEnd&, const StreamEnd&) = default;
};

class StreamModel {
 public:
  /// `results` are the digests of the first, second, ... good frame of a stream.
  using Digests = std::pair<std::uint64_t, std::uint64_t>;
  StreamModel(std::size_t window, bool may_open, const std::vector<Digests>& results);

  // Events in the order in which they take effect.
  /// `fault`: the reason for which the frame would be refused with any number; empty: none.
  void RequestCame(const MemoryRequest& request, const std::string& fault);
  void OpeningDone();
  void ReadsEnded();
  void WriteDone(bool ok);
  void Cancelled();
  void Drained();
  void WaitedTooLong();
  void TakenOver();
  /// A worker takes the next frame; false if no client waits for its answer.
  bool TakeUp();
  void Computed(bool answered);

  // Operations that must then be pending.
  bool reading() const { return reading_; }
  bool opening() const { return opening_; }
  bool computing() const { return computing_; }
  bool cut() const { return cut_; }
  const std::optional<MemoryAnswer>& writing() const { return writing_; }
  const std::optional<StreamEnd>& finished() const { return finished_; }
  std::uint64_t results() const { return results_; }
  std::uint64_t errors() const { return errors_; }
  std::uint64_t last_sequence() const { return last_sequence_; }

  /// The number that the next frame must have, and the number of good frames before it.
  std::uint64_t next_sequence() const { return next_sequence_; }
  std::size_t good_frames() const { return good_frames_; }

 private:
  enum class Phase { kOpening, kStreaming, kEnding, kAbandoned, kFinished };

  void End(StreamEnd end);
  void Abandon(StreamEnd end);
  MemoryAnswer AnswerTo(const MemoryRequest& request, const std::string& fault);
  void GoOn();

  const std::size_t window_;
  const bool may_open_;
  const std::vector<Digests>& digests_;
  Phase phase_ = Phase::kOpening;
  StreamEnd end_;
  std::vector<MemoryAnswer> answers_;     // Answers to the frames that were read.
  std::vector<std::uint64_t> sequences_;  // The last used number after each answer.
  std::size_t computed_ = 0, written_ = 0;
  bool reading_ = false, opening_ = false, computing_ = false, cut_ = false;
  bool owes_opened_ = false, owes_notice_ = false;
  std::optional<MemoryAnswer> writing_;
  std::optional<StreamEnd> finished_;
  std::uint64_t results_ = 0, errors_ = 0, last_sequence_ = 0;
  std::uint64_t next_sequence_ = 1;
  std::size_t good_frames_ = 0;
};

}  // namespace partiemc::server
