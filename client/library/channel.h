// How this library reaches a server, and what it says when it cannot.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/client/credentials.h"

namespace partiemc::client {

/// A channel with this library's settings; connects when it is first used.
/// Errors: INVALID_ARGUMENT unless `address` is HOST:PORT, [IPV6]:PORT or unix:PATH, and for
/// credentials that do not hold, or do not suit the address.
absl::StatusOr<std::shared_ptr<grpc::Channel>> MakeChannel(const std::string& address,
                                                           const Credentials& credentials);

/// What MakeChannel would say of the address, and of sending the token there.
absl::Status CheckAddress(const std::string& address, const Credentials& credentials);

/// Waits until `channel` is connected. A refused connection is tried again until the time is over.
/// Errors: UNAVAILABLE, "no server at ADDRESS (WHY): ...".
absl::Status Connect(const std::shared_ptr<grpc::Channel>& channel, const std::string& address,
                     std::chrono::milliseconds timeout);

/// A channel for one call that has until `deadline`: as MakeChannel, then Connect, which gets as
/// long as a server needs that starts at the same time.
absl::StatusOr<std::shared_ptr<grpc::Channel>> ConnectedChannel(const std::string& address,
                                                                const Credentials& credentials,
                                                                std::chrono::milliseconds deadline);

/// "0.25 s", as texts of this library tell times: to the millisecond.
std::string Seconds(std::chrono::nanoseconds duration);

/// What is said when a server that was reached did not accept `call` ("stream", "watcher") in time.
absl::Status NotAccepted(const std::string& address, const char* call,
                         std::chrono::milliseconds time);

/// Why a call has failed, in the system's words, which gRPC's end in:
/// "...: Failed to connect to remote host: Connection refused".
std::string Reason(const grpc::Status& status);

/// The end of a call as one line that names the server. OK stays OK.
absl::Status FromGrpc(const grpc::Status& status, const std::string& address);

}  // namespace partiemc::client
