#include "server/relay/pieces.h"

#include <algorithm>
#include <utility>

#include "partiemc/relay/v1/relay.pb.h"

namespace partiemc::server {
namespace {

// Maximum number of senders with an incomplete message.
constexpr std::size_t kMaxSenders = 1024;
// The incomplete messages of all senders may have the size of this many messages of maximum size.
constexpr std::size_t kMaxMessages = 4;

}  // namespace

bool SendInPieces(const std::string& replica, std::uint64_t number, std::string_view message,
                  absl::FunctionRef<bool(std::string_view piece)> send) {
  const std::size_t pieces =
      std::max<std::size_t>(1, (message.size() + kPieceBytes - 1) / kPieceBytes);
  relay::v1::Piece piece;
  piece.set_replica(replica);
  piece.set_message(number);
  piece.set_pieces(static_cast<std::uint32_t>(pieces));
  for (std::size_t k = 0; k < pieces; ++k) {
    piece.set_piece(static_cast<std::uint32_t>(k));
    piece.set_data(std::string(message.substr(k * kPieceBytes, kPieceBytes)));
    if (!send(piece.SerializeAsString())) return false;
  }
  return true;
}

std::string PieceJoiner::TakeOut(std::map<std::string, Begun>::iterator begun) {
  std::string bytes = std::move(begun->second.bytes);
  held_bytes_ -= bytes.size();
  begun_.erase(begun);
  return bytes;
}

void PieceJoiner::Forget(const std::string& replica) {
  const auto found = begun_.find(replica);
  if (found != begun_.end()) TakeOut(found);
}

void PieceJoiner::ForgetIdle() {
  for (auto next = begun_.begin(); next != begun_.end();) {
    const auto begun = next++;
    if (std::exchange(begun->second.idle, true)) TakeOut(begun);
  }
}

std::optional<std::string> PieceJoiner::Add(std::string_view bytes) {
  relay::v1::Piece piece;
  if (!piece.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return std::nullopt;
  const std::size_t size = piece.data().size();
  auto found = begun_.find(piece.replica());
  if (piece.piece() == 0) {
    if (found != begun_.end()) TakeOut(found);
    if (size > max_bytes_) return std::nullopt;
    if (piece.pieces() == 1) return std::move(*piece.mutable_data());
    if (piece.pieces() == 0 || begun_.size() >= kMaxSenders) return std::nullopt;
    found = begun_.emplace(piece.replica(), Begun{.message = piece.message()}).first;
  }
  if (found == begun_.end()) return std::nullopt;
  Begun& begun = found->second;
  if (begun.message != piece.message() || begun.next_piece != piece.piece() ||
      piece.piece() >= piece.pieces() || begun.bytes.size() + size > max_bytes_ ||
      held_bytes_ + size > kMaxMessages * max_bytes_) {
    TakeOut(found);
    return std::nullopt;
  }
  begun.idle = false;
  begun.bytes += piece.data();
  held_bytes_ += size;
  if (++begun.next_piece < piece.pieces()) return std::nullopt;
  return TakeOut(found);
}

}  // namespace partiemc::server
