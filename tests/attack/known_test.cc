// Publicly known attacks on gRPC 1.51.1 (Debian 12) and on HTTP/2 servers in general. The server
// must survive each, with bounded memory, and serve others. Attacks that gRPC itself does not
// survive are run through the proxy of docker/haproxy.cfg.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "attack/attacked_server.h"
#include "attack/honest_stream.h"
#include "attack/http2_client.h"
#include "attack/requests.h"
#include "support/certificates.h"
#include "support/temporary_folder.h"

namespace partiemc::attack {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kKnownPatience(20);
// Maximum growth of the process by an attack.
constexpr double kMaxGrowthMib = 32;

// The status of one GetServerInfo call over a new connection; -1: none. The call has another
// address than the attacks: if the server has cut an attack, its address may only make health
// checks for ten seconds.
int Serves(const std::string& address, const Headers& more = {}) {
  int status = -1;
  try {
    Http2Client client(address, {.source = "127.0.0.3"});
    client.OnFrame([&](const ReceivedFrame& frame) {
      if (frame.type == FrameType::kHeaders) status = std::max(status, GrpcStatusOf(frame.payload));
    });
    client.Data(client.Call(CallHeaders(kGetServerInfo, more)), Prefixed(""), true);
    client.Flush(kKnownPatience);
    client.Read(kKnownPatience, [&] { return status >= 0; });
  } catch (const std::runtime_error&) {
  }
  return status;
}

class Known : public ::testing::Test {
 protected:
  Known() : before_(server_.ResidentMib()), memory_(server_.process().process()) {}

  void ExpectBorne(const char* what) {
    ASSERT_TRUE(server_.Lives()) << what << ": " << server_.Output();
    EXPECT_EQ(Serves(server_.address()), 0) << what;
    const double peak = memory_.PeakMib(), processor = server_.ProcessorSeconds();
    std::printf("%s: %.1f -> at most %.1f MiB, %.2f s of processor time\n", what, before_, peak,
                processor);
    EXPECT_LE(peak - before_, kMaxGrowthMib) << what;
    EXPECT_EQ(server_.Terminate(), 0) << what;
  }

