// Compares the contract with the released one (proto/released).
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "partiemc/v1/reconstruction.pb.h"
#include "proto/contract_breaks.h"

namespace partiemc {
namespace {

using google::protobuf::DescriptorPool;
using google::protobuf::DescriptorProto;
using google::protobuf::FileDescriptor;
using google::protobuf::FileDescriptorProto;
using google::protobuf::FileDescriptorSet;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kFile[] = "partiemc/v1/reconstruction.proto";

const FileDescriptor& Released() {
  static DescriptorPool pool;
  static const FileDescriptor* const file = [] {
    std::ifstream image(PARTIEMC_SOURCE_DIR "/proto/released/reconstruction.binpb",
                        std::ios::binary);
    FileDescriptorSet set;
    EXPECT_TRUE(set.ParseFromIstream(&image));
    for (const FileDescriptorProto& one : set.file()) pool.BuildFile(one);
    return pool.FindFileByName(kFile);
  }();
  return *file;
}

const FileDescriptor& Today() { return *v1::ParticleFrame::descriptor()->file(); }

// The breaks after `change` is applied to the released contract.
std::vector<std::string> BreaksOf(const std::function<void(FileDescriptorProto&)>& change) {
  FileDescriptorProto file;
  Released().CopyTo(&file);
  Released().CopyJsonNameTo(&file);
  change(file);
  DescriptorPool pool;
  const FileDescriptor* const built = pool.BuildFile(file);
  if (built == nullptr) return {"does not build"};
  return ContractBreaks(Released(), *built);
}

DescriptorProto& Message(FileDescriptorProto& file, const std::string& name) {
  for (DescriptorProto& message : *file.mutable_message_type()) {
    if (message.name() == name) return message;
  }
  ADD_FAILURE() << "no message " << name;
  return *file.add_message_type();
}

auto& Field(FileDescriptorProto& file, const std::string& message, const std::string& name) {
  DescriptorProto& owner = Message(file, message);
  for (auto& field : *owner.mutable_field()) {
    if (field.name() == name) return field;
  }
  ADD_FAILURE() << "no field " << name;
  return *owner.add_field();
}

// Replaces a name by one of the same length everywhere, so that the file still builds.
void RenameEverywhere(FileDescriptorProto& file, const std::string& name,
                      const std::string& other) {
  ASSERT_EQ(name.size(), other.size());
  std::string bytes = file.SerializeAsString();
  for (auto at = bytes.find(name); at != std::string::npos; at = bytes.find(name, at)) {
    bytes.replace(at, name.size(), other);
  }
  ASSERT_TRUE(file.ParseFromString(bytes));
}

TEST(Contract, BreaksNobodyWhoSpeaksWhatWasReleased) {
  EXPECT_THAT(ContractBreaks(Released(), Today()), IsEmpty());
}

TEST(Contract, WhatIsAddedBreaksNobody) {
  EXPECT_THAT(BreaksOf([](FileDescriptorProto& file) {
                auto& field = *Message(file, "ParticleFrame").add_field();
                field.set_name("novelty");
                field.set_number(5000);
                field.set_type(google::protobuf::FieldDescriptorProto::TYPE_INT32);
                field.set_label(google::protobuf::FieldDescriptorProto::LABEL_OPTIONAL);
                file.add_message_type()->set_name("Novelty");
                auto& value = *file.mutable_enum_type(0)->add_value();
                value.set_name("NOVELTY");
                value.set_number(5000);
              }),
              IsEmpty());
}

TEST(Contract, EveryKindOfBreakIsSeen) {
  using google::protobuf::FieldDescriptorProto;
  const auto sequence = [](FileDescriptorProto& file) -> FieldDescriptorProto& {
    return Field(file, "ParticleFrame", "sequence");
  };
  const std::vector<std::pair<std::string, std::function<void(FileDescriptorProto&)>>> breaks = {
      {"package: was", [](auto& file) { RenameEverywhere(file, "partiemc.v1", "partiemc.v2"); }},
      {"FrameError: is gone",
       [](auto& file) { RenameEverywhere(file, "FrameError", "FrameFault"); }},
      {"sequence: is gone", [&](auto& file) { sequence(file).set_number(5000); }},
      {"sequence: name: was", [&](auto& file) { sequence(file).set_name("order"); }},
      {"name in JSON", [&](auto& file) { sequence(file).set_json_name("order"); }},
      {"sequence: type: was uint64",
       [&](auto& file) { sequence(file).set_type(FieldDescriptorProto::TYPE_INT64); }},
      {"is repeated",
       [&](auto& file) { sequence(file).set_label(FieldDescriptorProto::LABEL_REPEATED); }},
      {"ReconstructRequest.frame: oneof",
       [](auto& file) { Field(file, "ReconstructRequest", "frame").clear_oneof_index(); }},
      {"14 is not reserved any more",
       [](auto& file) { Message(file, "ReconstructionParameters").clear_reserved_range(); }},
      {"PLACEMENT_QEF: number: was 2, is 77",
       [](auto& file) { file.mutable_enum_type(0)->mutable_value(2)->set_number(77); }},
      {"PLACEMENT_QEF: number: was 2, is gone",
       [](auto& file) { file.mutable_enum_type(0)->mutable_value(2)->set_name("OTHER"); }},
      {"Reconstruct: was stream",
       [](auto& file) { file.mutable_service(0)->mutable_method(0)->set_client_streaming(false); }},
      {"ReconstructionService.Reconstruct: is gone",
       [](auto& file) { file.mutable_service(0)->mutable_method(0)->set_name("Other"); }},
  };
  for (const auto& [line, change] : breaks) {
    EXPECT_THAT(BreaksOf(change), Contains(HasSubstr(line)));
  }
}

}  // namespace
}  // namespace partiemc
