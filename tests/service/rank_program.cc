// One rank of a simulator: streams its part of a moving blob; particle k belongs to rank k modulo
// ranks. Rank 0 prints a line for each answer: "SEQUENCE RINGS_DIGEST MESH_DIGEST" or "SEQUENCE
// REASON". The others print refusals.
//
//   parts_rank ADDRESS FRAMES PAUSE_MS [RANK RANKS]     (default of the last two: Open MPI's)
#include <chrono>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/client/stream.h"
#include "server/moving_blob.h"

namespace partiemc::server {
namespace {

using client::Event;
using client::Received;
using client::Stream;

struct Share {
  std::vector<double> positions;
  std::vector<std::uint64_t> ids;
};

Share ShareOf(std::uint64_t frame, std::uint32_t rank, std::uint32_t ranks) {
  const std::vector<double> blob = MovingBlob(1, frame);
  Share share;
  for (std::uint64_t k = rank; k < blob.size() / 2; k += ranks) {
    share.positions.insert(share.positions.end(), {blob[2 * k], blob[2 * k + 1]});
    share.ids.push_back(k);
  }
  return share;
}

// False at the end of the stream.
bool ReceiveOne(Stream& stream) {
  Event event;
  const auto received = stream.Receive(event);
  if (!received.ok()) {
    std::fprintf(stderr, "%s\n", received.status().ToString().c_str());
    std::exit(1);
  }
  if (*received == Received::kEnd) return false;
  if (event.kind == Event::Kind::kResult) {
    std::printf("%" PRIu64 " %016" PRIx64 " %016" PRIx64 "\n", event.sequence,
                event.frame.rings_digest, event.frame.mesh_digest);
  } else if (event.kind == Event::Kind::kRefusal) {
    std::printf("%" PRIu64 " %s\n", event.sequence, event.violation.reason.c_str());
  }
  std::fflush(stdout);
  return true;
}

int Run(const std::string& address, std::uint64_t frames, std::chrono::milliseconds pause,
        std::uint32_t rank, std::uint32_t ranks) {
  client::StreamOptions options;
  options.name = "ranks";
  options.parameters = BlobParameters();
  options.parts = {
      .parts = ranks, .part = rank, .token = "of this job", .timeout = std::chrono::seconds(2)};
  options.reconnect.give_up_after = std::chrono::seconds(8);
  auto opened = Stream::Open(address, options);
  if (!opened.ok()) {
    std::fprintf(stderr, "%s\n", opened.status().ToString().c_str());
    return 1;
  }
  Stream& stream = **opened;
  for (std::uint64_t frame = 0; frame < frames; ++frame) {
    while (stream.InFlight() >= stream.info().frames_in_flight) ReceiveOne(stream);
    const Share share = ShareOf(frame, rank, ranks);
    const auto sent =
        stream.Send({.positions = std::span<const double>(share.positions), .ids = share.ids}, 0);
    if (!sent.ok()) {
      std::fprintf(stderr, "%s\n", sent.status().ToString().c_str());
      return 1;
    }
    std::this_thread::sleep_for(pause);
  }
  if (!stream.FinishSending().ok()) return 1;
  while (ReceiveOne(stream)) {
  }
  return 0;
}

std::uint32_t FromEnvironment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? 0 : static_cast<std::uint32_t>(std::strtoul(value, nullptr, 10));
}

}  // namespace
}  // namespace partiemc::server

int main(int argc, char** argv) {
  using partiemc::server::FromEnvironment;
  if (argc != 4 && argc != 6) return 2;
  const auto number = [&](int k) { return std::strtoul(argv[k], nullptr, 10); };
  const auto rank =
      argc == 6 ? static_cast<std::uint32_t>(number(4)) : FromEnvironment("OMPI_COMM_WORLD_RANK");
  const auto ranks =
      argc == 6 ? static_cast<std::uint32_t>(number(5)) : FromEnvironment("OMPI_COMM_WORLD_SIZE");
  return partiemc::server::Run(argv[1], number(2), std::chrono::milliseconds(number(3)), rank,
                               ranks);
}
