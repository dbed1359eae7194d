// The messages of refusals are kept in one file, golden_messages.txt, where they can be read and
// reviewed together.
#pragma once

#include <set>
#include <string>
#include <vector>

namespace partiemc::server {

/// The messages that the running test expects.
class GoldenMessages {
 public:
  GoldenMessages();

  /// Expects that `message` is one of the test's messages.
  void Expect(const std::string& message);
  /// Expects that each of the test's messages has occurred.
  void ExpectAllSeen() const;

 private:
  std::string test_;                ///< "Suite.Name".
  std::vector<std::string> lines_;  ///< In the file's order. "<N>" stands for a number.
  std::set<std::string> seen_;      ///< The lines that have occurred.
};

}  // namespace partiemc::server
