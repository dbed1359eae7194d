// Limits the connections of the gateway, and selects the one to close when there are too many.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>

namespace partiemc::server {

/// A connection is idle unless it has a call whose first request has arrived and which has not
/// ended. A handshake without a message, an incomplete body and a closing handshake are idle.
///
/// A new connection evicts an idle one if its address or the whole server is at the limit. In the
/// first case it is the oldest of this address, in the second the oldest of the address with the
/// most idle connections. If none is idle, the new connection gets a reserved slot, in which the
/// gateway answers health checks only. Connections in reserved slots are always idle and are
/// evicted by the same rule, so each new connection gets a slot. Thread-safe.
class ConnectionSlots {
 public:
  struct Limits {
    std::size_t connections = 256;  ///< Excludes the reserved slots; at least 1.
    std::size_t per_address = 128;  ///< Part of `connections`; at least 1.
    std::size_t reserved = 16;      ///< At least 1.
  };

  enum class State {
    kNoCall,   ///< Idle. Closing it loses nothing.
    kPending,  ///< Idle: a call without a request, or an ended call whose status is being sent.
    kServed,   ///< Not idle.
  };

  /// Closes the connection soon. Called from any thread, possibly after the connection was
  /// destroyed.
  using End = std::function<void()>;

  /// The slot of one connection; its destructor frees the slot.
  class Slot {
   public:
    Slot() = default;
    Slot(Slot&& other) noexcept { *this = std::move(other); }
    Slot& operator=(Slot&& other) noexcept {
      std::swap(slots_, other.slots_);
      std::swap(number_, other.number_);
      std::swap(reserved_, other.reserved_);
      return *this;
    }
    ~Slot();

    /// True if the connection may only make health checks.
    bool reserved() const { return reserved_; }
    void SetState(State state);

   private:
    friend class ConnectionSlots;
    ConnectionSlots* slots_ = nullptr;
    std::uint64_t number_ = 0;
    bool reserved_ = false;
  };

  explicit ConnectionSlots(Limits limits) : limits_(limits) {}

  /// Admits a connection from `address`. Sets `evicted` if another connection is closed for it. The
  /// slots must outlive the Slot.
  Slot Enter(const std::string& address, End end, bool& evicted);

  std::size_t count() const;
  /// EndUnused ends connections without a call, EndAll ends all.
  void EndUnused() { EndSome(false); }
  void EndAll() { EndSome(true); }
  /// Waits until all connections are closed; false if the deadline passes first.
  bool WaitUntilEmpty(std::chrono::steady_clock::time_point deadline);
  void WaitUntilEmpty();

 private:
  struct Connection {
    std::string address;
    End end;
    bool reserved = false;
    State state = State::kNoCall;
    bool evicted = false;  // Being closed; no longer counted.
  };

  // With the lock held:
  Connection* NextToEvict(bool reserved, const std::string* address);
  void Count(const Connection& connection);
  void Uncount(const Connection& connection);
  std::size_t CountOf(const std::string& address) const;
  // Without the lock:
  void EndSome(bool all);

  const Limits limits_;
  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable left_;
  std::map<std::uint64_t, Connection> connections_;  // In the order of admission.
  // Without evicted connections:
  std::size_t held_ = 0, held_reserved_ = 0;
  std::unordered_map<std::string, std::size_t>
      held_by_;  // By address; excludes the reserved slots.
  std::uint64_t next_ = 1;
};

}  // namespace partiemc::server
