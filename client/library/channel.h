// Opens connections to a server, and describes connection errors.
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

/// Creates a channel with this library's settings. It connects at its first use. Errors:
/// INVALID_ARGUMENT unless `address` is HOST:PORT, [IPV6]:PORT or unix:PATH, and for credentials
/// that are invalid or unsafe for the address.
absl::StatusOr<std::shared_ptr<grpc::Channel>> MakeChannel(const std::string& address,
                                                           const Credentials& credentials);

/// Checks the address and whether the token may be sent to it, as MakeChannel does.
absl::Status CheckAddress(const std::string& address, const Credentials& credentials);

/// Waits until `channel` is connected. Retries refused connections until `timeout`. Errors:
/// UNAVAILABLE, with the address, the cause and a remedy.
absl::Status Connect(const std::shared_ptr<grpc::Channel>& channel, const std::string& address,
                     std::chrono::milliseconds timeout);

/// Calls MakeChannel, then Connect with a timeout of 2 s, or of `deadline` if it is shorter. 2 s is
/// enough for a server that is starting.
absl::StatusOr<std::shared_ptr<grpc::Channel>> ConnectedChannel(const std::string& address,
                                                                const Credentials& credentials,
                                                                std::chrono::milliseconds deadline);

/// Formats a duration with milliseconds: "0.25 s".
std::string Seconds(std::chrono::nanoseconds duration);

/// The error for a server that was reached but did not accept `call` ("stream", "watcher") within
/// `time`.
absl::Status NotAccepted(const std::string& address, const char* call,
                         std::chrono::milliseconds time);

/// The cause at the end of gRPC's message: "Connection refused" for "...: Failed to connect to
/// remote host: Connection refused". "no answer" for an empty message.
std::string Reason(const grpc::Status& status);

/// The reason of the server in the trailing metadata of a call that has ended (proto/PROTOCOL.md);
/// empty if there is none.
std::string ReasonOf(const grpc::ClientContext& context);

/// Converts the status of a call to one line that names the server. OK stays OK.
absl::Status FromGrpc(const grpc::Status& status, const std::string& address);

}  // namespace partiemc::client
