#include "server/parts_model.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "partiemc/status.h"
#include "server/compute/read_permits.h"
#include "server/stream/frame_assembler.h"

namespace partiemc::server {
namespace {

using AssemblerClock = FrameAssembler::Clock;
using std::chrono::milliseconds;

constexpr std::size_t kPartsWindow = 3;
constexpr std::uint64_t kMessage = 1000;
constexpr milliseconds kTimeout(5000);

struct World {
  SteppedPool& pool;
  MemoryBudget& budget;
  AssemblerClock::time_point now{};
  std::string broken = {};  // The first violated promise.

  void Require(bool holds, const std::string& promise) {
    if (!holds && broken.empty()) broken = promise;
  }
};

// Received parts by frame: the whole state of the reference.
using PartsThere = std::map<std::uint64_t, std::set<std::uint32_t>>;

class PartOfRank final : public PartBytes {};

// A rank's connection, with the rules of PartZero and OtherPart (server/calls/frame_parts.h).
class Rank final : private StreamTransport, private StreamHandler {
 public:
  Rank(World& world, std::shared_ptr<FrameAssembler> assembler, PartsThere& there,
       std::uint32_t part, std::uint64_t first, std::uint64_t message_bytes)
      : bytes(message_bytes),
        world_(world),
        assembler_(std::move(assembler)),
        there_(there),
        part_(part),
        next_(first),
        slots_(kPartsWindow),
        machine_(std::make_shared<StreamStateMachine>(
            static_cast<StreamTransport&>(*this), static_cast<StreamHandler&>(*this),
            world.pool.pool(), world.budget, kPartsWindow)) {
    machine_->Start();
    TakeReadSlot();
    machine_->ReadDone(RequestKind::kOpen, 1);
    if (part_ == 0) {
      assembler_->SetLeader(machine_);
    } else if (auto seat = assembler_->Join(part_, machine_); seat.ok()) {
      seat_ = *seat;
    }
  }

  std::uint64_t bytes;  // Bytes of each message.

  bool reading() const { return read_slot_.has_value(); }
  bool writing() const { return writing_.has_value(); }
  bool finished() const { return finished_; }
  std::uint64_t next() const { return next_; }
  StreamStateMachine& machine() { return *machine_; }

  void Bring() {
    const std::size_t slot = TakeReadSlot();
    slots_[slot] = {.sequence = next_++, .came = world_.now, .refusal = absl::OkStatus()};
    const std::uint64_t sequence = slots_[slot].sequence;
    if (part_ != 0) machine_->PartArrives();
    const Phase phase = machine_->state().phase;
    if (phase == Phase::kServing || (part_ != 0 && phase == Phase::kEnding)) ++taken_;
    if (part_ == 0) {
      assembler_->LeaderSent(sequence);
    } else {
      auto status =
          assembler_->Offer(seat_, sequence, bytes, std::make_shared<PartOfRank>(), world_.now);
      if (status.ok()) there_[sequence].insert(part_);
      if (!absl::IsCancelled(status)) slots_[slot].refusal = std::move(status);
    }
    machine_->ReadDone(RequestKind::kFrame, bytes);
  }
  void EndReads() {
    TakeReadSlot();
    machine_->ReadEnded();
  }
  void EndWrite() {
    writing_.reset();
    machine_->WriteDone(!cut_);
  }
  // A pending write fails, as in gRPC.
  void Disconnect() {
    cut_ = true;
    machine_->Cancelled();
    if (writing()) EndWrite();
  }

 private:
  struct Slot {
    std::uint64_t sequence = 0;
    AssemblerClock::time_point came;
    absl::Status refusal;
  };

  std::size_t TakeReadSlot() { return *std::exchange(read_slot_, std::nullopt); }

  void StartRead(std::size_t slot) override { read_slot_ = slot; }
  void StartWrite(Outgoing what, std::size_t) override { writing_ = what; }
  void Cut() override { cut_ = true; }
  absl::Status Open(std::size_t, const StreamStateMachine&) override { return absl::OkStatus(); }
  const void* Assembly() const override { return assembler_.get(); }

  void Finish(const absl::Status& status) override {
    finished_ = true;
    world_.Require(!status.ok() || taken_ == answered_,
                   "each frame and part is answered once before a good end");
    if (part_ == 0) {
      assembler_->End(status);
      there_.clear();
    } else {
      assembler_->Leave(seat_);
      for (auto& [sequence, parts] : there_) parts.erase(part_);
    }
  }

