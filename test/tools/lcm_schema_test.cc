#include "tools/spy/lcm_schema.h"

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

TEST(LcmSchemaTest, ErrorsNameTheLine) {
  EXPECT_EQ(LcmSchema::Parse("package a;\nstruct b {\n int8_t x\n}").error().message,
            "line 4: expected ';', found '}'");
  EXPECT_EQ(LcmSchema::Parse("struct b { c_t x; }").error().message,
            "b: member x is of unknown type c_t");
  EXPECT_FALSE(LcmSchema::Parse("struct b { /* ").has_value());
}

}  // namespace
}  // namespace morphbus::tools
