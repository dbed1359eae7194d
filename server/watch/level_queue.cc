#include "server/watch/level_queue.h"

#include <pthread.h>
#include <sys/resource.h>

#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "partiemc/arena.h"
#include "partiemc/status.h"

namespace partiemc::server {
namespace {

// With all processors busy, the thread gets about a tenth of the time of a compute thread. A higher
// value would let it hold a lock for long while it waits for a processor.
constexpr int kNice = 10;

std::string Text(const LevelOfDetail& level) {
  return level.max_error ? absl::StrCat("max_error ", ShortestNumber(*level.max_error))
                         : absl::StrCat("max_triangles ", level.max_triangles.value_or(0));
}

}  // namespace

absl::StatusOr<LevelQueue::Seat> LevelQueue::Join(const void* stream, const LevelOfDetail& level) {
  const MutexLock lock(mutex_);
  const Key key(stream, level);
  const auto found = groups_.find(key);
  const auto levels = static_cast<std::size_t>(std::ranges::count_if(
      groups_, [&](const auto& group) { return group.first.first == stream; }));
  if (found == groups_.end() && levels >= limits_.levels_per_stream) {
    return ViolationError(
        absl::StatusCode::kResourceExhausted,
        {std::string(kReasonTooManyLevels), "open.level_of_detail", Text(level),
         absl::StrCat("must be one of the ", levels,
                      " levels that watchers of the stream already have, or wait until one of them "
                      "is free")});
  }
  Group& group = groups_[key];
  group.key = key;
  ++group.seats;
  if (!thread_.joinable() && !stopping_) thread_ = std::thread([this] { Run(); });
  return Seat(*this, group);
}

void LevelQueue::Leave(Group& group) {
  std::list<Kept> dropped;  // Freed without the lock.
  const MutexLock lock(mutex_);
  if (--group.seats > 0) return;
  for (auto kept = kept_.begin(); kept != kept_.end();) {
    const auto next = std::next(kept);
    if (kept->key.first == &group) {
      kept_bytes_ -= kept->bytes;
      kept_by_frame_.erase(kept->key);
      dropped.splice(dropped.end(), kept_, kept);
    }
    kept = next;
  }
  if (running_ && running_->group == &group) running_->group = nullptr;
  std::erase(ready_, &group);
  groups_.erase(Key(group.key));
}

void LevelQueue::Request(const Seat& seat, Frame exact, bool may_skip, Waiter& waiter) {
  const MutexLock lock(mutex_);
  Group& group = *seat.group_;
  const Asked request{.waiter = &waiter, .may_skip = may_skip};
  if (Frame level = FindKept(group, exact); level != nullptr) {
    ++shared_;
    done_.push_back({.waiter = &waiter, .level = std::move(level)});
    dispatcher_.Wake(*this);
    return;
  }
  // A cancelled job gives no level.
  if (running_ && running_->group == &group && running_->job.exact == exact && !cancelled_) {
    ++shared_;
    running_->job.requests.push_back(request);
    return;
  }
  const auto same = std::ranges::find(group.jobs, exact, &Job::exact);
  if (same != group.jobs.end()) {
    ++shared_;
    same->requests.push_back(request);
    return;
  }
  if (may_skip) SkipOlder(group);
  if (group.jobs.empty()) ready_.push_back(&group);
  group.jobs.push_back({.exact = std::move(exact), .requests = {request}});
  job_came_.NotifyOne();
}

// Ends the requests of `group` that wait and may be skipped. Their watchers take the newest frame
// instead.
void LevelQueue::SkipOlder(Group& group) {
  for (Job& job : group.jobs) {
    std::erase_if(job.requests, [this](const Asked& request) {
      mutex_.AssertHeld();
      if (request.may_skip) done_.push_back({.waiter = request.waiter, .level = Frame()});
      return request.may_skip;
    });
  }
  const bool had_jobs = !group.jobs.empty();
  std::erase_if(group.jobs, [](const Job& job) { return job.requests.empty(); });
  if (had_jobs && group.jobs.empty()) std::erase(ready_, &group);
  if (!done_.empty()) dispatcher_.Wake(*this);
}

bool LevelQueue::Withdraw(const Waiter& waiter) {
  Frame freed;
  const MutexLock lock(mutex_);
  const auto belongs = [&](const Asked& request) { return request.waiter == &waiter; };
  if (std::erase_if(done_, [&](const Done& done) { return done.waiter == &waiter; }) > 0) {
    return true;
  }
  if (running_ && std::erase_if(running_->job.requests, belongs) > 0) {
    if (running_->job.requests.empty()) cancelled_ = true;
    return true;
  }
  for (auto& [key, group] : groups_) {
    for (auto job = group.jobs.begin(); job != group.jobs.end(); ++job) {
      if (std::erase_if(job->requests, belongs) == 0) continue;
      if (job->requests.empty()) {
        freed = std::move(job->exact);
        group.jobs.erase(job);
        if (group.jobs.empty()) std::erase(ready_, &group);
      }
      return true;
    }
  }
  return false;
}

void LevelQueue::Stop() {
  std::thread thread;
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    cancelled_ = true;
    thread = std::move(thread_);
  }
  job_came_.NotifyAll();
  if (thread.joinable()) thread.join();
}

