// Frames of any size, and a client that sends them in one stream.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include "attack/http2_client.h"

namespace partiemc::attack {

/// About the largest frame that a server with 256 MB for frames accepts.
inline constexpr std::size_t kLarge = 32'900'000;

/// A square of particles with attributes that make the frame `bytes` large.
std::string SquareFrame(std::uint64_t sequence, std::size_t side, std::size_t bytes);

/// Particles of spacing 1 in space, as float32: a full cube, or a lattice with wide gaps.
std::string CubeFrame(std::uint64_t sequence, std::size_t side, float gap);

struct PartOf {
  std::string stream;
  std::uint32_t part = 0, parts = 0, timeout_ms = 0;
};

/// One Reconstruct call over its own connection.
class Sender {
 public:
  static constexpr std::chrono::seconds kPatience{120};

  explicit Sender(const std::string& address, const std::string& token = "");

  bool Open(const PartOf& part = {});
  /// Opens a stream of surfaces of spacing 1, in compact coordinates.
  bool OpenSurfaces();
  /// Sends a message as fast as the server reads it. False if the call has ended.
  bool Send(const std::string& message, bool last, std::chrono::milliseconds time = kPatience);
  /// True if an answer to the last message has begun to arrive.
  bool IsAnswered(std::chrono::milliseconds time = kPatience);
  /// The status of the call; -1 if it has not ended in time.
  int End();

 private:
  bool SendOpen(const std::string& message);

  Http2Client client_;
  std::uint32_t call_ = 0;
  std::size_t bytes_ = 0, before_ = 0;
  int status_ = -1;
  bool ended_ = false;
};

}  // namespace partiemc::attack
