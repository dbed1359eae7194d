// Queues that are served in turn.
#pragma once

#include <algorithm>
#include <list>
#include <map>
#include <optional>
#include <utility>

namespace partiemc::server {

/// A queue: first in, first out.
template <typename T>
class Line {
 public:
  using Item = T;

  void Push(T item) { items_.push_back(std::move(item)); }
  T Pop() {
    T item = std::move(items_.front());
    items_.pop_front();
    return item;
  }
  bool empty() const { return items_.empty(); }

 private:
  std::list<T> items_;  // An empty deque already allocates half a kilobyte.
};

/// One queue for each key. The non-empty queues take turns, one item in each turn, in the order in
/// which they became non-empty. `Lines` is the type of a queue: a Line, or again a RoundRobin.
/// Cost for each item: O(log(queues)); PopOf also passes the queues that it skips. Not thread-safe.
template <typename Key, typename Lines>
class RoundRobin {
 public:
  using Item = typename Lines::Item;

  /// `where`: the keys of the inner RoundRobins, if any, and finally the item.
  template <typename... Where>
  void Push(const Key& key, Where&&... where) {
    auto [line, is_new] = lines_.try_emplace(key);
    if (is_new) line->second = turns_.emplace(turns_.end(), key, Lines());
    line->second->second.Push(std::forward<Where>(where)...);
  }

  /// Requires: not empty.
  Item Pop() { return Take(turns_.begin()); }
  /// Pops an item from the first queue for whose key allowed(key) is true. Queues before it keep
  /// their turn. Returns nothing if there is no such queue.
  template <typename Allowed>
  std::optional<Item> PopOf(Allowed allowed) {
    const auto turn = std::find_if(turns_.begin(), turns_.end(),
                                   [&](const auto& line) { return allowed(line.first); });
    if (turn == turns_.end()) return std::nullopt;
    return Take(turn);
  }

  bool empty() const { return turns_.empty(); }

 private:
  using Turns = std::list<std::pair<Key, Lines>>;

  Item Take(typename Turns::iterator turn) {
    Item item = turn->second.Pop();
    if (turn->second.empty()) {
      lines_.erase(turn->first);
      turns_.erase(turn);
    } else {
      turns_.splice(turns_.end(), turns_, turn);
    }
    return item;
  }

  Turns turns_;  // Non-empty queues only, the next one first.
  std::map<Key, typename Turns::iterator> lines_;
};

}  // namespace partiemc::server
