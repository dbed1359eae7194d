#include "server/watch/watch_dispatcher.h"

#include <pthread.h>

#include <cerrno>
#include <future>
#include <utility>

namespace partiemc::server {

WatchDispatcher::WatchDispatcher() {
  sem_init(&wakes_, 0, 0);
  thread_ = std::thread([this] { Run(); });
  pthread_setname_np(thread_.native_handle(), "watch");
}

WatchDispatcher::~WatchDispatcher() {
  stopping_ = true;
  sem_post(&wakes_);
  thread_.join();
  for (Dispatched* dispatched = TakeWaiting(); dispatched != nullptr;) {
    Dispatched* const next = dispatched->next_;
    std::exchange(dispatched->self_, nullptr).reset();
    dispatched = next;
  }
  sem_destroy(&wakes_);
}

void WatchDispatcher::Wake(Dispatched& dispatched) {
  if (dispatched.waiting_.exchange(true)) return;  // The caller that set it adds it to the list.
  dispatched.self_ = dispatched.shared_from_this();
  Dispatched* head = waiting_.load();
  do {
    dispatched.next_ = head;
  } while (!waiting_.compare_exchange_weak(head, &dispatched));
  if (head == nullptr) sem_post(&wakes_);
}

void WatchDispatcher::Flush() {
  class Mark final : public Dispatched {
   public:
    std::promise<void> served;

   private:
    void Serve() override { served.set_value(); }
  };
  const auto mark = std::make_shared<Mark>();
  Wake(*mark);
  mark->served.get_future().wait();
}

void WatchDispatcher::Run() {
  while (!stopping_) {
    while (sem_wait(&wakes_) != 0 && errno == EINTR) {
    }
    for (Dispatched* dispatched = TakeWaiting(); dispatched != nullptr;) {
      Dispatched* const next = dispatched->next_;
      const std::shared_ptr<Dispatched> held = std::move(dispatched->self_);
      // Clears `waiting_` before Serve, so that a Wake during Serve queues the object again.
      dispatched->waiting_.exchange(false);
      if (!stopping_) held->Serve();
      dispatched = next;
    }
  }
}

// Takes the list of waiting objects and returns it in the order of arrival.
Dispatched* WatchDispatcher::TakeWaiting() {
  Dispatched* reversed = nullptr;
  for (Dispatched* newest = waiting_.exchange(nullptr); newest != nullptr;) {
    Dispatched* const older = newest->next_;
    newest->next_ = reversed;
    reversed = newest;
    newest = older;
  }
  return reversed;
}

}  // namespace partiemc::server
