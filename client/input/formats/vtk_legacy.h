// Reads the particles of a legacy VTK file. VTK's own readers of POLYDATA and UNSTRUCTURED_GRID
// also build the cells, trust their counts, and read out of bounds in a damaged file (VTK 9.1,
// vtkCellArray::AppendLegacyFormat). This reader skips the cells.
#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <string>

namespace partiemc::client::input {

/// Points, point arrays and field data of a file of POLYDATA or UNSTRUCTURED_GRID, of versions 1.0
/// to 5.1, ASCII or binary. Null for other data sets. VTK reports errors to vtkOutputWindow; the
/// data before an error is returned.
vtkSmartPointer<vtkPolyData> ReadLegacyParticles(const std::string& path);

}  // namespace partiemc::client::input
