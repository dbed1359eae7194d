#include "client/evaluation/scenes/scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <utility>

#include "client/evaluation/scenes/bodies.h"
#include "client/evaluation/scenes/erosion.h"
#include "client/evaluation/scenes/shapes.h"
#include "client/evaluation/scenes/trigonometry.h"

namespace partiemc::evaluation {
namespace {

// Straight sides of scenes that bend them need as many points as curves.
constexpr double kStraightStep = 0.25;

// Shears of a flow: strain of one step, and wavelength relative to the region's size.
constexpr double kMinStrain = 0.04, kMaxStrain = 0.10;
constexpr double kMinWave = 0.8, kMaxWave = 1.6;
constexpr double kVortexAngle = 0.15;  // Radians a step.

constexpr double kAreaGrowth = 1.05;  // A frame.
constexpr int kGrowthRounds = 6;      // Of relaxation after new particles came in.
constexpr int kGrowthShifts = 1;      // Of particle shifting in its place, where there are clumps.

// Bodies come from this gap and end this deep in each other, in spacings.
constexpr double kBodyGap = 3.1;
constexpr double kBodyDepth = 7.3;

// One frame in spacings, before it is brought to world units.
struct Snapshot {
  Outline outline;
  std::vector<Point> particles;
  std::vector<std::uint64_t> ids;  // Empty: particle k is the same one in every frame.
};

struct Draft {
  std::vector<Snapshot> snapshots;
  SharedMotion motion;
};

double Signed(double low, double high, Random& random) {
  const double size = random.Uniform(low, high);
  return random.Uniform() < 0.5 ? -size : size;
}

Point UnitVector(Random& random) {
  const Direction d = DirectionOf(random.Uniform(0, 2 * kPi));
  return {d.cosine, d.sine};
}

std::vector<Similarity> RigidSteps(Pace pace, std::size_t count, Random& random) {
  struct Range {
    double near, far, turn;
  };
  constexpr Range kRanges[] = {
      {0.05, 0.3, 0.01}, {0.5, 3, 0.1}, {5, 30, 1}, {0, 0, 0}, {0, 0, 0.1}};
  const Range range = kRanges[static_cast<int>(pace)];
  std::vector<Similarity> steps;
  Point center;
  for (std::size_t k = 0; k < count; ++k) {
    const Point move = random.Uniform(range.near, range.far) * UnitVector(random);
    const Direction d = DirectionOf(Signed(range.turn / 4, range.turn, random));
    Similarity step{d.cosine, d.sine, 1, {}};
    step.shift = center + move - step(center);
    steps.push_back(step);
    center = center + move;
  }
  return steps;
}

// The same flow in every step: strains add up as they do in a real one.
std::vector<FlowStep> FlowSteps(double size, std::size_t count, Random& random) {
  FlowStep step;
  for (FlowStep::Shear& shear : step.shears) {
    shear.along = UnitVector(random);
    shear.wavenumber = 2 * kPi / (random.Uniform(kMinWave, kMaxWave) * size);
    shear.amplitude = random.Uniform(kMinStrain, kMaxStrain) / shear.wavenumber;
    shear.phase = random.Uniform(0, 2 * kPi);
  }
  step.vortex_center = random.Uniform(0, 0.4) * size * UnitVector(random);
  step.vortex_radius = random.Uniform(0.4, 0.7) * size;
  step.vortex_angle = Signed(kVortexAngle / 2, kVortexAngle, random);
  return std::vector<FlowStep>(count, step);
}

void KeepShare(double share, std::vector<Point>& particles, Random& random) {
  const auto kept =
      static_cast<std::size_t>(std::lround(share * static_cast<double>(particles.size())));
  // The first steps of a shuffle: every subset is equally likely.
  for (std::size_t k = 0; k < kept; ++k) {
    std::swap(particles[k], particles[k + random.Below(particles.size() - k)]);
  }
  particles.resize(kept);
}

Draft Moving(const SceneRecipe& recipe, Random& random) {
  const auto count = static_cast<double>(recipe.particles);
  const bool flows = recipe.group == Group::kDeformed;
  Snapshot now;
  now.outline = MakeShape(recipe.shape, count, flows ? kCurveStep : kStraightStep);
  now.particles = Sample(now.outline, recipe.sampling, FitsLattice(recipe.shape), random);
  if (recipe.kept_share < 1) KeepShare(recipe.kept_share, now.particles, random);
  // Every third scene begins along the axes, as recordings do.
  if (random.Below(3) != 0) {
    const Direction d = DirectionOf(random.Uniform(0, 2 * kPi));
    for (Point& p : now.outline.points) p = Similarity{d.cosine, d.sine, 1, {}}(p);
    for (Point& p : now.particles) p = Similarity{d.cosine, d.sine, 1, {}}(p);
  }
  Draft draft;
  draft.motion = flows ? FlowMotion(FlowSteps(std::sqrt(count), recipe.frames - 1, random))
                       : SimilarityMotion(RigidSteps(recipe.pace, recipe.frames - 1, random));
  draft.snapshots.push_back(now);
  for (std::size_t t = 0; t + 1 < recipe.frames; ++t) {
    draft.motion->Carry(t, now.outline.points);
    draft.motion->Carry(t, now.particles);
    draft.snapshots.push_back(now);
  }
  for (Snapshot& snapshot : draft.snapshots) {
    if (recipe.noise == 0) break;
    for (Point& p : snapshot.particles) {
      p.x += recipe.noise * random.Normal();
      p.y += recipe.noise * random.Normal();
    }
  }
  return draft;
}

// The region swells around the origin; new particles come in where they fit, and all settle as
// their sampling wants it: darts stay where they are, lattices melt.
Draft Growing(const SceneRecipe& recipe, Random& random) {
  Snapshot now;
  now.outline = MakeShape(recipe.shape, static_cast<double>(recipe.particles), kStraightStep);
  now.particles = Sample(now.outline, recipe.sampling, FitsLattice(recipe.shape), random);
  const Similarity step{1, 0, std::sqrt(kAreaGrowth), {}};
  Draft draft;
  draft.motion = SimilarityMotion(std::vector<Similarity>(recipe.frames - 1, step));
  draft.snapshots.push_back(now);
  // Lattices do not have exactly one for each spacing squared.
  const double per_area = static_cast<double>(now.particles.size()) / SignedArea(now.outline);
  for (std::size_t t = 0; t + 1 < recipe.frames; ++t) {
    draft.motion->Carry(t, now.outline.points);
    draft.motion->Carry(t, now.particles);
    const SegmentIndex boundary(now.outline, 0.5);
    const auto wanted = static_cast<std::size_t>(std::lround(per_area * SignedArea(now.outline)));
    const auto darts = ThrowDarts(now.outline, boundary, kInset, now.particles,
                                  wanted - now.particles.size(), random);
    now.particles.insert(now.particles.end(), darts.begin(), darts.end());
    if (recipe.sampling == Sampling::kClumped) {
      ShiftParticles(now.outline, boundary, kGrowthShifts, now.particles);
    } else if (recipe.sampling != Sampling::kBlueNoise) {
      Relax(now.outline, boundary, kGrowthRounds, now.particles);
    }
    draft.snapshots.push_back(now);
  }
  return draft;
}

// Two or three bodies whose areas add up to `area`, on their way towards the first.
std::vector<Body> MakeBodies(std::string_view shape, double area, std::size_t steps,
                             Random& random) {
  struct Plan {
    std::string_view name;
    double second;    // Size of the second body relative to the first.
    double stretch;   // Half axis towards the other body, relative to the radius.
    double sideways;  // Lateral offset, relative to the reach of both.
    bool third;       // A copy of the second from the other side, later.
  };
  constexpr Plan kPlans[] = {
      {"discs", 0.8, 1, 0, false},
      {"uneven-discs", 0.45, 1, 0.1, false},
      {"glancing-discs", 0.9, 1, 0.5, false},
      {"disc-chain", 0.7, 1, 0.15, true},
      {"ellipses", 0.85, 1.3, 0, false},
      {"uneven-ellipses", 0.5, 0.8, 0.1, false},
      {"glancing-ellipses", 0.9, 0.75, 0.4, false},
      {"ellipse-chain", 0.65, 1.25, 0.1, true},
      {"ovals", 0.75, 1.15, 0.05, false},
      {"uneven-ovals", 0.4, 0.85, 0.2, false},
      {"glancing-ovals", 0.8, 1.1, 0.45, false},
      {"oval-chain", 0.6, 0.9, 0.12, true},
  };
  const Plan plan = *std::find_if(std::begin(kPlans), std::end(kPlans),
                                  [&](const Plan& p) { return p.name == shape; });
  const double parts = 1 + plan.second * plan.second * (plan.third ? 2 : 1);
  const double radius = std::sqrt(area / (kPi * parts));
  const double heading = random.Uniform(0, 2 * kPi);
  const Direction d = DirectionOf(heading);
  const Point drift = random.Uniform(0.1, 0.5) * UnitVector(random);
  const double speed = (kBodyGap + kBodyDepth) / static_cast<double>(steps);
  std::vector<Body> bodies = {{radius * plan.stretch, radius / plan.stretch, heading, {}, drift}};
  for (int k = 0; k < (plan.third ? 2 : 1); ++k) {
    Body body{bodies[0].a * plan.second, bodies[0].b * plan.second, heading, {}, {}};
    const double side = k == 0 ? 1 : -1;
    // Ellipses of one orientation are circles in stretched coordinates, where they touch at the
    // distance `reach`.
    const double reach = 1 + plan.second;
    const double lateral = plan.sideways * reach;
    const double ahead = std::sqrt(reach * reach - lateral * lateral) * bodies[0].a;
    const Point axis = {side * d.cosine, side * d.sine};
    const double gap = kBodyGap * (k == 0 ? 1 : 1.37);
    body.start = (ahead + gap) * axis + (lateral * bodies[0].b) * Point{-axis.y, axis.x};
    body.step = drift - speed * axis;
    bodies.push_back(body);
  }
  return bodies;
}

Draft Merging(const SceneRecipe& recipe, Random& random) {
  std::vector<Body> bodies =
      MakeBodies(recipe.shape, static_cast<double>(recipe.particles), recipe.frames - 1, random);
  if (recipe.reversed) {
    for (Body& body : bodies) {
      body.start = body.CenterAt(recipe.frames - 1);
      body.step = -1.0 * body.step;
    }
  }
  std::vector<std::vector<Point>> samples;
  for (const Body& body : bodies) {
    Outline outline;
    outline.AddLoop(EllipseLoop({}, body.a, body.b, body.angle));
    samples.push_back(Sample(outline, recipe.sampling, false, random));
  }
  Draft draft;
  for (std::size_t t = 0; t < recipe.frames; ++t) {
    KnownParticles particles = UnionParticles(bodies, samples, t);
    draft.snapshots.push_back(
        {UnionOutline(bodies, t), std::move(particles.points), std::move(particles.ids)});
  }
  draft.motion = BodiesMotion(std::move(bodies));
  return draft;
}

SequenceFrame InWorld(const Snapshot& snapshot, const Similarity& units, double time) {
  SequenceFrame frame;
  frame.time = time;
  frame.truth = snapshot.outline;
  for (Point& p : frame.truth.points) p = units(p);
  frame.area = SignedArea(snapshot.outline) * units.scale * units.scale;
  for (const Point& particle : snapshot.particles) {
    const Point p = units(particle);
    frame.positions.insert(frame.positions.end(), {p.x, p.y});
  }
  const auto count = static_cast<double>(snapshot.particles.size());
  frame.volumes.assign(snapshot.particles.size(), static_cast<float>(frame.area / count));
  frame.ids = snapshot.ids;
  if (frame.ids.empty()) {
    frame.ids.resize(frame.ParticleCount());
    std::iota(frame.ids.begin(), frame.ids.end(), std::uint64_t{0});
  }
  return frame;
}

// What the frames' particles look like, for people and tables: groups that change a sampling are
// one of their own.
std::string_view SamplerOf(const SceneRecipe& recipe) {
  const bool own = recipe.group == Group::kNoise || recipe.group == Group::kThinned;
  return own ? Name(recipe.group) : Name(recipe.sampling);
}

}  // namespace

std::string_view Name(Group group) {
  constexpr std::string_view kNames[kGroupCount] = {"rigid",    "noise",  "thinned", "deformed",
                                                    "topology", "ragged", "growth",  "recording"};
  return kNames[static_cast<std::size_t>(group)];
}

Outline OutermostCenters(const Sequence& sequence, std::size_t frame) {
  const Outline& truth = sequence.frames[frame].truth;
  return truth.Empty() ? Outline{} : ErodedOutline(truth, sequence.spacing / 2);
}

Sequence MakeScene(const SceneRecipe& recipe) {
  Random random(recipe.seed);
  Similarity units;
  units.scale = std::array{1.0, 0.01, 0.37, 25.0}[random.Below(4)];
  units.shift = random.Uniform(0, 200) * units.scale * UnitVector(random);
  Draft draft = recipe.group == Group::kTopology ? Merging(recipe, random)
                : recipe.group == Group::kGrowth ? Growing(recipe, random)
                                                 : Moving(recipe, random);
  Sequence sequence;
  sequence.name = recipe.name;
  sequence.group = recipe.group;
  sequence.shape = recipe.shape;
  sequence.seed = recipe.seed;
  sequence.sampler = SamplerOf(recipe);
  for (std::size_t t = 0; t < draft.snapshots.size(); ++t) {
    sequence.frames.push_back(InWorld(draft.snapshots[t], units, static_cast<double>(t)));
  }
  const SequenceFrame& first = sequence.frames.front();
  sequence.spacing = std::sqrt(first.area / static_cast<double>(first.ParticleCount()));
  sequence.original_spacing = recipe.kept_share < 1 ? units.scale : sequence.spacing;
  sequence.judged = recipe.kept_share > 0.4;
  sequence.motion = InUnits(std::move(draft.motion), units);
  sequence.truth_follows_motion = recipe.group != Group::kTopology;
  return sequence;
}

}  // namespace partiemc::evaluation
