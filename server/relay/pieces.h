// Messages of any size in pieces that the bus takes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "absl/functional/function_ref.h"

namespace partiemc::server {

/// NATS takes messages of up to a megabyte, unless it is told otherwise.
inline constexpr std::size_t kPieceBytes = std::size_t{512} << 10;

/// Calls `send` with each partiemc.relay.v1.Piece of `message`, serialised, in their order, until
/// it returns false. Whether it never did.
bool SendInPieces(const std::string& replica, std::uint64_t number, std::string_view message,
                  absl::FunctionRef<bool(std::string_view piece)> send);

/// Puts the pieces of several senders together; those of one come in their order, one message after
/// the other. A message of which a piece is missing is left out.
class PieceJoiner {
 public:
  /// A message of more than `max_bytes` is left out, and one for which those of others that are
  /// not whole yet leave no room: all together have four times as much.
  explicit PieceJoiner(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// The message of which `piece`, a serialised Piece, is the last.
  std::optional<std::string> Add(std::string_view piece);
  /// Of this sender nothing more is expected.
  void Forget(const std::string& replica);
  /// Of messages that are not whole yet.
  std::size_t held_bytes() const { return held_bytes_; }

 private:
  struct Begun {
    std::uint64_t message = 0;
    std::uint32_t next_piece = 0;
    std::string bytes;
  };

  // Its bytes, which nothing more is expected of.
  std::string TakeOut(std::map<std::string, Begun>::iterator begun);

  const std::size_t max_bytes_;
  std::map<std::string, Begun> begun_;  // By sender.
  std::size_t held_bytes_ = 0;
};

}  // namespace partiemc::server
