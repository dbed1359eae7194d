// Key files for checkpoints, and signatures.
#include "server/security/checkpoint_keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "absl/strings/escaping.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string kA = "0123456789abcdef-test";
const std::string kB = "another-0123456789+/=";

std::string Told(const std::string& text) {
  const auto keys = CheckpointKeys::Parse(text);
  EXPECT_EQ(keys.status().code(), absl::StatusCode::kInvalidArgument) << text;
  return std::string(keys.status().message());
}

TEST(CheckpointKeys, TheSignatureIsHmacSha256) {
  // printf 'bytes of a checkpoint' | openssl dgst -sha256 -hmac 0123456789abcdef-test
  const std::string signature = CheckpointKeys::Parse(kA)->Sign("bytes of a checkpoint");
  EXPECT_EQ(absl::BytesToHexString(signature),
            "c39d2378bc9bc1f4a20232590796621acb5ebcfff5c375481489975aa221f4d5");
}

TEST(CheckpointKeys, TheFirstSignsAndBothVerify) {
  const auto a = CheckpointKeys::Parse(kA), b = CheckpointKeys::Parse(kB);
  const auto both = CheckpointKeys::Parse("# in use\n" + kB + "\n\n  # before it\n  " + kA + " \n");
  ASSERT_TRUE(a.ok() && b.ok() && both.ok()) << both.status();
  EXPECT_EQ(both->Sign("text"), b->Sign("text"));
  EXPECT_TRUE(both->Verify("text", a->Sign("text")));
  EXPECT_TRUE(both->Verify("text", b->Sign("text")));
  EXPECT_TRUE(a->Verify("text", a->Sign("text")));
  EXPECT_FALSE(a->Verify("text", b->Sign("text")));
  EXPECT_FALSE(b->Verify("text", a->Sign("text")));
}

TEST(CheckpointKeys, NothingButTheWholeSignatureOfTheSameBytesVerifies) {
  const auto keys = CheckpointKeys::Parse(kA + "\n" + kB);
  ASSERT_TRUE(keys.ok());
  const std::string signature = keys->Sign("text");
  ASSERT_EQ(signature.size(), CheckpointKeys::kSignatureBytes);
  EXPECT_FALSE(keys->Verify("texT", signature));
  EXPECT_FALSE(keys->Verify("text", signature + '\0'));
  for (std::size_t k = 0; k < signature.size(); ++k) {
    EXPECT_FALSE(keys->Verify("text", signature.substr(0, k)));
    std::string flipped = signature;
    flipped[k] = static_cast<char>(flipped[k] ^ 1);
    EXPECT_FALSE(keys->Verify("text", flipped));
  }
}

TEST(CheckpointKeys, WhatIsWrongWithAFileIsToldWithoutTheKey) {
  EXPECT_THAT(Told(""), HasSubstr("no key"));
  EXPECT_THAT(Told("# " + kA), HasSubstr("no key"));
  EXPECT_THAT(Told("\nsecret"), HasSubstr("line 2: must be a key of 16 to 512 characters"));
  EXPECT_THAT(Told(std::string(513, 'a')), HasSubstr("line 1"));
  EXPECT_TRUE(CheckpointKeys::Parse(std::string(512, 'a')).ok());
  EXPECT_TRUE(CheckpointKeys::Parse(std::string(16, 'a')).ok());
  EXPECT_THAT(Told("a-secret-with-a-c\xc3\xb6lon"), HasSubstr("line 1"));
  EXPECT_THAT(Told(kA + " name"), HasSubstr("line 1"));
  EXPECT_THAT(Told(kA + "\n" + kA), HasSubstr("line 2: must not repeat"));
  EXPECT_THAT(Told(kA + "\n" + kB + "\nyet-another-0123456789"),
              HasSubstr("line 3: must be at most two"));
  for (const auto& text : {kA + "\n" + kA, kA + " name", "\n" + kA + "!"}) {
    EXPECT_THAT(Told(text), Not(HasSubstr("0123456789")));
  }
}

TEST(CurrentCheckpointKeys, AreNoneUntilTheyAreSetAndThenTheLast) {
  CurrentCheckpointKeys keys;
  EXPECT_EQ(keys.Get(), nullptr);
  keys.Set(*CheckpointKeys::Parse(kA));
  const auto held = keys.Get();
  keys.Set(*CheckpointKeys::Parse(kB));
  EXPECT_EQ(keys.Get()->Sign("text"), CheckpointKeys::Parse(kB)->Sign("text"));
  EXPECT_EQ(held->Sign("text"), CheckpointKeys::Parse(kA)->Sign("text"));
}

}  // namespace
}  // namespace partiemc::server
