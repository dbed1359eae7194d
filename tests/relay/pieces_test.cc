#include "server/relay/pieces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/random.h"

namespace partiemc::server {
namespace {

using testing::ElementsAre;
using testing::Optional;

std::vector<std::string> PiecesOf(const std::string& replica, std::uint64_t number,
                                  const std::string& message) {
  std::vector<std::string> pieces;
  EXPECT_TRUE(SendInPieces(replica, number, message, [&](std::string_view piece) {
    pieces.emplace_back(piece);
    return true;
  }));
  return pieces;
}

TEST(Pieces, MessagesOfAnySizeComeOutAsTheyWentIn) {
  for (const std::size_t bytes :
       {std::size_t{0}, std::size_t{1}, kPieceBytes, kPieceBytes + 1, 5 * kPieceBytes}) {
    std::string message(bytes, 'a');
    if (bytes > 0) message.back() = 'z';
    const auto pieces = PiecesOf("one", 1, message);
    EXPECT_EQ(pieces.size(), std::max<std::size_t>(1, (bytes + kPieceBytes - 1) / kPieceBytes));
    PieceJoiner joiner(8 * kPieceBytes);
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      EXPECT_LT(pieces[k].size(), std::size_t{1'000'000}) << "NATS takes no more";
      const auto whole = joiner.Add(pieces[k]);
      if (k + 1 < pieces.size()) {
        EXPECT_FALSE(whole);
      } else {
        EXPECT_THAT(whole, Optional(message));
      }
    }
  }
}

TEST(Pieces, OfSeveralSendersDoNotMix) {
  const auto a = PiecesOf("a", 1, std::string(3 * kPieceBytes, 'a'));
  const auto b = PiecesOf("b", 1, std::string(3 * kPieceBytes, 'b'));
  PieceJoiner joiner(8 * kPieceBytes);
  for (int k = 0; k < 2; ++k) {
    EXPECT_FALSE(joiner.Add(a[k]));
    EXPECT_FALSE(joiner.Add(b[k]));
  }
  EXPECT_THAT(joiner.Add(b[2]), Optional(std::string(3 * kPieceBytes, 'b')));
  EXPECT_THAT(joiner.Add(a[2]), Optional(std::string(3 * kPieceBytes, 'a')));
}

TEST(Pieces, OfManySendersTogetherTakeNoMoreThanThereIsRoomFor) {
  PieceJoiner joiner(4 * kPieceBytes);
  for (int sender = 0; sender < 100; ++sender) {
    const auto pieces = PiecesOf(std::to_string(sender), 1, std::string(4 * kPieceBytes, 'a'));
    for (int k = 0; k < 3; ++k) EXPECT_FALSE(joiner.Add(pieces[k]));
    EXPECT_LE(joiner.held_bytes(), 16 * kPieceBytes);
  }
  EXPECT_GE(joiner.held_bytes(), 15 * kPieceBytes);
  // Messages that were begun can be completed, which frees capacity.
  const auto first = PiecesOf("0", 1, std::string(4 * kPieceBytes, 'a'));
  EXPECT_TRUE(joiner.Add(first[3]));
  for (int sender = 0; sender < 100; ++sender) joiner.Forget(std::to_string(sender));
  EXPECT_EQ(joiner.held_bytes(), 0u);
}

TEST(Pieces, OfSendersThatStoppedMakeRoom) {
  PieceJoiner joiner(4 * kPieceBytes);
  const auto slow = PiecesOf("slow", 1, std::string(2 * kPieceBytes, 's'));
  EXPECT_FALSE(joiner.Add(slow[0]));
  for (const char* sender : {"a", "b", "c", "d"}) {
    const auto pieces = PiecesOf(sender, 1, std::string(4 * kPieceBytes, 'x'));
    for (int k = 0; k < 3; ++k) EXPECT_FALSE(joiner.Add(pieces[k]));
  }
  joiner.ForgetIdle();
  EXPECT_EQ(joiner.held_bytes(), 13 * kPieceBytes) << "they may still be sent";
  const auto third = PiecesOf("slow", 2, std::string(3 * kPieceBytes, 's'));
  EXPECT_FALSE(joiner.Add(third[0]));
  joiner.ForgetIdle();
  EXPECT_EQ(joiner.held_bytes(), kPieceBytes);
  EXPECT_FALSE(joiner.Add(third[1]));
  EXPECT_TRUE(joiner.Add(third[2]));
}

TEST(Pieces, AMessageWithAPieceMissingIsLeftOutAndTheNextIsNot) {
  const std::string large(3 * kPieceBytes, 'a');
  for (int missing = 0; missing < 3; ++missing) {
    PieceJoiner joiner(8 * kPieceBytes);
    const auto first = PiecesOf("a", 1, large), second = PiecesOf("a", 2, large);
    for (int k = 0; k < 3; ++k) {
      if (k == missing) continue;
      EXPECT_FALSE(joiner.Add(first[k]));
    }
    EXPECT_FALSE(joiner.Add(second[0]));
    EXPECT_FALSE(joiner.Add(second[1]));
    EXPECT_THAT(joiner.Add(second[2]), Optional(large));
  }
}

TEST(Pieces, WhatIsTooLargeOrMalformedIsLeftOut) {
  PieceJoiner joiner(kPieceBytes + 10);
  for (const auto& piece : PiecesOf("a", 1, std::string(2 * kPieceBytes, 'a'))) {
    EXPECT_FALSE(joiner.Add(piece));
  }
  support::Random random(11);
  const auto pieces = PiecesOf("a", 2, std::string(1000, 'b'));
  for (int k = 0; k < 20'000; ++k) {
    std::string piece = pieces.front();
    piece.resize(1 + random.Below(piece.size()));
    piece[random.Below(piece.size())] = static_cast<char>(random.Bits());
    joiner.Add(piece);
  }
  EXPECT_TRUE(joiner.Add(pieces.front()));
}

}  // namespace
}  // namespace partiemc::server
