#include "relay/memory_replica.h"

#include <gtest/gtest.h>

#include <future>
#include <utility>

#include "server/relay/watched_result.h"

namespace partiemc::server {

std::string FrameBytes(std::uint64_t sequence, std::size_t bytes) {
  std::string text(bytes, '\0');
  for (std::size_t k = 0; k < bytes; ++k) text[k] = static_cast<char>(sequence * 31 + k * k);
  return text;
}

MemoryReplica::MemoryReplica(MemoryHub& hub, std::uint64_t history_bytes,
                             const std::string& address, const TimeAndChance& surroundings)
    : history_(history_bytes, 8 * history_bytes),
      registry_(16, history_bytes > 0 ? &history_ : nullptr) {
  auto end = hub.Connect();
  end_ = end.get();
  relay_ = std::make_unique<Relay>(
      std::move(end), registry_, dispatcher_,
      Relay::Limits{.broadcaster = {.mailbox_bytes = kWatcherBytes, .kept_bytes = kWatcherBytes},
                    .watcher_bytes = kWatcherBytes,
                    .history = history_bytes > 0 ? &history_ : nullptr},
      address, surroundings);
}

MemoryReplica::~MemoryReplica() { relay_.reset(); }

ReconstructionParameters MemoryReplica::Parameters() {
  ReconstructionParameters parameters{.sizes = Sizes::kOwn, .boundary = Boundary::kGrains};
  parameters.sections = {{.phase = 1}, {.phase = 2}};
  parameters.phase_attribute = "type";
  parameters.box = PeriodicBox{.wraps = true};
  parameters.box->axes[0] = PeriodicAxis{.origin = -1, .length = 40};
  parameters.noise_filter = .5;
  parameters.walls = {{.points = {0, 0, 1, 0}}};
  parameters.wall_phases = {3};
  return parameters;
}

void MemoryReplica::Open(const std::string& name, const std::string& token,
                         std::uint64_t next_sequence) {
  Stream& stream = streams_[name];
  stream.machine = std::make_shared<StreamStateMachine>(transport_, transport_, pool_, budget_, 1);
  stream.broadcaster = std::make_shared<ResultBroadcaster>(
      dispatcher_,
      ResultBroadcaster::Limits{.mailbox_bytes = kWatcherBytes, .kept_bytes = kWatcherBytes});
  ASSERT_TRUE(registry_.Enter(stream.machine).ok());
  const auto opened = registry_.Open(*stream.machine,
                                     {.name = name,
                                      .labels = {{"made", "here"}},
                                      .parameters = Parameters(),
                                      .broadcaster = stream.broadcaster,
                                      .next_sequence = next_sequence},
                                     token);
  ASSERT_TRUE(opened.ok()) << opened.status();
}

void MemoryReplica::Publish(const std::string& name, std::uint64_t sequence, std::size_t bytes) {
  ResultBroadcaster& broadcaster = *streams_.at(name).broadcaster;
  auto frame = std::make_shared<WatchedResult>(wire::WatchedBytes(FrameBytes(sequence, bytes)));
  if (broadcaster.Publish(std::move(frame), sequence)) broadcaster.Announce();
}

void MemoryReplica::Close(const std::string& name, const absl::Status& status) {
  const auto stream = streams_.extract(name);
  registry_.Close(*stream.mapped().machine);
  registry_.Leave(*stream.mapped().machine);
  stream.mapped().broadcaster->End(WatchEnd::OfStream(status));
}

absl::StatusOr<Relay::Found> MemoryReplica::Find(const std::string& name,
                                                 std::optional<std::uint64_t> from) {
  std::promise<absl::StatusOr<Relay::Found>> found;
  relay_->Find(name, from, [&](const auto& one) { found.set_value(one); });
  return found.get_future().get();
}

std::unique_ptr<MemoryWatcher> MemoryReplica::Watch(const std::string& name, WatchMode mode,
                                                    std::optional<std::uint64_t> from,
                                                    std::uint64_t credit) {
  const auto found = Find(name, from);
  EXPECT_TRUE(found.ok()) << found.status();
  if (!found.ok()) return nullptr;
  auto watcher =
      std::make_unique<MemoryWatcher>(found->broadcaster, mode, credit, kWatcherBytes, from);
  watcher->WaitUntilOpened();
  return watcher;
}

std::unique_ptr<MemoryWatcher> MemoryReplica::WatchOwn(const std::string& name) {
  auto watcher = std::make_unique<MemoryWatcher>(streams_.at(name).broadcaster, WatchMode::kEvery,
                                                 std::uint64_t{1} << 40, kWatcherBytes);
  watcher->WaitUntilOpened();
  return watcher;
}

}  // namespace partiemc::server
