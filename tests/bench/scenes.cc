#include "bench/scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "client/cli/load/load_frames.h"
#include "client/recording/recording.h"
#include "support/random.h"

namespace partiemc::bench {
namespace {

constexpr std::uint64_t kSeed = 20240229;
constexpr double kJitter = 0.15;  // Largest shift in each direction, in spacings.
constexpr double kSway = 0.05;
constexpr std::array<double, 4> kSwayByFrame = {0, kSway, 0, -kSway};

struct Point {
  double x, y;
};

// The blob of about radius 1: cosines of multiples of the angle are powers of the direction.
bool InBlob(double x, double y) {
  struct Hole {
    double x, y, radius;
  };
  static constexpr std::array<Hole, 6> kHoles = {{{0.45, 0.1, 0.14},
                                                  {-0.3, 0.42, 0.11},
                                                  {-0.5, -0.25, 0.09},
                                                  {0.1, -0.5, 0.12},
                                                  {0.02, 0.05, 0.07},
                                                  {0.3, 0.6, 0.05}}};
  const double distance = std::sqrt(x * x + y * y);
  if (distance > 0) {
    const double c = x / distance, s = y / distance;
    const auto times = [](Point a, Point b) {
      return Point{a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x};
    };
    const Point z1{c, s}, z2 = times(z1, z1), z4 = times(z2, z2), z5 = times(z4, z1);
    const Point z9 = times(z5, z4), z14 = times(z9, z5), z28 = times(z14, z14);
    if (distance > 1 + 0.07 * z5.x + 0.05 * z9.y + 0.03 * z14.x + 0.015 * z28.y) return false;
  }
  for (const Hole& hole : kHoles) {
    const double dx = x - hole.x, dy = y - hole.y;
    if (dx * dx + dy * dy < hole.radius * hole.radius) return false;
  }
  return true;
}

bool InDisc(double x, double y) { return x * x + y * y <= 1; }

using Shape = bool (*)(double, double);

// Nodes of the lattice inside of a shape of this radius round the origin.
std::vector<Point> NodesIn(Shape shape, double radius) {
  std::vector<Point> nodes;
  const int reach = static_cast<int>(std::ceil(1.2 * radius));  // Waves included.
  for (int j = -reach; j <= reach; ++j) {
    for (int i = -reach; i <= reach; ++i) {
      if (shape(i / radius, j / radius)) nodes.push_back({double(i), double(j)});
    }
  }
  return nodes;
}

// The radius at which a shape has about `count` nodes.
double RadiusFor(Shape shape, std::size_t count) {
  constexpr double kSampleRadius = 200;
  const double area =
      static_cast<double>(NodesIn(shape, kSampleRadius).size()) / (kSampleRadius * kSampleRadius);
  return std::sqrt(static_cast<double>(count) / area);
}

// At least `count` nodes, and few more.
std::vector<Point> NodesOfCount(Shape shape, std::size_t count) {
  double radius = RadiusFor(shape, count);
  std::vector<Point> nodes = NodesIn(shape, radius);
  while (nodes.size() < count) nodes = NodesIn(shape, radius *= 1.0005);
  return nodes;
}

void Jitter(support::Random& random, Point& point, double size = 1) {
  point.x += random.Uniform(-kJitter * size, kJitter * size);
  point.y += random.Uniform(-kJitter * size, kJitter * size);
}

void Jitter(support::Random& random, std::vector<Point>& points) {
  for (Point& point : points) Jitter(random, point);
}

template <typename T>
void Shuffle(support::Random& random, std::vector<T>& points) {
  for (std::size_t left = points.size(); left > 1; --left) {
    std::swap(points[left - 1], points[random.Below(left)]);
  }
}

template <typename T>
std::vector<Scene::Positions> SwayingFrames(const std::vector<Point>& points) {
  std::vector<Scene::Positions> frames;
  for (const double sway : kSwayByFrame) {
    std::vector<T> xy;
    xy.reserve(2 * points.size());
    for (const Point& point : points) {
      xy.push_back(static_cast<T>(point.x + sway));
      xy.push_back(static_cast<T>(point.y));
    }
    frames.emplace_back(std::move(xy));
  }
  return frames;
}

}  // namespace

Frame Scene::At(std::size_t index) const {
  Frame frame;
  std::visit([&](const auto& xy) { frame.positions = std::span(xy); },
             frames[index % frames.size()]);
  frame.volumes = volumes;
  return frame;
}

std::size_t Scene::FrameBytes() const {
  return std::visit([](auto view) { return view.size_bytes(); }, At(0).positions);
}

Scene Blob(const std::string& name, std::size_t count) {
  support::Random random(kSeed + count);
  std::vector<Point> points = NodesOfCount(InBlob, count);
  Jitter(random, points);
  Shuffle(random, points);
  points.resize(count);  // The surplus is anywhere by now.
  return {.name = name, .frames = SwayingFrames<float>(points)};
}

Scene Islands(const std::string& name, std::size_t count) {
  constexpr int kIslands = 1000, kPlacesPerSide = 32;
  support::Random random(kSeed + count);
  const std::size_t island_count = count / kIslands;
  const double place = std::sqrt(1e4 * static_cast<double>(count)) / kPlacesPerSide;
  const std::vector<Point> disc = NodesOfCount(InDisc, island_count);
  const double margin =
      std::sqrt(static_cast<double>(island_count));  // Islands lie in their places.
  std::vector<Point> places;
  for (int j = 0; j < kPlacesPerSide; ++j) {
    for (int i = 0; i < kPlacesPerSide; ++i) places.push_back({i * place, j * place});
  }
  Shuffle(random, places);
  places.resize(kIslands);
  std::vector<Point> points;
  for (const Point& corner : places) {
    const double cx = corner.x + random.Uniform(margin, place - margin);
    const double cy = corner.y + random.Uniform(margin, place - margin);
    std::vector<Point> island = disc;
    for (Point& point : island) point = {point.x + cx, point.y + cy};
    Shuffle(random, island);
    island.resize(island_count);
    points.insert(points.end(), island.begin(), island.end());
  }
  Jitter(random, points);
  Shuffle(random, points);
  return {.name = name, .frames = SwayingFrames<double>(points)};
}

Scene SizedBlob(const std::string& name, std::size_t count, int ratio,
                const std::function<bool(support::Random&, double x, double y)>& is_large) {
  support::Random random(kSeed + count);
  const double radius = RadiusFor(InBlob, count);
  const auto is_inside = [&](double x, double y) { return InBlob(x / radius, y / radius); };
  struct Particle {
    Point at;
    double size;
  };
  std::vector<Particle> particles;
  const int reach = static_cast<int>(std::ceil(1.2 * radius)) / ratio;
  for (int j = -reach; j <= reach; ++j) {
    for (int i = -reach; i <= reach; ++i) {
      std::vector<Point> nodes;
      for (int k = 0; k < ratio * ratio; ++k) {
        const Point node{double(ratio * i + k % ratio), double(ratio * j + k / ratio)};
        if (is_inside(node.x, node.y)) nodes.push_back(node);
      }
      const double middle = (ratio - 1) / 2.0;
      const Point centre{ratio * i + middle, ratio * j + middle};
      if (nodes.size() == static_cast<std::size_t>(ratio) * ratio &&
          is_large(random, centre.x / radius, centre.y / radius)) {
        particles.push_back({centre, double(ratio)});
      } else {
        for (const Point& node : nodes) particles.push_back({node, 1});
      }
    }
  }
  for (Particle& particle : particles) Jitter(random, particle.at, particle.size);
  Shuffle(random, particles);
  std::vector<Point> points;
  Scene scene{.name = name};
  for (const Particle& particle : particles) {
    points.push_back(particle.at);
    scene.volumes.push_back(static_cast<float>(particle.size * particle.size));
  }
  scene.frames = SwayingFrames<float>(points);
  return scene;
}

Scene Layer(const std::string& name, int columns, int rows) {
  support::Random random(kSeed + columns);
  std::vector<Point> points;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) points.push_back({i + .5, j - (rows - 1) / 2.0});
  }
  Jitter(random, points);
  Shuffle(random, points);
  return {.name = name, .frames = SwayingFrames<float>(points)};
}

