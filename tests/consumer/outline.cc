// Outlines a disc of particles in this process and prints the area that the outline encloses.
#include <cstdio>
#include <span>
#include <vector>

#include "disc.h"
#include "partiemc/partiemc.h"

int main() {
  const auto reconstructor = partiemc::Reconstructor::Create({.spacing = kSpacing});
  if (!reconstructor.ok()) return 1;
  partiemc::State state;
  partiemc::Workspace workspace;
  partiemc::Result result;
  const std::vector<double> xy = Disc(0);
  const partiemc::Frame frame{.positions = std::span<const double>(xy)};
  if (auto status = reconstructor->Reconstruct(frame, state, workspace, result); !status.ok()) {
    std::fprintf(stderr, "%s\n", status.ToString().c_str());
    return 1;
  }
  std::printf("in process: %zu ring, area %.5f\n", result.rings.RingCount(),
              result.statistics.area);
  return result.rings.RingCount() == 1 && IsAreaOf(result.statistics.area, xy) ? 0 : 1;
}
