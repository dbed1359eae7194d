#include "partiemc/result.h"

namespace partiemc {

void Rings::Clear() {
  points.clear();
  offsets.assign(1, 0);
  outer_of.clear();
  measures.clear();
  normals.clear();
  parents.clear();
  parent_offsets.assign(1, 0);
  cuts.clear();
  wetted.clear();
  contacts.clear();
  contact_angles.clear();
}

void Mesh::Clear() {
  points.clear();
  triangles.clear();
  classes.clear();
}

void Result::Clear() {
  rings.Clear();
  mesh.Clear();
  surface.Clear();
  for (AttributeValues& attribute : attributes) attribute.values.clear();
  statistics = {};
  for (Result& section : sections) section.Clear();
}

void Surface::Clear() {
  points.clear();
  triangles.clear();
  normals.clear();
  point_offsets.assign(1, 0);
  triangle_offsets.assign(1, 0);
  outer_of.clear();
  measures.clear();
  parents.clear();
  parent_offsets.assign(1, 0);
  cuts.clear();
  for (AttributeValues& attribute : attributes) attribute.values.clear();
  statistics = {};
}

}  // namespace partiemc
