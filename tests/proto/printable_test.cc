#include "common/printable.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <string_view>

namespace partiemc {
namespace {

// Empty unless `text` is one character.
std::optional<char32_t> Only(std::string_view text) {
  const auto character = TakeCharacter(text);
  return text.empty() ? character : std::nullopt;
}

// Follows the definition of UTF-8 (RFC 3629).
std::string Encode(char32_t c) {
  const auto tail = [c](int shift) { return static_cast<char>(0x80 | ((c >> shift) & 0x3f)); };
  if (c < 0x80) return {static_cast<char>(c)};
  if (c < 0x800) return {static_cast<char>(0xc0 | (c >> 6)), tail(0)};
  if (c < 0x10000) return {static_cast<char>(0xe0 | (c >> 12)), tail(6), tail(0)};
  return {static_cast<char>(0xf0 | (c >> 18)), tail(12), tail(6), tail(0)};
}

TEST(Printable, EveryCharacterIsReadAndHalvesOfPairsAreNone) {
  for (char32_t c = 0; c <= 0x10ffff; ++c) {
    const bool half = c >= 0xd800 && c < 0xe000;
    ASSERT_EQ(Only(Encode(c)), half ? std::nullopt : std::optional(c)) << std::hex << unsigned(c);
  }
}

TEST(Printable, BytesThatAreNoCharacterAreTakenOneByOne) {
  for (const std::string_view bytes : {"\x80", "\xff", "\xc3", "\xc3(", "\xe2\x82", "\xf0\x9f\x98",
                                       "\xc0\xaf", "\xe0\x80\xaf", "\xf4\x90\x80\x80", "\xf8"}) {
    std::string_view rest = bytes;
    EXPECT_EQ(TakeCharacter(rest), std::nullopt);
    EXPECT_EQ(rest.size(), bytes.size() - 1);
    EXPECT_FALSE(IsPrintable(bytes));
  }
}

TEST(Printable, WordsOfAnyScriptStayAsTheyAre) {
  for (const std::string_view text : {"", "dam break 7", "Größe", "水", "\xf0\x9f\x8c\x8a"}) {
    EXPECT_TRUE(IsPrintable(text));
    EXPECT_EQ(Printable(text), text);
  }
}

TEST(Printable, WhatATerminalWouldObeyBecomesAnEscape) {
  EXPECT_EQ(Printable("a\x1b[31mb\n"), "a\\u001b[31mb\\u000a");
  EXPECT_EQ(Printable("\xc2\x9b"
                      "31m"),
            "\\u009b31m");
  EXPECT_EQ(Printable("\x7f"), "\\u007f");
  EXPECT_EQ(Printable("exe.\xe2\x80\xae"
                      "gpj"),
            "exe.\\u202egpj");
  EXPECT_EQ(Printable("\xe2\x81\xa6"), "\\u2066");
  EXPECT_EQ(Printable("\xff\xc3"), "\\xff\\xc3");
  for (const std::string_view text : {"\n", "\xc2\x85", "\xe2\x80\xa8", "\xe2\x80\x8f"}) {
    EXPECT_FALSE(IsPrintable(text));
    EXPECT_TRUE(IsPrintable(Printable(text)));
  }
}

}  // namespace
}  // namespace partiemc
