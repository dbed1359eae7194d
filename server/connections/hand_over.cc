#include "server/connections/hand_over.h"

#include <pthread.h>
#include <unistd.h>

namespace partiemc::server {

HandOverThreads::~HandOverThreads() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  came_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  for (; !waiting_.empty(); waiting_.pop()) close(waiting_.front());
}

void HandOverThreads::Add(int descriptor) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.push(descriptor);
    if (idle_ < waiting_.size() && threads_.size() < kMostThreads) {
      threads_.emplace_back([this] { Run(); });
    }
  }
  came_.notify_one();
}

void HandOverThreads::Run() {
  pthread_setname_np(pthread_self(), "hand-over");
  std::unique_lock lock(mutex_);
  while (true) {
    ++idle_;
    came_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
    --idle_;
    if (stop_) return;
    const int descriptor = waiting_.front();
    waiting_.pop();
    lock.unlock();
    hand_over_(descriptor);
    lock.lock();
  }
}

}  // namespace partiemc::server
