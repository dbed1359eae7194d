// Writes surfaces as files for read_surfaces.py.
//   surface_files DIR
// Frames 0 and 1 are the scene, frame 2 is empty, frame 3 is the scene with cuts. DIR/packed has
// the GLB files of --compress-glb.
#include <array>
#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "client/output/frame_writer.h"
#include "client/output/statistics_writer.h"
#include "client/output/surface_scene.h"

namespace partiemc::client {
namespace {

void Require(const absl::Status& status) {
  if (status.ok()) return;
  std::cerr << status << "\n";
  std::exit(1);
}

template <typename T>
T Required(absl::StatusOr<T> made) {
  Require(made.status());
  return *std::move(made);
}

void WriteAll(const std::filesystem::path& directory) {
  FrameWriter files = Required(FrameWriter::Create(
      {.directory = directory, .formats = Required(ParseFrameFormats("obj,vtp,ply,stl,glb"))}));
  FrameWriter packed = Required(FrameWriter::Create(
      {.directory = directory / "packed", .formats = {FrameFormat::kGlb}, .compress_glb = true}));
  StatisticsWriter statistics =
      Required(StatisticsWriter::Create(directory / "stats.json", {}, StatisticsOf::kSurfaces));
  Surface scene = HollowBallAndTorus();
  for (std::size_t k = 0; k < scene.ShellCount(); ++k) scene.measures[k].identity = 70 + k;
  const Surface empty, cut = WithCuts(scene);
  const std::array<const Surface*, 4> surfaces = {&scene, &scene, &empty, &cut};
  const Result no_outline;
  for (std::uint64_t k = 0; k < surfaces.size(); ++k) {
    const FrameRecord frame{.index = k,
                            .time = 0.5 + 0.25 * static_cast<double>(k),
                            .result = no_outline,
                            .surface = surfaces[k]};
    Require(files.Write(frame));
    Require(packed.Write(frame));
    Require(statistics.Add(frame));
  }
  Require(files.Finish());
  Require(statistics.Finish());
}

}  // namespace
}  // namespace partiemc::client

int main(int count, char** arguments) {
  if (count != 2) {
    std::cerr << "usage: surface_files DIR\n";
    return 2;
  }
  partiemc::client::WriteAll(arguments[1]);
}
