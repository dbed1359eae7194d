#include "client/c/particles.h"

#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/c/structs.h"
#include "partiemc/status.h"

namespace partiemc::c {
namespace {

absl::Status Invalid(std::string_view reason, std::string field, std::string value,
                     std::string rule) {
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(reason), std::move(field), std::move(value), std::move(rule)});
}

// False if `array` is absent (PARTIEMC_NONE). Errors: reason COUNT if `array` has no address and
// `count` is above 0.
absl::StatusOr<bool> IsThere(const partiemc_array& array, std::size_t count,
                             const std::string& field) {
  if (array.type == PARTIEMC_NONE) return false;
  if (array.first == nullptr && count > 0) {
    return Invalid(kReasonCount, field, "no address",
                   absl::StrCat("must have ", count, " numbers, or type PARTIEMC_NONE"));
  }
  return true;
}

absl::Status Read(const partiemc_array& array, std::size_t count, const std::string& field,
                  client::Reals& numbers) {
  const auto there = IsThere(array, count, field);
  if (!there.ok() || !*there) return there.status();
  if (array.type == PARTIEMC_FLOAT32) {
    numbers = {static_cast<const float*>(array.first), array.stride};
  } else if (array.type == PARTIEMC_FLOAT64) {
    numbers = {static_cast<const double*>(array.first), array.stride};
  } else {
    return Invalid("UNSUPPORTED", field, absl::StrCat("type ", array.type),
                   "must be PARTIEMC_FLOAT32 or PARTIEMC_FLOAT64");
  }
  return absl::OkStatus();
}

absl::Status Read(const partiemc_array& array, std::size_t count, const std::string& field,
                  client::Ids& numbers) {
  const auto there = IsThere(array, count, field);
  if (!there.ok() || !*there) return there.status();
  switch (array.type) {
    case PARTIEMC_INT32:
      numbers = {static_cast<const std::int32_t*>(array.first), array.stride};
      return absl::OkStatus();
    case PARTIEMC_INT64:
      numbers = {static_cast<const std::int64_t*>(array.first), array.stride};
      return absl::OkStatus();
    case PARTIEMC_UINT32:
      numbers = {static_cast<const std::uint32_t*>(array.first), array.stride};
      return absl::OkStatus();
    case PARTIEMC_UINT64:
      numbers = {static_cast<const std::uint64_t*>(array.first), array.stride};
      return absl::OkStatus();
    default:
      return Invalid("UNSUPPORTED", field, absl::StrCat("type ", array.type),
                     "must be an integer of 32 or 64 bits");
  }
}

template <typename T>
void SetCoordinates(partiemc_particles* particles, const T* coordinates, std::size_t count,
                    int components, std::int32_t type) {
  const auto stride = static_cast<std::ptrdiff_t>(sizeof(T)) * components;
  particles->count = count;
  particles->x = {coordinates, stride, type};
  particles->y = {coordinates + 1, stride, type};
  particles->z = {};
  if (components == 3) particles->z = {coordinates + 2, stride, type};
}

}  // namespace

std::optional<PeriodicBox> BoxOf(const double* numbers) {
  if (numbers == nullptr) return std::nullopt;
  PeriodicBox box;
  for (std::size_t k = 0; k < 3; ++k) {
    if (numbers[2 * k + 1] != 0) box.axes[k] = PeriodicAxis{numbers[2 * k], numbers[2 * k + 1]};
  }
  return box;
}

absl::StatusOr<client::ParticleArrays> ArraysOf(const partiemc_particles* particles,
                                                std::vector<client::AttributeArrays>& attributes) {
  if (particles == nullptr) {
    return Invalid(kReasonCount, "particles", "NULL", "must be given");
  }
  const partiemc_particles given = Take(particles, partiemc_particles{});
  client::ParticleArrays arrays{.count = given.count};
  for (const auto& [array, field, numbers] :
       {std::tuple(&given.x, "positions.x", &arrays.x),
        std::tuple(&given.y, "positions.y", &arrays.y),
        std::tuple(&given.z, "positions.z", &arrays.z),
        std::tuple(&given.volumes, "volumes", &arrays.volumes),
        std::tuple(&given.velocity_x, "velocities.x", &arrays.velocity_x),
        std::tuple(&given.velocity_y, "velocities.y", &arrays.velocity_y),
        std::tuple(&given.velocity_z, "velocities.z", &arrays.velocity_z)}) {
    if (auto read = Read(*array, given.count, field, *numbers); !read.ok()) return read;
  }
  if (auto read = Read(given.ids, given.count, "ids", arrays.ids); !read.ok()) return read;
  if (given.attribute_count > 0 && given.attributes == nullptr) {
    return Invalid(kReasonCount, "attributes", "NULL",
                   absl::StrCat("must be ", given.attribute_count, " of them"));
  }
  attributes.resize(given.attribute_count);
  for (std::size_t k = 0; k < given.attribute_count; ++k) {
    const partiemc_attribute& from = given.attributes[k];
    const std::string name = from.name == nullptr ? "" : from.name;
    const std::string field = absl::StrCat("attributes[", name, "].");
    attributes[k].name = from.name == nullptr ? std::string_view() : from.name;
    for (const auto& [array, axis, numbers] :
         {std::tuple(&from.x, "x", &attributes[k].x), std::tuple(&from.y, "y", &attributes[k].y),
          std::tuple(&from.z, "z", &attributes[k].z)}) {
      if (auto read = Read(*array, given.count, field + axis, *numbers); !read.ok()) return read;
    }
  }
  arrays.attributes = attributes;
  arrays.box = BoxOf(given.box);
  return arrays;
}

}  // namespace partiemc::c

void partiemc_particles_init(partiemc_particles* particles, size_t size) {
  partiemc::c::Give(partiemc_particles{}, size, particles);
}

void partiemc_set_float32(partiemc_particles* particles, const float* coordinates, size_t count,
                          int components) {
  partiemc::c::SetCoordinates(particles, coordinates, count, components, PARTIEMC_FLOAT32);
}

void partiemc_set_float64(partiemc_particles* particles, const double* coordinates, size_t count,
                          int components) {
  partiemc::c::SetCoordinates(particles, coordinates, count, components, PARTIEMC_FLOAT64);
}
