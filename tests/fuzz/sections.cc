// Frames with attributes in streams with sections: through the core, and through the codec.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "fuzz/hostile_frames.h"
#include "fuzz/require.h"
#include "fuzz/single_thread.h"
#include "fuzz/targets.h"
#include "partiemc/partiemc.h"
#include "wire/codec.h"

namespace partiemc::fuzz {
namespace {

constexpr std::size_t kMostAttributes = 5;

double HostileNumber(Choices& choices) {
  constexpr double kNumbers[] = {0, 0.5, 1, -1, 3, 1e-300, 1e300, 0.3};
  const std::size_t which = choices.Below(10);
  return which < std::size(kNumbers) ? kNumbers[which] : choices.Take<double>();
}

std::optional<SlicePlane> HostileSlice(Choices& choices) {
  if (choices.Flip()) return std::nullopt;
  SlicePlane slice;
  const bool any = choices.Below(4) == 3;
  for (double& x : slice.origin) x = any ? HostileNumber(choices) : 0.25;
  constexpr std::array<double, 3> kNormals[] = {{0, 0, 1}, {1, 0, 0}, {0, -1, 0}, {1, 2, 3}};
  slice.normal = kNormals[choices.Below(std::size(kNormals))];
  if (any) slice.normal[choices.Below(3)] = HostileNumber(choices);
  return slice;
}

std::optional<double> HostileIsovalue(Choices& choices) {
  if (choices.Flip()) return std::nullopt;
  return choices.Below(4) == 3 ? HostileNumber(choices) : choices.Take<std::uint8_t>() / 200.0;
}

// Usually few, sometimes more than allowed.
std::vector<Section> HostileSections(Choices& choices) {
  std::vector<Section> sections(choices.Below(16) == 15 ? 17 : choices.Below(4));
  for (Section& section : sections) {
    section = {.slice = HostileSlice(choices), .isovalue = HostileIsovalue(choices)};
  }
  return sections;
}

// The attributes of a frame of `particles`, and the memory of their values.
class HostileAttributes {
 public:
  HostileAttributes(Choices& choices, std::size_t particles)
      : values_(choices.Below(kMostAttributes)) {
    static const std::string* const kLong = new std::string(65, 'n');
    const std::string_view names[] = {"pressure", "stress", "a b", "speed", "", *kLong, "\x7f"};
    for (std::vector<float>& values : values_) {
      const auto shape = choices.Take<std::uint8_t>();
      const int components = shape < 250 ? 1 + shape % 3 : shape - 251;
      const std::size_t count = particles * static_cast<std::size_t>(std::max(components, 0));
      values.resize(shape % 16 == 15 ? count + 1 : count);
      for (float& value : values) {
        const auto byte = choices.Take<std::uint8_t>();
        value = byte == 255 ? choices.Take<float>() : static_cast<float>(byte);
      }
      attributes_.push_back(
          {names[choices.Below(choices.Below(8) == 7 ? 7 : 4)], components, values});
    }
  }
  std::span<const Attribute> view() const { return attributes_; }

