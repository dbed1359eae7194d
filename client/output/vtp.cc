#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>

#include "client/output/formats.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

// Values of the cell array "class" of rings. Triangles have the values of TriangleClass.
constexpr unsigned char kOuterRingClass = 2;
constexpr unsigned char kHoleClass = 3;

void InsertPoints(std::span<const double> points, vtkPoints* out) {
  for (std::size_t k = 0; k < points.size(); k += 2) {
    out->InsertNextPoint(points[k], points[k + 1], 0);
  }
}

void AddField(vtkPolyData* data, const char* name, double value) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->InsertNextValue(value);
  data->GetFieldData()->AddArray(array);
}

// Adds the attributes at the points of the mesh. If there is no mesh, adds the attributes at the
// points of the rings.
void AddAttributes(const Result& result, vtkPolyData* data) {
  for (const AttributeValues& attribute : result.attributes) {
    vtkNew<vtkFloatArray> array;
    array->SetName(attribute.name.c_str());
    array->SetNumberOfComponents(attribute.components);
    array->SetNumberOfTuples(data->GetNumberOfPoints());
    std::ranges::copy(attribute.values, array->GetPointer(0));
    data->GetPointData()->AddArray(array);
  }
}

}  // namespace

absl::StatusOr<std::string> EncodeVtp(const FrameRecord& frame) {
  const Rings& rings = frame.result.rings;
  const Mesh& mesh = frame.result.mesh;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  const bool shared = MeshSharesRingPoints(frame.result);
  InsertPoints(mesh.points, points);
  if (!shared) InsertPoints(rings.points, points);
  const vtkIdType first = shared ? 0 : static_cast<vtkIdType>(mesh.PointCount());

  // VTK numbers the lines of polygonal data before its polygons, so the values for rings come
  // first.
  vtkNew<vtkUnsignedCharArray> classes;
  classes->SetName("class");
  vtkNew<vtkIntArray> ring_of;
  ring_of->SetName("ring");
  vtkNew<vtkCellArray> lines;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::uint32_t begin = rings.offsets[ring], end = rings.offsets[ring + 1];
    lines->InsertNextCell(static_cast<int>(end - begin) + 1);
    for (std::uint32_t k = begin; k < end; ++k) lines->InsertCellPoint(first + k);
    lines->InsertCellPoint(first + begin);
    classes->InsertNextValue(rings.outer_of[ring] == kNoRing ? kOuterRingClass : kHoleClass);
    ring_of->InsertNextValue(static_cast<int>(ring));
  }
  vtkNew<vtkCellArray> polygons;
  for (std::size_t k = 0; k < mesh.TriangleCount(); ++k) {
    polygons->InsertNextCell(3);
    for (std::size_t corner = 0; corner < 3; ++corner) {
      polygons->InsertCellPoint(mesh.triangles[3 * k + corner]);
    }
    classes->InsertNextValue(static_cast<unsigned char>(mesh.classes[k]));
    ring_of->InsertNextValue(-1);
  }

  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetLines(lines);
  data->SetPolys(polygons);
  data->GetCellData()->AddArray(classes);
  data->GetCellData()->AddArray(ring_of);
  AddField(data, "TimeValue", frame.time);
  // A mesh that does not start with the points of the rings has more points than attribute values.
  // Attributes are then left out.
  if (shared || mesh.points.empty()) AddAttributes(frame.result, data);
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(data);
  writer->WriteToOutputStringOn();
  if (writer->Write() == 0) {
    return absl::InternalError(
        Concat("frame ", frame.index, ": VTK cannot write it; choose another format"));
  }
  return writer->GetOutputString();
}

}  // namespace partiemc::client