  bool MayAnswer(std::size_t slot) override {
    const Slot& frame = slots_[slot];
    if (part_ == 0) return assembler_->IsReady(frame.sequence, frame.came, world_.now);
    return !frame.refusal.ok() || assembler_->IsOver(frame.sequence, world_.now);
  }
  bool DropFrame(std::size_t slot, const absl::Status& why) override {
    if (part_ == 0) return false;
    if (!slots_[slot].refusal.ok()) return true;
    assembler_->Withdraw(seat_, slots_[slot].sequence);
    there_[slots_[slot].sequence].erase(part_);
    slots_[slot].refusal = why;
    return true;
  }

  Answered Answer(std::size_t slot, Worker&, const std::atomic<bool>&) override {
    ++answered_;
    const std::uint64_t sequence = slots_[slot].sequence;
    if (part_ != 0) {
      const auto outcome =
          slots_[slot].refusal.ok() ? assembler_->OutcomeOf(sequence) : slots_[slot].refusal;
      return {.is_result = outcome.ok(), .last_sequence = 0, .bytes = 1};
    }
    world_.Require(sequence == assembler_->next_wanted(), "frames are answered in their order");
    const auto parts = assembler_->Take();
    const bool whole = there_[sequence].size() == assembler_->parts() - 1;
    world_.Require(!parts.ok() || whole, "a frame without all of its parts is not computed");
    // Parts that were dropped because part 0 was late exist for the reference only.
    const bool late = !parts.ok() && FindViolation(parts.status())->value.starts_with("0");
    world_.Require(parts.ok() || !whole || late, "a frame with all of its parts is computed");
    there_.erase(sequence);
    assembler_->Answered(sequence + 1, false);
    return {.is_result = parts.ok(),
            .last_sequence = sequence,
            .bytes = 1,
            .afterwards = [assembler = assembler_] { assembler->TellMembers(); }};
  }

  World& world_;
  const std::shared_ptr<FrameAssembler> assembler_;
  PartsThere& there_;
  const std::uint32_t part_;
  FrameAssembler::Seat seat_;
  std::uint64_t next_;
  std::vector<Slot> slots_;
  std::optional<std::size_t> read_slot_;
  std::optional<Outgoing> writing_;
  // A part that comes when the call is closing after an error is not taken: the end is its answer.
  std::uint64_t taken_ = 0, answered_ = 0;
  bool finished_ = false, cut_ = false;
  std::shared_ptr<StreamStateMachine> machine_;
};

struct PartsStream {
  std::shared_ptr<FrameAssembler> assembler;
  PartsThere there;
  std::vector<std::unique_ptr<Rank>> ranks;  // Part 0 first.
};

class Model {
 public:
  Model(SteppedPool& pool, const ChooseBelow& choose)
      : choose_(choose),
        slots_(1 + choose(3)),
        budget_(kMessage * choose(5),
                {.reads = {.streams_beyond = static_cast<std::uint32_t>(slots_),
                           .message_bytes = kMessage}}),
        world_{pool, budget_} {
    const std::size_t streams = 1 + choose(4);
    for (std::size_t k = 0; k < streams; ++k) {
      streams_.push_back(std::make_unique<PartsStream>());
      Begin(*streams_.back(), 2 + static_cast<std::uint32_t>(choose(3)));
    }
  }

  std::string Run(std::size_t steps) {
    for (std::size_t k = 0; k < steps && world_.broken.empty(); ++k) {
      Step();
      CheckBound();
    }
    if (world_.broken.empty()) Drain();
    CheckEnd();
    return world_.broken;
  }

 private:
  std::uint64_t Size() {
    constexpr std::uint64_t kSizes[] = {1, 60, 300, kMessage};
    return kSizes[choose_(std::size(kSizes))];
  }

  void Begin(PartsStream& stream, std::uint32_t parts) {
    stream.assembler = std::make_shared<FrameAssembler>(FrameAssembler::Terms{
        .parts = parts, .window = kPartsWindow, .max_frame_bytes = kMessage, .timeout = kTimeout});
    stream.there.clear();
    for (auto& rank : stream.ranks) gone_.push_back(std::move(rank));
    stream.ranks.clear();
    for (std::uint32_t part = 0; part < parts; ++part) Connect(stream, part, 1);
  }
  void Connect(PartsStream& stream, std::uint32_t part, std::uint64_t first) {
    auto rank = std::make_unique<Rank>(world_, stream.assembler, stream.there, part, first, Size());
    if (part < stream.ranks.size()) {
      gone_.push_back(std::exchange(stream.ranks[part], std::move(rank)));
    } else {
      stream.ranks.push_back(std::move(rank));
    }
  }

