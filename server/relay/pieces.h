// Splits messages into pieces that the bus accepts, and joins received pieces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "absl/functional/function_ref.h"

namespace partiemc::server {

/// Size of a piece. By default NATS accepts messages of at most one megabyte.
inline constexpr std::size_t kPieceBytes = std::size_t{512} << 10;

/// Calls `send` with each piece of `message`, in order, until `send` returns false. Each piece is a
/// serialised partiemc.relay.v1.Piece of the sender `replica`. `number` differs for each message of
/// this sender. Returns whether all pieces were sent.
bool SendInPieces(const std::string& replica, std::uint64_t number, std::string_view message,
                  absl::FunctionRef<bool(std::string_view piece)> send);

/// Joins pieces of several senders. The pieces of one sender arrive in order, and a sender finishes
/// a message before it begins the next. A message with a missing piece is dropped.
class PieceJoiner {
 public:
  /// Drops a message of more than `max_bytes`. Also drops a message if the incomplete messages
  /// would together exceed four times `max_bytes` or 1024 senders.
  explicit PieceJoiner(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// Adds a serialised Piece. Returns the whole message if this piece completes it.
  std::optional<std::string> Add(std::string_view piece);
  /// Drops the incomplete message of this sender.
  void Forget(const std::string& replica);
  /// Drops the incomplete messages that got no piece since the last call. Their senders may be
  /// lost, and the messages would take room from other senders.
  void ForgetIdle();
  /// Bytes of incomplete messages.
  std::size_t held_bytes() const { return held_bytes_; }

 private:
  struct Begun {
    std::uint64_t message = 0;
    std::uint32_t next_piece = 0;
    bool idle = false;  // No piece since ForgetIdle.
    std::string bytes;
  };

  // Removes an incomplete message and returns its bytes.
  std::string TakeOut(std::map<std::string, Begun>::iterator begun);

  const std::size_t max_bytes_;
  std::map<std::string, Begun> begun_;  // Key: sender.
  std::size_t held_bytes_ = 0;
};

}  // namespace partiemc::server
