// The frames that a stream holds until a checkpoint covers them.
#include "client/library/resend_buffer.h"

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/slice.h>
#include <gtest/gtest.h>

#include <string>

namespace partiemc::client {
namespace {

TEST(ResendBuffer, HoldsFramesByTheirNumbersAndCountsTheirBytes) {
  const auto request = [](const std::string& text) {
    const grpc::Slice slice(text);
    return grpc::ByteBuffer(&slice, 1);
  };
  ResendBuffer buffer(5);
  buffer.Add(request("12"));
  buffer.Add(request("1234"));
  buffer.Add(request("1"));
  EXPECT_EQ(buffer.begin(), 5u);
  EXPECT_EQ(buffer.end(), 8u);
  EXPECT_EQ(buffer.bytes(), 7u);
  EXPECT_EQ(buffer.at(6).Length(), 4u);
  buffer.DropBelow(7);
  EXPECT_EQ(buffer.begin(), 7u);
  EXPECT_EQ(buffer.bytes(), 1u);
  buffer.DropBelow(100);
  EXPECT_EQ(buffer.begin(), 8u) << "what was never there cannot go";
  EXPECT_EQ(buffer.bytes(), 0u);
}

}  // namespace
}  // namespace partiemc::client
