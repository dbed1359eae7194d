// The keys that sign checkpoints. Replicas share the file with the keys.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "common/mutex.h"

namespace partiemc::server {

/// Signs checkpoints by HMAC-SHA256. The first key signs; all keys verify. So replicas can replace
/// a key one after the other without refusing each other's checkpoints.
class CheckpointKeys {
 public:
  static constexpr std::size_t kSignatureBytes = 32;

  /// Parses a key file. `text` has one or two lines with one key each; empty lines and lines that
  /// begin with '#' are ignored. A key has 16 to 512 characters of [A-Za-z0-9-._~+/=]. Keys must be
  /// random, because an attacker can test guesses offline with a signed checkpoint. Errors:
  /// INVALID_ARGUMENT for an invalid or repeated key, no key, or more than two keys. The message
  /// contains line and rule, but not the key.
  static absl::StatusOr<CheckpointKeys> Parse(std::string_view text);

  /// Returns the signature, which has kSignatureBytes bytes.
  std::string Sign(std::string_view bytes) const;
  /// Whether one of the keys has signed `bytes`. The time does not depend on the signature.
  bool Verify(std::string_view bytes, std::string_view signature) const;

 private:
  std::vector<std::string> keys_;  // At least one.
};

/// The current keys. Thread-safe.
class CurrentCheckpointKeys {
 public:
  void Set(CheckpointKeys keys) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Returns the current keys. Null before the first Set: checkpoints are then not signed.
  std::shared_ptr<const CheckpointKeys> Get() const ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  mutable Mutex mutex_;
  std::shared_ptr<const CheckpointKeys> keys_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
