// A producer that keeps to every rule, and what its answers have to be.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace partiemc::attack {

/// Streams frames of some ten thousand particles at a steady rate, one at a time, from its
/// construction until Stop. Every answer is compared with what the core computes in this process;
/// the first wrong one, or the end of the call, fails the test and ends it.
class HonestStream {
 public:
  /// Opened when it returns. An empty token sends none. `ca`: the authority of the server's
  /// certificate in PEM; empty: without TLS.
  HonestStream(const std::string& address, const std::string& token, unsigned seed,
               const std::string& ca = "");
  ~HonestStream();

  void Stop();

  /// From sending to the answer, in milliseconds: since the last call of this.
  std::vector<double> TakeLatencies();
  std::uint64_t frames() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::thread thread_;
};

}  // namespace partiemc::attack
