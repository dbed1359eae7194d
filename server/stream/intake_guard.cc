#include "server/stream/intake_guard.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

namespace partiemc::server {
namespace {

// A fast connection brings 15 MB meanwhile.
constexpr std::chrono::milliseconds kPeriod(10);

// Giving back a hundred megabytes takes 15 ms, in which nobody allocates.
constexpr std::chrono::milliseconds kBetweenGivingBack(250);

// While memory is left: what connections have received costs two system calls each. More often if
// streams wait, or if so much has come since the last look at the process.
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
  // First, as giving memory back takes a while.
  if (reads_ != nullptr) RevokeReads();
  const bool gives_back = now - gave_back_ >= kBetweenGivingBack;
  if (gives_back) {  // Some of it may be free already.
    process_.give_back_freed();
    gave_back_ = now;
  }
  if (gives_back && !IsTooMuch()) return;
  opening_.GiveWayToAll();
  // Not before it is sure that this is not free memory alone: watchers are there to stay.
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
