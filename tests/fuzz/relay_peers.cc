// Messages of several hostile replicas for one: announcements, fetches and pieces in any order,
// through the relay's queues and directory.
#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "fuzz/choices.h"
#include "fuzz/require.h"
#include "fuzz/targets.h"
#include "server/relay/fetch_queue.h"
#include "server/relay/message_bus.h"
#include "server/relay/pieces.h"
#include "server/relay/relay_queue.h"
#include "server/relay/stream_directory.h"

namespace partiemc::fuzz {
namespace {

using relay::v1::RelayMessage;
using server::RelayQueue;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMaxMessageBytes = 4096;
constexpr std::array<std::size_t, RelayQueue::kLanes> kQueueBytes = {16384, 8192};
constexpr std::size_t kPeers = 4, kMaxSteps = 256;

// Delivers at once.
class Bus final : public server::MessageBus {
 public:
  bool connected() const override { return true; }
  bool Publish(const std::string& subject, std::string_view message) override {
    handlers_.at(subject)(message);
    return true;
  }
  std::unique_ptr<Subscription> Subscribe(const std::string& subject, Handler handler) override {
    handlers_[subject] = std::move(handler);
    return std::make_unique<Subscription>();
  }
  void Flush() override {}

 private:
  std::map<std::string, Handler> handlers_;
};

std::string PeerName(std::size_t peer) { return std::string(1, static_cast<char>('a' + peer)); }

// One replica that receives the messages.
class Receiver {
 public:
  Receiver() {
    subscriptions_[0] = queue_->Listen(bus_, "news", RelayQueue::kNews);
    subscriptions_[1] = queue_->Listen(bus_, "asked", RelayQueue::kAsked);
  }

  void Send(bool asked, std::string_view bytes) {
    const std::size_t lane = asked ? RelayQueue::kAsked : RelayQueue::kNews;
    const std::uint64_t lost = queue_->lost_messages();
    const std::size_t size = bytes.size() + RelayQueue::kBytesOfMessage;
    bus_.Publish(asked ? "asked" : "news", bytes);
    if (queue_->lost_messages() == lost) {
      queued_bytes_[lane] += size;
      queued_[lane] += 1;
    } else {
      Require(queued_bytes_[lane] + size > kQueueBytes[lane],
              "nothing is lost while its lane has room");
    }
    Require(queued_bytes_[lane] <= kQueueBytes[lane], "a lane is bounded");
  }

  // Handles the next messages.
  void Receive(Clock::time_point now) {
    RelayQueue::Work work;
    queue_->Take(std::chrono::milliseconds(0), work);
    for (std::size_t lane = 0; lane < RelayQueue::kLanes; ++lane) {
      Require(work.messages[lane].size() == std::min(queued_[lane], RelayQueue::kMostMessages),
              "each lane is emptied in small numbers, whatever the others hold");
      queued_[lane] -= work.messages[lane].size();
      for (const std::string& piece : work.messages[lane]) {
        queued_bytes_[lane] -= piece.size() + RelayQueue::kBytesOfMessage;
        Take(lane, piece, now);
      }
    }
  }

  // Answers all fetches.
  void Answer() {
    std::map<std::string, std::size_t> answered;
    while (const auto next = fetches_.TakeNext()) {
      const std::size_t turns = ++answered[next->replica];
      Require(turns <= server::FetchQueue::kFetchesOfReplica, "fetches of a replica are bounded");
      for (const auto& [replica, count] : waiting_) {
        Require(count == 0 || answered[replica] + 1 >= std::min(turns, count),
                "no replica waits for another one's second turn");
      }
      Require(next->replica.size() + next->fetch.ByteSizeLong() <= server::FetchQueue::kFetchBytes,
              "a fetch is bounded");
    }
    Require(fetches_.empty(), "no fetch is left");
    waiting_.clear();
  }

  void Expire(Clock::time_point before) { directory_.Expire(before); }

  void RequireBounded() const {
    Require(joiner_.held_bytes() <= 4 * kMaxMessageBytes, "pieces that wait are bounded");
    Require(asked_joiner_.held_bytes() <= 4 * server::FetchQueue::kFetchBytes,
            "pieces of fetches are bounded");
    const auto all = directory_.List("", 1000, [](const auto&) { return true; });
    std::set<std::string> ids;
    for (const auto& stream : all) {
      const std::string& id = stream.summary().stream_id();
      Require(ids.insert(id).second && id == *ids.rbegin(), "streams are listed once and in order");
      const auto found = directory_.FindName(stream.summary().stream_name());
      Require(found.has_value(), "a stream that is listed is found");
      Require(directory_.Has(found->replica, found->id()), "a stream that is found is there");
      const auto lineage = directory_.FindLineage(stream.lineage());
      Require(lineage && lineage->stream.opened_unix_ms() >= stream.opened_unix_ms(),
              "of a lineage the latest is found");
    }
  }