std::size_t LevelQueue::level_count() const {
  const MutexLock lock(mutex_);
  return groups_.size();
}

std::size_t LevelQueue::waiting() const {
  const MutexLock lock(mutex_);
  std::size_t jobs = running_ ? 1 : 0;
  for (const auto& [key, group] : groups_) jobs += group.jobs.size();
  return jobs;
}

void LevelQueue::Serve() {
  std::vector<Done> done;
  {
    const MutexLock lock(mutex_);
    done = std::exchange(done_, {});
  }
  for (const Done& each : done) each.waiter->LevelDone(each.level);
}

void LevelQueue::Run() {
  pthread_setname_np(pthread_self(), "levels");
  setpriority(PRIO_PROCESS, 0, kNice);  // Under Linux only this thread.
  Arena arena(1);
  const MutexLock lock(mutex_);
  while (true) {
    while (ready_.empty() && !stopping_) job_came_.Wait(mutex_);
    if (stopping_) return;
    Group& group = *ready_.front();
    ready_.pop_front();
    running_ = Running{.group = &group, .job = std::move(group.jobs.front())};
    group.jobs.pop_front();
    if (!group.jobs.empty()) ready_.push_back(&group);
    cancelled_ = false;
    const Frame exact = running_->job.exact;
    const LevelOfDetail level = group.key.second;
    Made made;
    {
      const MutexUnlock unlock(mutex_);
      arena.Execute([&] { made = compute_(exact, level, cancelled_); });
    }
    Finish(made);
  }
}

// Passes the level of the running job to the dispatcher.
void LevelQueue::Finish(const Made& made) {
  const Running finished = *std::exchange(running_, std::nullopt);
  if (made.level.ok()) ++computed_;
  if (made.level.ok() && finished.group != nullptr) {
    Keep(*finished.group, finished.job.exact, *made.level);
  }
  for (const Asked& request : finished.job.requests) {
    const bool skips = !made.level.ok() && made.may_succeed_later && request.may_skip;
    done_.push_back(
        {.waiter = request.waiter, .level = skips ? absl::StatusOr<Frame>(Frame()) : made.level});
  }
  if (!done_.empty()) dispatcher_.Wake(*this);
}

LevelQueue::Frame LevelQueue::FindKept(const Group& group, const Frame& exact) const {
  const auto found = kept_by_frame_.find({&group, exact.get()});
  if (found == kept_by_frame_.end()) return nullptr;
  // The address may belong to another frame by now.
  return found->second->exact.lock() == exact ? found->second->level : nullptr;
}

void LevelQueue::Keep(const Group& group, const Frame& exact, const Frame& level) {
  const auto former = kept_by_frame_.find({&group, exact.get()});
  if (former != kept_by_frame_.end()) Drop(former->second);
  const std::size_t bytes = level->memory() + kPublishedBytes;
  // The levels of released frames are of no use.
  while (!kept_.empty() &&
         (kept_.front().exact.expired() || kept_bytes_ + bytes > limits_.kept_bytes)) {
    Drop(kept_.begin());
  }
  if (bytes > limits_.kept_bytes) return;
  kept_.push_back({.key = {&group, exact.get()}, .exact = exact, .level = level, .bytes = bytes});
  kept_by_frame_[kept_.back().key] = std::prev(kept_.end());
  kept_bytes_ += bytes;
}

void LevelQueue::Drop(std::list<Kept>::iterator kept) {
  kept_bytes_ -= kept->bytes;
  kept_by_frame_.erase(kept->key);
  kept_.erase(kept);
}

}  // namespace partiemc::server
