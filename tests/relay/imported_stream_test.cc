// An imported stream without a bus: the owner's messages are given.
#include "server/relay/imported_stream.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <string>

namespace partiemc::server {
namespace {

class Port final : public RelayPort {
 public:
  void Post(std::function<void()> action) override { action(); }
  bool Send(const std::string&, relay::v1::RelayMessage& message) override {
    if (message.fetch().fetch() != 0) last_fetch = message.fetch().fetch();
    return true;
  }

  std::uint64_t last_fetch = 0;
};

class Imported : public testing::Test {
 protected:
  void Receive(std::uint64_t number) {
    relay::v1::Result result;
    result.set_number(number);
    result.set_sequence(number);
    result.set_fetch(port_.last_fetch);
    result.set_first(true);
    result.set_frame("frame");
    stream_.OnMessage(result, {});
  }
  std::uint64_t NewestNumber() {
    dispatcher_.Flush();
    return stream_.broadcaster()->Newest().number;
  }

  Port port_;
  FinishedStreams finished_;
  WatchDispatcher dispatcher_;
  ImportedStream stream_{
      RemoteStream{.replica = "other"}, std::nullopt, dispatcher_, {}, port_, {}};
};

TEST_F(Imported, IgnoresNumbersWithoutASuccessor) {
  constexpr std::uint64_t kLast = std::numeric_limits<std::uint64_t>::max();
  relay::v1::FetchEnd fetch_end;
  fetch_end.set_last_number(kLast);
  stream_.OnMessage(fetch_end, {});
  relay::v1::StreamEnd end;
  end.set_last_number(kLast);
  stream_.OnMessage(end, {});
  Receive(kLast);
  EXPECT_EQ(NewestNumber(), 0u);
  Receive(7);
  EXPECT_EQ(NewestNumber(), 7u);
  relay::v1::FetchEnd found;
  found.set_fetch(port_.last_fetch);
  found.set_last_number(7);
  stream_.OnMessage(found, {});
  end.set_last_number(7);
  stream_.OnMessage(end, {});
  EXPECT_TRUE(stream_.ended());
}

TEST_F(Imported, OnlyAFinishedStreamIsRememberedWithItsLastFrame) {
  const auto remembered_after = [this](const std::string& reason) {
    relay::v1::LiveStream live;
    live.set_lineage(reason);
    ImportedStream stream(RemoteStream{.replica = "other", .stream = live}, std::nullopt,
                          dispatcher_, {.finished = &finished_}, port_, {});
    relay::v1::Result result;
    result.set_number(3);
    result.set_sequence(4);
    result.set_fetch(port_.last_fetch);
    result.set_first(true);
    stream.OnMessage(result, {});
    relay::v1::FetchEnd fetch_end;
    fetch_end.set_fetch(port_.last_fetch);
    fetch_end.set_last_number(3);
    stream.OnMessage(fetch_end, {});
    relay::v1::StreamEnd end;
    end.set_reason(reason);
    end.set_last_number(3);
    stream.OnMessage(end, {});
    EXPECT_TRUE(stream.ended());
    return finished_.Find("", reason);
  };
  EXPECT_FALSE(remembered_after("PRODUCER_LOST"));
  EXPECT_FALSE(remembered_after("DRAINING"));
  const auto finished = remembered_after("FINISHED");
  ASSERT_TRUE(finished);
  EXPECT_EQ(finished->summary().last_sequence(), 4u);
}

TEST_F(Imported, ResultsRepeatTheNumberOfTheLastLoss) {
  const auto last_loss = [&] {
    dispatcher_.Flush();
    return stream_.broadcaster()->Newest().last_loss;
  };
  Receive(7);
  EXPECT_EQ(last_loss(), 0u);
  Receive(9);  // The owner's history begins with this result.
  EXPECT_EQ(last_loss(), 9u);
  Receive(10);
  EXPECT_EQ(last_loss(), 9u);
  Receive(13);
  EXPECT_EQ(last_loss(), 13u);
}

}  // namespace
}  // namespace partiemc::server
