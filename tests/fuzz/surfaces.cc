// Frames in space: surfaces keep their guarantees, continue from a restored state bit for bit, and
// arrive in every format.
#include <array>
#include <string>

#include "fuzz/hostile_frames.h"
#include "fuzz/require.h"
#include "fuzz/single_thread.h"
#include "fuzz/targets.h"
#include "partiemc/partiemc.h"
#include "wire/codec.h"

namespace partiemc::fuzz {
namespace {

// Enough bricks for two bodies with the default parameters.
constexpr FrameLimits kLimits{.max_particles = 256, .max_tiles = 160};
constexpr int kReach = 5;

// Mostly valid.
ReconstructionParameters HostileSurface(Choices& choices) {
  ReconstructionParameters parameters{.spacing = 1};
  if (choices.Below(4) == 0) {
    parameters = HostileParameters(choices);
  } else {
    parameters.placement = AllPlacements()[choices.Below(AllPlacements().size())];
  }
  parameters.output = Output::kSurface;
  constexpr std::array kDistances = {.03, .0, .3, 1e-9, -1.0, 1e300};
  parameters.surface.thinning_distance = kDistances[choices.Below(kDistances.size())];
  if (choices.Flip()) parameters.surface.max_drop_particles = choices.Take<std::uint8_t>();
  constexpr std::array kErrors = {.0, .0, .0, .05, .5, 1.5};
  parameters.surface.simplify = kErrors[choices.Below(kErrors.size())];
  if (choices.Below(4) == 1)
    parameters.surface.min_component_volume = static_cast<double>(choices.Below(8));
  if (choices.Below(4) == 1) {
    parameters.sections.push_back(
        {.slice = SlicePlane{.origin = {0, 0, .25}, .normal = {0, 1, 2}}});
  }
  // At the end, so that the corpus keeps its meaning.
  for (std::size_t left = choices.Below(4) == 1 ? 1 + choices.Below(3) : 0; left > 0; --left) {
    const auto axis = static_cast<int>(choices.Below(3));
    constexpr std::array kPlaces = {0., -1., .25, 2., 1e-9, 1e20};
    const double place = kPlaces[choices.Below(kPlaces.size())];
    parameters.wall_planes.push_back({axis, place, choices.Flip()});
  }
  return parameters;
}

void RequireArrives(const Result& result, wire::Coordinates coordinates) {
  v1::ReconstructedFrame sent, received;
  const absl::Status encoded =
      wire::EncodeResult(result, {}, {.normals = true, .coordinates = coordinates}, sent);
  if (!encoded.ok()) {
    Require(coordinates != wire::Coordinates::kFloat64 && absl::IsOutOfRange(encoded),
            "float64 always fits");
    return RequireViolation(encoded);
  }
  Require(received.ParseFromString(sent.SerializeAsString()), "a message reads back");
  wire::ReconstructedFrame frame;
  RequireOk(wire::DecodeResult(received, frame), "the client takes what the server sends");
  Require(frame.surface_digest == DigestSurface(result.surface), "the digest arrives");
  const Surface &from = result.surface, &to = frame.result.surface;
  if (coordinates == wire::Coordinates::kFloat64) {
    Require(from.ShellCount() == 0 || from == to, "a surface arrives bit for bit");
  }
  Require(from.point_offsets == to.point_offsets && from.outer_of == to.outer_of &&
              from.triangle_offsets == to.triangle_offsets && from.measures == to.measures &&
              from.parents == to.parents,
          "shells arrive in any format");
}

void RequireSound(const Result& result, const ReconstructionParameters& parameters) {
  RequireOk(Validate(result.surface), "every guarantee of surfaces holds");
  for (const Result& section : result.sections) {
    RequireOk(Validate(section, parameters.fill), "every guarantee of sections holds");
  }
}

}  // namespace

void AttackSurfaces(Bytes bytes) {
  const SingleThread single_thread;
  Choices choices(bytes);
  const ReconstructionParameters parameters = HostileSurface(choices);
  const auto reconstructor = Reconstructor::Create(parameters, kLimits);
  if (!reconstructor.ok()) return RequireViolation(reconstructor.status());
  static auto* const workspace = new Workspace;  // Its history never changes a result.
  State state;
  Result result, again;
  for (std::size_t left = 1 + choices.Below(3); left > 0; --left) {
    const HostileFrame frame(choices, parameters.spacing.value_or(1), kReach);
    const std::string before = Serialize(state);
    const absl::Status status =
        reconstructor->Reconstruct(frame.AsFrame(), state, *workspace, result);
    if (!status.ok()) {
      RequireViolation(status);
      Require(result == Result{}, "the result of a refused frame is empty");
      Require(Serialize(state) == before, "a refused frame leaves no trace");
      continue;
    }
    RequireSound(result, parameters);
    for (const auto coordinates : {wire::Coordinates::kFloat64, wire::Coordinates::kRelativeFloat32,
                                   wire::Coordinates::kCompact}) {
      RequireArrives(result, coordinates);
    }
    auto restored = ParseState(before);
    RequireOk(restored.status(), "a state reads back");
    Workspace fresh;
    RequireOk(reconstructor->Reconstruct(frame.AsFrame(), *restored, fresh, again),
              "a restored stream takes the same frame");
    Require(result == again && Serialize(*restored) == Serialize(state),
            "a stream goes on from a restored state bit for bit");
  }
}

}  // namespace partiemc::fuzz
