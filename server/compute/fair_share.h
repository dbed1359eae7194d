// Room of the server that its callers share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>

namespace partiemc::server {

class CallerAccount;

/// Counts what callers hold of a room, so that none of them can fill it: whoever holds something
/// may take more only as long as no more of the room is its own than is free after that. One caller
/// alone has half of the room, two greedy ones a third each, and there is always some for the next
/// one. Not thread-safe.
class FairShare {
 public:
  static constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

  enum class Fit {
    kYes,
    kNoRoom,         ///< It holds nothing, and the room is too full all the same.
    kMoreThanShare,  ///< It holds something, and would hold too much.
  };

  explicit FairShare(std::uint64_t room) : room_(room) {}

  /// Whether `caller` may take `amount` more and hold at most `most` in all. Null is the server
  /// itself, to which only the room applies.
  Fit Fits(const CallerAccount* caller, std::uint64_t amount, std::uint64_t most = kNoLimit) const {
    return FitsInto(room_ + beyond_, caller, amount, most);
  }
  /// Whether what `caller` holds would fit if `beyond` less were permitted beyond the room.
  bool FitsWithout(std::uint64_t beyond, const CallerAccount* caller, std::uint64_t most) const {
    return FitsInto(room_ + beyond_ - beyond, caller, 0, most) == Fit::kYes;
  }

  /// Of what is held, `amount` is permitted beyond the room: it takes no room from other callers.
  void AddBeyond(std::uint64_t amount) { beyond_ += amount; }
  void RemoveBeyond(std::uint64_t amount) { beyond_ -= amount; }

  /// Counts what is held in any case, whether it fits or not.
  void Take(const CallerAccount* caller, std::uint64_t amount);
  void GiveBack(const CallerAccount* caller, std::uint64_t amount);

  std::uint64_t held() const { return held_; }
  std::uint64_t held_by(const CallerAccount* caller) const;
  std::uint64_t room() const { return room_; }
  /// Of whom anything is counted: it grows with those who hold something, not with those who came.
  std::size_t callers() const { return held_by_.size(); }

 private:
  Fit FitsInto(std::uint64_t room, const CallerAccount* caller, std::uint64_t amount,
               std::uint64_t most) const;

  const std::uint64_t room_;
  std::uint64_t beyond_ = 0;
  std::uint64_t held_ = 0;                                 // May be more than both together.
  std::map<const CallerAccount*, std::uint64_t> held_by_;  // None is 0.
};

}  // namespace partiemc::server
