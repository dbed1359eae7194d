// A MemoryGuard for tests.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>

#include "partiemc/partiemc.h"

namespace partiemc::support {

/// Grants a number of requests, and records the requested bytes.
class RecordingGuard final : public MemoryGuard {
 public:
  explicit RecordingGuard(int granted) : granted_(granted) {}
  bool Reserve(std::uint64_t bytes) override {
    EXPECT_GE(bytes, last_);
    last_ = bytes;
    return granted_-- > 0;
  }
  std::uint64_t last() const { return last_; }

 private:
  int granted_;
  std::uint64_t last_ = 0;
};

}  // namespace partiemc::support
