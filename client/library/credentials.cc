#include "client/library/credentials.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string_view>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc::client {
namespace {

namespace experimental = grpc::experimental;

constexpr std::size_t kMaxTokenBytes = 512;  // The server's limit.

absl::StatusOr<std::string> ReadPem(const std::string& field, const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  std::string pem = std::move(text).str();
  if (pem.find("-----BEGIN ") == std::string::npos) {
    return InvalidOption(field, path, "must be a PEM file that can be read");
  }
  return pem;
}

bool IsToken(const std::string& text) {
  return !text.empty() && text.size() <= kMaxTokenBytes && std::ranges::all_of(text, [](char c) {
    return absl::ascii_isgraph(static_cast<unsigned char>(c));
  });
}

absl::StatusOr<std::string> TokenOf(const Credentials& credentials) {
  if (!credentials.token.empty()) {
    if (IsToken(credentials.token)) return credentials.token;
    return InvalidOption("token", "(not shown)", "must be at most 512 visible ASCII characters");
  }
  std::ifstream file(credentials.token_file);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string word;
    if (words >> word && word.front() != '#' && IsToken(word)) return word;
  }
  return InvalidOption("token_file", credentials.token_file,
                       "must be a file that can be read and holds a token");
}

class TokenSender final : public experimental::Interceptor {
 public:
  explicit TokenSender(std::string header) : header_(std::move(header)) {}

  void Intercept(experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(
            experimental::InterceptionHookPoints::PRE_SEND_INITIAL_METADATA)) {
      methods->GetSendInitialMetadata()->emplace("authorization", std::move(header_));
    }
    methods->Proceed();
  }

 private:
  std::string header_;
};

// Adds the token to calls by an interceptor, because gRPC's call credentials require TLS.
class TokenSenderFactory final : public experimental::ClientInterceptorFactoryInterface {
 public:
  explicit TokenSenderFactory(Credentials credentials) : credentials_(std::move(credentials)) {}

  experimental::Interceptor* CreateClientInterceptor(experimental::ClientRpcInfo*) override {
    const auto token = TokenOf(credentials_);
    // If the file is missing now, the call carries no token, and the server refuses it.
    return token.ok() ? new TokenSender(absl::StrCat("Bearer ", *token)) : nullptr;
  }

 private:
  const Credentials credentials_;
};

std::string Variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

absl::Status InvalidOption(std::string field, std::string value, std::string rule) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonOutOfRange), std::move(field), std::move(value), std::move(rule)});
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> MakeChannelCredentials(
    const Credentials& credentials) {
  if (!credentials.tls) {
    for (const auto& [field, path] : {std::pair("ca_file", &credentials.ca_file),
                                      std::pair("cert_file", &credentials.cert_file),
                                      std::pair("key_file", &credentials.key_file)}) {
      if (!path->empty()) return InvalidOption(field, *path, "goes with `tls`");
    }
    return grpc::InsecureChannelCredentials();
  }
  if (credentials.cert_file.empty() != credentials.key_file.empty()) {
    return credentials.cert_file.empty()
               ? InvalidOption("key_file", credentials.key_file, "goes with cert_file")
               : InvalidOption("cert_file", credentials.cert_file, "goes with key_file");
  }
  grpc::SslCredentialsOptions options;
  for (const auto& [field, path, pem] :
       {std::tuple("ca_file", &credentials.ca_file, &options.pem_root_certs),
        std::tuple("cert_file", &credentials.cert_file, &options.pem_cert_chain),
        std::tuple("key_file", &credentials.key_file, &options.pem_private_key)}) {
    if (path->empty()) continue;
    auto read = ReadPem(field, *path);
    if (!read.ok()) return read.status();
    *pem = *std::move(read);
  }
  return grpc::SslCredentials(options);
}

absl::StatusOr<std::unique_ptr<experimental::ClientInterceptorFactoryInterface>> MakeTokenSender(
    const Credentials& credentials, const Address& address) {
  std::unique_ptr<experimental::ClientInterceptorFactoryInterface> sender;
  if (credentials.token.empty() && credentials.token_file.empty()) return sender;
  if (const auto token = TokenOf(credentials); !token.ok()) return token.status();
  if (!credentials.tls && !address.IsLocal()) {
    return InvalidOption(credentials.token.empty() ? "token_file" : "token", "(not shown)",
                         absl::StrCat("would travel to ", address.ToString(),
                                      " in the clear; must go over TLS, or within this machine"));
  }
  sender = std::make_unique<TokenSenderFactory>(credentials);
  return sender;
}

Credentials CredentialsFromEnvironment() {
  Credentials credentials{.ca_file = Variable("PARTIEMC_TLS_CA"),
                          .cert_file = Variable("PARTIEMC_TLS_CERT"),
                          .key_file = Variable("PARTIEMC_TLS_KEY"),
                          .token = Variable("PARTIEMC_TOKEN"),
                          .token_file = Variable("PARTIEMC_TOKEN_FILE")};
  // Any value that does not clearly disable TLS enables it.
  constexpr std::string_view kNo[] = {"", "0", "false", "no", "off", "n", "f", "disable"};
  credentials.tls = !std::ranges::count(kNo, absl::AsciiStrToLower(Variable("PARTIEMC_TLS"))) ||
                    !credentials.ca_file.empty() || !credentials.cert_file.empty() ||
                    !credentials.key_file.empty();
  return credentials;
}

std::string ServerFromEnvironment() {
  std::string address = Variable("PARTIEMC_SERVER");
  return address.empty() ? "127.0.0.1:50051" : address;
}

}  // namespace partiemc::client
