// How many connections the gateway holds, and which of them gives way.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace partiemc::server {

/// A connection waits until a call of it is let in, and again once the call is over. When one more
/// comes than there are places, one that waits gives way: the oldest of the host that has most of
/// them, so that nobody is kept out by sockets that stay mute, whoever opens them. Where none
/// waits, the new one gets no place. Safe from any thread.
class ConnectionPlaces {
 public:
  /// Closes the connection, soon. It may come when that has gone already, and from any thread.
  using End = std::function<void()>;

  /// Of one connection, until it is gone.
  class Place {
   public:
    Place() = default;
    Place(Place&& other) noexcept { *this = std::move(other); }
    Place& operator=(Place&& other) noexcept {
      std::swap(places_, other.places_);
      std::swap(number_, other.number_);
      return *this;
    }
    ~Place();

    /// A call of the connection was let in, or is over and another one may come.
    void SetWaiting(bool waiting);

   private:
    friend class ConnectionPlaces;
    ConnectionPlaces* places_ = nullptr;
    std::uint64_t number_ = 0;
  };

  explicit ConnectionPlaces(std::size_t most) : most_(most) {}

  /// Nothing where there is no place. The places outlive it. `gave_way` is set where another one
  /// was told to go.
  std::optional<Place> Enter(std::string host, End end, bool& gave_way);

  std::size_t count() const;
  /// Ends those that wait, or all.
  void EndWaiting() { EndSome(false); }
  void EndAll() { EndSome(true); }
  /// Until all have gone; false where they have not by then.
  bool WaitUntilEmpty(std::chrono::steady_clock::time_point deadline);
  void WaitUntilEmpty();

 private:
  struct Connection {
    std::string host;
    End end;
    bool waiting = true;
    bool told = false;  // To go, and counted no more.
  };

  void EndSome(bool all);
  // With the lock held:
  End TakeNextToGo();
  std::size_t Held() const { return connections_.size() - told_; }

  const std::size_t most_;
  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable left_;
  std::map<std::uint64_t, Connection> connections_;  // By their order.
  std::size_t told_ = 0;
  std::uint64_t next_ = 1;
};

}  // namespace partiemc::server
