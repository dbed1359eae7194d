#include <cmath>

#include "client/output/formats/formats.h"
#include "client/output/formats/wall_values.h"
#include "client/output/text.h"

namespace partiemc::client {

namespace {

// Quotes a name as in RFC 4180, because it may have any printable character.
std::string Cell(const std::string& text) {
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string cell = "\"";
  for (const char c : text) cell += c == '"' ? "\"\"" : std::string(1, c);
  return cell + '"';
}

void AppendAttributeNames(std::string& out, const AttributeValues& attribute) {
  const std::string name = NameBesideWalls(attribute.name);
  for (int k = 0; k < attribute.components; ++k) {
    AppendAll(out, ",", Cell(attribute.components == 1 ? name : Concat(name, ":", k)));
  }
}

}  // namespace

std::string EncodeCsv(const FrameRecord& frame) {
  const Rings& rings = frame.result.rings;
  std::string out = "ring,index,x,y,nx,ny";
  for (const AttributeValues& attribute : frame.result.attributes) {
    AppendAttributeNames(out, attribute);
  }
  const WallValues walls = WallValuesOf(rings);
  if (!walls.wetted.empty()) AppendAll(out, ",", kWetted, ",", kContactAngle);
  out += '\n';
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    for (std::size_t k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
      AppendAll(out, ring, ",", k - rings.offsets[ring], ",");
      AppendNumber(out, rings.points[2 * k]);
      out += ',';
      AppendNumber(out, rings.points[2 * k + 1]);
      out += ',';
      if (!rings.normals.empty()) AppendNumber(out, rings.normals[2 * k]);
      out += ',';
      if (!rings.normals.empty()) AppendNumber(out, rings.normals[2 * k + 1]);
      for (const AttributeValues& attribute : frame.result.attributes) {
        const auto components = static_cast<std::size_t>(attribute.components);
        for (std::size_t c = 0; c < components; ++c) {
          AppendAll(out, ",", attribute.values[components * k + c]);
        }
      }
      if (!walls.wetted.empty()) {
        AppendAll(out, walls.wetted[k] != 0 ? ",1," : ",0,");
        if (std::isfinite(walls.contact_angles[k])) AppendNumber(out, walls.contact_angles[k]);
      }
      out += '\n';
    }
  }
  return out;
}

}  // namespace partiemc::client