absl::StatusOr<Scene> Recorded(const std::string& name, const std::string& path) {
  auto reader = client::RecordingReader::Open(path, "");
  if (!reader.ok()) return reader.status();
  Scene scene{.name = name, .spacing = (*reader)->header().spacing.value_or(1)};
  client::RecordedFrame frame;
  while (true) {
    const auto more = (*reader)->Next(frame);
    if (!more.ok()) return more.status();
    if (!*more) return scene;
    scene.frames.emplace_back(std::vector<float>(frame.positions.begin(), frame.positions.end()));
  }
}

Scene Load(const std::string& name, int count) {
  Scene scene{.name = name};
  for (std::vector<float>& xy : client::LoadFrames(count)) scene.frames.emplace_back(std::move(xy));
  return scene;
}

absl::StatusOr<Scenes> MakeScenes(bool quick) {
  auto dam_break = Recorded("dam_break", PARTIEMC_SOURCE_DIR "/client/recordings/dam_break.pemc");
  if (!dam_break.ok()) return dam_break.status();
  Scenes scenes{.islands_1m = Islands("islands_1m", 1'000'000),
                .blob_1024 = Blob("1024", 640'000),
                .dam_break = *std::move(dam_break),
                .load_1m = Load("load_1m", 1'000'000)};
  scenes.blobs = {Blob("10k", 10'000), Blob("100k", 100'000), Blob("1m", 1'000'000)};
  if (!quick) scenes.blobs.push_back(Blob("4m", 4'000'000));
  return scenes;
}

std::vector<std::uint64_t> ShuffledIds(const Scene& scene) {
  std::size_t count = 0;
  for (std::size_t k = 0; k < scene.frames.size(); ++k) {
    count = std::max(count, scene.At(k).ParticleCount());
  }
  std::vector<std::uint64_t> ids(count);
  std::iota(ids.begin(), ids.end(), std::uint64_t{0});
  support::Random random(kSeed);
  Shuffle(random, ids);
  return ids;
}

std::span<const float> FloatPositions(const Scene& scene) {
  return std::get<std::vector<float>>(scene.frames.front());
}

}  // namespace partiemc::bench
