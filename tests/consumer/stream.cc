// usage: stream ADDRESS. Streams a drifting disc to a server, as a simulator would do it, and
// prints the area of every outline that comes back.
#include "partiemc/client/stream.h"

#include <cstdio>
#include <span>
#include <vector>

#include "disc.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  constexpr int kFrames = 5;
  auto stream = partiemc::client::Stream::Open(argv[1], {.parameters = {.spacing = kSpacing}});
  if (!stream.ok()) {
    std::fprintf(stderr, "%s\n", stream.status().ToString().c_str());
    return 1;
  }

  int right = 0;
  for (int k = 0; k < kFrames; ++k) {
    const std::vector<double> xy = Disc(0.25 * k);
    const partiemc::Frame frame{.positions = std::span<const double>(xy)};
    partiemc::client::Event event;
    const auto sent = (*stream)->Send(frame, 0.1 * k);
    const auto received = (*stream)->Receive(event);
    if (!sent.ok() || !received.ok() || event.kind != partiemc::client::Event::Kind::kResult) {
      std::fprintf(stderr, "%s %s %s\n", sent.status().ToString().c_str(),
                   received.status().ToString().c_str(), event.message.c_str());
      return 1;
    }
    const auto& statistics = event.frame.result.statistics;
    std::printf("frame %d by the server: area %.5f\n", k + 1, statistics.area);
    if (event.sequence == *sent && IsAreaOf(statistics.area, xy)) ++right;
  }
  return (*stream)->FinishSending().ok() && right == kFrames ? 0 : 1;
}
