// A service of gRPC whose methods are all streams of bytes (server/calls/byte_call.h).
#pragma once

#include <grpcpp/impl/codegen/service_type.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <list>
#include <string>

namespace partiemc::server {

/// gRPC's generated services read and parse the request of a unary call before they call its
/// method, and the server cannot end a call that waits for its request. A unary call looks like a
/// stream of one message each way on the wire, so every method can be served as a stream.
class ByteService : public grpc::Service {
 protected:
  using Reactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;
  using Method = std::function<Reactor*(grpc::CallbackServerContext*)>;

  /// Called before the service is registered. `path`: "/package.Service/Method".
  void Serve(std::string path, Method method);

 private:
  std::list<std::string> paths_;  // gRPC keeps pointers to them.
};

}  // namespace partiemc::server
