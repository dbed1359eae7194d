// Keys that sign checkpoints, from a file that replicas share.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "common/mutex.h"

namespace partiemc::server {

/// HMAC-SHA256. The first key signs, all keys verify, so that replicas can replace a key without
/// refusing checkpoints.
class CheckpointKeys {
 public:
  static constexpr std::size_t kSignatureBytes = 32;

  /// `text` has one or two lines with one key each; empty lines and lines that begin with '#' are
  /// ignored. A key has 16 to 512 characters of [A-Za-z0-9-._~+/=]. Keys must be random, because a
  /// signed checkpoint permits offline guessing. Errors: INVALID_ARGUMENT with line and rule, but
  /// without the key: an invalid or repeated key, no key, more than two keys.
  static absl::StatusOr<CheckpointKeys> Parse(std::string_view text);

  /// Returns kSignatureBytes bytes.
  std::string Sign(std::string_view bytes) const;
  /// Whether one of the keys has signed `bytes`. Constant time for all signatures.
  bool Verify(std::string_view bytes, std::string_view signature) const;

 private:
  std::vector<std::string> keys_;  // At least one.
};

/// The current keys. Thread-safe.
class CurrentCheckpointKeys {
 public:
  void Set(CheckpointKeys keys) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Null before the first Set: checkpoints are not signed.
  std::shared_ptr<const CheckpointKeys> Get() const ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  mutable Mutex mutex_;
  std::shared_ptr<const CheckpointKeys> keys_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
