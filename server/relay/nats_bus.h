// The bus that replicas share: a server of NATS, or several of one cluster.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/relay/message_bus.h"

namespace partiemc::server {

/// Connects in the background, and again whenever the connection is lost, for ever. `url` is
/// nats://[USER:PASSWORD@|TOKEN@]HOST[:PORT] or tls://..., or several with commas between them.
/// Errors: INVALID_ARGUMENT for what is no such URL.
absl::StatusOr<std::unique_ptr<MessageBus>> ConnectToNats(const std::string& url);

}  // namespace partiemc::server
