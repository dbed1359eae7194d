#include "service/load_recordings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "client/cli/program.h"
#include "client/recording/recording.h"

namespace partiemc::server {

void RecordDamBreak(const std::string& path, std::uint64_t count) {
  const auto reader = client::RecordingReader::Open(client::kDamBreak, "");
  ASSERT_TRUE(reader.ok()) << reader.status();
  std::vector<client::RecordedFrame> frames(*(*reader)->FrameCount());
  for (client::RecordedFrame& frame : frames) ASSERT_TRUE((*reader)->Next(frame).value_or(false));
  const auto writer = client::RecordingWriter::Create(path, (*reader)->header(), {});
  ASSERT_TRUE(writer.ok()) << writer.status();
  for (std::uint64_t k = 0; k < count; ++k) {
    client::RecordedFrame& frame = frames[k % frames.size()];
    frame.time = 0.01 * static_cast<double>(k);
    ASSERT_TRUE((*writer)->Add(frame).ok());
  }
  ASSERT_TRUE((*writer)->Finish().ok());
}

void RecordSquare(const std::string& path, std::uint64_t particles, std::uint64_t count) {
  const auto writer = client::RecordingWriter::Create(path, {.spacing = 1}, {});
  ASSERT_TRUE(writer.ok()) << writer.status();
  const auto side = static_cast<std::uint64_t>(std::sqrt(static_cast<double>(particles)));
  client::RecordedFrame frame;
  for (std::uint64_t k = 0; k < count; ++k) {
    frame.positions.clear();
    frame.time = 0.01 * static_cast<double>(k);
    for (std::uint64_t row = 0; row < side; ++row) {
      for (std::uint64_t column = 0; column < side; ++column) {
        const auto x = static_cast<double>(column), y = static_cast<double>(row);
        const double wave = std::sin(0.05 * x + 0.3 * static_cast<double>(k));
        frame.positions.insert(frame.positions.end(),
                               {x, std::round(64 * y * (1 + 0.02 * wave)) / 64});
      }
    }
    ASSERT_TRUE((*writer)->Add(frame).ok());
  }
  ASSERT_TRUE((*writer)->Finish().ok());
}

}  // namespace partiemc::server
