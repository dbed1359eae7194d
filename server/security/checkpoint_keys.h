// The keys by which servers tell checkpoints of their own making from others: a file that replicas
// share.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace partiemc::server {

/// HMAC-SHA256. The first key signs; each of them verifies, so that a fleet changes its key without
/// a refused checkpoint.
class CheckpointKeys {
 public:
  static constexpr std::size_t kSignatureBytes = 32;

  /// `text` has one or two lines with a key each; blank lines and lines that begin with '#' count
  /// for nothing. A key is 16 to 512 characters of [A-Za-z0-9-._~+/=]; whoever has a signed
  /// checkpoint can try keys at leisure, so it should be random.
  /// Errors: INVALID_ARGUMENT, which names the line and the rule and never a key: something else,
  /// a key twice, none, more than two.
  static absl::StatusOr<CheckpointKeys> Parse(std::string_view text);

  /// kSignatureBytes.
  std::string Sign(std::string_view bytes) const;
  /// Whether one of the keys has signed `bytes`. Takes as long whatever the signature is.
  bool Verify(std::string_view bytes, std::string_view signature) const;

 private:
  std::vector<std::string> keys_;  // At least one.
};

/// Those in force. Safe from any thread.
class CurrentCheckpointKeys {
 public:
  void Set(CheckpointKeys keys);
  /// Null before the first Set: checkpoints are not signed.
  std::shared_ptr<const CheckpointKeys> Get() const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const CheckpointKeys> keys_;  // Guarded by mutex_.
};

}  // namespace partiemc::server
