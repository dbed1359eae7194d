// OpenVDB's surface of particles, for surface_peers.py. Not part of the build; surface_peers.py
// --help has the command.
//
// Particles are rasterised into a narrow-band level set, which is filtered and then meshed by dual
// contouring. Runs on one thread. Prints the least processor time of a run in milliseconds, without
// reading and writing files.

#include <openvdb/openvdb.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointRasterizeSDF.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/ParticlesToLevelSet.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

namespace {

/// Lengths are in the units of the positions.
struct Settings {
  bool averages;  ///< Averaged spheres (Zhu and Bridson 2005) instead of the union of spheres.
  double voxel_size;
  double radius;         ///< Of a particle's sphere.
  double search_radius;  ///< Of averaged spheres.
  int gaussian_steps;    ///< Steps of the Gaussian filter, of a width of one voxel.
  int curvature_steps;   ///< Steps of the flow by mean curvature.
  double isovalue;       ///< Negative values move the surface inwards.
};

struct Mesh {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
};

/// The interface that ParticlesToLevelSet reads.
class Particles {
 public:
  using PosType = openvdb::Vec3R;

  explicit Particles(const std::vector<openvdb::Vec3R>& positions) : positions_(positions) {}

  std::size_t size() const { return positions_.size(); }
  void getPos(std::size_t k, openvdb::Vec3R& position) const { position = positions_[k]; }

 private:
  const std::vector<openvdb::Vec3R>& positions_;
};

openvdb::FloatGrid::Ptr UnionOfSpheres(const std::vector<openvdb::Vec3R>& positions,
                                       const Settings& settings) {
  auto grid = openvdb::createLevelSet<openvdb::FloatGrid>(settings.voxel_size);
  openvdb::tools::ParticlesToLevelSet<openvdb::FloatGrid> raster(*grid);
  raster.setRmin(0);       // By default, spheres of less than 1.5 voxels are ignored.
  raster.setGrainSize(0);  // No threads.
  raster.rasterizeSpheres(Particles(positions), settings.radius);
  raster.finalize(/*prune=*/true);
  return grid;
}

openvdb::FloatGrid::Ptr AveragedSpheres(const std::vector<openvdb::Vec3R>& positions,
                                        const Settings& settings) {
  const auto transform = openvdb::math::Transform::createLinearTransform(settings.voxel_size);
  const auto points =
      openvdb::points::createPointDataGrid<openvdb::points::NullCodec,
                                           openvdb::points::PointDataGrid>(positions, *transform);
  return openvdb::points::rasterizeSmoothSpheres(*points, settings.radius, settings.search_radius);
}

Mesh Reconstruct(const std::vector<openvdb::Vec3R>& positions, const Settings& settings) {
  const auto grid = settings.averages ? AveragedSpheres(positions, settings)
                                      : UnionOfSpheres(positions, settings);
  if (settings.gaussian_steps + settings.curvature_steps > 0) {
    openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
    for (int k = 0; k < settings.gaussian_steps; ++k) filter.gaussian(1);
    for (int k = 0; k < settings.curvature_steps; ++k) filter.meanCurvature();
  }
  Mesh mesh;
  openvdb::tools::volumeToMesh(*grid, mesh.points, mesh.triangles, mesh.quads, settings.isovalue,
                               /*adaptivity=*/0);
  return mesh;
}

/// Raw doubles, three a particle.
std::vector<openvdb::Vec3R> ReadPositions(const std::string& path) {
  std::vector<openvdb::Vec3R> positions(std::filesystem::file_size(path) / sizeof(openvdb::Vec3R));
  std::ifstream(path, std::ios::binary)
      .read(reinterpret_cast<char*>(positions.data()),
            static_cast<std::streamsize>(positions.size() * sizeof(openvdb::Vec3R)));
  return positions;
}

/// The number of points and of triangles (uint64), points (three floats), triangles (three uint32).
void WriteMesh(const Mesh& mesh, const std::string& path) {
  std::vector<openvdb::Vec3I> triangles = mesh.triangles;
  for (const openvdb::Vec4I& quad : mesh.quads) {
    triangles.emplace_back(quad[0], quad[1], quad[2]);
    triangles.emplace_back(quad[0], quad[2], quad[3]);
  }
  std::ofstream file(path, std::ios::binary);
  const std::uint64_t counts[] = {mesh.points.size(), triangles.size()};
  file.write(reinterpret_cast<const char*>(counts), sizeof counts);
  file.write(reinterpret_cast<const char*>(mesh.points.data()),
             static_cast<std::streamsize>(mesh.points.size() * sizeof(openvdb::Vec3s)));
  file.write(reinterpret_cast<const char*>(triangles.data()),
             static_cast<std::streamsize>(triangles.size() * sizeof(openvdb::Vec3I)));
}

double ProcessorMilliseconds() {
  timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 11) {
    std::cerr
        << "usage: openvdb_peer POSITIONS MESH RUNS union|average VOXEL_SIZE RADIUS SEARCH_RADIUS"
           " GAUSSIAN_STEPS CURVATURE_STEPS ISOVALUE\n";
    return 2;
  }
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  openvdb::initialize();
  const Settings settings{.averages = std::string(argv[4]) == "average",
                          .voxel_size = std::atof(argv[5]),
                          .radius = std::atof(argv[6]),
                          .search_radius = std::atof(argv[7]),
                          .gaussian_steps = std::atoi(argv[8]),
                          .curvature_steps = std::atoi(argv[9]),
                          .isovalue = std::atof(argv[10])};
  const std::vector<openvdb::Vec3R> positions = ReadPositions(argv[1]);
  double least = std::numeric_limits<double>::infinity();
  Mesh mesh;
  for (int run = 0; run < std::atoi(argv[3]); ++run) {
    const double before = ProcessorMilliseconds();
    mesh = Reconstruct(positions, settings);
    least = std::min(least, ProcessorMilliseconds() - before);
  }
  WriteMesh(mesh, argv[2]);
  std::cout << least << '\n';
  return 0;
}
