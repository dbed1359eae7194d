// How good a contour is, and how calm. Every distance is in spacings, every area relative.
#pragma once

#include <cstddef>
#include <vector>

#include "client/evaluation/metrics/advection.h"
#include "client/evaluation/scenes/outline.h"
#include "client/evaluation/scenes/segment_index.h"
#include "client/evaluation/scenes/sequence.h"
#include "partiemc/result.h"

namespace partiemc::evaluation {

/// Curves are sampled at this distance or less, in spacings.
inline constexpr double kSampleStep = 0.1;

/// How far two curves are from each other.
struct Deviation {
  double hausdorff = 0;  ///< Largest distance from a point of one to the other, both ways.
  double mean = 0;       ///< Mean of the two mean distances, each along the length of its curve.
};

/// Points along a curve: those in the middle of pieces of equal length, which count in means, and
/// the corners that turn by more than 0.1 rad, which count in maxima only.
struct CurveSamples {
  std::vector<Point> middles;  ///< Loop by loop; each stands for (nearly) the same length.
  std::vector<Point> corners;
};
CurveSamples SampleCurve(const Outline& curve, double step);

/// A curve ready for comparisons: sampled, and indexed for nearest-segment queries.
struct Curve {
  Curve(const Outline& outline, double spacing);

  CurveSamples samples;
  SegmentIndex index;
  double spacing;
};

/// Symmetric deviation in units of a.spacing. If one of the two is empty and the other is not, both
/// distances are the extent of the other one.
/// Accuracy: the maximum misses at most half a sample step on smooth parts, nothing at corners.
Deviation Compare(const Curve& a, const Curve& b);

/// Jitter from frame t to t + 1: Compare(contour t carried along by the known motion, contour
/// t + 1). `carried` was sampled every kSampleStep before it was carried, so that bent chords stay
/// true. 0 for a contour that is transported exactly.
///
/// Where the truth does not move as the map says (outlines that appear or vanish when bodies
/// merge), a change is no jitter: samples whose distances to the carried truth and to the next
/// truth differ by more than 0.1 spacings are left out. Null truths: nothing is left out.
Deviation Jitter(const Curve& carried, const Curve& next, const SegmentIndex* carried_truth,
                 const SegmentIndex* next_truth);

/// `contour` (world units) sampled every kSampleStep spacings and carried from `frame` to the next.
Outline Carried(const Outline& contour, const Motion& motion, std::size_t frame, double spacing);

/// The jitter of a recording where its particles tell how the contour moves.
struct KnownJitter {
  Deviation deviation;     ///< NaN if in one of the two directions nothing is known.
  double known_share = 0;  ///< Of the samples of both contours.
};

/// Jitter from frame t to t + 1 without what nobody knows: where particles scatter, a contour can
/// not be carried along, and the distance of the next one says nothing of its method.
///
/// Samples of contour t go forward, those of contour t + 1 back, each by its own particles, and are
/// compared with the contour there. Those count of which Advection::Trace::uncertainty is at most
/// 0.1 spacings, the tolerance that Jitter() has for truths. That is a property of a place and the
/// particles around it: whatever method put a contour there, it is judged alike.
KnownJitter JitterWhereKnown(const Curve& before, const Curve& next, const Advection& advection);

/// What is wrong with a result as a picture, in numbers.
struct Defects {
  std::size_t self_intersections = 0;   ///< Pairs of segments of rings that properly cross.
  std::size_t folds = 0;                ///< Triangles that are clockwise or degenerate.
  std::size_t spurious_components = 0;  ///< Outer rings without a particle.
  std::size_t component_error = 0;      ///< |outer rings - components of the truth|.
  std::size_t hole_error = 0;           ///< |holes - holes of the truth|.
  double wrong_normal_share = 0;        ///< Of the contour's vertices: outward normals more than a
                                        ///< right angle from those of the nearest true segment.
};

/// `truth` may be empty: errors and the share are then 0.
Defects FindDefects(const Result& result, const Outline& truth, const SegmentIndex& truth_index,
                    double spacing);

}  // namespace partiemc::evaluation
