#include "bench/peer_measures.h"

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "bench/progress.h"

namespace partiemc::bench {
namespace {

constexpr int kSide = 1024;  // Nodes of the field whose contours are compared.
constexpr int kKernelRadius = 3;

// The density round the scene's middle on kSide x kSide nodes, from the floor.
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

// Half of the kernel sum deep inside, its integral over the plane.
double HalfDensity() { return 0.5 * 3.14159265358979323846 * kKernelRadius * kKernelRadius / 4; }

void AddStages(Harness& harness, const std::string& name, CoreStream& stream, int iterations,
               std::vector<Stage> stages) {
  harness.Add(name, iterations, [&stream, stages](benchmark::State& state) {
    stream.stages().Clear();
    for (auto _ : state) stream.Next();
    Cost sum;
    for (const Stage stage : stages) sum += stream.stages()[stage];
    state.counters["wall_ms"] = {sum.wall_ms, benchmark::Counter::kAvgIterations};
    state.counters["cpu_ms"] = {sum.cpu_ms, benchmark::Counter::kAvgIterations};
  });
}

template <typename Peer>
void AddPeer(Harness& harness, const std::string& name, Peer& peer, int iterations) {
  peer.Run();
  harness.Add(name, iterations, [&peer](benchmark::State& state) {
    for (auto _ : state) peer.Run();
  });
}

}  // namespace

PeerMeasures::PeerMeasures(const ReferenceScenes& scenes, bool quick, Harness& harness)
    : harness_(harness) {
  UseOneVtkThread();
  Progress("warming up: VTK");
  const auto xy = FloatPositions(scenes.blob_1m);
  field_box_ = LatticeBox::Around(xy, kKernelRadius);
  sph_ = std::make_unique<SphFieldPeer>(xy, field_box_);
  AddPeer(harness, "vtk_sph/1m", *sph_, 1);
  if (sph_->ReachedNodeCount() < scenes.blob_1m.ParticleCount()) Fail("VTK left nodes out");

  const Scene& scene = scenes.blob_1024;
  contours_ = std::make_unique<CoreStream>(scene, ReferenceParameters(scene));
  auto parameters = ReferenceParameters(scene);
  parameters.placement = Placement::kMarchingSquares;
  parameters.fill = Fill::kNone;
  linear_ = std::make_unique<CoreStream>(scene, parameters);
  parameters.fill = Fill::kPolygon;
  filled_ = std::make_unique<CoreStream>(scene, parameters);
  for (CoreStream* stream : {contours_.get(), linear_.get(), filled_.get()}) stream->WarmUp();
  const int iterations = quick ? 3 : 8;
  AddStages(harness, "contours/1024", *contours_, iterations, {Stage::kCrossings, Stage::kRings});
  AddStages(
      harness, "linear/1024", *linear_, iterations,
      {Stage::kCrossings, Stage::kRings, Stage::kNormals, Stage::kVertices, Stage::kIdentities});
  AddStages(harness, "filled/1024", *filled_, iterations, {Stage::kMesh});

  vtk_contours_ = std::make_unique<ContourPeer>(SquareField(scene), kSide, kSide, HalfDensity());
  AddPeer(harness, "vtk_contours/1024", *vtk_contours_, 10);
  vtk_fill_ = std::make_unique<FillPeer>(filled_->result().rings);
  AddPeer(harness, "vtk_fill/1024", *vtk_fill_, 1);
}

void PeerMeasures::AddTo(Report& report) const {
  const auto ours = [this](const std::string& name) {
    return Cost{harness_.MedianCounter(name, "wall_ms"), harness_.MedianCounter(name, "cpu_ms")};
  };
  struct Comparison {
    std::string metric, work, our_part;
    Cost ours, theirs;
    std::string peer;
  };
  const std::vector<Comparison> comparisons = {
      {"field_vs_vtk_sph_1m", "field of 1m, kernel radius 3", "bins, field",
       Cost{report.Metric("bins_ms_1m") + report.Metric("field_ms_1m"),
            report.Metric("bins_cpu_ms_1m") + report.Metric("field_cpu_ms_1m")},
       harness_.Median("vtk_sph/1m"), "vtkSPHInterpolator"},
      {"contours_vs_vtk_1024", "isolines of 1024 x 1024 nodes", "crossings, rings",
       ours("contours/1024"), harness_.Median("vtk_contours/1024"),
       "vtkFlyingEdges2D + vtkStripper"},
      {"linear_contours_vs_vtk_1024", "the same, to coordinates, normals and measures",
       "crossings to vertices, marching-squares", ours("linear/1024"),
       harness_.Median("vtk_contours/1024"), "vtkFlyingEdges2D + vtkStripper"},
      {"fill_vs_vtk_1024", "the inside of those rings as triangles", "mesh, polygon",
       ours("filled/1024"), harness_.Median("vtk_fill/1024"), "vtkContourTriangulator"},
  };
  report.AddMetric("field_stage_vs_vtk_sph_1m",
                   harness_.Median("vtk_sph/1m").cpu_ms / report.Metric("field_cpu_ms_1m"),
                   "ratio");
  report.AddHeading("Peers");
  report.AddParagraph(
      "Same data, same run, one thread each; the ratio is that of processor time: how many times "
      "faster. vtkSPHInterpolator builds its locator and sums its quintic kernel, of the same "
      "reach, "
      "at every node of the scene's box; ours is bins and field, likewise from positions to the "
      "field. The isolines are those of one blob: VTK's of the density at half of its inner "
      "value on 1024 x 1024 nodes, ours of the level set on the tiles that particles reach. VTK's "
      "polylines are neither nested nor cleaned; what crossings and rings leave is, with the same "
      "coordinates in cells, and with the particles of every body counted. The line below it goes "
      "on to all that a result holds: normals from particles, measures, identities.");
  std::vector<Report::Row> rows = {
      {"work", "ours, wall / processor ms", "peer", "peer, wall / processor ms", "ratio"}};
  for (const Comparison& c : comparisons) {
    const double ratio = c.theirs.cpu_ms / c.ours.cpu_ms;
    report.AddMetric(c.metric, ratio, "ratio");
    rows.push_back(
        {c.work,
         absl::StrCat(c.our_part, ": ", Figure(c.ours.wall_ms), " / ", Figure(c.ours.cpu_ms)),
         c.peer, absl::StrCat(Figure(c.theirs.wall_ms), " / ", Figure(c.theirs.cpu_ms)),
         Figure(ratio)});
  }
  report.AddTable(rows);
  const Result& linear = linear_->result();
  const double tile_nodes = static_cast<double>(linear.statistics.tiles) * 1024;
  report.AddMetric("contours_1024_points", static_cast<double>(linear.rings.PointCount()), "count");
  report.AddMetric("contours_1024_vtk_points", static_cast<double>(vtk_contours_->PointCount()),
                   "count");
  report.AddParagraph(absl::StrCat(
      "Points and lines of the isolines: ", linear.rings.PointCount(), " in ",
      linear.rings.RingCount(), " rings, VTK ", vtk_contours_->PointCount(), " in ",
      vtk_contours_->LineCount(), ". Tiles hold ", Figure(100 * tile_nodes / (kSide * kSide)),
      " % of the square's nodes. Triangles: ", filled_->result().mesh.TriangleCount(), ", VTK ",
      vtk_fill_->TriangleCount(), ". VTK's field has ", field_box_.NodeCount(), " nodes, ",
      sph_->ReachedNodeCount(), " of which particles reach."));
}

}  // namespace partiemc::bench
