#include "server/connections/sockets.h"

#include <fcntl.h>
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/connections/acceptor.h"
#include "server/rpc/stream_counts.h"

namespace partiemc::server {
namespace {

bool Eventually(const std::function<bool()>& is_true) {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!is_true()) {
    if (std::chrono::steady_clock::now() > give_up) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

sockaddr_in LocalAddress(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

// Connects to `port` of this machine from `own_port`; 0: any port. The kernel frees the client's
// port at once when the connection is closed.
Descriptor ConnectTo(std::uint16_t port, std::uint16_t own_port = 0) {
  Descriptor client(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const int on = 1;
  setsockopt(client.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  const linger reset{.l_onoff = 1, .l_linger = 0};
  setsockopt(client.get(), SOL_SOCKET, SO_LINGER, &reset, sizeof(reset));
  const sockaddr_in from = LocalAddress(own_port), to = LocalAddress(port);
  EXPECT_EQ(bind(client.get(), reinterpret_cast<const sockaddr*>(&from), sizeof(from)), 0);
  EXPECT_EQ(connect(client.get(), reinterpret_cast<const sockaddr*>(&to), sizeof(to)), 0);
  return client;
}

std::uint16_t OwnPort(const Descriptor& client) {
  sockaddr_in address{};
  socklen_t size = sizeof(address);
  EXPECT_EQ(getsockname(client.get(), reinterpret_cast<sockaddr*>(&address), &size), 0);
  return ntohs(address.sin_port);
}

// A listener of this machine, a client and the accepted connection.
struct Loopback {
  Listeners listeners =
      ListenOn({.host = "127.0.0.1", .port = 0, .unix_path = ""}, std::chrono::milliseconds(1000))
          .value();
  Descriptor client{socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  Descriptor accepted;

  Loopback() {
    const sockaddr_in to = LocalAddress(listeners.port);
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

TEST(Connections, TheLastDescriptorEvictsAnIdleConnection) {
  const Loopback first, second;
  ConnectionTable table;
  ConnectionWatch watch(ConnectionLimits{}, ConnectionRules{}, table);
  std::vector<Descriptor> handed_over;
  const auto hand_over = [&](Descriptor one) { handed_over.push_back(std::move(one)); };
  watch.Add(Descriptor(dup(first.accepted.get())), hand_over);
  Descriptor last(dup(second.accepted.get()));
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const int free = Descriptor(fcntl(last.get(), F_DUPFD_CLOEXEC, 0)).get();
  const rlimit none_free{.rlim_cur = static_cast<rlim_t>(free), .rlim_max = before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none_free), 0);
  watch.Add(std::move(last), hand_over);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_EQ(handed_over.size(), 2u);
  EXPECT_EQ(watch.counters().evicted, 1u);
  EXPECT_EQ(watch.count(), 1u);
}

// A watch of connections on which clients send bytes that belong to no call.
class SentBytes {
 public:
  explicit SentBytes(const ConnectionLimits& limits)
      : watch(limits, {.unaccounted_bytes = 30'000, .usual_bytes = 2'000}, table_) {}

  void Add(const Loopback& connection, std::size_t bytes) {
    const std::vector<char> sent(bytes);
    EXPECT_EQ(send(connection.client.get(), sent.data(), bytes, 0), static_cast<ssize_t>(bytes));
    watch.Add(Descriptor(dup(connection.accepted.get())),
              [&](Descriptor one) { handed_over_.push_back(std::move(one)); });
  }
  // Waits for floods. Returns the number of connections that were cut.
  std::uint64_t Cut() {
    const auto& cut = watch.counters().floods[static_cast<std::size_t>(Flood::kUnaccountedBytes)];
    EXPECT_TRUE(Eventually([&] { return cut > 0; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return cut;
  }

 private:
  ConnectionTable table_;
  std::vector<Descriptor> handed_over_;

 public:
  ConnectionWatch watch;
};

// Sends more than the limit, more than a sixth of it, and less, on connections of one address.
// Returns the number of connections that were cut.
std::uint64_t CutOfThree(const ConnectionLimits& limits) {
  const Loopback flood, suspect, usual;
  SentBytes sent(limits);
  sent.Add(suspect, 10'000);
  sent.Add(usual, 1'000);
  sent.Add(flood, 40'000);
  sent.watch.Start(nullptr);
  const std::uint64_t cut = sent.Cut();
  EXPECT_EQ(sent.watch.count(), 3 - cut);
  return cut;
}

TEST(Connections, AFloodAlsoCutsTheSuspectsOfItsAddress) { EXPECT_EQ(CutOfThree({}), 2u); }

TEST(Connections, BehindAProxyAFloodCutsNoOtherConnection) {
  EXPECT_EQ(CutOfThree({.new_of_address = 0}), 1u);
}

TEST(Connections, AFloodCutsAndRefusesNoHealthCheckOfItsAddress) {
  const Loopback flood, check, later;
  // The second connection of an address may only make health checks.
  SentBytes sent({.connections = 10, .of_address = 1, .new_of_address = 10});
  sent.Add(flood, 40'000);
  sent.Add(check, 3'500);
  sent.watch.Start(nullptr);
  EXPECT_EQ(sent.Cut(), 1u);
  EXPECT_EQ(sent.watch.count(), 1u);
  sent.Add(later, 0);
  EXPECT_EQ(sent.watch.count(), 2u);
}

TEST(Connections, NoneIsHandedOverWhenTheAcceptorIsGone) {
  ConnectionTable table;
  // The second connection of an address may only make health checks, so its hand-over is delayed.
  ConnectionWatch watch({.connections = 10, .of_address = 1, .new_of_address = 10},
                        ConnectionRules{}, table);
  auto acceptor = Acceptor::Listen({.host = "127.0.0.1", .port = 0, .unix_path = ""},
                                   std::chrono::milliseconds(1000), watch)
                      .value();
  acceptor->Start([](int descriptor) { Descriptor{descriptor}; });
  const Descriptor kept = ConnectTo(acceptor->port()), waits = ConnectTo(acceptor->port());
  ASSERT_TRUE(Eventually([&] { return watch.count() == 2; }));
  acceptor.reset();
  EXPECT_EQ(watch.count(), 1u);
  watch.Start(nullptr);
}

// Otherwise a client could avoid the limits of streams and headers.
TEST(ChannelzStreams, CountsTheNextConnectionFromTheSamePort) {
  grpc::CallbackGenericService service;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterCallbackGenericService(&service);
  const auto server = builder.BuildAndStart();
  ASSERT_NE(server, nullptr);
  const auto server_port = static_cast<std::uint16_t>(port);
  Descriptor first = ConnectTo(server_port);
  const std::uint16_t own_port = OwnPort(first);
  const auto peer = [](std::uint16_t of) { return "ipv4:127.0.0.1:" + std::to_string(of); };
  ConnectionReading reading;
  ChannelzStreams observer, streams;
  std::int64_t first_id = 0, other_id = 0, new_id = 0, id = 0;
  ASSERT_TRUE(Eventually([&] { return observer.Read(peer(own_port), first_id, reading); }));
  const Descriptor other = ConnectTo(server_port);
  // `streams` also lists the first connection.
  ASSERT_TRUE(Eventually([&] { return streams.Read(peer(OwnPort(other)), other_id, reading); }));
  first = Descriptor();
  ASSERT_TRUE(Eventually([&] { return !observer.Read(peer(own_port), first_id, reading); }));
  first = ConnectTo(server_port, own_port);
  ASSERT_TRUE(Eventually([&] { return observer.Read(peer(own_port), new_id, reading); }));
  EXPECT_TRUE(streams.Read(peer(own_port), id, reading));
  first = Descriptor();
  server->Shutdown(std::chrono::system_clock::now());
}

}  // namespace
}  // namespace partiemc::server
