#include "server/stream/intake_guard.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

namespace partiemc::server {
namespace {

// Interval of the memory checks. A fast connection can deliver 15 MB in this time.
constexpr std::chrono::milliseconds kPeriod(10);

// Minimum interval between two returns of freed memory to the operating system. Returning 100 MB
// takes 15 ms, during which no other thread can allocate.
constexpr std::chrono::milliseconds kBetweenGivingBack(250);

// Interval between readings of the bytes that each connection has received (ReadPermits::Look). A
// reading costs two system calls for each connection. The shorter interval applies while streams
// wait for memory. The thread takes a reading at once if memory is exhausted, or if the memory of
// the process has grown by kMuchMore since the last check.
constexpr std::chrono::milliseconds kBetweenLooks(250), kBetweenLooksWhileWaiting(50);
constexpr std::uint64_t kMuchMore = 16 << 20;

}  // namespace

IntakeGuard::IntakeGuard(OpeningCalls& opening, Process process, ReadPermits* reads)
    : opening_(opening), reads_(reads), process_(std::move(process)), thread_([this] { Run(); }) {
  if (reads_ != nullptr) reads_->OnWaiting([this] { opening_.LookAgain(); });
}

IntakeGuard::~IntakeGuard() {
  if (reads_ != nullptr) reads_->OnWaiting({});
  opening_.StopWaiting();
  thread_.join();
}

void IntakeGuard::Run() {
  pthread_setname_np(pthread_self(), "intake");
  while (opening_.WaitForOne([this] { return reads_ != nullptr && reads_->NeedsLook(); })) {
    const auto now = std::chrono::steady_clock::now();
    const bool too_much = IsTooMuch();
    if (reads_ != nullptr && reads_->NeedsLook()) {
      const std::uint64_t resident = process_.resident_bytes();
      const bool much_more = resident > resident_before_ + kMuchMore;
      resident_before_ = resident;
      const auto pause = reads_->NeedsBytes() ? kBetweenLooksWhileWaiting : kBetweenLooks;
      if (too_much || much_more || now - looked_ >= pause) LookAtReads(now);
    }
    if (too_much) FreeMemory(now);
    std::this_thread::sleep_for(kPeriod);
  }
}

void IntakeGuard::LookAtReads(std::chrono::steady_clock::time_point now) {
  looked_ = now;
  const auto received =
      process_.received_bytes ? process_.received_bytes() : std::map<std::string, std::uint64_t>();
  reads_->Look(now, [&](const std::string& peer) -> std::optional<std::uint64_t> {
    const auto found = received.find(peer);
    if (found == received.end()) return std::nullopt;
    return found->second;
  });
}

void IntakeGuard::FreeMemory(std::chrono::steady_clock::time_point now) {
  // First, because returning freed memory takes milliseconds.
  if (reads_ != nullptr) RevokeReads();
  const bool gives_back = now - gave_back_ >= kBetweenGivingBack;
  if (gives_back) {  // Part of the resident memory may be freed already.
    process_.give_back_freed();
    gave_back_ = now;
  }
  if (gives_back && !IsTooMuch()) return;
  opening_.GiveWayToAll();
  // Watchers stay connected for a long time, so their eviction is the last resort: only if freed
  // memory was just returned and the process still exceeds the limit.
  if (gives_back && IsTooMuch()) opening_.WatchersGiveWay();
}

void IntakeGuard::RevokeReads() {
  const std::uint64_t resident = process_.resident_bytes();
  reads_->Revoke(process_.limit_bytes - std::min(process_.limit_bytes, resident));
}

bool IntakeGuard::IsTooMuch() const {
  const std::uint64_t resident = process_.resident_bytes(), most = process_.most_bytes();
  return resident > most && resident - most > process_.more_bytes();
}

}  // namespace partiemc::server
