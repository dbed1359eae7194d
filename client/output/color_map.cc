#include "client/output/color_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace partiemc::client {
namespace {

// The colours of the map `violet-yellow` in the light theme of the page (rampStops in
// client/viewer/src/draw/ramp.ts). A test of the page compares both lists.
constexpr std::array<std::array<double, 3>, 9> kStops{{{0x3d, 0x00, 0x6f},
                                                       {0x28, 0x26, 0x88},
                                                       {0x03, 0x47, 0x7c},
                                                       {0x11, 0x5a, 0x71},
                                                       {0x17, 0x6a, 0x6e},
                                                       {0x0e, 0x7c, 0x67},
                                                       {0x1e, 0x8e, 0x46},
                                                       {0x71, 0x93, 0x1f},
                                                       {0xa6, 0x93, 0x13}}};

}  // namespace

Rgb RgbOf(double share) {
  const double place = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const std::size_t below = std::min(static_cast<std::size_t>(place), kStops.size() - 2);
  const double part = place - static_cast<double>(below);
  Rgb color;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    color[channel] = static_cast<std::uint8_t>(
        std::lround((1 - part) * kStops[below][channel] + part * kStops[below + 1][channel]));
  }
  return color;
}

std::string TextOf(const Rgb& color) {
  std::string text = "#";
  for (const std::uint8_t byte : color) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

std::string ColorOf(double share) { return TextOf(RgbOf(share)); }

const AttributeValues* FindAttribute(const Result& result, const std::string& name) {
  for (const AttributeValues& attribute : result.attributes) {
    if (!name.empty() && attribute.name == name) return &attribute;
  }
  return nullptr;
}

std::vector<double> MagnitudesOf(const AttributeValues& attribute) {
  const auto components = static_cast<std::size_t>(attribute.components);
  std::vector<double> magnitudes(attribute.values.size() / components);
  for (std::size_t k = 0; k < magnitudes.size(); ++k) {
    const float* const values = &attribute.values[components * k];
    if (components == 1) {
      magnitudes[k] = values[0];
      continue;
    }
    double sum = 0;
    for (std::size_t c = 0; c < components; ++c) {
      sum += static_cast<double>(values[c]) * static_cast<double>(values[c]);
    }
    magnitudes[k] = std::sqrt(sum);
  }
  return magnitudes;
}

std::size_t ChannelCount(const AttributeValues& attribute) {
  const auto components = static_cast<std::size_t>(attribute.components);
  return components == 1 ? 1 : components + 1;
}

std::vector<double> ChannelOf(const AttributeValues& attribute, std::size_t channel) {
  if (channel == 0) return MagnitudesOf(attribute);
  const auto components = static_cast<std::size_t>(attribute.components);
  std::vector<double> values(attribute.values.size() / components);
  for (std::size_t k = 0; k < values.size(); ++k) {
    values[k] = attribute.values[components * k + channel - 1];
  }
  return values;
}

ValueRange RangeOf(std::span<const double> values) {
  if (values.empty()) return {};
  const auto [low, high] = std::ranges::minmax_element(values);
  return {*low, *high};
}

}  // namespace partiemc::client
