// Checks the attributes of a frame and selects the requested ones.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "frame/frame_view.h"
#include "partiemc/frame.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

// Names appear in errors, which go to logs and messages, so they must be printable.
std::string Escaped(std::string_view name) { return absl::CHexEscape({name.data(), name.size()}); }

absl::Status CheckAttribute(const Frame& frame, std::size_t k) {
  const Attribute& attribute = frame.attributes[k];
  const std::string field = absl::StrCat("attributes[", k, "]");
  const auto is_printable = [](char c) { return c >= ' ' && c <= '~'; };
  if (attribute.name.empty() || attribute.name.size() > kMostNameBytes ||
      !std::ranges::all_of(attribute.name, is_printable)) {
    return InvalidFrame(kReasonOutOfRange, field + ".name",
                        attribute.name.empty() ? "empty" : Escaped(attribute.name),
                        absl::StrCat("must be 1 to ", kMostNameBytes, " bytes of ASCII"));
  }
  for (const Attribute& before : frame.attributes.first(k)) {
    if (before.name != attribute.name) continue;
    return InvalidFrame(kReasonDuplicate, field + ".name", std::string(attribute.name),
                        "must be the name of one attribute only");
  }
  if (attribute.components < 1 || attribute.components > 3) {
    return InvalidFrame(kReasonOutOfRange, field + ".components",
                        absl::StrCat(attribute.components), "must be 1, 2 or 3");
  }
  const auto components = static_cast<std::size_t>(attribute.components);
  if (attribute.values.size() != components * frame.ParticleCount()) {
    return InvalidFrame(
        kReasonCount, field + ".values", absl::StrCat(attribute.values.size(), " values"),
        absl::StrCat("must be ", components, " per particle (", frame.ParticleCount(), ")"));
  }
  for (std::size_t v = 0; v < attribute.values.size(); ++v) {
    if (std::isfinite(attribute.values[v])) continue;
    return InvalidFrame(kReasonNotFinite, absl::StrCat(field, ".values[", v, "]"),
                        ShortestNumber(attribute.values[v]), "must be finite");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckAttributes(const Frame& frame) {
  std::size_t components = 0;
  for (std::size_t k = 0; k < frame.attributes.size(); ++k) {
    if (absl::Status status = CheckAttribute(frame, k); !status.ok()) return status;
    components += static_cast<std::size_t>(frame.attributes[k].components);
  }
  if (components <= kMostAttributeValues) return absl::OkStatus();
  return InvalidFrame(kReasonOutOfRange, "attributes", absl::StrCat(components, " components"),
                      absl::StrCat("must be at most ", kMostAttributeValues, " in all"));
}

absl::Status ChooseAttributes(const Frame& frame, std::span<const std::string> names,
                              std::vector<Attribute>& chosen) {
  chosen.clear();
  for (const std::string& name : names) {
    if (name == kVelocityAttribute && !frame.velocities.empty()) {
      chosen.push_back({.name = name, .components = frame.components, .values = frame.velocities});
      continue;
    }
    const auto found =
        std::ranges::find(frame.attributes, std::string_view(name), &Attribute::name);
    if (found == frame.attributes.end() && frame.ParticleCount() == 0) {
      chosen.push_back({.name = name});
      continue;
    }
    if (found == frame.attributes.end()) {
      return InvalidFrame(kReasonNoSuchAttribute, "attributes", Escaped(name),
                          "must be in every frame, as it is asked for");
    }
    chosen.push_back(*found);
  }
  return absl::OkStatus();
}

absl::Status TakePhaseValues(const Frame& frame, const std::string& name,
                             std::span<const float>& phases, std::vector<Attribute>& others) {
  others.clear();
  phases = {};
  bool is_found = frame.ParticleCount() == 0;
  for (const Attribute& attribute : frame.attributes) {
    if (attribute.name != name) {
      others.push_back(attribute);
      continue;
    }
    is_found = true;
    const auto field = [&] { return "attributes[" + name + "]"; };
    if (attribute.components != 1) {
      return InvalidFrame(kReasonOutOfRange, field(),
                          absl::StrCat(attribute.components, " components"),
                          "must be one number per particle: its phase");
    }
    for (std::size_t k = 0; k < attribute.values.size(); ++k) {
      const float value = attribute.values[k];
      if (value == std::floor(value)) continue;
      return InvalidFrame(kReasonOutOfRange, absl::StrCat(field(), "[", k, "]"),
                          ShortestNumber(value), "must be a whole number: a phase");
    }
    phases = attribute.values;
  }
  if (is_found) return absl::OkStatus();
  return InvalidFrame(kReasonNoSuchAttribute, "attributes", name,
                      "must be an attribute of the frame: the phases of its particles");
}

}  // namespace partiemc
