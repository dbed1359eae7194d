#include "server/relay/fetch_queue.h"

#include <utility>

namespace partiemc::server {

void FetchQueue::Add(const std::string& replica, const relay::v1::Fetch& fetch) {
  const bool is_large = replica.size() + fetch.ByteSizeLong() > kFetchBytes;
  if (is_large || (fetches_.size() >= kReplicas && !fetches_.contains(replica))) {
    ++dropped_;
    return;
  }
  std::deque<relay::v1::Fetch>& of_replica = fetches_[replica];
  if (of_replica.empty()) turns_.push_back(replica);
  if (of_replica.size() >= kFetchesOfReplica) {
    of_replica.pop_front();
    ++dropped_;
  }
  of_replica.push_back(fetch);
}

std::optional<FetchQueue::Item> FetchQueue::TakeNext() {
  if (turns_.empty()) return std::nullopt;
  Item item{.replica = std::move(turns_.front()), .fetch = {}};
  turns_.pop_front();
  const auto found = fetches_.find(item.replica);
  item.fetch = std::move(found->second.front());
  found->second.pop_front();
  if (found->second.empty()) {
    fetches_.erase(found);
  } else {
    turns_.push_back(item.replica);
  }
  return item;
}

}  // namespace partiemc::server
