// Divides a limited capacity fairly between callers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>

namespace partiemc::server {

class CallerAccount;

/// Divides a capacity (the "room", in bytes or slots) between callers: counts the amount that each
/// caller holds, and decides whether it may take more.
///
/// Rule: a caller that holds nothing may take any amount that is free. A caller that holds
/// something may take more only if the amount that then stays free is at least the caller's new
/// total. So with small amounts a single caller gets half of the room, and two callers get a third
/// each. Some room stays free for the next caller. Not thread-safe.
class FairShare {
 public:
  static constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

  enum class Fit {
    kYes,
    kNoRoom,         ///< Not enough room is free, although the caller holds nothing.
    kMoreThanShare,  ///< The caller would exceed its quota or, if it holds some, its share.
  };

  explicit FairShare(std::uint64_t room) : room_(room) {}

  /// Whether `caller` may take `amount` more. `most` is the caller's quota. A null caller is the
  /// server itself, which is limited by the room only.
  Fit Fits(const CallerAccount* caller, std::uint64_t amount, std::uint64_t most = kNoLimit) const {
    return FitsInto(room_ + beyond_, caller, amount, most);
  }
  /// Whether all rules would hold for `caller` and for the room if RemoveBeyond(beyond) were called
  /// now. `most` is the caller's quota.
  bool FitsWithout(std::uint64_t beyond, const CallerAccount* caller, std::uint64_t most) const {
    return FitsInto(room_ + beyond_ - beyond, caller, 0, most) == Fit::kYes;
  }

  /// Enlarges the room by `amount`, for an amount that a caller may take beyond the room. So other
  /// callers lose no room. RemoveBeyond reverses this.
  void AddBeyond(std::uint64_t amount) { beyond_ += amount; }
  void RemoveBeyond(std::uint64_t amount) { beyond_ -= amount; }

  /// Counts `amount` as held by `caller`, even if it does not fit.
  void Take(const CallerAccount* caller, std::uint64_t amount);
  /// Requires: `caller` holds at least `amount`.
  void GiveBack(const CallerAccount* caller, std::uint64_t amount);

  std::uint64_t held() const { return held_; }
  std::uint64_t held_by(const CallerAccount* caller) const;
  std::uint64_t room() const { return room_; }
  /// Number of callers that hold something.
  std::size_t callers() const { return held_by_.size(); }

 private:
  Fit FitsInto(std::uint64_t room, const CallerAccount* caller, std::uint64_t amount,
               std::uint64_t most) const;

  const std::uint64_t room_;
  std::uint64_t beyond_ = 0;
  std::uint64_t held_ = 0;                                 // May exceed room_ + beyond_.
  std::map<const CallerAccount*, std::uint64_t> held_by_;  // No value is 0.
};

}  // namespace partiemc::server
