// Reads whole sequences from files that a test writes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "client/input/sequence.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "support/temporary_folder.h"

namespace partiemc::client {

/// All frames of an input up to its end or the first error.
struct ReadSequence {
  absl::Status status;
  std::vector<RecordedFrame> frames;
  std::vector<std::string> notices;
  std::optional<std::size_t> frame_count;
  std::string description;
};

inline ReadSequence ReadAll(const std::string& input, const SequenceOptions& options = {}) {
  ReadSequence read;
  auto sequence = Sequence::Open(input, options);
  if (!sequence.ok()) {
    read.status = sequence.status();
    return read;
  }
  read.frame_count = (*sequence)->FrameCount();
  read.description = (*sequence)->Description();
  RecordedFrame frame;
  while (true) {
    const auto found = (*sequence)->Next(frame);
    read.status = found.status();
    if (!found.ok() || !*found) break;
    read.frames.push_back(frame);
  }
  // Errors are permanent: a caller that continues must not mistake the rest for the whole.
  if (!read.status.ok()) {
    EXPECT_EQ((*sequence)->Next(frame).status(), read.status);
  }
  read.notices = (*sequence)->notices();
  return read;
}

/// The only frame of an input. Fails the test and returns an empty frame if the number differs.
inline RecordedFrame ReadOne(const std::string& input, const SequenceOptions& options = {}) {
  const ReadSequence read = ReadAll(input, options);
  EXPECT_TRUE(read.status.ok()) << read.status;
  EXPECT_EQ(read.frames.size(), 1u) << input;
  return read.frames.empty() ? RecordedFrame() : read.frames.front();
}

/// Expects a one-line status with `code` that contains each of `words`.
inline void ExpectRefused(const absl::Status& status, absl::StatusCode code,
                          const std::vector<std::string>& words) {
  EXPECT_EQ(status.code(), code) << status;
  const std::string message(status.message());
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  for (const std::string& word : words) EXPECT_THAT(message, testing::HasSubstr(word));
}

inline std::string SamplePath(const std::string& name) {
  return std::string(PARTIEMC_SOURCE_DIR "/tests/data/formats/") + name;
}

}  // namespace partiemc::client
