// The thread that carries results from the mailboxes of all streams to their watchers, so that no
// worker does.
#pragma once

#include <semaphore.h>

#include <atomic>
#include <memory>
#include <thread>

namespace partiemc::server {

/// Something that the dispatcher serves. May be asked to while it is being served.
class Dispatched : public std::enable_shared_from_this<Dispatched> {
 public:
  virtual ~Dispatched() = default;

 protected:
  /// Called by the dispatcher's thread alone.
  virtual void Serve() = 0;

 private:
  friend class WatchDispatcher;

  std::atomic<bool> waiting_ = false;  // In the dispatcher's list.
  Dispatched* next_ = nullptr;         // In it.
  std::shared_ptr<Dispatched> self_;   // While in it.
};

class WatchDispatcher {
 public:
  WatchDispatcher();
  /// Joins. What still waits is not served.
  ~WatchDispatcher();
  WatchDispatcher(const WatchDispatcher&) = delete;
  WatchDispatcher& operator=(const WatchDispatcher&) = delete;

  /// Has `dispatched` served once more after this call began. Takes no lock and never waits; from
  /// any thread.
  void Wake(Dispatched& dispatched);
  /// Returns when all that was woken before has been served.
  void Flush();

 private:
  void Run();
  Dispatched* TakeWaiting();

  std::atomic<Dispatched*> waiting_ = nullptr;  // The last one that came.
  std::atomic<bool> stopping_ = false;
  sem_t wakes_;  // Posted when the list stops being empty. Never blocks whoever posts.
  std::thread thread_;
};

}  // namespace partiemc::server
