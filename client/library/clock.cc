#include "client/library/clock.h"

#include <random>

namespace partiemc::client {
namespace {

class MonotonicClock final : public Clock {
 public:
  TimePoint Now() const override { return std::chrono::steady_clock::now(); }
};

class Device final : public RandomSource {
 public:
  // One device for each call: std::random_device is not thread-safe.
  std::uint64_t Next() override { return std::random_device{}(); }
};

}  // namespace

Clock& SystemClock() {
  static MonotonicClock clock;
  return clock;
}

RandomSource& SystemRandom() {
  static Device device;
  return device;
}

}  // namespace partiemc::client
