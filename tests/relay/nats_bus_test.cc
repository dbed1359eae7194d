// The bus with a real NATS server.
#include "server/relay/nats_bus.h"

#include <gtest/gtest.h>

#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "relay/nats_process.h"
#include "relay/soon.h"

namespace partiemc::server {
namespace {

std::unique_ptr<MessageBus> Connect(const std::string& url) {
  auto bus = ConnectToNats(url);
  EXPECT_TRUE(bus.ok()) << bus.status();
  return *std::move(bus);
}

// Received messages; thread-safe.
struct Heard {
  std::mutex mutex;
  std::vector<std::string> messages;

  MessageBus::Handler Handler() {
    return [this](std::string_view message) {
      const std::lock_guard lock(mutex);
      messages.emplace_back(message);
    };
  }
  std::size_t count() {
    const std::lock_guard lock(mutex);
    return messages.size();
  }
};

TEST(NatsBus, KeepsASendersOrderAcrossSubjectsWithoutEchoes) {
  const NatsProcess nats;
  const auto one = Connect(nats.url()), other = Connect(nats.url());
  Heard heard, echoes;
  const auto a = other->Subscribe("a", heard.Handler()), b = other->Subscribe("b", heard.Handler());
  const auto echo = one->Subscribe("a", echoes.Handler());
  other->Flush();
  const std::string large(std::size_t{600} << 10, 'x');
  for (int k = 0; k < 500; ++k) {
    const std::string message = std::to_string(k) + (k % 50 == 0 ? large : "");
    ASSERT_TRUE(one->Publish(k % 2 == 0 ? "a" : "b", message));
  }
  ASSERT_TRUE(Soon([&] { return heard.count() == 500; }));
  for (int k = 0; k < 500; ++k) EXPECT_EQ(std::stoi(heard.messages[k]), k);
  EXPECT_EQ(echoes.count(), 0u);
}

TEST(NatsBus, ComesBackWithItsSubscriptionsAndSendsNothingOld) {
  NatsProcess nats;
  const auto one = Connect(nats.url()), other = Connect(nats.url());
  Heard heard;
  const auto a = other->Subscribe("a", heard.Handler());
  other->Flush();
  ASSERT_TRUE(one->Publish("a", "first"));
  ASSERT_TRUE(Soon([&] { return heard.count() == 1; }));
  nats.Stop();
  ASSERT_TRUE(Soon([&] { return !one->connected() && !other->connected(); }));
  EXPECT_FALSE(one->Publish("a", "lost"));
  nats.Start();
  ASSERT_TRUE(Soon([&] { return one->connected() && other->connected(); }));
  other->Flush();
  ASSERT_TRUE(one->Publish("a", "second"));
  ASSERT_TRUE(Soon([&] { return heard.count() == 2; }));
  EXPECT_EQ(heard.messages[1], "second");
}

TEST(NatsBus, AFrozenServerCountsAsGoneUntilItContinues) {
  NatsProcess nats;
  const auto one = Connect(nats.url()), other = Connect(nats.url());
  Heard heard;
  const auto a = other->Subscribe("a", heard.Handler());
  other->Flush();
  nats.Freeze();
  EXPECT_TRUE(Soon([&] { return !one->connected() && !other->connected(); }));
  nats.Continue();
  ASSERT_TRUE(Soon([&] { return one->connected() && other->connected(); }));
  other->Flush();
  ASSERT_TRUE(one->Publish("a", "again"));
  EXPECT_TRUE(Soon([&] { return heard.count() == 1; }));
}

TEST(NatsBus, ConnectsToAServerThatComesLater) {
  NatsProcess nats;
  nats.Stop();
  const auto bus = Connect(nats.url());
  EXPECT_FALSE(bus->connected());
  Heard heard;
  const auto a = bus->Subscribe("a", heard.Handler());
  ASSERT_NE(a, nullptr);
  nats.Start();
  ASSERT_TRUE(Soon([&] { return bus->connected(); }));
  bus->Flush();
  const auto other = Connect(nats.url());
  ASSERT_TRUE(other->Publish("a", "first"));
  EXPECT_TRUE(Soon([&] { return heard.count() == 1; }));
}

TEST(NatsBus, AUrlThatIsNoneIsRefusedWithoutItsPassword) {
  const auto bus = ConnectToNats("nats://user:secret@host:notaport");
  ASSERT_FALSE(bus.ok());
  EXPECT_EQ(bus.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(std::string(bus.status().message()).find("secret"), std::string::npos);
}

}  // namespace
}  // namespace partiemc::server
