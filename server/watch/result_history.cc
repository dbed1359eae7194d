#include "server/watch/result_history.h"

#include <algorithm>
#include <utility>

namespace partiemc::server {
namespace {

constexpr std::size_t kFirstRoom = 16;

std::uint64_t BytesOf(const Published& published) {
  return published.frame->memory() + kPublishedBytes;
}

}  // namespace

void HistoryRoom::Enter(std::weak_ptr<HistoryOwner> owner) {
  std::vector<std::shared_ptr<HistoryOwner>> others;  // Released without the lock.
  const MutexLock lock(mutex_);
  std::erase_if(owners_, [](const auto& other) { return other.expired(); });
  if (is_scarce()) {
    for (const auto& other : owners_) others.push_back(other.lock());
  }
  for (const auto& other : others) {
    if (other != nullptr) other->ShareRoom();
  }
  owners_.push_back(std::move(owner));
}

bool HistoryRoom::TryTake(std::uint64_t bytes) {
  std::uint64_t held = held_;
  do {
    if (bytes > bytes_of_all_ || held > bytes_of_all_ - bytes) return false;
  } while (!held_.compare_exchange_weak(held, held + bytes));
  return true;
}

ResultHistory::ResultHistory(HistoryRoom& room) : room_(room) { ++room_.histories_; }

ResultHistory::~ResultHistory() {
  room_.GiveBack(bytes_);
  --room_.histories_;
}

void ResultHistory::Add(const Published& published) {
  const std::uint64_t bytes = BytesOf(published);
  // The frames must be consecutive.
  while (size_ > 0 && at(size_ - 1).number + 1 != published.number) DropOldest();
  DropUntilFits(bytes);
  bool has_room = bytes <= room_.share();
  // The memory of all histories may be used up: other histories may exceed their share until they
  // shrink. Then drops further frames of this history.
  while (has_room && !room_.TryTake(bytes)) {
    has_room = size_ > 0;
    if (has_room) DropOldest();
  }
  if (!has_room) return;
  if (size_ == ring_.size()) Grow();
  ring_[(first_ + size_) % ring_.size()] = published;
  ++size_;
  bytes_ += bytes;
}

std::unique_ptr<ResultHistory> ResultHistory::CopyBefore(std::uint64_t sequence) const {
  auto copy = std::make_unique<ResultHistory>(room_);
  const std::size_t end = CountBefore(sequence);
  const std::uint64_t share = room_.share();
  std::size_t first = end;
  std::uint64_t bytes = 0;
  while (first > 0 && bytes + BytesOf(at(first - 1)) <= share) bytes += BytesOf(at(--first));
  while (!room_.TryTake(bytes)) bytes -= BytesOf(at(first++));
  copy->ring_.reserve(end - first);
  for (std::size_t k = first; k < end; ++k) copy->ring_.push_back(at(k));
  copy->size_ = end - first;
  copy->bytes_ = bytes;
  return copy;
}

std::vector<Published> ResultHistory::TakeFrom(std::uint64_t sequence) {
  std::vector<Published> taken;
  const std::size_t left = CountBefore(sequence);
  taken.reserve(size_ - left);
  std::uint64_t bytes = 0;
  for (std::size_t k = left; k < size_; ++k) {
    Published& published = ring_[(first_ + k) % ring_.size()];
    bytes += BytesOf(published);
    taken.push_back(std::exchange(published, {}));
  }
  size_ = left;
  bytes_ -= bytes;
  room_.GiveBack(bytes);
  return taken;
}

void ResultHistory::DropUntilFits(std::uint64_t bytes) {
  const std::uint64_t share = room_.share();
  while (size_ > 0 && bytes_ + bytes > share) DropOldest();
}

void ResultHistory::DropOldest() {
  Published& oldest = ring_[first_];
  const std::uint64_t bytes = BytesOf(oldest);
  oldest = {};
  first_ = (first_ + 1) % ring_.size();
  --size_;
  bytes_ -= bytes;
  room_.GiveBack(bytes);
}

void ResultHistory::Grow() {
  std::vector<Published> larger(std::max(kFirstRoom, 2 * ring_.size()));
  for (std::size_t k = 0; k < size_; ++k) larger[k] = std::move(ring_[(first_ + k) % ring_.size()]);
  ring_ = std::move(larger);
  first_ = 0;
}

const Published* ResultHistory::FromNumber(std::uint64_t number) const {
  if (empty() || at(size_ - 1).number < number) return nullptr;
  const std::uint64_t oldest = at(0).number;
  return &at(number <= oldest ? 0 : number - oldest);
}

const Published* ResultHistory::FromSequence(std::uint64_t sequence) const {
  const std::size_t older = CountBefore(sequence);
  return older == size_ ? nullptr : &at(older);
}

std::size_t ResultHistory::CountBefore(std::uint64_t sequence) const {
  std::size_t older = 0,
              end = size_;  // Binary search: frames before `older` are older, from `end` on not.
  while (older < end) {
    const std::size_t middle = older + (end - older) / 2;
    if (at(middle).sequence < sequence) {
      older = middle + 1;
    } else {
      end = middle;
    }
  }
  return end;
}

}  // namespace partiemc::server
