// Wall-clock and processor time, read together.
#pragma once

#include <time.h>

namespace partiemc::bench {

inline double Milliseconds(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
}

inline double WallMs() { return Milliseconds(CLOCK_MONOTONIC); }

/// Wall-clock time, and processor time of all threads of the process.
struct Cost {
  double wall_ms = 0;
  double cpu_ms = 0;

  static Cost Now() { return {WallMs(), Milliseconds(CLOCK_PROCESS_CPUTIME_ID)}; }
  friend Cost operator-(Cost a, Cost b) { return {a.wall_ms - b.wall_ms, a.cpu_ms - b.cpu_ms}; }
  Cost& operator+=(Cost other) {
    wall_ms += other.wall_ms;
    cpu_ms += other.cpu_ms;
    return *this;
  }
};

}  // namespace partiemc::bench