  void Step() {
    PartsStream& stream = *streams_[choose_(streams_.size())];
    const auto part = static_cast<std::uint32_t>(choose_(stream.ranks.size()));
    Rank& rank = *stream.ranks[part];
    const std::size_t dice = choose_(32);
    if (dice < 13) {
      if (rank.reading()) rank.Bring();
    } else if (dice < 20) {
      if (rank.writing()) rank.EndWrite();
    } else if (dice < 27) {
      world_.pool.Step();
    } else if (dice < 29) {
      Pass(milliseconds(700 * choose_(4)));
    } else if (dice == 29) {
      rank.Disconnect();
      world_.pool.Step();  // Ends its pending work.
      if (part > 0 && !stream.ranks[0]->finished()) {
        Connect(stream, part, stream.assembler->next_wanted());
      }
    } else if (dice == 30) {
      RestartIfOver(stream);
    } else {
      budget_.reads().Revoke(0);
    }
  }

  // A stream without part 0 restarts, like a client that resumes it.
  void RestartIfOver(PartsStream& stream) {
    if (!stream.ranks[0]->finished()) return;
    for (auto& rank : stream.ranks) rank->Disconnect();
    world_.pool.Step();
    Begin(stream, stream.assembler->parts());
  }

  void Pass(milliseconds time) {
    world_.now += time;
    budget_.reads().Look(world_.now, [](const std::string&) { return std::nullopt; });
    looked_ = true;
    for (auto& stream : streams_) {
      for (auto& rank : stream->ranks) rank->machine().LookAgain();
    }
  }

  // Expired permits may bring one frame of part 0 each. Parts are dropped.
  void CheckBound() {
    const std::uint64_t beyond = 2 * slots_ + (looked_ ? streams_.size() : 0);
    const std::uint64_t small = 64;  // Responses and `open`.
    world_.Require(budget_.planned() <= budget_.bytes() + beyond * kMessage + small,
                   "what is held and planned stays within the budget and its slots");
    world_.Require(budget_.reads().streams_beyond() <= slots_, "no more slots than there are");
  }

  // One stream after the other, while the next ones are silent: each connection sends two frames
  // more than any of its stream has sent, and half-closes.
  void Drain() {
    for (auto& stream : streams_) RestartIfOver(*stream);
    for (auto& stream : streams_) {
      std::uint64_t last = 0;
      for (auto& rank : stream->ranks) last = std::max(last, rank->next() + 2);
      for (int quiet = 0; quiet < 40 && !IsFinished(*stream) && world_.broken.empty();) {
        quiet = DrainOnce(*stream, last) ? 0 : quiet + 1;
      }
      world_.Require(IsFinished(*stream), "no connection waits for ever");
    }
  }

  // True if anything has happened.
  bool DrainOnce(PartsStream& stream, std::uint64_t last) {
    bool moved = false;
    for (auto& other : streams_) {
      for (auto& rank : other->ranks) {
        if (!rank->writing()) continue;
        moved = true;
        rank->EndWrite();
      }
    }
    for (auto& rank : stream.ranks) {
      if (rank->finished() || !rank->reading()) continue;
      moved = true;
      rank->next() < last ? rank->Bring() : rank->EndReads();
    }
    world_.pool.Step();
    if (!moved) Pass(milliseconds(1000));
    return moved;
  }

  static bool IsFinished(const PartsStream& stream) {
    return std::ranges::all_of(stream.ranks, [](const auto& rank) { return rank->finished(); });
  }

  void CheckEnd() {
    for (auto& stream : streams_) {
      for (auto& rank : stream->ranks) rank->Disconnect();
    }
    for (int k = 0; k < 3; ++k) world_.pool.Step();
    world_.Require(budget_.held() == 0 && budget_.planned() == 0, "nothing is held at the end");
    world_.Require(budget_.reads().waiting() == 0 && budget_.reads().streams_beyond() == 0,
                   "nothing waits at the end");
  }

  const ChooseBelow& choose_;
  const std::size_t slots_;
  MemoryBudget budget_;
  World world_;
  bool looked_ = false;
  std::vector<std::unique_ptr<Rank>> gone_;
  std::vector<std::unique_ptr<PartsStream>> streams_;
};

}  // namespace

std::string RunPartsModel(SteppedPool& pool, const ChooseBelow& choose, std::size_t steps) {
  return Model(pool, choose).Run(steps);
}

}  // namespace partiemc::server
