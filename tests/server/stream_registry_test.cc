// Who may open a stream, and how streams end in a drain.
#include "server/stream/stream_registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "partiemc/status.h"
#include "server/closed_transport.h"
#include "server/stream/stream_token.h"

namespace partiemc::server {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class Registry : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kMaxStreams = 3;

  std::shared_ptr<StreamStateMachine> Enter(const Caller& caller = {}) {
    auto machine = std::make_shared<StreamStateMachine>(transport_, transport_, pool_, budget_, 1);
    EXPECT_TRUE(registry_.Enter(machine, caller).ok());
    return machine;
  }
  absl::StatusOr<StreamSummary> Open(const StreamStateMachine& machine, const std::string& name) {
    return registry_.Open(machine, {.name = name, .labels = {}, .parameters = {}},
                          NewStreamToken());
  }
  static std::string ReasonOf(const absl::Status& status) {
    const auto violation = FindViolation(status);
    return violation ? violation->reason : status.ToString();
  }

  ComputePool pool_{1};
  MemoryBudget budget_{1000};
  ClosedTransport transport_;
  StreamRegistry registry_{kMaxStreams};
};

TEST_F(Registry, OneStreamTooManyIsRefusedAtOnceWithTheLimitAndTheWayOut) {
  std::vector<std::shared_ptr<StreamStateMachine>> machines;
  for (std::uint32_t i = 0; i < kMaxStreams; ++i) {
    machines.push_back(Enter());
    EXPECT_TRUE(Open(*machines.back(), "").ok());
  }
  const auto late = Enter();
  const auto refused = Open(*late, "late");
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.status().message(),
            "streams: 3 open; must be at most 3; try again when one has ended, or start the server "
            "with a larger --max-streams");
  registry_.Close(*machines[0]);
  EXPECT_TRUE(Open(*late, "late").ok());
}

// A caller with a token with these terms.
Caller CallerWith(const CallerTerms& terms) {
  return Caller(std::make_shared<const CallerTerms>(terms),
                std::make_shared<CallerAccount>(terms.quota));
}

TEST_F(Registry, ACallerOpensNoMoreStreamsThanItsQuotaAndOthersDo) {
  const Caller caller = CallerWith({.quota = {.streams = 1}});
  const auto first = Enter(caller), second = Enter(caller), other = Enter();
  ASSERT_TRUE(Open(*first, "").ok());
  const auto refused = Open(*second, "");
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ReasonOf(refused.status()), kReasonCallerStreams);
  EXPECT_TRUE(Open(*other, "").ok());
  registry_.Close(*first);
  EXPECT_TRUE(Open(*second, "").ok());
}

TEST_F(Registry, AStreamThatIsTakenOverPassesItsPlaceOn) {
  const Caller caller = CallerWith({.quota = {.streams = 1}});
  const auto first = Enter(caller), second = Enter(caller), third = Enter(caller);
  const std::string token = NewStreamToken();
  ASSERT_TRUE(registry_.Open(*first, {.name = "tank", .labels = {}, .parameters = {}}, token).ok());
  ASSERT_TRUE(
      registry_.Open(*second, {.name = "tank", .labels = {}, .parameters = {}}, token).ok());
  EXPECT_EQ(caller.account()->held(CallerAccount::Kind::kStream), 1u);
  registry_.Close(*first);
  EXPECT_EQ(caller.account()->held(CallerAccount::Kind::kStream), 1u);
  EXPECT_FALSE(Open(*third, "").ok());
  // Resumed by another caller with the stream's token: that caller's quota applies.
  const Caller other = CallerWith({.quota = {.streams = 1}});
  const auto fourth = Enter(other);
  ASSERT_TRUE(registry_.Open(*fourth, {.name = "", .labels = {}, .parameters = {}}, token).ok());
  EXPECT_EQ(other.account()->held(CallerAccount::Kind::kStream), 1u);
  registry_.Close(*second);
  EXPECT_EQ(caller.account()->held(CallerAccount::Kind::kStream), 0u);
  registry_.Close(*fourth);
  EXPECT_EQ(other.account()->held(CallerAccount::Kind::kStream), 0u);
}

