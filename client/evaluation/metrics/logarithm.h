// Logarithm and exponential by plain arithmetic: those of the C library differ between machines in
// their last bits, and means of logarithms go into tables that have to be the same everywhere.
#pragma once

namespace partiemc::evaluation {

/// Natural logarithm, to 1e-15 (absolute near 1, relative elsewhere). Requires: x > 0, finite.
double Logarithm(double x);

/// e to the power of x, to 1e-14 relative. Requires: |x| < 700.
double Exponential(double x);

}  // namespace partiemc::evaluation
