// Messages for a replica that shows another replica's stream: pieces, announcements, results and
// ends in any order, late, repeated or missing, with a watcher.
#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/address.h"
#include "fuzz/choices.h"
#include "fuzz/require.h"
#include "fuzz/targets.h"
#include "server/relay/imported_stream.h"
#include "server/relay/pieces.h"
#include "server/relay/stream_directory.h"

namespace partiemc::fuzz {
namespace {

using relay::v1::RelayMessage;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMaxBytes = 4096;
constexpr std::size_t kMaxMessages = 256;
constexpr char kStreamId[] = "s-1";

// A watcher that accepts every frame at once.
class ReadyWatch final : private server::WatchTransport {
 public:
  ReadyWatch(std::shared_ptr<server::ResultBroadcaster> broadcaster,
             std::optional<std::uint64_t> from_sequence)
      : terms_{.broadcaster = std::move(broadcaster),
               .mode = server::WatchMode::kEvery,
               .credit = std::uint64_t{1} << 40,
               .from_sequence = from_sequence} {
    machine_->Start();
    machine_->ReadDone({.kind = server::WatchRequest::Kind::kOpen, .credit = terms_.credit});
  }
  ~ReadyWatch() override {
    machine_->Cancelled();
    if (writing_) WriteDone();
    if (reading_) machine_->ReadEnded();
    Require(finished_, "a watch comes to its end");
  }

  // True if a write was pending.
  bool WriteDone() {
    if (!std::exchange(writing_, false)) return false;
    machine_->WriteDone(true);
    return true;
  }

 private:
  void StartRead() override { reading_ = true; }
  void StartOpen() override {
    reading_ = false;
    machine_->Opened(terms_);
  }
  void WriteOpened(const server::HeldFrames&) override { writing_ = true; }
  void WriteFrame(const server::Published& published, std::uint64_t dropped,
                  std::uint64_t) override {
    Require(published.number > last_, "numbers rise");
    Require(last_ == 0 || published.number == last_ + dropped + 1, "every drop is counted");
    last_ = published.number;
    writing_ = true;
  }
  void WriteEnded(const server::WatchEnd&, std::uint64_t) override { writing_ = true; }
  void Cut() override {}
  void Finish(const absl::Status&) override {
    Require(!std::exchange(finished_, true), "a watch ends once");
  }

  const server::WatchTerms terms_;
  std::uint64_t last_ = 0;
  bool reading_ = false, writing_ = false, finished_ = false;
  std::shared_ptr<server::WatchStateMachine> machine_ = std::make_shared<server::WatchStateMachine>(
      static_cast<server::WatchTransport&>(*this), kMaxBytes);
};

// Receives the requests of an ImportedStream.
class Port final : public server::RelayPort {
 public:
  void Post(std::function<void()> action) override { action(); }
  bool Send(const std::string&, RelayMessage& message) override {
    Require(message.fetch().stream_id() == kStreamId, "asks for its own stream");
    if (message.fetch().fetch() != 0) last_fetch = message.fetch().fetch();
    return true;
  }

  std::uint64_t last_fetch = 0;
};

// Small numbers, and numbers at the end of their range.
std::uint64_t Number(Choices& choices) {
  const auto small = choices.Take<std::uint8_t>();
  return small < 240 ? small % 16 : std::uint64_t{0} - (small % 4);
}

}  // namespace

void AttackRelayMessages(Bytes bytes) {
  static auto* const dispatcher = new server::WatchDispatcher;
  Choices choices(bytes);
  Port port;
  server::HistoryRoom room(2 * kMaxBytes, 3 * kMaxBytes);
  server::StreamDirectory directory;
  server::PieceJoiner joiner(kMaxBytes);
  auto now = Clock::now();
  std::optional<std::uint64_t> from;
  if (choices.Flip()) from = Number(choices);
  server::RemoteStream remote{.replica = "one"};
  remote.stream.mutable_summary()->set_stream_id(kStreamId);
  server::ImportedStream stream(
      remote, from, *dispatcher,
      {.broadcaster = {.mailbox_bytes = 2 * kMaxBytes, .kept_bytes = kMaxBytes},
       .waiting_bytes = kMaxBytes,
       .history = choices.Flip() ? &room : nullptr},
      port, now);
  std::unique_ptr<ReadyWatch> watch;
  stream.Await([&](const absl::Status& status) {
    if (status.ok()) watch = std::make_unique<ReadyWatch>(stream.broadcaster(), from);
  });
  for (std::size_t step = 0; step < kMaxMessages && !choices.empty(); ++step) {
    RelayMessage message;
    const std::uint8_t what = choices.Take<std::uint8_t>();
    switch (what % 8) {
      case 0:
      case 1:
      case 2: {
        auto& result = *message.mutable_result();
        result.set_number(Number(choices));
        result.set_sequence(Number(choices));
        result.set_oldest_sequence(Number(choices));
        result.set_fetch(what < 128 ? port.last_fetch : Number(choices));
        result.set_first(what & 64);
        result.set_frame(std::string(choices.Take<std::uint16_t>() % (kMaxBytes + 2), 'f'));
        break;
      }
      case 3: {
        auto& end = *message.mutable_fetch_end();
        end.set_fetch(what < 128 ? port.last_fetch : Number(choices));
        end.set_next_number(Number(choices));
        end.set_last_number(Number(choices));
        end.set_gone(what == 251);
        break;
      }
      case 4:
        message.mutable_stream_end()->set_last_number(Number(choices));
        message.mutable_stream_end()->set_reason("FINISHED");
        message.mutable_stream_end()->set_code(choices.Take<std::int8_t>());
        break;
      case 5:
        if (const auto whole = joiner.Add(choices.TakeText(choices.Take<std::uint8_t>()))) {
          Require(whole->size() <= kMaxBytes, "no message is larger than it may be");
          if (!message.ParseFromString(*whole)) message.Clear();
        }
        break;
      case 6:
        now += std::chrono::milliseconds(choices.Take<std::uint16_t>());
        stream.Tick(now, what < 128);
        directory.Expire(now - std::chrono::seconds(3));
        break;
      default:
        stream.FetchAgain(now);
    }
    if (message.has_result()) stream.OnMessage(*message.mutable_result(), now);
    if (message.has_fetch_end()) stream.OnMessage(message.fetch_end(), now);
    if (message.has_stream_end()) stream.OnMessage(message.stream_end(), now);
    if (message.has_announcement()) {
      (void)directory.Announced("one", message.announcement(), now);
    }
    Require(joiner.held_bytes() <= 4 * kMaxBytes, "pieces that wait are bounded");
    for (const std::string& address : directory.Addresses(4)) {
      const auto parsed = ParseAddress(address);
      Require(parsed.ok() && parsed->unix_path.empty() && parsed->port != 0,
              "clients are sent to addresses only");
    }
    do {
      dispatcher->Flush();  // Makes runs reproducible.
    } while (watch != nullptr && watch->WriteDone());
  }
  watch.reset();
  dispatcher->Flush();
}

}  // namespace partiemc::fuzz
