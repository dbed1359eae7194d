#include "server/relay/pieces.h"

#include <algorithm>
#include <utility>

#include "partiemc/relay/v1/relay.pb.h"

namespace partiemc::server {
namespace {

// Replicas whose messages are being put together; others have to wait until those are through.
constexpr std::size_t kMaxSenders = 1024;

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

std::optional<std::string> PieceJoiner::Add(std::string_view bytes) {
  relay::v1::Piece piece;
  if (!piece.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return std::nullopt;
  const auto found = begun_.find(piece.replica());
  if (piece.piece() == 0) {
    if (found != begun_.end()) begun_.erase(found);
    if (piece.data().size() > max_bytes_) return std::nullopt;
    if (piece.pieces() == 1) return std::move(*piece.mutable_data());
    if (piece.pieces() == 0 || begun_.size() >= kMaxSenders) return std::nullopt;
    begun_[piece.replica()] = {piece.message(), 1, std::move(*piece.mutable_data())};
    return std::nullopt;
  }
  if (found == begun_.end()) return std::nullopt;
  Begun& begun = found->second;
  if (begun.message != piece.message() || begun.next_piece != piece.piece() ||
      piece.piece() >= piece.pieces() || begun.bytes.size() + piece.data().size() > max_bytes_) {
    begun_.erase(found);
    return std::nullopt;
  }
  begun.bytes += piece.data();
  if (++begun.next_piece < piece.pieces()) return std::nullopt;
  std::optional<std::string> whole = std::move(begun.bytes);
  begun_.erase(found);
  return whole;
}

}  // namespace partiemc::server
