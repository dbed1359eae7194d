// The example of README.md, as it stands there, in the least that it needs around it.
#include <cstdio>
#include <vector>

#include "readme_includes.inc"

namespace {

struct Simulation {
  bool Step() { return ++step <= 3; }
  const std::vector<float>& xy() const { return positions; }
  double time() const { return step; }

  int step = 0;
  std::vector<float> positions = {0, 0, 1, 0, 0, 1, 1, 1};
};

int Fail(const absl::Status& status) {
  std::printf("%s\n", status.ToString().c_str());
  return 1;
}

void Draw(const partiemc::Rings&) {}

}  // namespace

// Built, not run: no server listens on its address here.
int main() {
  const double dx = 1;
  Simulation simulation;
#include "readme_example.inc"
  return 0;
}
