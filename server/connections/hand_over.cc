#include "server/connections/hand_over.h"

#include <pthread.h>
#include <unistd.h>

namespace partiemc::server {

HandOverThreads::~HandOverThreads() {
  {
    const MutexLock lock(mutex_);
    stop_ = true;
  }
  came_.NotifyAll();
  for (std::thread& thread : threads_) thread.join();
  for (; !waiting_.empty(); waiting_.pop()) close(waiting_.front());
}

void HandOverThreads::Add(int descriptor) {
  {
    const MutexLock lock(mutex_);
    waiting_.push(descriptor);
    if (idle_ < waiting_.size() && threads_.size() < kMostThreads) {
      threads_.emplace_back([this] { Run(); });
    }
  }
  came_.NotifyOne();
}

void HandOverThreads::Run() {
  pthread_setname_np(pthread_self(), "hand-over");
  const MutexLock lock(mutex_);
  while (true) {
    ++idle_;
    while (!stop_ && waiting_.empty()) came_.Wait(mutex_);
    --idle_;
    if (stop_) return;
    const int descriptor = waiting_.front();
    waiting_.pop();
    const MutexUnlock unlock(mutex_);
    hand_over_(descriptor);
  }
}

}  // namespace partiemc::server
