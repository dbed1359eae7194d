// A producer that keeps all rules and checks its answers.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace partiemc::attack {

/// Tokens of the honest producer and of the callers that attack.
inline constexpr char kHonestToken[] = "honest-0123456789abcdef";
inline constexpr char kHostileToken[] = "hostile-0123456789abcdef";

/// Streams frames of about ten thousand particles at a steady rate, one at a time, from its
/// construction until Stop. Compares every answer with the core in this process. The first wrong
/// answer or the end of the call fails the test and stops it.
class HonestStream {
 public:
  /// Opened when it returns. An empty token sends none. `ca`: the authority of the server's
  /// certificate in PEM; empty: without TLS.
  HonestStream(const std::string& address, const std::string& token, unsigned seed,
               const std::string& ca = "");
  ~HonestStream();

  void Stop();

  /// Milliseconds from sending to the answer, since the last call.
  std::vector<double> TakeLatencies();
  std::uint64_t frames() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::thread thread_;
};

}  // namespace partiemc::attack
