// The ranks of a simulator as plain clients of one stream, each with its own connection.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/moving_blob.h"
#include "service/service_testing.h"

namespace partiemc::server {

inline constexpr char kPartsToken[] = "between the ranks";

inline v1::ReconstructRequest OpenPart(const std::string& name, std::uint32_t part,
                                       std::uint32_t parts) {
  auto request = OpenRequest(name);
  request.mutable_open()->set_part(part);
  request.mutable_open()->set_parts(parts);
  request.mutable_open()->set_parts_token(kPartsToken);
  return request;
}

/// Part `part` of frame `index` of blob `seed`. With ids (indices in the blob), particle k belongs
/// to part k % parts; without ids, each part is a contiguous range of the blob.
inline v1::ReconstructRequest PartRequest(std::uint32_t part, std::uint32_t parts,
                                          std::uint64_t sequence, unsigned seed,
                                          std::uint64_t index, bool ids) {
  const std::vector<double> blob = MovingBlob(seed, index);
  const std::size_t count = blob.size() / 2;
  v1::ReconstructRequest request;
  v1::ParticleFrame& frame = *request.mutable_frame();
  frame.set_sequence(sequence);
  frame.set_position_format(v1::POSITION_FORMAT_FLOAT64_2);
  for (std::uint64_t k = 0; k < count; ++k) {
    if ((ids ? k % parts : k * parts / count) != part) continue;
    frame.mutable_positions()->append(reinterpret_cast<const char*>(&blob[2 * k]), 16);
    if (ids) frame.mutable_ids()->append(reinterpret_cast<const char*>(&k), 8);
  }
  return request;
}

/// Opens the parts in order, part 0 first.
class Ranks {
 public:
  Ranks(Server& server, std::string name, std::uint32_t parts, std::uint32_t timeout_ms = 0,
        std::uint32_t checkpoint_interval = 0)
      : server_(server), name_(std::move(name)) {
    for (std::uint32_t part = 0; part < parts; ++part) {
      ranks_.emplace_back();
      auto open = OpenPart(name_, part, parts);
      open.mutable_open()->set_part_timeout_ms(timeout_ms);
      open.mutable_open()->set_checkpoint_interval(checkpoint_interval);
      const auto opened = Open(part, open);
      if (part == 0) opened_ = opened;
    }
  }

  /// The first response to part 0.
  const v1::StreamOpened& opened() const { return opened_; }

  StreamClient& operator[](std::uint32_t part) { return *ranks_[part]; }
  std::uint32_t count() const { return static_cast<std::uint32_t>(ranks_.size()); }

  /// Closes the connection of `part` and opens another.
  v1::StreamOpened Reopen(std::uint32_t part) { return Open(part, OpenPart(name_, part, count())); }
  v1::StreamOpened Open(std::uint32_t part, const v1::ReconstructRequest& request) {
    ranks_[part] = std::make_unique<StreamClient>(Connect(server_, Transport::kTcp));
    auto response = ranks_[part]->SendAndReceive(request);
    EXPECT_TRUE(response.has_opened()) << "part " << part;
    return response.opened();
  }

  bool Send(std::uint32_t part, std::uint64_t sequence, unsigned seed = 1, bool ids = true) {
    return ranks_[part]->Send(PartRequest(part, count(), sequence, seed, sequence - 1, ids));
  }
  void SendAll(std::uint64_t sequence) {
    for (std::uint32_t part = 0; part < count(); ++part) Send(part, sequence);
  }

  /// Expects the answers to this frame of blob 1: the result for part 0, confirmations for the
  /// other parts.
  void ExpectAnswered(std::uint64_t sequence, const Digests& expected) {
    const auto answer = ranks_[0]->Receive();
    ASSERT_TRUE(answer.has_frame()) << answer.ShortDebugString().substr(0, 200);
    EXPECT_EQ(answer.frame().sequence(), sequence);
    EXPECT_EQ((Digests{answer.frame().rings_digest(), answer.frame().mesh_digest()}), expected);
    for (std::uint32_t part = 1; part < count(); ++part) ExpectTaken(part, sequence);
  }
  void ExpectTaken(std::uint32_t part, std::uint64_t sequence) {
    const auto answer = ranks_[part]->Receive();
    ASSERT_TRUE(answer.has_part()) << "part " << part << ": " << answer.ShortDebugString();
    EXPECT_EQ(answer.part().sequence(), sequence);
  }
  void ExpectRefused(std::uint32_t part, std::uint64_t sequence, const std::string& reason) {
    const auto answer = ranks_[part]->Receive();
    ASSERT_TRUE(answer.has_error()) << "part " << part << ": " << answer.ShortDebugString();
    EXPECT_EQ(answer.error().sequence(), sequence);
    EXPECT_EQ(answer.error().reason(), reason) << answer.error().message();
  }

 private:
  Server& server_;
  const std::string name_;
  std::vector<std::unique_ptr<StreamClient>> ranks_;
  v1::StreamOpened opened_;
};

}  // namespace partiemc::server
