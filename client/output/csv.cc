#include "client/output/formats.h"
#include "client/output/text.h"

namespace partiemc::client {

std::string EncodeCsv(const FrameRecord& frame) {
  const Rings& rings = frame.result.rings;
  std::string out = "ring,index,x,y,nx,ny\n";
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
      out += '\n';
    }
  }
  return out;
}

}  // namespace partiemc::client
