#include "client/cli/replay/refusal_text.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string_view>

#include "client/output/text.h"
#include "common/text.h"

namespace partiemc::client {
namespace {

// Removes "PREFIX[N]" from the front of `message` and returns N. Empty for other messages.
std::optional<std::size_t> TakeIndex(std::string_view prefix, std::string_view& message) {
  const std::size_t end = message.find(']');
  const bool has_index = message.starts_with(prefix) &&
                         message.substr(prefix.size()).starts_with('[') &&
                         end != std::string_view::npos;
  if (!has_index) return std::nullopt;
  const auto index =
      ParseNumber<std::size_t>(message.substr(prefix.size() + 1, end - prefix.size() - 1));
  if (index) message.remove_prefix(end + 1);
  return index;
}

// The number of components of an attribute of a frame.
std::size_t ComponentsOf(const RecordedFrame& frame, std::string_view name) {
  const auto found = std::ranges::find(frame.attributes, name, &ParticleAttribute::name);
  // "velocity" has the components of the positions.
  return static_cast<std::size_t>(found == frame.attributes.end() ? frame.components
                                                                  : found->components);
}

}  // namespace

std::string RefusalText(const RecordedFrame& frame, std::span<const std::string> attributes,
                        const std::string& message) {
  if (message.starts_with("volumes: 0 values")) {
    return "has no sizes; --sizes own and --boundary grains require a column volume, diameter or "
           "radius";
  }
  std::string_view rest = message;
  for (const std::string_view axis : {"x", "y", "z"}) {
    const std::string field = Concat("parameters.box.", axis, ".length");
    if (!rest.starts_with(field)) continue;
    return Concat("the length of the periodic box along ", axis, rest.substr(field.size()));
  }
  if (const auto particle = TakeIndex("volumes", rest);
      particle && *particle < frame.ParticleCount()) {
    return Concat(VolumeName(frame, *particle), rest);
  }
  // "attributes[NAME][PARTICLE]" of a wrong phase.
  rest = message;
  if (const std::size_t end = rest.find(']');
      rest.starts_with("attributes[") && end != std::string_view::npos) {
    const std::string_view name = rest.substr(11, end - 11);
    rest.remove_prefix(end + 1);
    const auto particle = TakeIndex("", rest);
    if (particle && *particle < frame.ParticleCount()) {
      return Concat("attribute '", name, "' of ", ParticleName(frame, *particle), rest);
    }
  }
  rest = message;
  const auto attribute = TakeIndex("attributes", rest);
  const auto value = TakeIndex(".values", rest);
  if (!attribute || !value || *attribute >= attributes.size()) return message;
  const std::string& name = attributes[*attribute];
  const std::size_t particle = *value / ComponentsOf(frame, name);
  if (particle >= frame.ParticleCount()) return message;
  return Concat("attribute '", name, "' of ", ParticleName(frame, particle), rest);
}

}  // namespace partiemc::client
