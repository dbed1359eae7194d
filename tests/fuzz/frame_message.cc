// A frame as received by a server: bytes, message, view, result, message, and the client's result.
#include "fuzz/hostile_frames.h"
#include "fuzz/require.h"
#include "fuzz/single_thread.h"
#include "fuzz/targets.h"
#include "partiemc/partiemc.h"
#include "wire/codec.h"

namespace partiemc::fuzz {
namespace {

// Requires that the client decodes `result` unchanged.
void RequireArrives(const Result& result, wire::Outputs outputs) {
  v1::ReconstructedFrame sent, received;
  const absl::Status encoded = wire::EncodeResult(result, {}, outputs, sent);
  if (!encoded.ok()) {
    Require(outputs.coordinates != wire::Coordinates::kFloat64 && absl::IsOutOfRange(encoded),
            "float64 always fits");
    RequireViolation(encoded);
    return;
  }
  Require(received.ParseFromString(sent.SerializeAsString()), "a message reads back");
  wire::ReconstructedFrame frame;
  RequireOk(wire::DecodeResult(received, frame), "the client takes what the server sends");
  Require(frame.rings_digest == DigestRings(result.rings), "the rings' digest arrives");
  if (outputs.rings || outputs.mesh) {
    Require(frame.result.attributes.size() == result.attributes.size(), "attributes arrive");
  }
  if (outputs.mesh && result.mesh.PointCount() > 0) {
    Require(frame.result.attributes == result.attributes, "attributes arrive bit for bit");
  }
  Require(frame.surface_digest == DigestSurface(result.surface), "the surface's digest arrives");
  if (outputs.coordinates != wire::Coordinates::kFloat64) return;
  if (outputs.surface) {
    Require(DigestSurface(frame.result.surface) == frame.surface_digest,
            "the surface arrives bit for bit");
  }
  if (outputs.rings) {
    Require(DigestRings(frame.result.rings) == frame.rings_digest, "rings arrive bit for bit");
  }
  if (outputs.mesh) {
    Require(DigestMesh(frame.result.mesh) == frame.mesh_digest, "the mesh arrives bit for bit");
  }
}

}  // namespace

void AttackFrameMessage(Bytes bytes) {
  const SingleThread single_thread;
  v1::ReconstructFrameRequest request;
  if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
  const auto parameters = wire::DecodeParameters(request.parameters());
  const auto outputs = wire::DecodeOutputs(request.outputs(), request.has_outputs());
  static auto* const views = new wire::AttributeViews;
  const auto frame = wire::DecodeFrame(
      request.frame(), outputs.ok() ? outputs->attributes : std::vector<std::string>(), *views);
  for (const absl::Status& status : {parameters.status(), outputs.status(), frame.status()}) {
    if (!status.ok()) RequireViolation(status);
  }
  // Errors of one part do not prevent checks of the others.
  const auto reconstructor = Reconstructor::Create(
      parameters.ok() && Validate(*parameters).ok() ? *parameters : ReconstructionParameters{},
      kHostileLimits);
  RequireOk(reconstructor.status(), "legal parameters are taken");
  if (!frame.ok()) return;
  static auto* const workspace = new Workspace;
  State state;
  Result result;
  const absl::Status status = reconstructor->Reconstruct(*frame, state, *workspace, result);
  if (!status.ok()) {
    RequireViolation(status);
    v1::FrameError error;
    wire::EncodeFrameError(status, 1, 2, error);
    Require(!error.reason().empty() && !error.SerializeAsString().empty(), "an error can be sent");
    return;
  }
  if (KeepsGuarantees(reconstructor->parameters().placement)) {
    RequireOk(Validate(result, reconstructor->parameters().fill), "every guarantee holds");
  }
  RequireArrives(result, outputs.ok() ? *outputs : wire::Outputs{});
  RequireArrives(result, {.normals = true});
  v1::ParticleFrame encoded;
  wire::EncodeFrame(*frame, encoded);
  RequireOk(wire::DecodeFrame(encoded).status(), "what we encode we decode");
}

}  // namespace partiemc::fuzz
