#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "bench/core_stream.h"
#include "bench/measures.h"
#include "bench/peers.h"
#include "bench/require.h"

namespace partiemc::bench {
namespace {

constexpr int kSide = 1024;  // Nodes of the field whose isolines are compared.
constexpr int kKernelRadius = 3;

// The density of the scene on kSide x kSide nodes, computed by the floor.
std::vector<float> SquareField(const Scene& scene) {
  const auto xy = FloatPositions(scene);
  const LatticeBox box = LatticeBox::Around(xy, kKernelRadius + 1);
  if (box.columns > kSide || box.rows > kSide) Fail("the scene does not fit into the field");
  ScatterBuffers buffers;
  ScatterDensity(xy, box, kKernelRadius, buffers);
  std::vector<float> field(std::size_t{kSide} * kSide, 0);
  const int left = (kSide - box.columns) / 2, bottom = (kSide - box.rows) / 2;
  for (int row = 0; row < box.rows; ++row) {
    const float* const from = buffers.density.data() + row * buffers.stride;
    std::copy(from, from + box.columns, field.data() + (bottom + row) * kSide + left);
  }
  return field;
}

// Half of the kernel sum inside the body, which is the kernel's integral over the plane.
constexpr double kHalfDensity = 0.5 * std::numbers::pi * kKernelRadius * kKernelRadius / 4;

template <typename Peer>
void RegisterPeer(const std::string& name, int iterations, const std::shared_ptr<Peer>& peer) {
  Register(name, iterations, [peer](benchmark::State& state) {
    for (auto _ : state) peer->Run();
  });
}

void RegisterFrames(const std::string& name, const std::shared_ptr<CoreStream>& stream) {
  Register(name, 3, [stream](benchmark::State& state) {
    MeasureFrames(*stream, state);
    const Result& result = stream->result();
    state.counters["points"] = static_cast<double>(result.rings.PointCount());
    state.counters["triangles"] = static_cast<double>(result.mesh.TriangleCount());
  });
}

void RegisterField(const Scene& scene) {
  const auto xy = FloatPositions(scene);
  const auto sph = std::make_shared<SphFieldPeer>(xy, LatticeBox::Around(xy, kKernelRadius));
  Register("vtk_sph/" + scene.name, 1, [sph, &scene](benchmark::State& state) {
    for (auto _ : state) sph->Run();
    if (sph->ReachedNodeCount() < scene.ParticleCount()) Fail("VTK left nodes out");
  });
}

}  // namespace

void RegisterPeers(const Scenes& scenes) {
  UseOneVtkThread();
  for (const Scene& blob : scenes.blobs) {
    if (blob.name == "1m") RegisterField(blob);
  }
  const Scene& scene = scenes.blob_1024;
  auto parameters = ReferenceParameters(scene);
  RegisterFrames("contours/1024", std::make_shared<CoreStream>(scene, parameters));
  parameters.placement = Placement::kMarchingSquares;
  parameters.fill = Fill::kNone;
  RegisterFrames("linear_contours/1024", std::make_shared<CoreStream>(scene, parameters));
  parameters.fill = Fill::kPolygon;
  const auto filled = std::make_shared<CoreStream>(scene, parameters);
  RegisterFrames("fill/1024", filled);

  const auto contours =
      std::make_shared<ContourPeer>(SquareField(scene), kSide, kSide, kHalfDensity);
  RegisterPeer("vtk_contours/1024", 10, contours);
  filled->WarmUp();
  RegisterPeer("vtk_fill/1024", 1, std::make_shared<FillPeer>(filled->result().rings));
}

}  // namespace partiemc::bench
