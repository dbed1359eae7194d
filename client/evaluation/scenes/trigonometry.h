// Sine and cosine by plain arithmetic: glibc picks its own by processor, and their bits differ.
#pragma once

namespace partiemc::evaluation {

inline constexpr double kPi = 3.14159265358979323846;

struct Direction {
  double cosine = 1, sine = 0;
};

/// Cosine and sine of an angle in radians, to 1e-14 for |angle| < 1e4. The same bits everywhere.
Direction DirectionOf(double angle);

inline double Sine(double angle) { return DirectionOf(angle).sine; }

}  // namespace partiemc::evaluation
