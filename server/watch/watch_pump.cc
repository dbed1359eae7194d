#include "server/watch/watch_pump.h"

#include <pthread.h>

#include <cerrno>
#include <future>
#include <utility>

namespace partiemc::server {

WatchPump::WatchPump() {
  sem_init(&wakes_, 0, 0);
  thread_ = std::thread([this] { Run(); });
  pthread_setname_np(thread_.native_handle(), "watch");
}

WatchPump::~WatchPump() {
  stopping_ = true;
  sem_post(&wakes_);
  thread_.join();
  for (Pumped* pumped = TakeWaiting(); pumped != nullptr;) {
    Pumped* const next = pumped->next_;
    std::exchange(pumped->self_, nullptr).reset();
    pumped = next;
  }
  sem_destroy(&wakes_);
}

void WatchPump::Wake(Pumped& pumped) {
  if (pumped.waiting_.exchange(true)) return;  // Whoever set it puts it into the list.
  pumped.self_ = pumped.shared_from_this();
  Pumped* head = waiting_.load();
  do {
    pumped.next_ = head;
  } while (!waiting_.compare_exchange_weak(head, &pumped));
  if (head == nullptr) sem_post(&wakes_);
}

void WatchPump::Flush() {
  class Mark final : public Pumped {
   public:
    std::promise<void> served;

   private:
    void Serve() override { served.set_value(); }
  };
  const auto mark = std::make_shared<Mark>();
  Wake(*mark);
  mark->served.get_future().wait();
}

void WatchPump::Run() {
  while (!stopping_) {
    while (sem_wait(&wakes_) != 0 && errno == EINTR) {
    }
    for (Pumped* pumped = TakeWaiting(); pumped != nullptr;) {
      Pumped* const next = pumped->next_;
      const std::shared_ptr<Pumped> held = std::move(pumped->self_);
      // Before serving: what comes from here on wakes again.
      pumped->waiting_.exchange(false);
      if (!stopping_) held->Serve();
      pumped = next;
    }
  }
}

// In the order in which they came.
Pumped* WatchPump::TakeWaiting() {
  Pumped* reversed = nullptr;
  for (Pumped* newest = waiting_.exchange(nullptr); newest != nullptr;) {
    Pumped* const older = newest->next_;
    newest->next_ = reversed;
    reversed = newest;
    newest = older;
  }
  return reversed;
}

}  // namespace partiemc::server
