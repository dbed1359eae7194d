#include "server/connections/sockets.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <chrono>
#include <string>

namespace partiemc::server {
namespace {

// A listener of this machine, a client and the accepted connection.
struct Loopback {
  Listeners listeners =
      ListenOn({.host = "127.0.0.1", .port = 0, .unix_path = ""}, std::chrono::milliseconds(1000))
          .value();
  Descriptor client{socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  Descriptor accepted;

  Loopback() {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(listeners.port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(client.get(), reinterpret_cast<const sockaddr*>(&to), sizeof(to)), 0);
    while (accepted.get() < 0) {
      accepted = Descriptor(accept4(listeners.sockets.front().get(), nullptr, nullptr, 0));
    }
  }
};

TEST(Sockets, CountReceivedAndReadBytes) {
  const Loopback loopback;
  const std::string bytes(1000, 'x');
  ASSERT_EQ(send(loopback.client.get(), bytes.data(), bytes.size(), 0), 1000);
  ConnectionReading reading;
  while (reading.bytes_received < bytes.size()) {
    ASSERT_TRUE(ReadByteCounts(loopback.accepted.get(), reading));
  }
  EXPECT_EQ(reading.bytes_received, 1000u);
  EXPECT_EQ(reading.bytes_read, 0u);
  std::string read(400, ' ');
  ASSERT_EQ(recv(loopback.accepted.get(), read.data(), read.size(), 0), 400);
  ASSERT_TRUE(ReadByteCounts(loopback.accepted.get(), reading));
  EXPECT_EQ(reading.bytes_read, 400u);
}

// A count that decreased would be a flood of 2^64 bytes.
TEST(Sockets, CountsDoNotDecreaseWhenAConnectionIsAborted) {
  const Loopback loopback;
  ASSERT_EQ(send(loopback.client.get(), "hello", 5, 0), 5);
  ConnectionReading reading;
  while (reading.bytes_received < 5) {
    ASSERT_TRUE(ReadByteCounts(loopback.accepted.get(), reading));
  }
  Abort(loopback.accepted.get());
  ReadByteCounts(loopback.accepted.get(), reading);
  EXPECT_EQ(reading.bytes_received, 5u);
}

TEST(Sockets, PeersOfALoopbackConnectionHaveItsAddress) {
  const Loopback loopback;
  const auto peer = PeerOf(loopback.accepted.get());
  ASSERT_TRUE(peer.has_value());
  EXPECT_EQ(peer->name.substr(0, 15), "ipv4:127.0.0.1:");
}

}  // namespace
}  // namespace partiemc::server
