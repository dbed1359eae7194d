// The thread that carries results from the taps of all streams to their watchers, so that no worker
// does.
#pragma once

#include <semaphore.h>

#include <atomic>
#include <memory>
#include <thread>

namespace partiemc::server {

/// Something that the pump serves. May be asked to while it is being served.
class Pumped : public std::enable_shared_from_this<Pumped> {
 public:
  virtual ~Pumped() = default;

 protected:
  /// Called by the pump's thread alone.
  virtual void Serve() = 0;

 private:
  friend class WatchPump;

  std::atomic<bool> waiting_ = false;  // In the pump's list.
  Pumped* next_ = nullptr;             // In it.
  std::shared_ptr<Pumped> self_;       // While in it.
};

class WatchPump {
 public:
  WatchPump();
  /// Joins. What still waits is not served.
  ~WatchPump();
  WatchPump(const WatchPump&) = delete;
  WatchPump& operator=(const WatchPump&) = delete;

  /// Has `pumped` served once more after this call began. Takes no lock and never waits; from any
  /// thread.
  void Wake(Pumped& pumped);
  /// Returns when all that was woken before has been served.
  void Flush();

 private:
  void Run();
  Pumped* TakeWaiting();

  std::atomic<Pumped*> waiting_ = nullptr;  // The last one that came.
  std::atomic<bool> stopping_ = false;
  sem_t wakes_;  // Posted when the list stops being empty. Never blocks whoever posts.
  std::thread thread_;
};

}  // namespace partiemc::server