  AttackedServer server_{{"--memory-budget", "64MB"}};
  const double before_;
  MemoryWatch memory_;
};

// CVE-2023-1428: such a header, then more than the limit of 8 KiB for all headers.
TEST_F(Known, HeadersThatAbort) {
  const Headers culprits = {{"te", "x"},
                            {":scheme", "x"},
                            {"grpclb_client_stats", "x"},
                            {"grpc-timeout", "x"},
                            {"grpc-encoding", "x"},
                            {"content-type", "x"},
                            {":method", "x"},
                            {"grpc-previous-rpc-attempts", "x"},
                            {"grpc-retry-pushback-ms", "x"},
                            {"grpc-status", "x"},
                            {"grpc-trace-bin", "!"},
                            {"lb-token", "x"},
                            {"lb-cost-bin", "x"}};
  for (const auto& culprit : culprits) {
    for (const std::size_t size : {0u, 9'000u, 20'000u}) {
      for (const bool split : {false, true}) {
        if (!server_.Lives()) break;
        Http2Client client(server_.address());
        const std::string block =
            HeaderBlock(CallHeaders(kGetServerInfo, {culprit})) +
            (size == 0 ? "" : HeaderBlock({{"x-large", std::string(size, 'a')}})) +
            HeaderBlock({culprit, {"x-after", "b"}});
        if (block.size() > 16'384 || split) {
          const std::size_t half = std::min<std::size_t>(block.size() / 2, 16'384);
          const auto call = client.CallBlock(block.substr(0, half), 0);
          client.Frame(FrameType::kContinuation, kEndHeaders, call, block.substr(half));
        } else {
          client.CallBlock(block);
        }
        client.Flush(kKnownPatience);
        client.Read(milliseconds(20));
      }
    }
    EXPECT_TRUE(server_.Lives()) << culprit.first << ": " << culprit.second;
  }
  ExpectBorne("headers that abort");
}

TEST_F(Known, TinyContinuations) {
  Http2Client client(server_.address());
  const auto call = client.CallBlock(HeaderBlock(CallHeaders(kGetServerInfo)), 0);
  for (int k = 0; k < 500'000 && !client.closed(); ++k) {
    client.Frame(FrameType::kContinuation, 0, call, "");
    if (client.queued() > (1u << 20)) client.Flush(kKnownPatience);
  }
  client.Flush(kKnownPatience);
  ExpectBorne("500,000 empty CONTINUATION");
}

// A large header table; each call refers to its entries.
TEST_F(Known, ABombOfReferences) {
  Http2Client client(server_.address());
  std::string block = HeaderBlock(CallHeaders(kGetServerInfo));
  block += '\x40' + HpackInteger(0, 7, 5) + "x-big" + HpackInteger(0, 7, 3'900) +
           std::string(3'900, 'a');
  client.CallBlock(block);
  for (int call = 0; call < 2'000 && !client.closed(); ++call) {
    std::string bomb = HeaderBlock(CallHeaders(kGetServerInfo));
    bomb += std::string(8'000, static_cast<char>(0x80 | 62));
    client.CallBlock(bomb);
    if (client.queued() > (1u << 20)) client.Flush(kKnownPatience);
  }
  client.Flush(kKnownPatience);
  ExpectBorne("2,000 calls that refer 8,000 times to a header of 4 kB");
}

// 300,000 frames after the headers of a call. Responses are not read, so they would accumulate. The
// attacker has its own address, because the server refuses the address of a flood.
template <typename Queue>
void Flood(const std::string& address, const Queue& queue) {
  Http2Client client(address, {.source = "127.0.0.2"});
  const auto call = client.Call(CallHeaders(kReconstruct));
  client.Flush(kKnownPatience, false);
  for (int k = 0; k < 300'000 && !client.closed(); ++k) {
    queue(client, call);
    if (client.queued() > (1u << 16) && !client.Flush(seconds(1), false)) break;
  }
}

TEST_F(Known, FloodsOfSmallFrames) {
  const auto flood = [&](const char* what, const auto& queue) {
    Flood(server_.address(), queue);
    EXPECT_TRUE(server_.Lives()) << what;
    std::printf("  %s: at most %.1f MiB\n", what, memory_.PeakMib());
  };
  flood("settings", [](Http2Client& client, std::uint32_t) { client.Setting(4, 65'535); });
  flood("empty settings",
        [](Http2Client& client, std::uint32_t) { client.Frame(FrameType::kSettings, 0, 0, ""); });
  flood("empty data", [](Http2Client& client, std::uint32_t call) {
    client.Frame(FrameType::kData, 0, call, "");
  });
  flood("data of one byte", [](Http2Client& client, std::uint32_t call) {
    client.Frame(FrameType::kData, 0, call, std::string_view("\0", 1));
  });
  flood("window updates",
        [](Http2Client& client, std::uint32_t call) { client.WindowUpdate(call, 1); });
  flood("priorities", [](Http2Client& client, std::uint32_t call) {
    client.Frame(FrameType::kPriority, 0, call, std::string(5, '\0'));
  });
  flood("resets of what is not there",
        [](Http2Client& client, std::uint32_t call) { client.Reset(call + 1'000'000); });
  flood("frames of unknown types", [](Http2Client& client, std::uint32_t) {
    client.Frame(static_cast<FrameType>(0x77), 0, 0, std::string(100, 'x'));
  });
  ExpectBorne("floods of small frames");
}

// Empty messages: each costs the server more than its client.
TEST_F(Known, AFloodOfEmptyMessages) {
  Http2Client client(server_.address());
  const auto call = client.Call(CallHeaders(kReconstruct));
  std::string many;
  for (int k = 0; k < 3'000; ++k) many += Prefixed("");
  for (int k = 0; k < 300 && !client.closed(); ++k) {
    if (!client.SendData(call, many, false, milliseconds(200))) break;
  }
  ExpectBorne("up to 900,000 empty messages");
}

// gRPC's reflection uses a thread for each running call.
TEST_F(Known, ReflectionThatSaysNothingTakesFewThreads) {
  const auto threads = [this] {
    const std::filesystem::path tasks =
        "/proc/" + std::to_string(server_.process().process()) + "/task";
    return std::distance(std::filesystem::directory_iterator(tasks), {});
  };
  const auto before = threads();
  Http2Client client(server_.address());
  for (int k = 0; k < 200; ++k) {
    client.Call(CallHeaders("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"));
  }
  client.Flush(kKnownPatience);
  client.Read(seconds(1));
  std::printf("200 mute calls of reflection: %td -> %td threads\n", before, threads());
  EXPECT_LE(threads() - before, 20);
  client.Close(false);
  ExpectBorne("reflection that says nothing");
}

// Silent and incomplete connections end, also during a TLS handshake.
TEST(KnownOfHandshakes, HalfOpenConnectionsEnd) {
  const support::TemporaryFolder folder;
  const CertificateAuthority authority("authority");
  const IssuedCertificate identity = authority.Issue("server");
  AttackedServer plain, tls({"--tls-cert", folder.Write("server.pem", identity.certificate),
                             "--tls-key", folder.Write("server.key", identity.key)});
  const double before = plain.ResidentMib() + tls.ResidentMib();
  std::vector<std::unique_ptr<Http2Client>> silent;
  for (int k = 0; k < 400; ++k) {
    silent.push_back(std::make_unique<Http2Client>(k % 2 == 0 ? plain.address() : tls.address(),
                                                   Http2Client::Options{.greet = false}));
    if (k % 4 < 2) silent.back()->Bytes(k % 2 == 0 ? "PRI * HT" : "\x16\x03\x01\x02");
    silent.back()->Flush(kKnownPatience);
  }
  const double after = plain.ResidentMib() + tls.ResidentMib();
  const auto began = std::chrono::steady_clock::now();
  std::size_t ended = 0;
  while (ended < silent.size() && std::chrono::steady_clock::now() < began + seconds(40)) {
    ended = 0;
    for (const auto& client : silent) {
      client->Read(milliseconds(0));
      ended += client->closed() ? 1 : 0;
    }
    std::this_thread::sleep_for(milliseconds(50));
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  std::printf("400 connections that say nothing: %.1f -> %.1f MiB, ended after %.1f s\n", before,
              after, took.count());
  EXPECT_EQ(ended, silent.size()) << "they stay";
  EXPECT_LE(after - before, kMaxGrowthMib);
  EXPECT_EQ(Serves(plain.address()), 0);
  EXPECT_EQ(plain.Terminate(), 0);
  EXPECT_EQ(tls.Terminate(), 0);
}

// CVE-2023-4785: without a free descriptor gRPC's listener stops for good. The server therefore
// raises its limit to the maximum.
TEST(KnownOfDescriptors, AServerTakesAllItMayHave) {
  rlimit own{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &own), 0);
  const rlimit few{64, own.rlim_max};
  ASSERT_GE(own.rlim_max, 1'000u);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  AttackedServer server;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &own), 0);
  {
    std::vector<std::unique_ptr<Http2Client>> many;
    for (int k = 0; k < 200; ++k) {
      many.push_back(std::make_unique<Http2Client>(server.address()));
      many.back()->Flush(seconds(1));
    }
    EXPECT_EQ(Serves(server.address()), 0);
  }
  EXPECT_EQ(Serves(server.address()), 0) << "nobody is let in any more";
  EXPECT_EQ(server.Terminate(), 0);
}

// Sends `part` as CONTINUATION until `bytes` were sent or the server closes the connection; returns
// the number of bytes.
std::uint64_t Continue(Http2Client& client, std::uint32_t call, const std::string& part,
                       std::uint64_t bytes) {
  std::uint64_t sent = 0;
  while (sent < bytes && !client.closed()) {
    client.Frame(FrameType::kContinuation, 0, call, part);
    sent += part.size();
    if (client.queued() > (1u << 17)) client.Flush(kKnownPatience);
  }
  client.Flush(kKnownPatience);
  client.Read(milliseconds(20));
  std::printf("  %s after %.2f MiB\n", client.closed() ? "ended by the server" : "not ended",
              static_cast<double>(sent) / (1 << 20));
  return sent;
}

class BehindProxy : public Known {
 protected:
  const Proxy proxy_{server_.address()};
};

TEST_F(BehindProxy, OthersAreServed) {
  EXPECT_EQ(Serves(proxy_.address()), 0);
  HonestStream honest(proxy_.address(), "", 1);
  std::this_thread::sleep_for(milliseconds(500));
  honest.Stop();
  EXPECT_GE(honest.frames(), 5u);
  ExpectBorne("an honest stream behind a proxy");
}

// CVE-2023-44487.
TEST_F(BehindProxy, RapidReset) {
  std::unique_ptr<Http2Client> client;
  const std::string block = HeaderBlock(CallHeaders(kGetServerInfo));
  for (int k = 0; k < 50'000; ++k) {
    if (!client || client->closed()) client = std::make_unique<Http2Client>(proxy_.address());
    client->Reset(client->CallBlock(block));
    if (client->queued() > (1u << 16)) client->Flush(kKnownPatience);
  }
  client->Flush(kKnownPatience);
  ExpectBorne("50,000 calls reset at once");
}

// gRPC ends such a connection only after up to 64 MiB.
TEST_F(BehindProxy, AFloodOfPings) {
  Flood(proxy_.address(), [](Http2Client& client, std::uint32_t) { client.Ping(1); });
  ExpectBorne("300,000 pings");
}

// CVE-2023-32732: invalid base64 in binary headers; the connection's other calls continue.
TEST_F(BehindProxy, ABadBinaryHeaderEndsItsCallAlone) {
  Http2Client client(proxy_.address());
  bool opened = false, ended = false;
  const auto held = client.Call(CallHeaders(kReconstruct));
  client.OnFrame([&](const ReceivedFrame& frame) {
    if (frame.stream != held) return;
    opened |= frame.type == FrameType::kData;
    ended |= frame.EndsStream();
  });
  client.Data(held, Prefixed(Open("held").SerializeAsString()));
  client.Flush(kKnownPatience);
  EXPECT_TRUE(client.Read(kKnownPatience, [&] { return opened; }));
  for (const char* value : {"!", "a", "====", "\xff\xfe"}) {
    client.Data(client.Call(CallHeaders(kGetServerInfo, {{"x-bad-bin", value}})), Prefixed(""),
                true);
  }
  client.Flush(kKnownPatience);
  client.Read(milliseconds(200));
  EXPECT_FALSE(client.closed()) << "the connection has ended";
  EXPECT_FALSE(ended);
  client.Close(false);
  ExpectBorne("headers that are no base64");
}

// CVE-2024-7246 and CVE-2023-32731: a malformed header must not stay in the connection's table with
// its error, and later entries must not be skipped.
TEST_F(BehindProxy, ABadHeaderDoesNotPoisonTheConnection) {
  Http2Client client(proxy_.address());
  std::vector<int> statuses;
  client.OnFrame([&](const ReceivedFrame& frame) {
    if (frame.type != FrameType::kHeaders) return;
    if (const int status = GrpcStatusOf(frame.payload); status >= 0) statuses.push_back(status);
  });
  const auto indexed = [](const std::string& name, const std::string& value) {
    return '\x40' + HpackInteger(0, 7, name.size()) + name + HpackInteger(0, 7, value.size()) +
           value;
  };
  client.CallBlock(HeaderBlock(CallHeaders(kGetServerInfo)) + indexed("x-bad-bin", "!") +
                   indexed("x-good", "1"));
  client.CallBlock(HeaderBlock(CallHeaders(kGetServerInfo)) +
                   indexed("x-large", std::string(10'000, 'a')) + indexed("x-good", "2"));
  client.Flush(kKnownPatience);
  client.Read(milliseconds(100));
  // Another client's call behind the same proxy refers to the entry x-good.
  const auto call =
      client.CallBlock(HeaderBlock(CallHeaders(kGetServerInfo)) + static_cast<char>(0x80 | 62));
  client.Data(call, Prefixed(""), true);
  client.Flush(kKnownPatience);
  client.Read(seconds(2), [&] { return !statuses.empty() && statuses.back() == 0; });
  EXPECT_FALSE(client.closed()) << "the connection has ended";
  EXPECT_TRUE(!statuses.empty() && statuses.back() == 0) << "the other's call has failed";
  client.Close(false);
  ExpectBorne("headers that poison the table");
}

// CVE-2023-33953, first: a string is buffered before its size is checked.
TEST_F(BehindProxy, AHeaderOfManyMegabytes) {
  Http2Client client(proxy_.address());
  std::string block = HeaderBlock(CallHeaders(kGetServerInfo));
  block += '\0' + HpackInteger(0, 7, 7) + "x-large" + HpackInteger(0, 7, 512u << 20);
  const auto call = client.CallBlock(block, 0);
  Continue(client, call, std::string(16'384, 'a'), 256u << 20);
  ExpectBorne("a header of 256 MiB");
}

// Second: an integer may have any number of leading zeros.
TEST_F(BehindProxy, AnIntegerWithoutEnd) {
  Http2Client client(proxy_.address());
  const auto call = client.CallBlock(HeaderBlock(CallHeaders(kGetServerInfo)) + '\0' + '\x7f', 0);
  Continue(client, call, std::string(16'384, '\x80'), 16u << 20);
  ExpectBorne("an integer of 16 MiB");
  EXPECT_LT(server_.ProcessorSeconds(), 5);
}

// Third: the sum of CONTINUATION frames.
TEST_F(BehindProxy, AFloodOfContinuations) {
  Http2Client client(proxy_.address());
  const auto call = client.CallBlock(HeaderBlock(CallHeaders(kGetServerInfo)), 0);
  std::string part;
  for (int k = 0; part.size() < 16'000; ++k) {
    part += HeaderBlock({{"x-" + std::to_string(k), std::string(100, 'a')}});
  }
  Continue(client, call, part, 128u << 20);
  ExpectBorne("128 MiB of CONTINUATION");
}

}  // namespace
}  // namespace partiemc::attack
