#include "server/rpc/byte_service.h"

#include <grpcpp/impl/codegen/server_callback_handlers.h>

#include <utility>

namespace partiemc::server {

void ByteService::Serve(std::string path, Method method) {
  using grpc::internal::RpcMethod;
  const int index = static_cast<int>(paths_.size());
  paths_.push_back(std::move(path));
  AddMethod(new grpc::internal::RpcServiceMethod(paths_.back().c_str(), RpcMethod::BIDI_STREAMING,
                                                 nullptr));
  MarkMethodRawCallback(index,
                        new grpc::internal::CallbackBidiHandler<grpc::ByteBuffer, grpc::ByteBuffer>(
                            std::move(method)));
}

}  // namespace partiemc::server