 private:
  void Take(std::size_t lane, const std::string& piece, Clock::time_point now) {
    const bool asked = lane == RelayQueue::kAsked;
    const auto whole = (asked ? asked_joiner_ : joiner_).Add(piece);
    RelayMessage message;
    if (!whole || !message.ParseFromString(*whole)) return;
    const std::string& replica = message.replica();
    if (asked && message.has_fetch()) {
      const std::uint64_t dropped = fetches_.dropped();
      fetches_.Add(replica, message.fetch());
      if (fetches_.dropped() == dropped) ++waiting_[replica];
    } else if (!asked && message.has_announcement()) {
      if (message.announcement().leaving()) {
        directory_.Left(replica);
        joiner_.Forget(replica);
      } else {
        directory_.Announced(replica, message.announcement(), now);
      }
    }
  }

  Bus bus_;
  const std::shared_ptr<RelayQueue> queue_ = std::make_shared<RelayQueue>(kQueueBytes);
  std::array<std::unique_ptr<server::MessageBus::Subscription>, 2> subscriptions_;
  server::PieceJoiner joiner_{kMaxMessageBytes}, asked_joiner_{server::FetchQueue::kFetchBytes};
  server::StreamDirectory directory_;
  server::FetchQueue fetches_;
  std::array<std::size_t, RelayQueue::kLanes> queued_{}, queued_bytes_{};
  std::map<std::string, std::size_t> waiting_;  // Unanswered fetches.
};

// Few names, lineages and times, so that replicas contradict each other.
RelayMessage AnnouncementOf(Choices& choices) {
  RelayMessage message;
  auto& announcement = *message.mutable_announcement();
  const auto shape = choices.Take<std::uint8_t>();
  announcement.set_leaving(shape % 16 == 1);
  announcement.set_draining(shape & 32);
  constexpr const char* kAddresses[] = {"", "127.0.0.1:1", "unix:/tmp/s", "x:0"};
  announcement.set_address(kAddresses[shape / 64]);
  for (std::size_t k = choices.Below(4); k > 0; --k) {
    auto& stream = *announcement.add_streams();
    const auto which = choices.Take<std::uint8_t>();
    stream.mutable_summary()->set_stream_id(absl::StrCat("s-", which % 5));
    stream.mutable_summary()->set_stream_name(absl::StrCat("n", which / 5 % 4));
    stream.set_lineage(absl::StrCat("l", which / 20 % 3));
    stream.set_opened_unix_ms(choices.Take<std::int8_t>());
  }
  return message;
}

RelayMessage FetchOf(Choices& choices) {
  RelayMessage message;
  auto& fetch = *message.mutable_fetch();
  const auto shape = choices.Take<std::uint8_t>();
  fetch.set_stream_id(shape == 255 ? std::string(2000, 's') : "s-" + std::to_string(shape % 5));
  fetch.set_fetch(shape);
  if (shape & 64) fetch.set_sequence(choices.Take<std::uint64_t>());
  return message;
}

}  // namespace

void AttackRelayPeers(Bytes bytes) {
  Choices choices(bytes);
  Receiver receiver;
  std::array<std::uint64_t, kPeers> sent{};
  auto now = Clock::now();
  for (std::size_t step = 0; step < kMaxSteps && !choices.empty(); ++step) {
    const auto what = choices.Take<std::uint8_t>();
    const std::size_t peer = what / 8 % kPeers;
    const bool asked = what & 128;
    switch (what % 8) {
      case 0:
      case 1:
      case 2: {
        RelayMessage message = what % 8 == 0 ? AnnouncementOf(choices) : FetchOf(choices);
        message.set_replica(PeerName(peer));
        const std::size_t copies = 1 + (what & 64 ? choices.Below(80) : 0);
        for (std::size_t k = 0; k < copies; ++k) {
          server::SendInPieces(PeerName(peer), ++sent[peer], message.SerializeAsString(),
                               [&](std::string_view piece) {
                                 receiver.Send(what % 8 != 0 || asked, piece);
                                 return true;
                               });
        }
        break;
      }
      case 3: {
        relay::v1::Piece piece;
        piece.set_replica(PeerName(peer));
        piece.set_message(choices.Below(3));
        piece.set_piece(choices.Take<std::uint8_t>() % 4);
        piece.set_pieces(choices.Take<std::uint8_t>() % 4);
        piece.set_data(std::string(choices.TakeText(choices.Take<std::uint8_t>())));
        receiver.Send(asked, piece.SerializeAsString());
        break;
      }
      case 4:
        receiver.Send(asked, choices.TakeText(choices.Take<std::uint8_t>()));
        break;
      case 5:
        now += std::chrono::milliseconds(choices.Take<std::uint16_t>());
        receiver.Expire(now - std::chrono::seconds(3));
        break;
      case 6:
        receiver.Receive(now);
        break;
      default:
        receiver.Answer();
    }
    if (what % 8 >= 5) receiver.RequireBounded();
  }
  receiver.Receive(now);
  receiver.Answer();
}

}  // namespace partiemc::fuzz
