// A server to be refused by, as the tests of the error tables need it.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "service/service_testing.h"

namespace partiemc::server {

class ErrorTable : public ::testing::Test {
 protected:
  void Serve() {
    server_ = StartServer(options_);
    channel_ = Connect(*server_, Transport::kTcp);
    stub_ = v1::ReconstructionService::NewStub(channel_);
  }

  ServerOptions options_ = TestOptions();
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::ReconstructionService::Stub> stub_;
};

}  // namespace partiemc::server
