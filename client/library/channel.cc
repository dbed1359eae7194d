#include "client/library/channel.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/library/credentials.h"
#include "common/address.h"
#include "common/clock.h"
#include "partiemc/status.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"

namespace partiemc::client {
namespace {

// Backoff after a refused connection: long enough to cost nothing, short enough to find a starting
// server at once.
constexpr int kFirstBackoffMs = 100;
constexpr int kLongestBackoffMs = 500;

// A dead connection is detected after the sum of two times: the silence before a ping, and the time
// for its acknowledgement. The second time must cover a slow connection with megabytes on the way.
constexpr int kKeepaliveMs = 4000;
constexpr int kKeepaliveTimeoutMs = 6000;

// Enough for a server that is starting.
constexpr std::chrono::milliseconds kConnectTimeout(2000);

// Timeout of the call that obtains gRPC's reason for a missing connection. gRPC already has the
// reason, so the call returns at once.
constexpr std::chrono::seconds kReasonTimeout(1);

absl::StatusOr<Address> ParseTarget(const std::string& address) {
  auto parsed = ParseAddress(address);
  if (parsed.ok() && (!parsed->unix_path.empty() || parsed->port != 0)) return parsed;
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {.reason = std::string(kReasonOutOfRange),
                         .field = "address",
                         .value = absl::StrCat("'", address, "'"),
                         .rule = "must be HOST:PORT, [IPV6]:PORT or unix:PATH"});
}

}  // namespace

std::string Reason(const grpc::Status& status) {
  std::string text = status.error_message();
  const std::size_t colon = text.rfind(": ");
  if (colon != std::string::npos) text.erase(0, colon + 2);
  return text.empty() ? "no answer" : text;
}

std::string ReasonOf(const grpc::ClientContext& context) {
  const auto& metadata = context.GetServerTrailingMetadata();
  const auto found = metadata.find("partiemc-reason");
  return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
}

absl::Status CheckAddress(const std::string& address, const Credentials& credentials) {
  const auto parsed = ParseTarget(address);
  if (!parsed.ok()) return parsed.status();
  return MakeTokenSender(credentials, *parsed).status();
}

absl::StatusOr<std::shared_ptr<grpc::Channel>> MakeChannel(const std::string& address,
                                                           const Credentials& credentials) {
  const auto parsed = ParseTarget(address);
  if (!parsed.ok()) return parsed.status();
  auto channel_credentials = MakeChannelCredentials(credentials);
  if (!channel_credentials.ok()) return channel_credentials.status();
  auto token_sender = MakeTokenSender(credentials, *parsed);
  if (!token_sender.ok()) return token_sender.status();

  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kFirstBackoffMs);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kFirstBackoffMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kLongestBackoffMs);
  // Disables gRPC's retries, because this library resumes streams itself. With gRPC's retries, a
  // call that a proxy has refused could hang after it is cancelled.
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  // Opens a new connection instead of sharing an existing one, which may be dead after a loss.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // Frames go directly to the address; an http_proxy for browsers must not redirect them.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> senders;
  if (*token_sender != nullptr) senders.push_back(*std::move(token_sender));
  return grpc::experimental::CreateCustomChannelWithInterceptors(address, *channel_credentials,
                                                                 arguments, std::move(senders));
}

absl::Status Connect(const std::shared_ptr<grpc::Channel>& channel, const std::string& address,
                     std::chrono::milliseconds timeout) {
  if (channel->WaitForConnected(SystemClock().TimeOfDay() + timeout)) {
    return absl::OkStatus();
  }
  grpc::ClientContext context;
  context.set_deadline(SystemClock().TimeOfDay() + kReasonTimeout);
  v1::GetServerInfoResponse response;
  const auto stub = v1::ReconstructionService::NewStub(channel);
  const grpc::Status status = stub->GetServerInfo(&context, {}, &response);
  if (status.ok()) return absl::OkStatus();  // The server has started since.
  const std::string reason = Reason(status);
  if (reason.find("certificate") != std::string::npos) {
    return absl::UnavailableError(
        absl::StrCat("the server at ", address, " has an invalid certificate (", reason,
                     "): it must be valid, for that host, and signed by an authority of --tls-ca"));
  }
  if (reason.find("refused") == std::string::npos && reason.find("closed") != std::string::npos) {
    return absl::UnavailableError(
        absl::StrCat("the program at ", address, " closed the connection (", reason,
                     "): check whether the server uses TLS (--tls) and requires a client "
                     "certificate (--tls-cert, --tls-key)"));
  }
  return absl::UnavailableError(absl::StrCat("no server at ", address, " (", reason,
                                             "): start one with `partiemc-server --address ",
                                             address, "`"));
}

absl::StatusOr<std::shared_ptr<grpc::Channel>> ConnectedChannel(
    const std::string& address, const Credentials& credentials,
    std::chrono::milliseconds deadline) {
  auto channel = MakeChannel(address, credentials);
  if (!channel.ok()) return channel;
  const absl::Status connected = Connect(*channel, address, std::min(deadline, kConnectTimeout));
  if (!connected.ok()) return connected;
  return channel;
}

std::string Seconds(std::chrono::nanoseconds duration) {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(duration);
  return absl::StrCat(static_cast<double>(ms.count()) / 1000, " s");
}

absl::Status NotAccepted(const std::string& address, const char* call,
                         std::chrono::milliseconds time) {
  return absl::DeadlineExceededError(absl::StrCat("the server at ", address, " did not accept the ",
                                                  call, " within ", Seconds(time),
                                                  ": it may be overloaded; try again later"));
}

absl::Status FromGrpc(const grpc::Status& status, const std::string& address) {
  if (status.ok()) return absl::OkStatus();
  const auto code = static_cast<absl::StatusCode>(status.error_code());
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      return absl::Status(
          code, absl::StrCat("the connection to the server at ", address, " was lost (",
                             Reason(status), "): read the server's log, then start again"));
    case grpc::StatusCode::UNIMPLEMENTED:
      return absl::Status(code, absl::StrCat("the program at ", address,
                                             " does not speak partiemc.v1: give the address of a "
                                             "partiemc-server"));
    default:
      return absl::Status(
          code, absl::StrCat("the server at ", address, " reports: ", status.error_message()));
  }
}

}  // namespace partiemc::client
