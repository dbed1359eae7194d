#include "bench/peers.h"

#include <vtkCellArray.h>
#include <vtkContourTriangulator.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges2D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSPHInterpolator.h>
#include <vtkSPHQuinticKernel.h>
#include <vtkStripper.h>

#include <algorithm>
#include <cstdlib>

namespace partiemc::bench {

// Not by vtkSMPTools, whose header is no C++20.
void UseOneVtkThread() { setenv("VTK_SMP_BACKEND_IN_USE", "Sequential", 1); }

struct SphFieldPeer::Pipeline {
  vtkNew<vtkPolyData> particles;
  vtkNew<vtkImageData> lattice;
  vtkNew<vtkSPHInterpolator> interpolator;
  vtkFloatArray* sums = nullptr;
};

SphFieldPeer::SphFieldPeer(std::span<const float> xy, const LatticeBox& box)
    : pipeline_(std::make_unique<Pipeline>()) {
  vtkNew<vtkPoints> points;
  points->SetNumberOfPoints(static_cast<vtkIdType>(xy.size() / 2));
  for (std::size_t k = 0; k < xy.size() / 2; ++k) {
    points->SetPoint(static_cast<vtkIdType>(k), xy[2 * k], xy[2 * k + 1], 0);
  }
  pipeline_->particles->SetPoints(points);
  pipeline_->lattice->SetOrigin(box.first_column, box.first_row, 0);
  pipeline_->lattice->SetDimensions(box.columns, box.rows, 1);
  vtkNew<vtkSPHQuinticKernel> kernel;
  kernel->SetSpatialStep(1);
  kernel->SetDimension(2);
  pipeline_->interpolator->SetKernel(kernel);
  pipeline_->interpolator->SetInputData(pipeline_->lattice);
  pipeline_->interpolator->SetSourceData(pipeline_->particles);
}

SphFieldPeer::~SphFieldPeer() = default;

void SphFieldPeer::Run() {
  // As if the particles were new, so that the locator is built again.
  pipeline_->particles->GetPoints()->Modified();
  pipeline_->particles->Modified();
  pipeline_->interpolator->Update();
  pipeline_->sums =
      vtkFloatArray::SafeDownCast(pipeline_->interpolator->GetOutput()->GetPointData()->GetArray(
          pipeline_->interpolator->GetShepardSumArrayName().c_str()));
}

std::size_t SphFieldPeer::ReachedNodeCount() const {
  const float* const sums = pipeline_->sums->GetPointer(0);
  return static_cast<std::size_t>(std::count_if(sums, sums + pipeline_->sums->GetNumberOfValues(),
                                                [](float sum) { return sum > 0; }));
}

struct ContourPeer::Pipeline {
  vtkNew<vtkImageData> image;
  vtkNew<vtkFlyingEdges2D> contour;
  vtkNew<vtkStripper> stripper;
};

ContourPeer::ContourPeer(std::span<const float> field, int columns, int rows, double isovalue)
    : pipeline_(std::make_unique<Pipeline>()) {
  pipeline_->image->SetDimensions(columns, rows, 1);
  vtkNew<vtkFloatArray> values;
  values->SetNumberOfValues(static_cast<vtkIdType>(field.size()));
  std::copy(field.begin(), field.end(), values->GetPointer(0));
  pipeline_->image->GetPointData()->SetScalars(values);
  pipeline_->contour->SetInputData(pipeline_->image);
  pipeline_->contour->SetValue(0, isovalue);
  pipeline_->contour->ComputeScalarsOff();
  pipeline_->stripper->SetInputConnection(pipeline_->contour->GetOutputPort());
  pipeline_->stripper->JoinContiguousSegmentsOn();
  pipeline_->stripper->SetMaximumLength(static_cast<int>(field.size()));
}

ContourPeer::~ContourPeer() = default;

void ContourPeer::Run() {
  pipeline_->image->Modified();
  pipeline_->stripper->Update();
}

std::size_t ContourPeer::PointCount() const {
  return static_cast<std::size_t>(pipeline_->stripper->GetOutput()->GetNumberOfPoints());
}

std::size_t ContourPeer::LineCount() const {
  return static_cast<std::size_t>(pipeline_->stripper->GetOutput()->GetNumberOfLines());
}

struct FillPeer::Pipeline {
  vtkNew<vtkPolyData> outline;
  vtkNew<vtkContourTriangulator> triangulator;
};

FillPeer::FillPeer(const Rings& rings) : pipeline_(std::make_unique<Pipeline>()) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (std::size_t k = 0; k < rings.PointCount(); ++k) {
    points->InsertNextPoint(rings.points[2 * k], rings.points[2 * k + 1], 0);
  }
  vtkNew<vtkCellArray> lines;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::uint32_t first = rings.offsets[ring], end = rings.offsets[ring + 1];
    lines->InsertNextCell(static_cast<int>(end - first) + 1);
    for (std::uint32_t k = first; k < end; ++k) lines->InsertCellPoint(k);
    lines->InsertCellPoint(first);
  }
  pipeline_->outline->SetPoints(points);
  pipeline_->outline->SetLines(lines);
  pipeline_->triangulator->SetInputData(pipeline_->outline);
}

FillPeer::~FillPeer() = default;

void FillPeer::Run() {
  pipeline_->outline->Modified();
  pipeline_->triangulator->Update();
}

std::size_t FillPeer::TriangleCount() const {
  return static_cast<std::size_t>(pipeline_->triangulator->GetOutput()->GetNumberOfPolys());
}

}  // namespace partiemc::bench
