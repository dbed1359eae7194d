// Other people's code for the same work, on one thread: VTK.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "bench/scatter_floor.h"
#include "partiemc/result.h"

namespace partiemc::bench {

/// Lets VTK use one thread. To be called before anything else of it.
void UseOneVtkThread();

/// vtkSPHInterpolator with its quintic kernel, whose reach is three spacings: the sum of the kernel
/// (its "Shepard sum") at every node of a box, from particles of spacing 1.
class SphFieldPeer {
 public:
  SphFieldPeer(std::span<const float> xy, const LatticeBox& box);
  ~SphFieldPeer();

  /// Builds the point locator and interpolates.
  void Run();
  /// Nodes that particles reached in the last Run.
  std::size_t ReachedNodeCount() const;

 private:
  struct Pipeline;
  std::unique_ptr<Pipeline> pipeline_;
};

/// vtkFlyingEdges2D, then vtkStripper: the isoline of a field as polylines.
class ContourPeer {
 public:
  /// `field` is a dense box of nodes, row by row.
  ContourPeer(std::span<const float> field, int columns, int rows, double isovalue);
  ~ContourPeer();

  void Run();
  std::size_t PointCount() const;
  std::size_t LineCount() const;

 private:
  struct Pipeline;
  std::unique_ptr<Pipeline> pipeline_;
};

/// vtkContourTriangulator: the inside of rings as triangles.
class FillPeer {
 public:
  explicit FillPeer(const Rings& rings);
  ~FillPeer();

  void Run();
  std::size_t TriangleCount() const;

 private:
  struct Pipeline;
  std::unique_ptr<Pipeline> pipeline_;
};

}  // namespace partiemc::bench
