#include "common/clock.h"

#include <random>

namespace partiemc {
namespace {

class MachineClock final : public Clock {
 public:
  TimePoint Now() const override { return std::chrono::steady_clock::now(); }
  std::chrono::system_clock::time_point TimeOfDay() const override {
    return std::chrono::system_clock::now();
  }
  bool WaitUntil(CondVar& changed, Mutex& mutex, TimePoint until) const override
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) {
    return changed.WaitUntil(mutex, until);
  }
};

class Device final : public RandomSource {
 public:
  // One device for each call: std::random_device is not thread-safe.
  std::uint64_t Next() override {
    std::random_device random;  // The operating system's generator: 32 bits each.
    const std::uint64_t high = random();
    return high << 32 | random();
  }
};

}  // namespace

const Clock& SystemClock() {
  static const MachineClock clock;
  return clock;
}

RandomSource& SystemRandom() {
  static Device device;
  return device;
}

}  // namespace partiemc