 private:
  std::vector<std::vector<float>> values_;
  std::vector<Attribute> attributes_;
};

// The points of a mesh begin with the points of the rings.
std::size_t PointCount(const Result& result) {
  return std::max(result.rings.PointCount(), result.mesh.PointCount());
}

void RequireAttributes(const Result& result, const Frame& frame) {
  Require(result.attributes.size() == frame.attributes.size(), "each attribute has its values");
  for (std::size_t k = 0; k < result.attributes.size(); ++k) {
    const AttributeValues& values = result.attributes[k];
    Require(values.name == frame.attributes[k].name, "attributes keep their order");
    Require(
        values.values.size() == PointCount(result) * static_cast<std::size_t>(values.components),
        "an attribute has a value at each point");
    for (const float value : values.values) {
      Require(std::isfinite(value), "interpolated values are finite");
    }
  }
}

void RequireSound(const Result& result, const Frame& frame,
                  const ReconstructionParameters& parameters) {
  if (KeepsGuarantees(parameters.placement)) {
    RequireOk(Validate(result, parameters.fill), "every guarantee holds");
  }
  RequireAttributes(result, frame);
}

// Each section equals the outline of a stream with its plane and isovalue and without sections.
void RequireIndependent(const Result& result, const Frame& frame,
                        const ReconstructionParameters& parameters) {
  for (std::size_t k = 0; k < result.sections.size(); ++k) {
    const Section& section = parameters.sections[k];
    ReconstructionParameters alone = parameters;
    alone.sections.clear();
    alone.isovalue = section.isovalue;
    if (section.slice) alone.slice = section.slice;
    const auto reconstructor = Reconstructor::Create(alone, kHostileLimits);
    RequireOk(reconstructor.status(), "what a section may be a stream may be");
    State state;
    Workspace workspace;
    Result outline;
    RequireOk(reconstructor->Reconstruct(frame, state, workspace, outline),
              "a section is refused with its frame");
    Require(DigestRings(outline.rings) == DigestRings(result.sections[k].rings) &&
                DigestMesh(outline.mesh) == DigestMesh(result.sections[k].mesh),
            "a section is as if it were the only one");
  }
}

void RequireArrives(const Result& result) {
  v1::ReconstructedFrame sent, received;
  RequireOk(wire::EncodeResult(result, {}, {.normals = true}, sent), "float64 always fits");
  Require(received.ParseFromString(sent.SerializeAsString()), "a message reads back");
  wire::ReconstructedFrame frame;
  RequireOk(wire::DecodeResult(received, frame), "the client takes what the server sends");
  Require(frame.section_digests == DigestSections(result), "digests of sections arrive");
  Require(DigestSections(frame.result) == frame.section_digests, "sections arrive bit for bit");
  for (std::size_t k = 0; k < result.sections.size(); ++k) {
    Require(frame.result.sections[k].attributes.size() == result.sections[k].attributes.size(),
            "attributes of sections arrive");
  }
}

// Requires that the codec restores `frame` and `parameters`.
void RequireSameOverTheWire(const Frame& frame, const ReconstructionParameters& parameters,
                            const Result& result) {
  v1::ReconstructionParameters parameter_message;
  wire::EncodeParameters(parameters, parameter_message);
  const auto decoded = wire::DecodeParameters(parameter_message);
  RequireOk(decoded.status(), "what we encode we decode");
  Require(*decoded == parameters, "parameters arrive");
  v1::ParticleFrame message;
  wire::EncodeFrame(frame, message);
  std::vector<std::string> names;
  for (const Attribute& attribute : frame.attributes) names.emplace_back(attribute.name);
  wire::AttributeViews views;
  const auto arrived = wire::DecodeFrame(message, names, views);
  RequireOk(arrived.status(), "a legal frame arrives");
  const auto reconstructor = Reconstructor::Create(*decoded, kHostileLimits);
  State state;
  Workspace workspace;
  Result again;
  RequireOk(reconstructor->Reconstruct(*arrived, state, workspace, again), "the frame is taken");
  Require(again == result, "the wire changes no bit");
}

}  // namespace

void AttackSections(Bytes bytes) {
  const SingleThread single_thread;
  Choices choices(bytes);
  ReconstructionParameters parameters = HostileParameters(choices);
  parameters.slice = HostileSlice(choices);
  parameters.isovalue = HostileIsovalue(choices);
  parameters.sections = HostileSections(choices);
  const auto reconstructor = Reconstructor::Create(parameters, kHostileLimits);
  if (!reconstructor.ok()) return RequireViolation(reconstructor.status());
  const HostileFrame particles(choices, parameters.spacing.value_or(1));
  Frame frame = particles.AsFrame();
  const HostileAttributes attributes(choices, frame.ParticleCount());
  frame.attributes = attributes.view();
  State state;
  Workspace workspace;
  Result result;
  const absl::Status status = reconstructor->Reconstruct(frame, state, workspace, result);
  if (!status.ok()) {
    RequireViolation(status);
    return Require(Serialize(state) == Serialize(State{}), "a refused frame leaves no trace");
  }
  Require(result.sections.size() == parameters.sections.size(), "each section has its outline");
  RequireSound(result, frame, parameters);
  for (const Result& section : result.sections) RequireSound(section, frame, parameters);
  RequireIndependent(result, frame, parameters);
  RequireArrives(result);
  RequireSameOverTheWire(frame, parameters, result);
}

}  // namespace partiemc::fuzz
