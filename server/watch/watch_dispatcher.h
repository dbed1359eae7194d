// Runs the thread that delivers the results of all streams to their watchers, so that compute
// threads need not do it.
#pragma once

#include <semaphore.h>

#include <atomic>
#include <memory>
#include <thread>

namespace partiemc::server {

/// An object that the dispatcher's thread serves after a call of Wake. Wake may also be called
/// during Serve.
class Dispatched : public std::enable_shared_from_this<Dispatched> {
 public:
  virtual ~Dispatched() = default;

 protected:
  /// Called by the dispatcher's thread.
  virtual void Serve() = 0;

 private:
  friend class WatchDispatcher;

  std::atomic<bool> waiting_ = false;  // Whether it is in the dispatcher's list.
  Dispatched* next_ = nullptr;         // Link of the list.
  std::shared_ptr<Dispatched> self_;   // Keeps this alive while it is in the list.
};

class WatchDispatcher {
 public:
  WatchDispatcher();
  /// Stops and joins the thread. Objects that still wait are not served.
  ~WatchDispatcher();
  WatchDispatcher(const WatchDispatcher&) = delete;
  WatchDispatcher& operator=(const WatchDispatcher&) = delete;

  /// Makes the dispatcher's thread call Serve of `dispatched` soon. All calls of Wake before that
  /// Serve begins share it. Lock-free and thread-safe.
  void Wake(Dispatched& dispatched);
  /// Waits until every object that was woken before this call has been served.
  void Flush();

 private:
  void Run();
  Dispatched* TakeWaiting();

  std::atomic<Dispatched*> waiting_ = nullptr;  // Head of the list: the newest object.
  std::atomic<bool> stopping_ = false;
  sem_t wakes_;  // Posted when the list becomes non-empty. Posting never blocks.
  std::thread thread_;
};

}  // namespace partiemc::server
