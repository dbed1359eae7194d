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
#include <vtkTypeUInt64Array.h>
#include <vtkUnsignedCharArray.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>
#include <limits>

#include "client/output/formats/file_mesh.h"
#include "client/output/formats/formats.h"
#include "client/output/formats/stretches.h"
#include "client/output/formats/wall_values.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

// Values of the cell array "class" of rings. Triangles have the values of TriangleClass.
constexpr unsigned char kOuterRingClass = 2;
constexpr unsigned char kHoleClass = 3;

constexpr const char* kNormals = "Normals";

// Cell array: the identity of the ring or shell (partiemc/result.h, surface.h). 0 if it is not
// tracked, and for triangles of outlines.
constexpr const char* kIdentity = "identity";

void AddField(vtkPolyData* data, const char* name, double value) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->InsertNextValue(value);
  data->GetFieldData()->AddArray(array);
}

vtkNew<vtkFloatArray> FloatArray(const std::string& name, int components,
                                 std::span<const float> values) {
  vtkNew<vtkFloatArray> array;
  array->SetName(name.c_str());
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(static_cast<vtkIdType>(values.size()) / components);
  std::ranges::copy(values, array->GetPointer(0));
  return array;
}

void AddPoints(const FileMesh& mesh, vtkPolyData* data) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  const std::span<const double> coordinates = mesh.points();
  for (std::size_t k = 0; k < coordinates.size(); k += 3) {
    points->InsertNextPoint(coordinates[k], coordinates[k + 1], coordinates[k + 2]);
  }
  data->SetPoints(points);
  if (!mesh.normals().empty()) {
    data->GetPointData()->SetNormals(FloatArray(kNormals, 3, mesh.normals()));
  }
  for (const AttributeValues& one : mesh.attributes()) {
    // Renames attributes with a name that another array can have: VTK would replace the array.
    std::string name = mesh.surface() ? one.name : NameBesideWalls(one.name);
    if (mesh.surface() && name == kNormals) name += '_';
    data->GetPointData()->AddArray(FloatArray(name, one.components, one.values));
  }
}

void AddPolygons(const FileMesh& mesh, vtkPolyData* data) {
  vtkNew<vtkCellArray> polygons;
  for (std::size_t k = 0; k < mesh.triangles().size(); ++k) {
    if (k % 3 == 0) polygons->InsertNextCell(3);
    polygons->InsertCellPoint(mesh.triangles()[k]);
  }
  data->SetPolys(polygons);
}

// Adds the rings as lines, without the segments in Rings::cuts, and the cell data of an outline.
void AddOutline(const FileMesh& mesh, const Mesh& triangles, vtkPolyData* data) {
  // VTK numbers the lines of polygonal data before its polygons, so the values for rings come
  // first.
  vtkNew<vtkUnsignedCharArray> classes;
  classes->SetName("class");
  vtkNew<vtkIntArray> ring_of;
  ring_of->SetName("ring");
  vtkNew<vtkTypeUInt64Array> identities;
  identities->SetName(kIdentity);
  vtkNew<vtkCellArray> lines;
  const Rings& rings = mesh.rings();
  const vtkIdType first = mesh.first_of_rings();
  ForEachStretch(rings, [&](std::size_t ring, std::span<const std::uint32_t> points, bool closed) {
    lines->InsertNextCell(static_cast<int>(points.size()) + (closed ? 1 : 0));
    for (const std::uint32_t point : points) lines->InsertCellPoint(first + point);
    if (closed) lines->InsertCellPoint(first + points[0]);
    classes->InsertNextValue(rings.outer_of[ring] == kNoRing ? kOuterRingClass : kHoleClass);
    ring_of->InsertNextValue(static_cast<int>(ring));
    identities->InsertNextValue(rings.measures[ring].identity);
  });
  for (std::size_t k = 0; k < triangles.TriangleCount(); ++k) {
    classes->InsertNextValue(static_cast<unsigned char>(triangles.classes[k]));
    ring_of->InsertNextValue(-1);
    identities->InsertNextValue(0);
  }
  data->SetLines(lines);
  data->GetCellData()->AddArray(classes);
  data->GetCellData()->AddArray(ring_of);
  data->GetCellData()->AddArray(identities);
}

// Adds `wetted` and `contact_angle` if the rings touch walls. Points that only the mesh has get 0
// and NaN.
void AddWalls(const FileMesh& mesh, vtkPolyData* data) {
  const WallValues values = WallValuesOf(mesh.rings());
  if (values.wetted.empty()) return;
  vtkNew<vtkUnsignedCharArray> wetted;
  wetted->SetName(kWetted);
  wetted->SetNumberOfTuples(static_cast<vtkIdType>(mesh.PointCount()));
  wetted->Fill(0);
  std::ranges::copy(values.wetted, wetted->GetPointer(mesh.first_of_rings()));
  vtkNew<vtkFloatArray> angles;
  angles->SetName(kContactAngle);
  angles->SetNumberOfTuples(static_cast<vtkIdType>(mesh.PointCount()));
  angles->Fill(std::numeric_limits<float>::quiet_NaN());
  std::ranges::copy(values.contact_angles, angles->GetPointer(mesh.first_of_rings()));
  data->GetPointData()->AddArray(wetted);
  data->GetPointData()->AddArray(angles);
}

void AddCuts(const FileMesh& mesh, vtkPolyData* data) {
  const std::vector<bool> is_cut = mesh.Cuts();
  if (is_cut.empty()) return;
  vtkNew<vtkUnsignedCharArray> cuts;
  cuts->SetName(kCut);
  for (const bool cut : is_cut) cuts->InsertNextValue(cut ? 1 : 0);
  data->GetCellData()->AddArray(cuts);
}

void AddShells(const Surface& surface, vtkPolyData* data) {
  vtkNew<vtkIntArray> shell_of, body_of;
  shell_of->SetName("shell");
  body_of->SetName("body");
  vtkNew<vtkTypeUInt64Array> identities;
  identities->SetName(kIdentity);
  const std::vector<std::uint32_t> bodies = BodyOfShells(surface);
  for (std::size_t shell = 0; shell < bodies.size(); ++shell) {
    for (std::uint32_t k = surface.triangle_offsets[shell]; k < surface.triangle_offsets[shell + 1];
         ++k) {
      shell_of->InsertNextValue(static_cast<int>(shell));
      body_of->InsertNextValue(static_cast<int>(bodies[shell]));
      identities->InsertNextValue(surface.measures[shell].identity);
    }
  }
  data->GetCellData()->AddArray(shell_of);
  data->GetCellData()->AddArray(body_of);
  data->GetCellData()->AddArray(identities);
}

}  // namespace

absl::StatusOr<std::string> EncodeVtp(const FrameRecord& frame) {
  const FileMesh mesh(frame);
  vtkNew<vtkPolyData> data;
  AddPoints(mesh, data);
  AddWalls(mesh, data);
  AddPolygons(mesh, data);
  if (mesh.surface()) {
    AddShells(*mesh.surface(), data);
    AddCuts(mesh, data);
  } else {
    AddOutline(mesh, frame.result.mesh, data);
  }
  AddField(data, "TimeValue", frame.time);
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
