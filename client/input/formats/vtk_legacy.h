// The particles of a legacy VTK file. VTK's own readers of POLYDATA and UNSTRUCTURED_GRID build the
// cells as well, believe their counts, and read beyond them in a damaged file (VTK 9.1,
// vtkCellArray::AppendLegacyFormat). We need no cells, so they are passed over.
#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <string>

namespace partiemc::client::input {

/// Points, point arrays and field data of a file of POLYDATA or UNSTRUCTURED_GRID, of versions 1.0
/// to 5.1, ASCII or binary. Null for another kind of data set. Errors are VTK's own, reported to
/// vtkOutputWindow; what came before one is returned.
vtkSmartPointer<vtkPolyData> ReadLegacyParticles(const std::string& path);

}  // namespace partiemc::client::input
