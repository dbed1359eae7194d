#include "server/calls/requests.h"

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/stream/stream_state_machine.h"
#include "wire/message_bytes.h"

namespace partiemc::server {

const std::string& ServiceName() {
  return v1::GetServerInfoRequest::descriptor()
      ->file()
      ->FindServiceByName("ReconstructionService")
      ->full_name();
}

absl::Status ParseRequest(grpc::ByteBuffer& bytes, std::uint64_t max_bytes,
                          google::protobuf::Message& request) {
  const std::size_t size = bytes.Length();
  const bool parsed = size <= max_bytes && wire::HasFewFields(bytes, *request.GetDescriptor()) &&
                      wire::MergeBytes(bytes, request);
  bytes.Clear();
  if (parsed) return absl::OkStatus();
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(kReasonMalformed), "request", absl::StrCat(size, " bytes"),
                         absl::StrCat("must be a ", request.GetDescriptor()->name(), " of at most ",
                                      max_bytes, " bytes and ", wire::kMaxFields, " fields")});
}

}  // namespace partiemc::server
