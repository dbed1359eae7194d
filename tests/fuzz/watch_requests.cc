// A watcher's messages while results arrive and writes end at any moment.
#include <memory>
#include <string>

#include "fuzz/choices.h"
#include "fuzz/require.h"
#include "fuzz/targets.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/watch/result_broadcaster.h"
#include "server/watch/watch_dispatcher.h"
#include "server/watch/watch_state_machine.h"

namespace partiemc::fuzz {
namespace {

constexpr std::size_t kMaxWatcherBytes = 4096;
constexpr std::size_t kMaxWatchSteps = 256;

// A watch without a connection: its writes end on request.
class Watch final : private server::WatchTransport {
 public:
  explicit Watch(std::shared_ptr<server::ResultBroadcaster> broadcaster)
      : broadcaster_(std::move(broadcaster)) {
    machine_->Start();
  }
  ~Watch() override {
    machine_->Cancelled();
    if (writing_) WriteDone(false);
    if (reading_) ReadEnded();
    Require(finished_, "a watch comes to its end");
  }

  // Handles a message like the server's reactor.
  void Take(std::string_view bytes) {
    if (!reading_) return;
    server::WatchRequest request;
    parsed_.Clear();
    if (parsed_.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
      using Kind = server::WatchRequest::Kind;
      request.kind = parsed_.has_open()     ? Kind::kOpen
                     : parsed_.has_credit() ? Kind::kCredit
                                            : Kind::kEmpty;
      request.credit = parsed_.credit().frames();
      if (is_open_ && parsed_.has_credit()) credit_ += request.credit;
    }
    reading_ = false;
    machine_->ReadDone(request);
  }
  void ReadEnded() {
    if (std::exchange(reading_, false)) machine_->ReadEnded();
  }
  void WriteDone(bool ok) {
    if (std::exchange(writing_, false)) machine_->WriteDone(ok);
  }
  void Cancel() { machine_->Cancelled(); }
  void Drain() { machine_->Drain(); }
  void CutOff() { machine_->Cut(); }
  void GiveUp() { machine_->GiveUp(absl::ResourceExhaustedError("no memory")); }
  void RequireBounded() const {
    // In mode `latest` at most two results, each within the limit: one of them is being written.
    Require(machine_->held_bytes() <= (is_every_ ? 1 : 2) * kMaxWatcherBytes,
            "a watcher holds no more than it may");
  }

 private:
  void StartRead() override {
    Require(!reading_ && !finished_, "one read at a time");
    reading_ = true;
  }
  void StartOpen() override {
    Require(!is_open_, "a watch is opened once");
    is_open_ = true;
    credit_ = parsed_.open().credits();
    is_every_ = parsed_.open().mode() == v1::WATCH_MODE_EVERY;
    server::WatchTerms terms{
        .broadcaster = broadcaster_,
        .mode = is_every_ ? server::WatchMode::kEvery : server::WatchMode::kLatest,
        .credit = credit_};
    if (parsed_.open().has_from_sequence()) terms.from_sequence = parsed_.open().from_sequence();
    machine_->Opened(terms);
  }
  void WriteOpened(const server::HeldFrames& held) override {
    Require(held.oldest <= held.newest, "what is held has an order");
    Write();
  }
  void WriteFrame(const server::Published& published, std::uint64_t, std::uint64_t) override {
    Require(published.frame->bytes() <= kMaxWatcherBytes,
            "a frame that is too large is not written");
    Require(credit_-- > 0, "no frame is written without credit");
    Write();
  }
  void WriteEnded(const server::WatchEnd& end, std::uint64_t) override {
    Require(!end.reason.empty(), "an end has its reason");
    Write();
  }
  void Cut() override {
    if (writing_) WriteDone(false);
    ReadEnded();
  }
  void Finish(const absl::Status&) override {
    Require(!finished_ && !writing_, "a watch ends once, after its last write");
    finished_ = true;
  }

  void Write() {
    Require(!writing_ && !finished_, "one write at a time");
    writing_ = true;
  }

  const std::shared_ptr<server::ResultBroadcaster> broadcaster_;
  v1::WatchStreamRequest parsed_;
  std::uint64_t credit_ = 0;
  bool is_open_ = false, is_every_ = false, reading_ = false, writing_ = false, finished_ = false;
  std::shared_ptr<server::WatchStateMachine> machine_ = std::make_shared<server::WatchStateMachine>(
      static_cast<server::WatchTransport&>(*this), kMaxWatcherBytes);
};

}  // namespace

void AttackWatchRequests(Bytes bytes) {
  static auto* const dispatcher = new server::WatchDispatcher;
  server::HistoryRoom room(2 * kMaxWatcherBytes, 3 * kMaxWatcherBytes);
  const auto broadcaster = std::make_shared<server::ResultBroadcaster>(
      *dispatcher,
      server::ResultBroadcaster::Limits{.mailbox_bytes = 2 * kMaxWatcherBytes, .kept_bytes = 256});
  broadcaster->BeginHistory(room, nullptr, 1);
  std::uint64_t sequence = 0;
  Choices choices(bytes);
  {
    Watch watch(broadcaster);
    bool over = false;
    for (std::size_t step = 0; step < kMaxWatchSteps && !choices.empty(); ++step) {
      const std::uint8_t what = choices.Take<std::uint8_t>();
      switch (what % 8) {
        case 0:
        case 1:
          watch.Take(choices.TakeText(choices.Take<std::uint8_t>()));
          break;
        case 2:
        case 3:
          watch.WriteDone(what < 248);
          break;
        case 4:
        case 5:
          if (over) break;
          sequence += 1 + what / 128;  // Some frames are refused.
          if (broadcaster->Publish(std::make_shared<server::WatchFrame>(16 * std::size_t{what}),
                                   sequence)) {
            broadcaster->Announce();
          }
          break;
        case 6:
          watch.ReadEnded();
          break;
        default:
          if (what == 231) watch.CutOff();
          if (what == 239) watch.GiveUp();
          if (what < 240) break;
          if (what == 255) watch.Cancel();
          if (what == 247) watch.Drain();
          if (!std::exchange(over, true)) {
            broadcaster->End(server::WatchEnd::OfStream(absl::OkStatus()));
          }
      }
      dispatcher->Flush();  // Makes runs reproducible.
      watch.RequireBounded();
    }
  }
  dispatcher->Flush();
}

}  // namespace partiemc::fuzz
