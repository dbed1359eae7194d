#include "client/evaluation/metrics/run.h"

#include <cmath>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/evaluation/metrics/recorded_truth.h"
#include "common/stage_clock.h"
#include "partiemc/reconstructor.h"

namespace partiemc::evaluation {
namespace {

// Mean of the numbers that are there.
class Mean {
 public:
  void Add(double value) {
    if (std::isnan(value)) return;
    sum_ += value;
    ++count_;
  }
  double Value() const { return count_ > 0 ? sum_ / count_ : kAbsent; }

 private:
  double sum_ = 0, count_ = 0;
};

template <typename Number>
double MeanOf(std::span<const FrameNumbers> numbers, Number number) {
  Mean mean;
  for (const FrameNumbers& frame : numbers) mean.Add(static_cast<double>(number(frame)));
  return mean.Value();
}

// Of the jitter where the motion is known. Pairs of frames count by the share of their samples that
// it is taken from, so that a few stray ones do not weigh as much as a whole contour.
template <typename Number>
double MeanOfKnown(std::span<const FrameNumbers> numbers, Number number) {
  double sum = 0, weight = 0;
  for (const FrameNumbers& frame : numbers) {
    const double value = number(frame.known_jitter.deviation);
    if (std::isnan(value)) continue;
    sum += frame.known_jitter.known_share * value;
    weight += frame.known_jitter.known_share;
  }
  return weight > 0 ? sum / weight : kAbsent;
}

double AreaDeviation(std::span<const FrameNumbers> numbers) {
  if (numbers.size() < 2) return kAbsent;
  const double first = 1 + numbers[0].area_error;
  if (std::isnan(first)) return kAbsent;
  if (!(first > 0)) return 1;  // Nothing to compare with: as if all of it had come and gone.
  return MeanOf(numbers.subspan(1), [first](const FrameNumbers& frame) {
    return std::abs((1 + frame.area_error) / first - 1);
  });
}

double TriangleDeviation(std::span<const FrameNumbers> numbers) {
  const double mean = MeanOf(numbers, [](const FrameNumbers& f) { return f.triangles; });
  return std::sqrt(MeanOf(numbers, [mean](const FrameNumbers& f) {
    const double difference = static_cast<double>(f.triangles) - mean;
    return difference * difference;
  }));
}

Frame FrameOf(const SequenceFrame& frame, Knowledge knowledge, bool ids) {
  Frame view;
  view.positions = std::span<const double>(frame.positions);
  if (knowledge == Knowledge::kVolumes) view.volumes = frame.volumes;
  if (ids) view.ids = frame.ids;
  return view;
}

}  // namespace

std::string_view Name(Knowledge knowledge) {
  switch (knowledge) {
    case Knowledge::kVolumes:
      return "volumes";
    case Knowledge::kSpacing:
      return "spacing";
    case Knowledge::kNothing:
      return "nothing";
  }
  return "";
}

std::string_view Name(Metric metric) {
  constexpr std::array<std::string_view, kMetricCount> kNames = {"hausdorff",
                                                                 "mean_deviation",
                                                                 "bias",
                                                                 "area_deviation",
                                                                 "hausdorff_jitter",
                                                                 "mean_jitter",
                                                                 "known_hausdorff_jitter",
                                                                 "known_mean_jitter",
                                                                 "known_share",
                                                                 "area_error_size",
                                                                 "wall_roughness",
                                                                 "area_error",
                                                                 "center_hausdorff",
                                                                 "center_mean",
                                                                 "triangles",
                                                                 "triangle_deviation",
                                                                 "triangles_grid",
                                                                 "self_intersections",
                                                                 "folds",
                                                                 "spurious_components",
                                                                 "component_error",
                                                                 "hole_error",
                                                                 "wrong_normals",
                                                                 "vertices",
                                                                 "milliseconds"};
  return kNames[static_cast<std::size_t>(metric)];
}

Evaluator::Evaluator(Sequence sequence, bool centers) : sequence_(std::move(sequence)) {
  for (std::size_t t = 1; sequence_.motion == nullptr && t < sequence_.frames.size(); ++t) {
    advections_.push_back(
        Advection::Between(sequence_.frames[t - 1], sequence_.frames[t], sequence_.spacing));
  }
  for (const SequenceFrame& frame : sequence_.frames) {
    neighbours_.push_back(NearestNeighbours(frame.positions, sequence_.spacing));
  }
  for (std::size_t t = 0; t < sequence_.frames.size(); ++t) {
    const Outline& truth = sequence_.frames[t].truth;
    if (truth.Empty()) break;
    references_.push_back({Curve(truth, sequence_.spacing), std::nullopt, std::nullopt});
    if (centers) {
      if (const Outline curve = OutermostCenters(sequence_, t); !curve.Empty()) {
        references_.back().centers.emplace(curve, sequence_.spacing);
      }
    }
    if (t > 0 && !sequence_.truth_follows_motion) {
      Outline carried = sequence_.frames[t - 1].truth;
      sequence_.motion->Carry(t - 1, carried.points);
      references_.back().carried_truth.emplace(carried, sequence_.spacing / 4);
    }
  }
}

absl::StatusOr<std::vector<Result>> Evaluator::Reconstruct(
    const Method& method, const RunOptions& options, std::vector<FrameNumbers>& numbers) const {
  ReconstructionParameters parameters = method.parameters;
  parameters.spacing.reset();
  if (options.knowledge != Knowledge::kNothing) {
    parameters.spacing = options.original_spacing ? sequence_.original_spacing : sequence_.spacing;
  }
  const auto reconstructor = CreateVariant(parameters, method.variant);
  if (!reconstructor.ok()) return reconstructor.status();
  const bool ids = TellsIds(options);
  State state;
  Workspace workspace;
  std::vector<Result> results(sequence_.frames.size());
  numbers.assign(sequence_.frames.size(), {});
  for (std::size_t t = 0; t < results.size(); ++t) {
    StageClock clock;
    const Frame frame = FrameOf(sequence_.frames[t], options.knowledge, ids);
    const absl::Status status =
        reconstructor->Reconstruct(frame, state, workspace, results[t], {.observer = &clock});
    if (!status.ok()) {
      return absl::Status(status.code(), absl::StrCat(sequence_.name, ", frame ", t, ", ",
                                                      method.name, ": ", status.message()));
    }
    numbers[t].stage_ms = clock.stages_ms();
  }
  return results;
}

absl::StatusOr<std::vector<Result>> Evaluator::Reconstruct(const Method& method,
                                                           const RunOptions& options) const {
  std::vector<FrameNumbers> numbers;
  return Reconstruct(method, options, numbers);
}

bool Evaluator::TellsIds(const RunOptions& options) const {
  return (options.ids || sequence_.group == Group::kRecording) && sequence_.HasIds();
}

double Evaluator::TrueArea(std::size_t frame) const {
  const SequenceFrame& known = sequence_.frames[frame];
  if (known.area > 0) return known.area;
  return static_cast<double>(known.ParticleCount()) * sequence_.spacing * sequence_.spacing;
}

void Evaluator::Measure(std::size_t frame, const Result& result, const Curve& contour,
                        FrameNumbers& numbers) const {
  numbers.neighbours = neighbours_[frame];
  numbers.area = result.statistics.area;
  if (sequence_.whole) numbers.area_error = numbers.area / TrueArea(frame) - 1;
  numbers.vertices = result.rings.PointCount();
  numbers.triangles = result.statistics.triangles;
  numbers.triangles_grid = result.statistics.triangles_grid;
  if (references_.empty()) {
    numbers.defects = FindDefects(result, {}, contour.index, sequence_.spacing);
    return;
  }
  const Reference& reference = references_[frame];
  numbers.truth = Compare(contour, reference.truth);
  if (reference.centers) numbers.centers = Compare(contour, *reference.centers);
  numbers.defects =
      FindDefects(result, sequence_.frames[frame].truth, reference.truth.index, sequence_.spacing);
}

void Evaluator::MeasureJitter(std::size_t frame, const Outline& before, const Curve& contour,
                              FrameNumbers& numbers) const {
  const std::size_t from = frame - 1;
  const double spacing = sequence_.spacing;
  if (sequence_.motion == nullptr) {
    const std::optional<Advection>& advection = advections_[from];
    if (!advection) return;
    numbers.jitter = Compare(Curve(advection->Carry(before), spacing), contour);
    numbers.known_jitter = JitterWhereKnown(Curve(before, spacing), contour, *advection);
    return;
  }
  const Curve carried(Carried(before, *sequence_.motion, from, spacing), spacing);
  const SegmentIndex* carried_truth = nullptr;
  const SegmentIndex* truth = nullptr;
  if (!references_.empty() && references_[frame].carried_truth) {
    carried_truth = &*references_[frame].carried_truth;
    truth = &references_[frame].truth.index;
  }
  numbers.jitter = Jitter(carried, contour, carried_truth, truth);
}

absl::StatusOr<Row> Evaluator::Run(const Method& method, const RunOptions& options) const {
  std::vector<FrameNumbers> numbers;
  const auto results = Reconstruct(method, options, numbers);
  if (!results.ok()) return results.status();
  Outline before;
  for (std::size_t t = 0; t < results->size(); ++t) {
    Outline outline = OutlineOf((*results)[t].rings);
    const Curve contour(outline, sequence_.spacing);
    Measure(t, (*results)[t], contour, numbers[t]);
    numbers[t].wall_roughness =
        WallRoughness(outline, sequence_.frames[t].positions, sequence_.walls, sequence_.spacing);
    if (t > 0) MeasureJitter(t, before, contour, numbers[t]);
    before = std::move(outline);
  }
  Row row = Summary(numbers);
  row.method = method.name;
  row.knowledge = options.knowledge;
  row.ids = TellsIds(options);
  row.frames = std::move(numbers);
  return row;
}

Row Evaluator::Summary(const std::vector<FrameNumbers>& numbers) const {
  Row row;
  row.sequence = sequence_.name;
  row.shape = sequence_.shape;
  row.sampler = sequence_.sampler;
  row.group = sequence_.group;
  row.judged = sequence_.judged;
  row.values.fill(kAbsent);
  using F = const FrameNumbers&;
  const auto put = [&](Metric metric, double value) {
    row.values[static_cast<std::size_t>(metric)] = value;
  };
  const auto mean = [&](Metric metric, auto number) { put(metric, MeanOf(numbers, number)); };
  mean(Metric::kHausdorff, [](F f) { return f.truth.hausdorff; });
  mean(Metric::kMeanDeviation, [](F f) { return f.truth.mean; });
  mean(Metric::kAreaError, [](F f) { return f.area_error; });
  mean(Metric::kAreaErrorSize, [](F f) { return std::abs(f.area_error); });
  mean(Metric::kWallRoughness, [](F f) { return f.wall_roughness; });
  put(Metric::kBias, std::abs(row[Metric::kAreaError]));
  put(Metric::kAreaDeviation, AreaDeviation(numbers));
  mean(Metric::kHausdorffJitter, [](F f) { return f.jitter.hausdorff; });
  mean(Metric::kMeanJitter, [](F f) { return f.jitter.mean; });
  put(Metric::kKnownHausdorffJitter,
      MeanOfKnown(numbers, [](const Deviation& jitter) { return jitter.hausdorff; }));
  put(Metric::kKnownMeanJitter,
      MeanOfKnown(numbers, [](const Deviation& jitter) { return jitter.mean; }));
  mean(Metric::kKnownShare, [](F f) { return f.known_jitter.known_share; });
  mean(Metric::kCenterHausdorff, [](F f) { return f.centers.hausdorff; });
  mean(Metric::kCenterMean, [](F f) { return f.centers.mean; });
  mean(Metric::kTriangles, [](F f) { return f.triangles; });
  put(Metric::kTriangleDeviation, TriangleDeviation(numbers));
  mean(Metric::kTrianglesGrid, [](F f) { return f.triangles_grid; });
  mean(Metric::kSelfIntersections, [](F f) { return f.defects.self_intersections; });
  mean(Metric::kFolds, [](F f) { return f.defects.folds; });
  mean(Metric::kSpuriousComponents, [](F f) { return f.defects.spurious_components; });
  mean(Metric::kComponentError, [](F f) { return f.defects.component_error; });
  mean(Metric::kHoleError, [](F f) { return f.defects.hole_error; });
  mean(Metric::kWrongNormals, [](F f) { return f.defects.wrong_normal_share; });
  mean(Metric::kVertices, [](F f) { return f.vertices; });
  mean(Metric::kMilliseconds, [](F f) {
    double sum = 0;
    for (const double stage : f.stage_ms) sum += stage;
    return sum;
  });
  return row;
}

}  // namespace partiemc::evaluation