TEST_F(Registry, ACallerUsesAndSeesItsOwnNamesOnly) {
  const Caller tanks = CallerWith({.names = {"tank-*"}});
  const auto mine = Enter(tanks), other = Enter(), wrong = Enter(tanks);
  ASSERT_TRUE(Open(*mine, "tank-1").ok());
  ASSERT_TRUE(Open(*other, "dam").ok());
  EXPECT_EQ(ReasonOf(Open(*wrong, "dam-2").status()), kReasonNotPermitted);
  EXPECT_EQ(ReasonOf(Open(*wrong, "").status()), kReasonNotPermitted) << "the name is made up";
  EXPECT_EQ(ReasonOf(Open(*wrong, "dam").status()), kReasonNotPermitted) << "in use or not";

  EXPECT_TRUE(registry_.Find("tank-1", tanks).ok());
  EXPECT_EQ(ReasonOf(registry_.Find("tank-2", tanks).status()), kReasonNoSuchStream);
  EXPECT_EQ(registry_.Find("dam", tanks).status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(registry_.Find("dim", tanks).status().code(), absl::StatusCode::kPermissionDenied);
  ASSERT_EQ(registry_.List(0, 10, tanks).size(), 1u);
  EXPECT_EQ(registry_.List(0, 10, tanks)[0].description.name, "tank-1");
  EXPECT_EQ(registry_.List(0, 10).size(), 2u);
  EXPECT_TRUE(Open(*wrong, "tank-2").ok());
}

TEST_F(Registry, ATakeoverInheritsNoNameThatItsCallerMayNotUse) {
  const std::string token = NewStreamToken();
  const auto first = Enter(), second = Enter(CallerWith({.names = {"tank-*"}}));
  ASSERT_TRUE(registry_.Open(*first, {.name = "dam", .labels = {}, .parameters = {}}, token).ok());
  const auto refused = registry_.Open(*second, {.name = "", .labels = {}, .parameters = {}}, token);
  EXPECT_EQ(ReasonOf(refused.status()), kReasonNotPermitted);
  EXPECT_FALSE(transport_.finished.has_value()) << "the first goes on";
}

TEST_F(Registry, ANameBelongsToOneOpenStreamAndIsFreeOnceThatIsClosed) {
  const auto first = Enter(), second = Enter();
  ASSERT_TRUE(Open(*first, "tank").ok());
  const auto refused = Open(*second, "tank");
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(ReasonOf(refused.status()), kReasonNameInUse);
  const auto left = registry_.Close(*first);
  ASSERT_TRUE(left.has_value());
  EXPECT_EQ(left->description.name, "tank");
  EXPECT_TRUE(Open(*second, "tank").ok());
}

TEST_F(Registry, WhoHasTheTokenTakesOverAndNobodyElse) {
  const std::string token = NewStreamToken();
  const auto first = Enter(), second = Enter(), stranger = Enter();
  ASSERT_TRUE(registry_.Open(*first, {.name = "tank", .labels = {}, .parameters = {}}, token).ok());
  EXPECT_EQ(ReasonOf(Open(*stranger, "tank").status()), kReasonNameInUse);
  EXPECT_FALSE(transport_.finished.has_value());

  const auto resumed = registry_.Open(*second, {.name = "", .labels = {}, .parameters = {}}, token);
  ASSERT_TRUE(resumed.ok());
  EXPECT_EQ(resumed->description.name, "tank") << "inherited";
  ASSERT_TRUE(transport_.finished.has_value()) << "the call before has ended";
  EXPECT_EQ(transport_.finished->code(), absl::StatusCode::kAborted);
  EXPECT_EQ(ReasonOf(*transport_.finished), kReasonTakenOver);
  EXPECT_EQ(registry_.OpenCount(), 1u);
  ASSERT_EQ(registry_.List(0, 10).size(), 1u);
  EXPECT_EQ(registry_.List(0, 10)[0].id, resumed->id);
  EXPECT_TRUE(registry_.Close(*first).has_value()) << "for its line in the log";
  EXPECT_EQ(registry_.OpenCount(), 1u);
  EXPECT_EQ(ReasonOf(Open(*stranger, "tank").status()), kReasonNameInUse);
  EXPECT_TRUE(registry_.Close(*second).has_value());
  EXPECT_TRUE(Open(*stranger, "tank").ok());
}

TEST_F(Registry, TakingOverNeedsNoFreePlace) {
  const std::string token = NewStreamToken();
  const auto first = Enter();
  ASSERT_TRUE(registry_.Open(*first, {.name = "", .labels = {}, .parameters = {}}, token).ok());
  for (std::uint32_t k = 1; k < kMaxStreams; ++k) ASSERT_TRUE(Open(*Enter(), "").ok());
  EXPECT_EQ(ReasonOf(Open(*Enter(), "").status()), kReasonTooManyStreams);
  EXPECT_TRUE(registry_.Open(*Enter(), {.name = "", .labels = {}, .parameters = {}}, token).ok());
}

TEST_F(Registry, ARankThatComesBackReplacesItsCallAtTheLimit) {
  StreamRegistry registry(1, nullptr, /*max_parts=*/1);
  const auto enter = [&] {
    auto machine = std::make_shared<StreamStateMachine>(transport_, transport_, pool_, budget_, 1);
    EXPECT_TRUE(registry.Enter(machine).ok());
    return machine;
  };
  const auto leader = enter(), lost = enter(), again = enter(), other = enter();
  StreamDescription stream{.name = "tank", .labels = {}, .parameters = {}, .broadcaster = {}};
  stream.assembler = std::make_shared<FrameAssembler>(FrameAssembler::Terms{.parts = 3});
  ASSERT_TRUE(registry.Open(*leader, stream, NewStreamToken()).ok());
  const auto join = [&](const StreamStateMachine& machine, std::uint32_t part) {
    return ReasonOf(
        registry.JoinPart(machine, {.stream_name = "tank", .part = part, .parts = 3, .token = ""})
            .status());
  };
  EXPECT_EQ(join(*lost, 1), "OK");
  EXPECT_EQ(join(*other, 2), kReasonTooManyParts);
  EXPECT_EQ(join(*again, 1), "OK");
  EXPECT_EQ(join(*other, 2), kReasonTooManyParts);
  registry.Close(*lost);  // Frees nothing: the other call has its slot.
  EXPECT_EQ(join(*other, 2), kReasonTooManyParts);
  registry.Close(*again);
  EXPECT_EQ(join(*other, 2), "OK");
}

TEST_F(Registry, TokensOfAnotherFormAreRefusedAndNotRepeated) {
  const auto machine = Enter();
  for (const std::string& token : {std::string(), std::string("secret"), std::string(33, 'a'),
                                   std::string(31, 'a') + "G", std::string(31, 'a') + "A"}) {
    const auto refused =
        registry_.Open(*machine, {.name = "", .labels = {}, .parameters = {}}, token);
    EXPECT_EQ(ReasonOf(refused.status()), kReasonStreamToken);
    EXPECT_EQ(refused.status().message().find("secret"), std::string::npos);
  }
  EXPECT_TRUE(IsStreamToken(NewStreamToken()));
  EXPECT_NE(NewStreamToken(), NewStreamToken());
}

TEST_F(Registry, NamesAreShortAndPlain) {
  const auto machine = Enter();
  for (const std::string& name :
       {std::string("a b"), std::string("\n"), std::string("a/b"), std::string(129, 'a')}) {
    const auto refused = Open(*machine, name);
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(ReasonOf(refused.status()), kReasonName);
    EXPECT_EQ(refused.status().message().find('\n'), std::string::npos);
  }
  EXPECT_TRUE(Open(*machine, std::string(128, 'a')).ok());
}

TEST_F(Registry, LabelsAreFewAndShort) {
  const auto machine = Enter();
  StreamDescription many{.name = "", .labels = {}, .parameters = {}};
  for (int i = 0; i < 17; ++i) many.labels[std::to_string(i)] = "";
  EXPECT_EQ(ReasonOf(registry_.Open(*machine, many, NewStreamToken()).status()), kReasonLabels);
  StreamDescription wide{.name = "", .labels = {{"k", std::string(129, 'v')}}, .parameters = {}};
  EXPECT_EQ(ReasonOf(registry_.Open(*machine, wide, NewStreamToken()).status()), kReasonLabels);
  many.labels.erase("0");
  EXPECT_TRUE(registry_.Open(*machine, many, NewStreamToken()).ok());
}

TEST_F(Registry, StreamsWithoutANameGetDifferentOnes) {
  const auto first = Enter(), second = Enter();
  const auto one = Open(*first, ""), two = Open(*second, "");
  ASSERT_TRUE(one.ok() && two.ok());
  EXPECT_NE(one->id, two->id);
  const auto streams = registry_.List(0, 10);
  ASSERT_EQ(streams.size(), 2u);
  EXPECT_NE(streams[0].description.name, streams[1].description.name);
}

TEST_F(Registry, ListsOpenStreamsInOrderAndPageByPage) {
  const auto first = Enter(), second = Enter(), not_open = Enter();
  ASSERT_TRUE(Open(*second, "a").ok());
  ASSERT_TRUE(Open(*first, "b").ok());
  EXPECT_EQ(registry_.OpenCount(), 2u);
  const auto page = registry_.List(0, 1);
  ASSERT_EQ(page.size(), 1u);
  EXPECT_EQ(page[0].description.name, "a");
  const auto rest = registry_.List(page[0].number, 5);
  ASSERT_EQ(rest.size(), 1u);
  EXPECT_EQ(rest[0].description.name, "b");
}

TEST_F(Registry, SendsOneAfterTheOtherElsewhere) {
  EXPECT_THAT(registry_.TakeElsewhere(), IsEmpty());
  registry_.SetElsewhere({"a:1", "b:1", "c:1"});
  EXPECT_THAT(registry_.TakeElsewhere(), ElementsAre("b:1", "c:1", "a:1"));
  EXPECT_THAT(registry_.TakeElsewhere(), ElementsAre("c:1", "a:1", "b:1"));
}

class RecordingTransport final : public ClosedTransport {
 public:
  explicit RecordingTransport(std::vector<const RecordingTransport*>& ended) : ended_(ended) {}
  void Finish(const absl::Status&) override { ended_.push_back(this); }

 private:
  std::vector<const RecordingTransport*>& ended_;
};

TEST_F(Registry, SendsStreamsAwayInTheOrderOfTheirArrival) {
  struct Stream {
    std::shared_ptr<StreamStateMachine> machine;
    std::unique_ptr<RecordingTransport> transport;
  };
  std::vector<const RecordingTransport*> ended, arrived;
  std::vector<Stream> streams;
  for (std::uint32_t i = 0; i < kMaxStreams; ++i) {
    auto transport = std::make_unique<RecordingTransport>(ended);
    auto machine = std::make_shared<StreamStateMachine>(*transport, *transport, pool_, budget_, 1);
    streams.push_back({std::move(machine), std::move(transport)});
  }
  // The order must not be the order of the machines' addresses.
  std::sort(streams.begin(), streams.end(), [](const Stream& a, const Stream& b) {
    return std::greater<>()(a.machine.get(), b.machine.get());
  });
  for (const Stream& stream : streams) {
    ASSERT_TRUE(registry_.Enter(stream.machine, {}).ok());
    arrived.push_back(stream.transport.get());
  }
  registry_.SendAway(std::chrono::milliseconds(0));
  EXPECT_EQ(ended, arrived);
}

TEST_F(Registry, DrainingLetsNobodyInAndSendsEverybodyHome) {
  const auto machine = Enter();
  registry_.Drain();
  EXPECT_TRUE(registry_.draining());
  ASSERT_TRUE(transport_.finished.has_value());
  EXPECT_EQ(transport_.finished->code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(
      registry_
          .Enter(std::make_shared<StreamStateMachine>(transport_, transport_, pool_, budget_, 1))
          .code(),
      absl::StatusCode::kUnavailable);
  EXPECT_EQ(ReasonOf(Open(*machine, "x").status()), kReasonDraining);

  const auto now = std::chrono::steady_clock::now();
  registry_.Close(*machine);
  EXPECT_FALSE(registry_.WaitUntilEmpty(now)) << "closed is not gone";
  std::thread leaver([&] { registry_.Leave(*machine); });
  EXPECT_TRUE(registry_.WaitUntilEmpty(now + std::chrono::seconds(60)));
  leaver.join();
}

}  // namespace
}  // namespace partiemc::server
