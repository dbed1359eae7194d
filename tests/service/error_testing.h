// Test server for the tests of the error tables.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "service/error_table.h"
#include "service/golden_messages.h"
#include "service/service_testing.h"

namespace partiemc::server {

inline constexpr char kToken[] = "0123456789abcdef0123456789abcdef";

/// Expects the same information in Google's error model, and an existing field.
inline void ExpectDetails(const grpc::Status& status, const std::string& reason) {
  if (reason.empty()) {
    EXPECT_TRUE(status.error_details().empty());
    return;
  }
  google::rpc::Status details;
  ASSERT_TRUE(details.ParseFromString(status.error_details()));
  EXPECT_EQ(details.code(), static_cast<int>(status.error_code()));
  EXPECT_EQ(details.message(), status.error_message());
  const bool bad_request = status.error_code() == grpc::StatusCode::INVALID_ARGUMENT;
  ASSERT_EQ(details.details_size(), bad_request ? 2 : 1);
  google::rpc::ErrorInfo info;
  ASSERT_TRUE(details.details(0).UnpackTo(&info));
  EXPECT_EQ(info.reason(), reason);
  EXPECT_EQ(info.domain(), "partiemc");
  ASSERT_EQ(info.metadata_size(), 3);
  const std::string& field = info.metadata().at("field");
  const std::string rest = info.metadata().at("value") + "; " + info.metadata().at("rule");
  EXPECT_EQ(field + ": " + rest, status.error_message());
  EXPECT_TRUE(IsFieldOrSubject(field)) << field;
  if (!bad_request) return;
  google::rpc::BadRequest request;
  ASSERT_TRUE(details.details(1).UnpackTo(&request));
  ASSERT_EQ(request.field_violations_size(), 1);
  EXPECT_EQ(request.field_violations(0).field(), field);
  EXPECT_EQ(request.field_violations(0).description(), rest);
}

class ErrorTable : public ::testing::Test {
 protected:
  void TearDown() override { messages_.ExpectAllSeen(); }

  void Serve() {
    server_ = StartServer(options_);
    channel_ = Connect(*server_, Transport::kTcp);
    stub_ = v1::ReconstructionService::NewStub(channel_);
  }

  GoldenMessages messages_;
  ServerOptions options_ = TestOptions();
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::ReconstructionService::Stub> stub_;
};

}  // namespace partiemc::server
