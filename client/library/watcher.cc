#include "partiemc/client/watcher.h"

#include <utility>

#include "library/rejoining_watch.h"

namespace partiemc::client {

absl::StatusOr<std::unique_ptr<Watcher>> Watcher::Open(std::string_view address,
                                                       std::string_view stream_name,
                                                       const WatcherOptions& options) {
  std::vector<std::string> addresses = {std::string(address)};
  addresses.insert(addresses.end(), options.fallback_addresses.begin(),
                   options.fallback_addresses.end());
  auto watch = std::make_unique<RejoiningWatch>(std::move(addresses), stream_name, options);
  if (auto status = watch->Open(); !status.ok()) return status;
  return std::unique_ptr<Watcher>(new Watcher(std::move(watch)));
}

Watcher::Watcher(std::unique_ptr<RejoiningWatch> watch) : watch_(std::move(watch)) {}
Watcher::~Watcher() = default;

const WatchedStream& Watcher::stream() const { return watch_->stream(); }
absl::StatusOr<Received> Watcher::Receive(WatchedFrame& frame,
                                          std::optional<std::chrono::milliseconds> wait) {
  return watch_->Receive(frame, wait);
}
const WatchEnd& Watcher::end() const { return watch_->end(); }
void Watcher::Cancel() { watch_->Cancel(); }

}  // namespace partiemc::client
