// Limits the connections of the gateway, and selects the connection to close if there are too many.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <unordered_map>
#include <utility>

#include "common/mutex.h"

namespace partiemc::server {

/// A connection is busy while it has a call whose first request has arrived and that has not ended.
/// Otherwise it is idle: for example, during a handshake, while a request body is incomplete, and
/// while it closes.
///
/// If a new connection would exceed the limit of its address or of the server, an idle connection
/// is evicted. At the limit of the address, it is the oldest idle connection of this address. At
/// the limit of the server, it is the oldest one of the address with the most idle connections. If
/// there is none, the new connection gets a reserved slot, in which the gateway answers health
/// checks only. Connections in reserved slots always count as idle and are evicted by the same
/// rule, so each new connection gets a slot. Thread-safe.
class ConnectionSlots {
 public:
  struct Limits {
    std::size_t connections = 256;  ///< Excludes the reserved slots; at least 1.
    std::size_t per_address = 128;  ///< Part of `connections`; at least 1.
    std::size_t reserved = 16;      ///< At least 1.
  };

  enum class State {
    kNoCall,   ///< Idle: no call, at most a response to be sent, such as a file.
    kPending,  ///< Idle: a call without a request, or an ended call whose status is being sent.
    kServed,   ///< Busy.
  };

  /// Function that closes the connection soon. Called from any thread, possibly after the
  /// connection was destroyed.
  using End = std::function<void()>;

  /// The slot of one connection. Its destructor frees the slot.
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

    /// Whether the slot is a reserved one, so that the connection may only make health checks.
    bool reserved() const { return reserved_; }
    void SetState(State state);

   private:
    friend class ConnectionSlots;
    ConnectionSlots* slots_ = nullptr;
    std::uint64_t number_ = 0;
    bool reserved_ = false;
  };

  explicit ConnectionSlots(Limits limits) : limits_(limits) {}

  /// Admits a connection from `address`. Sets `evicted` to true if another connection is closed to
  /// admit it. This object must outlive the returned Slot.
  Slot Enter(const std::string& address, End end, bool& evicted) ABSL_LOCKS_EXCLUDED(mutex_);

  std::size_t count() const ABSL_LOCKS_EXCLUDED(mutex_);
  /// EndUnused closes the connections in state kNoCall; EndAll closes all connections.
  void EndUnused() { EndSome(false); }
  void EndAll() { EndSome(true); }
  /// Waits until all connections are closed. Returns false if the deadline passes first.
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

  Connection* NextToEvict(bool reserved, const std::string* address)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Count(const Connection& connection) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Uncount(const Connection& connection) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  std::size_t CountOf(const std::string& address) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void EndSome(bool all) ABSL_LOCKS_EXCLUDED(mutex_);

  const Limits limits_;
  mutable Mutex mutex_;
  CondVar left_;
  // In the order of admission.
  std::map<std::uint64_t, Connection> connections_ ABSL_GUARDED_BY(mutex_);
  // Without evicted connections:
  std::size_t held_ ABSL_GUARDED_BY(mutex_) = 0;
  std::size_t held_reserved_ ABSL_GUARDED_BY(mutex_) = 0;
  // By address; excludes the reserved slots.
  std::unordered_map<std::string, std::size_t> held_by_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t next_ ABSL_GUARDED_BY(mutex_) = 1;
};

}  // namespace partiemc::server
