#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/strings/str_cat.h"
#include "partiemc/byte_string.h"
#include "state_parts.h"

namespace partiemc {
namespace {

constexpr double kMaxCells = 0x1p31;  // Columns and rows of nodes are numbers of 32 bits.
constexpr std::uint64_t kMinRingPoints = 3;

// Neither is anything that is not finite.
bool IsPlace(double x, double y) { return std::abs(x) <= kMaxCells && std::abs(y) <= kMaxCells; }

absl::Status NoPlace(const char* what, std::size_t k) {
  return CorruptState(absl::StrCat(what, " ", k, " of the outline"),
                      "must lie within 2^31 cells of the origin");
}

absl::Status CheckOffsets(const KnownOutline& outline) {
  const std::vector<std::uint32_t>& offsets = outline.offsets;
  const std::size_t points = outline.points.size() / 2;
  const std::uint32_t first = offsets.empty() ? 0 : offsets.front();
  const std::uint32_t last = offsets.empty() ? 0 : offsets.back();
  if (first != 0 || last != points) {
    return CorruptState(absl::StrCat("rings of points ", first, " to ", last),
                        absl::StrCat("must be made of all of 0 to ", points));
  }
  for (std::size_t k = 1; k < offsets.size(); ++k) {
    if (offsets[k] < offsets[k - 1] + kMinRingPoints) {
      return CorruptState(absl::StrCat("ring ", k - 1, " of the outline"),
                          absl::StrCat("must have at least ", kMinRingPoints, " points"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckOutline(const KnownOutline& outline) {
  if (absl::Status status = CheckOffsets(outline); !status.ok()) return status;
  for (std::size_t k = 0; k < outline.points.size(); k += 2) {
    if (!IsPlace(outline.points[k], outline.points[k + 1])) return NoPlace("point", k / 2);
  }
  for (std::size_t k = 0; k < outline.particles.size(); ++k) {
    const NearParticle& particle = outline.particles[k];
    if (!IsPlace(particle.x, particle.y)) return NoPlace("particle", k);
    if (k > 0 && outline.particles[k - 1].hash >= particle.hash) {
      return CorruptState(absl::StrCat("particle ", k, " of the outline"),
                          "must come after the one before it");
    }
  }
  return absl::OkStatus();
}

}  // namespace

void PutOutline(const KnownOutline& outline, std::string& bytes) {
  for (const std::uint32_t offset : outline.offsets) PutNumber(offset, bytes);
  for (const double coordinate : outline.points) PutNumber(coordinate, bytes);
  for (const NearParticle& particle : outline.particles) {
    PutNumber(particle.hash, bytes);
    PutNumber(particle.x, bytes);
    PutNumber(particle.y, bytes);
  }
}

absl::Status TakeOutline(std::string_view& rest, KnownOutline& outline) {
  for (std::uint32_t& offset : outline.offsets) offset = TakeNumber<std::uint32_t>(rest);
  for (double& coordinate : outline.points) coordinate = TakeNumber<double>(rest);
  for (NearParticle& particle : outline.particles) {
    particle.hash = TakeNumber<std::uint64_t>(rest);
    particle.x = TakeNumber<double>(rest);
    particle.y = TakeNumber<double>(rest);
  }
  return CheckOutline(outline);
}

}  // namespace partiemc
