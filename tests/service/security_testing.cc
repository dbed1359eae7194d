#include "service/security_testing.h"

#include <grpcpp/generic/generic_stub.h>

#include <chrono>
#include <filesystem>

namespace partiemc::server {

void Security::Write(const std::string& name, const std::string& text) const {
  std::filesystem::rename(folder_.Write(name + ".part", text), Path(name));
}

void Security::WriteIdentity(const IssuedCertificate& identity) const {
  Write("server.pem", identity.certificate);
  Write("server.key", identity.key);
}

ServerOptions Security::Options(bool tls, bool client_ca, bool tokens) const {
  ServerOptions options = TestOptions();
  options.reload_interval = std::chrono::milliseconds(10);
  if (tls) {
    options.tls = {Path("server.pem"), Path("server.key"), client_ca ? Path("clients.pem") : ""};
  }
  if (tokens) options.token_file = Path("tokens");
  return options;
}

std::shared_ptr<grpc::Channel> Security::Channel(const Client& client) const {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  const auto credentials = client.tls
                               ? grpc::SslCredentials({.pem_root_certs = client.authority,
                                                       .pem_private_key = client.own.key,
                                                       .pem_cert_chain = client.own.certificate})
                               : grpc::InsecureChannelCredentials();
  return grpc::CreateCustomChannel(server_->address().ToString(), credentials, arguments);
}

Security::End Security::Ask(const std::shared_ptr<grpc::Channel>& channel,
                            const std::string& token) {
  return Call(channel,
              v1::ReconstructionService::service_full_name() + std::string("/GetServerInfo"),
              token.empty() ? "" : "Bearer " + token);
}

Security::End Security::Call(const std::shared_ptr<grpc::Channel>& channel,
                             const std::string& method, const std::string& authorization) {
  TimedContext context;
  if (!authorization.empty()) context.AddMetadata("authorization", authorization);
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  const auto call = stub.PrepareCall(&context, "/" + method, &queue);
  const auto step = [&] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  call->StartCall(nullptr);
  bool goes_on = step();
  const grpc::Slice nothing;
  if (goes_on) {
    call->WriteLast(grpc::ByteBuffer(&nothing, 1), {}, nullptr);
    goes_on = step();
  }
  while (goes_on) {
    grpc::ByteBuffer answer;
    call->Read(&answer, nullptr);
    goes_on = step();
  }
  grpc::Status status;
  call->Finish(&status, nullptr);
  EXPECT_TRUE(step());
  return {status.error_code(), ReasonOf(context), status.error_message()};
}

}  // namespace partiemc::server
