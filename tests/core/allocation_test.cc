// Counts every operator new of the program: a frame like one before must need none. oneTBB's own
// task pool takes memory by other means and is not counted.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <ostream>
#include <string>
#include <vector>

#include "partiemc/partiemc.h"
#include "support/particles.h"

namespace {

std::atomic<std::size_t> allocations = 0;

void* Allocate(std::size_t bytes, std::size_t alignment) {
  ++allocations;
  void* memory = nullptr;
  if (posix_memalign(&memory, alignment, bytes) != 0) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t bytes) { return Allocate(bytes, alignof(std::max_align_t)); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return Allocate(bytes, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace partiemc {
namespace {

using support::Particles;

struct AllocationCase {
  Placement placement;
  Fill fill;
  int threads;
  bool volumes, ids;
  bool estimates_spacing = false;  // In each frame.
};

void PrintTo(const AllocationCase& tested, std::ostream* out) {
  *out << Name(tested.placement) << ", " << Name(tested.fill) << ", " << tested.threads
       << " threads" << (tested.volumes ? ", volumes" : "") << (tested.ids ? ", ids" : "")
       << (tested.estimates_spacing ? ", spacing estimated" : "");
}

class WarmFrame : public testing::TestWithParam<AllocationCase> {};

TEST_P(WarmFrame, AllocatesNothing) {
  const AllocationCase& tested = GetParam();
  tbb::global_control control(tbb::global_control::max_allowed_parallelism, tested.threads);
  tbb::task_arena arena(tested.threads);
  ReconstructionParameters parameters{
      .placement = tested.placement, .fill = tested.fill, .min_component_particles = 3};
  if (tested.estimates_spacing) {
    parameters.spacing_rule = SpacingRule::kEveryFrame;
  } else {
    parameters.spacing = 1.0;
  }
  const auto reconstructor = Reconstructor::Create(parameters);
  ASSERT_TRUE(reconstructor.ok());
  // Bodies that meet and part, spray, holes that cleaning fills, more than one stretch of
  // particles; then few particles, then none.
  std::vector<Particles> frames;
  for (int k = 0; k < 4; ++k) {
    support::Random random(static_cast<std::uint64_t>(k));
    Particles frame = support::Disc(120);
    frame.Add(support::Shifted(support::Blob(random, 12), 118 + 6 * k, 5));
    frame.Add(support::Shifted(support::Noise(random, 200, 60), -200, 150));
    if (tested.volumes) frame.volumes.assign(frame.size(), 1.0f);
    for (std::size_t id = 0; tested.ids && id < frame.size(); ++id) {
      // Numbers without and with large gaps; frames that follow each other know their particles.
      frame.ids.push_back(k < 2 ? id : id << 32);
    }
    frames.push_back(frame);
  }
  frames.insert(frames.begin() + 2, {support::Disc(5), Particles()});
  State state;
  Workspace workspace;
  Result result;
  std::size_t before = 0;
  for (int round = 0; round < 3; ++round) {
    before = allocations;
    for (const Particles& frame : frames) {
      arena.execute([&] {
        ASSERT_TRUE(reconstructor->Reconstruct(frame.AsFrame(), state, workspace, result).ok());
      });
    }
    if (round == 0) {
      EXPECT_GT(allocations, before) << "nothing is counted";
    }
  }
  EXPECT_EQ(allocations - before, 0u) << "in " << frames.size() << " frames";
  EXPECT_GT(result.rings.RingCount(), 1u);
}

std::vector<AllocationCase> Cases() {
  std::vector<AllocationCase> cases;
  for (const Placement placement : AllPlacements()) {
    for (const Fill fill : AllFills()) {
      for (const int threads : {1, 2}) {
        cases.push_back({placement, fill, threads, threads == 1, threads == 2});
      }
    }
  }
  for (const int threads : {1, 2}) {
    cases.push_back({Placement::kVirtualPlane, Fill::kGreedy, threads, false, false, true});
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(PlacementsAndFills, WarmFrame, testing::ValuesIn(Cases()),
                         [](const auto& tested) {
                           std::string name(Name(tested.param.placement));
                           std::erase(name, '-');
                           return name + "_" + std::string(Name(tested.param.fill)) +
                                  std::to_string(tested.param.threads) +
                                  (tested.param.estimates_spacing ? "_spacing" : "");
                         });

}  // namespace
}  // namespace partiemc
