#include "server/stream/intake_guard.h"

#include <pthread.h>

#include <chrono>
#include <utility>

namespace partiemc::server {
namespace {

// A fast connection brings 15 MB meanwhile.
constexpr std::chrono::milliseconds kPeriod(10);

// Giving back a hundred megabytes takes 15 ms, in which nobody allocates.
constexpr std::chrono::milliseconds kBetweenGivingBack(250);

}  // namespace

IntakeGuard::IntakeGuard(OpeningCalls& opening, Process process)
    : opening_(opening), process_(std::move(process)), thread_([this] { Run(); }) {}

IntakeGuard::~IntakeGuard() {
  opening_.StopWaiting();
  thread_.join();
}

void IntakeGuard::Run() {
  pthread_setname_np(pthread_self(), "intake");
  auto give_back = std::chrono::steady_clock::time_point::min();
  while (opening_.WaitForOne()) {
    if (IsTooMuch()) {
      const auto now = std::chrono::steady_clock::now();
      const bool gives_back = now >= give_back;
      if (gives_back) {  // Some of it may be free already.
        process_.give_back_freed();
        give_back = now + kBetweenGivingBack;
      }
      if (!gives_back || IsTooMuch()) opening_.GiveWayToAll();
      // Not before it is sure that this is not free memory alone: watchers are there to stay.
      if (gives_back && IsTooMuch()) opening_.WatchersGiveWay();
    }
    std::this_thread::sleep_for(kPeriod);
  }
}

bool IntakeGuard::IsTooMuch() const {
  const std::uint64_t resident = process_.resident_bytes(), most = process_.most_bytes();
  return resident > most && resident - most > process_.more_bytes();
}

}  // namespace partiemc::server
