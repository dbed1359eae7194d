#include "server/rpc/stream_counts.h"

#include <grpc/grpc.h>
#include <grpc/support/alloc.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <string_view>

namespace partiemc::server {
namespace {

// If listed_ exceeds this number of peers, Find clears it and lists all sockets again.
constexpr std::size_t kMostListed = 20'000;

using Text = std::unique_ptr<char, decltype(&gpr_free)>;

// Finds the next `"name":"` at or after `from`, returns the value that follows, and moves `from`
// behind the value. Returns "" if there is none. This search suffices, because channelz writes
// numbers as strings and its output contains no text of clients.
std::string_view NextValue(std::string_view text, std::string_view name, std::size_t& from) {
  const std::string key = "\"" + std::string(name) + "\":\"";
  const auto at = text.find(key, from);
  if (at == text.npos) return {};
  const auto begin = at + key.size(), end = text.find('"', begin);
  if (end == text.npos) return {};
  from = end;
  return text.substr(begin, end - begin);
}

std::int64_t NumberIn(std::string_view value) {
  std::int64_t number = 0;
  std::from_chars(value.data(), value.data() + value.size(), number);
  return number;
}

std::int64_t Number(std::string_view text, std::string_view name) {
  std::size_t from = 0;
  return NumberIn(NextValue(text, name, from));
}

// channelz leaves out counts of zero.
std::uint64_t Count(std::string_view text, std::string_view name) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, Number(text, name)));
}

}  // namespace

ChannelzStreams::ChannelzStreams() {
  while (true) {
    const Text text(grpc_channelz_get_servers(server_ + 1), &gpr_free);
    if (text == nullptr) return;
    const std::int64_t before = server_;
    std::size_t from = 0;
    for (std::string_view id; !(id = NextValue(text.get(), "serverId", from)).empty();) {
      server_ = std::max(server_, NumberIn(id));
    }
    if (server_ == before) return;
  }
}

std::int64_t ChannelzStreams::Find(const std::string& peer) {
  if (listed_.size() > kMostListed) {
    listed_.clear();
    next_socket_ = 0;
  }
  while (!listed_.contains(peer)) {
    const Text text(grpc_channelz_get_server_sockets(server_, next_socket_, 0), &gpr_free);
    if (text == nullptr) return 0;
    // {"name":"chttp2 ipv4:192.0.2.7:51234","socketId":"12"}
    bool any = false;
    std::size_t from = 0;
    for (std::string_view name; !(name = NextValue(text.get(), "name", from)).empty();) {
      const std::int64_t id = NumberIn(NextValue(text.get(), "socketId", from));
      listed_[NormalPeer(name.substr(name.rfind(' ') + 1))] = id;
      next_socket_ = std::max(next_socket_, id + 1);
      any = true;
    }
    if (!any) return 0;
  }
  const auto found = listed_.find(peer);
  const std::int64_t socket = found->second;
  listed_.erase(found);
  return socket;
}

bool ChannelzStreams::Read(const std::string& peer, std::int64_t& socket,
                           ConnectionReading& reading) {
  if (socket == 0) socket = Find(peer);
  if (socket == 0) return false;
  Text text(grpc_channelz_get_socket(socket), &gpr_free);
  if (text == nullptr) {
    // gRPC has closed this socket. It belonged to an earlier connection from the same port.
    socket = Find(peer);
    text.reset(grpc_channelz_get_socket(socket));
  }
  if (text == nullptr) return false;
  reading.streams_started = Count(text.get(), "streamsStarted");
  const std::uint64_t ended =
      Count(text.get(), "streamsSucceeded") + Count(text.get(), "streamsFailed");
  reading.streams_open = reading.streams_started - std::min(reading.streams_started, ended);
  reading.messages = Count(text.get(), "messagesReceived");
  return true;
}

}  // namespace partiemc::server
