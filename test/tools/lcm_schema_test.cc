#include "tools/spy/lcm_schema.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <morphbus/actuator_t.hpp>
#include <morphbus/info_part_t.hpp>
#include <morphbus/log_end_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <vector>

#include "tools/spy/lcm_sources.h"

namespace morphbus::tools {
namespace {

LcmSchema Ours() {
  Result<LcmSchema> schema = LcmSchema::Parse(LcmSources());
  EXPECT_TRUE(schema.has_value()) << schema.error().message;
  return std::move(*schema);
}

template <class M>
std::vector<uint8_t> Bytes(const M& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

// The published example of LCM's own tutorial, whose hash stands in its C# binding.
TEST(LcmSchemaTest, TheExampleOfLcmHasItsKnownFingerprint) {
  const Result<LcmSchema> schema = LcmSchema::Parse(
      "package exlcm;\nstruct example_t {\n  int64_t timestamp;\n  double position[3];\n"
      "  double orientation[4];\n  int32_t num_ranges;\n  int16_t ranges[num_ranges];\n"
      "  string name;\n  boolean enabled;\n}\n");
  ASSERT_TRUE(schema.has_value());
  const LcmType* type = schema->FindByName("exlcm.example_t");
  ASSERT_NE(type, nullptr);
  EXPECT_EQ(static_cast<uint64_t>(type->base_hash), 0x1baa9e29b0fbaa8bu);
  EXPECT_EQ(static_cast<uint64_t>(type->fingerprint), 0x37553c5361f75516u);
}

TEST(LcmSchemaTest, FingerprintsAreThoseOfTheGeneratedCode) {
  const LcmSchema schema = Ours();
  EXPECT_EQ(schema.FindByName("morphbus.sensors_t")->fingerprint, morphbus::sensors_t::getHash());
  EXPECT_EQ(schema.FindByName("morphbus.transform_t")->fingerprint,
            morphbus::transform_t::getHash());
  EXPECT_EQ(schema.FindByName("morphbus.status_t")->fingerprint, morphbus::status_t::getHash());
  EXPECT_EQ(schema.FindByName("morphbus.log_end_t")->fingerprint, morphbus::log_end_t::getHash());
  EXPECT_EQ(schema.FindByName("morphbus.info_part_t")->fingerprint,
            morphbus::info_part_t::getHash());
  EXPECT_EQ(schema.FindByName("morphbus.actuator_t")->fingerprint, morphbus::actuator_t::getHash());
}

TEST(LcmSchemaTest, NestedArraysDecodeToWhatWasEncoded) {
  morphbus::sensors_t message = {};
  message.header.tick = -5;
  message.num_parts = 1;
  message.num_modules = 1;
  message.modules.resize(1);
  message.modules[0].name = "m1";
  message.modules[0].num_joints = 2;
  message.modules[0].joint_position_si = {0.25, -1e300};
  message.modules[0].joint_velocity_si = {1.5f, -2.0f};
  message.modules[0].joint_effort_si = {0.0f, 0.5f};
  message.modules[0].num_docked = 0;
  const std::vector<uint8_t> bytes = Bytes(message);
  const auto json = Ours().Decode(bytes.data(), bytes.size());
  ASSERT_TRUE(json.has_value()) << json.error().message;
  EXPECT_EQ((*json)["header"]["tick"], -5);
  EXPECT_EQ((*json)["modules"][0]["name"], "m1");
  EXPECT_EQ((*json)["modules"][0]["joint_position_si"][1], -1e300);
  EXPECT_EQ((*json)["modules"][0]["joint_velocity_si"][0], 1.5);
}

TEST(LcmSchemaTest, ArraysOfBytesAreHexadecimal) {
  morphbus::info_part_t message = {};
  message.size = 3;
  message.data = {0x00, 0xab, 0xff};
  const std::vector<uint8_t> bytes = Bytes(message);
  EXPECT_EQ((*Ours().Decode(bytes.data(), bytes.size()))["data"], "00abff");
}

TEST(LcmSchemaTest, BytesThatAreCutAnywhereAreRefused) {
  morphbus::transform_t message = {};
  message.num_links = 1;
  message.link_poses.resize(1);
  const std::vector<uint8_t> bytes = Bytes(message);
  const LcmSchema schema = Ours();
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(schema.Decode(bytes.data(), size).has_value()) << size;
  }
  std::vector<uint8_t> longer = bytes;
  longer.push_back(0);
  EXPECT_FALSE(schema.Decode(longer.data(), longer.size()).has_value());
}

TEST(LcmSchemaTest, HugeLengthsAreRefusedWithoutMemory) {
  const Result<LcmSchema> schema = LcmSchema::Parse("struct a_t { int32_t n; string s[n]; }");
  ASSERT_TRUE(schema.has_value());
  std::vector<uint8_t> bytes(8);
  const auto hash = static_cast<uint64_t>(schema->FindByName("a_t")->fingerprint);
  for (size_t i = 0; i < 8; ++i) bytes[i] = static_cast<uint8_t>(hash >> (56 - 8 * i));
  for (const uint8_t b : {0x7f, 0xff, 0xff, 0xff}) bytes.push_back(b);
  EXPECT_FALSE(schema->Decode(bytes.data(), bytes.size()).has_value());
}

// LCM's own channel_to_port_t (lcm/lcmtypes/channel_to_port_t.c) and its generated hash.
TEST(LcmSchemaTest, ATypeWithoutAPackageHasItsKnownHash) {
  const Result<LcmSchema> schema =
      LcmSchema::Parse("struct channel_to_port_t { string channel; int16_t port; }");
  ASSERT_TRUE(schema.has_value());
  EXPECT_EQ(static_cast<uint64_t>(schema->FindByName("channel_to_port_t")->base_hash),
            0x11dde9fa42a43913u);
}

/// A message of the first type of `schema` with these bytes behind the fingerprint.
std::vector<uint8_t> MessageOf(const LcmSchema& schema, const std::string& type,
                               std::vector<uint8_t> bytes) {
  const auto hash = static_cast<uint64_t>(schema.FindByName(type)->fingerprint);
  for (size_t i = 0; i < 8; ++i) {
    bytes.insert(bytes.begin() + static_cast<ptrdiff_t>(i),
                 static_cast<uint8_t>(hash >> (56 - 8 * i)));
  }
  return bytes;
}

// The figures are those of lcm-gen 1.3.1's Python for the same text.
TEST(LcmSchemaTest, EnumerationsAreAsLcmGenHasThem) {
  const Result<LcmSchema> schema = LcmSchema::Parse(
      "package t; enum color_t { RED = 1, GREEN = 2 }\n"
      "struct u_t { color_t c; double a[0x3]; int8_t n; float b[n][2], z; color_t d[2]; }");
  ASSERT_TRUE(schema.has_value()) << schema.error().message;
  EXPECT_EQ(static_cast<uint64_t>(schema->FindByName("t.color_t")->fingerprint),
            0x7636f6d82a7e5b6u);
  EXPECT_EQ(static_cast<uint64_t>(schema->FindByName("t.u_t")->base_hash), 0x6fdce710723ad062u);
  std::vector<uint8_t> bytes = {0, 0, 0, 2};
  bytes.resize(4 + 24);
  for (const uint8_t b : {0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 7}) bytes.push_back(b);
  const std::vector<uint8_t> message = MessageOf(*schema, "t.u_t", bytes);
  const auto json = schema->Decode(message.data(), message.size());
  ASSERT_TRUE(json.has_value()) << json.error().message;
  EXPECT_EQ((*json)["c"], "GREEN");
  EXPECT_EQ((*json)["d"][0], "RED");
  EXPECT_EQ((*json)["d"][1], 7);
}

TEST(LcmSchemaTest, ValuesOfAnEnumerationGoOnFromTheLargest) {
  const Result<LcmSchema> schema = LcmSchema::Parse("enum e { A, B = 7; C D }");
  ASSERT_TRUE(schema.has_value()) << schema.error().message;
  EXPECT_EQ(schema->FindByName("e")->values,
            (std::map<int32_t, std::string>{{1, "A"}, {7, "B"}, {8, "C"}, {9, "D"}}));
}

TEST(LcmSchemaTest, ConstantsAsSizesCountByTheirText) {
  const auto hash = [](const std::string& text) {
    return LcmSchema::Parse(text)->FindByName("a")->fingerprint;
  };
  EXPECT_EQ(hash("struct a { const int32_t N = 0x10; byte x[N]; }"),
            hash("struct a { byte x[0x10]; }"));
  EXPECT_NE(hash("struct a { const int32_t N = 0x10; byte x[N]; }"),
            hash("struct a { byte x[16]; }"));
  const Result<LcmSchema> schema =
      LcmSchema::Parse("struct a { const int8_t N = 0x2; int8_t x[N]; }");
  const std::vector<uint8_t> message = MessageOf(*schema, "a", {1, 2});
  EXPECT_EQ((*schema->Decode(message.data(), message.size()))["x"][1], 2);
}

TEST(LcmSchemaTest, FilesUseEachOthersTypes) {
  std::vector<std::string> warnings;
  const Result<LcmSchema> split =
      LcmSchema::ParseFiles({{"b.lcm", "package x.y; struct b_t { other.a_t a; c_t c; }"},
                             {"a.lcm", "package other; struct a_t { int8_t v; }"},
                             {"c.lcm", "package x.y; struct c_t { double w; }"},
                             {"plain.lcm", "struct d_t { int8_t v; }"}},
                            &warnings);
  ASSERT_TRUE(split.has_value()) << split.error().message;
  EXPECT_TRUE(warnings.empty());
  EXPECT_NE(split->FindByName("d_t"), nullptr);
  const std::vector<uint8_t> message = MessageOf(*split, "x.y.b_t", {5, 0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ((*split->Decode(message.data(), message.size()))["a"]["v"], 5);
}

TEST(LcmSchemaTest, WhatOneFileLacksLeavesOutWhatNeedsItAndNothingElse) {
  std::vector<std::string> warnings;
  const Result<LcmSchema> schema =
      LcmSchema::ParseFiles({{"a.lcm", "struct a_t { b_t b; }\nstruct c_t { int8_t v; }"},
                             {"b.lcm", "struct b_t {\n gone_t g; }"},
                             {"other.lcm", "struct c_t { int16_t v; }"}},
                            &warnings);
  ASSERT_TRUE(schema.has_value()) << schema.error().message;
  EXPECT_EQ(schema->size(), 1u);
  EXPECT_EQ(warnings, (std::vector<std::string>{
                          "other.lcm: c_t is another one than in a.lcm, which counts",
                          "b.lcm:2: b_t is left out: no file defines the type of g, gone_t",
                          "a.lcm:1: a_t is left out: no file defines the type of b, b_t"}));
  EXPECT_EQ(LcmSchema::ParseFiles({{"bad.lcm", "struct"}}, &warnings).error().message,
            "bad.lcm: line 1: expected the name of a struct, found ''");
}

TEST(LcmSchemaTest, TypesThatHoldThemselvesEndAndThoseInTooManyWaysAreLeftOut) {
  const Result<LcmSchema> list = LcmSchema::Parse(
      "struct a { int8_t n; a next[n]; b other[n]; } struct b { int8_t n; a x[n]; }");
  ASSERT_TRUE(list.has_value()) << list.error().message;
  // Every type holds all others: the ways through them are more than anybody can walk.
  std::string tangle;
  for (int i = 0; i < 30; ++i) {
    tangle += "struct t" + std::to_string(i) + " { int8_t n;";
    for (int j = 0; j < 30; ++j)
      tangle += " t" + std::to_string(j) + " m" + std::to_string(j) + "[n];";
    tangle += " }\n";
  }
  std::vector<std::string> warnings;
  const Result<LcmSchema> none = LcmSchema::ParseFiles({{"tangle.lcm", tangle}}, &warnings);
  ASSERT_TRUE(none.has_value());
  EXPECT_EQ(warnings.size(), 30u);
  // A chain that is long, but has one way only, is none of these.
  std::string chain = "struct c0 { int8_t v; }";
  for (int i = 1; i < 40; ++i) chain += fmt::format(" struct c{} {{ c{} a, b, c, d; }}", i, i - 1);
  EXPECT_TRUE(LcmSchema::Parse(chain).has_value());
}

TEST(LcmSchemaTest, ArraysOfNothingHaveAnEnd) {
  const Result<LcmSchema> schema =
      LcmSchema::Parse("struct e {} struct a { int32_t n; e x[n][n][n]; byte pad[10000]; }");
  ASSERT_TRUE(schema.has_value()) << schema.error().message;
  std::vector<uint8_t> bytes = {0, 0, 0x27, 0x10};
  bytes.resize(10'004);
  const std::vector<uint8_t> message = MessageOf(*schema, "a", bytes);
  EXPECT_EQ(schema->Decode(message.data(), message.size()).error().message,
            "more than 262144 values of a");
  EXPECT_FALSE(schema->Fits(*schema->FindByName("a"), message.data(), message.size()));
}

TEST(LcmSchemaTest, WhatLcmGenRefusesIsRefusedWithItsLine) {
  const auto error = [](const std::string& text) { return LcmSchema::Parse(text).error().message; };
  EXPECT_EQ(error("struct a {\n byte x[n]; }"),
            "line 2: the size 'n' must be a member before the array, found ']'");
  EXPECT_EQ(error("struct a { double n; byte x[n]; }"),
            "line 1: the size 'n' must be a whole number, found ']'");
  EXPECT_EQ(error("struct a { byte x[0]; }"),
            "line 1: the size of an array is a whole number above 0, found ']'");
  EXPECT_EQ(error("struct a { byte x[99999999999999999999]; }"),
            "line 1: the size of an array is a whole number above 0, found ']'");
  EXPECT_EQ(error("struct a { int8_t x; byte x; }"), "line 1: there are two 'x', found ';'");
  EXPECT_EQ(error("enum e { A = 1, B = 1 }"), "line 1: two values are 1, found '}'");
  EXPECT_EQ(error("struct a { const string S = 1; }"),
            "line 1: a constant is a whole number, a float or a double, found 'S'");
}

TEST(LcmSchemaTest, ErrorsNameTheLine) {
  EXPECT_EQ(LcmSchema::Parse("package a;\nstruct b {\n int8_t x\n}").error().message,
            "line 4: expected ';', found '}'");
  EXPECT_EQ(LcmSchema::Parse("struct b { c_t x; }").error().message,
            "b: member x is of unknown type c_t");
  EXPECT_FALSE(LcmSchema::Parse("struct b { /* ").has_value());
}

}  // namespace
}  // namespace morphbus::tools
