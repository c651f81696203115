#include "tools/convert/lcm_proto.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/descriptor_database.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include "tools/base/json.h"

namespace morphbus::tools {
namespace {

namespace pb = google::protobuf;

constexpr const char* kTypes = R"(
package p;
struct inner_t { double x; float y[2]; }
struct outer_t {
  int8_t n;
  int64_t big;
  int32_t size;
  p.inner_t parts[size];
  byte raw[size];
  byte rows[2][3];
  int16_t grid[2][2];
  boolean yes;
  byte one;
  string name;
  string words[size];
  q.other_t other;
}
package q;
struct other_t { int32_t value; }
)";

/// The message as a reader sees it who knows nothing but the schema that goes with it.
std::string AsJson(const std::string& schema, const std::string& type, const std::string& bytes) {
  pb::FileDescriptorSet set;
  EXPECT_TRUE(set.ParseFromString(schema));
  pb::SimpleDescriptorDatabase database;
  for (const auto& file : set.file()) database.Add(file);
  pb::DescriptorPool pool(&database);
  const pb::Descriptor* descriptor = pool.FindMessageTypeByName(type);
  if (descriptor == nullptr) return "no such type";
  pb::DynamicMessageFactory factory;
  const std::unique_ptr<pb::Message> message(factory.GetPrototype(descriptor)->New());
  EXPECT_TRUE(message->ParseFromString(bytes));
  pb::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;
  std::string json;
  EXPECT_TRUE(pb::util::MessageToJsonString(*message, &json, options).ok());
  return json;
}

TEST(LcmProtoTest, EveryKindOfFieldComesThroughUnderItsName) {
  const auto schema = LcmSchema::Parse(kTypes);
  ASSERT_TRUE(schema.has_value());
  const auto proto = LcmProto::Create(*schema, *schema->FindByName("p.outer_t"));
  ASSERT_TRUE(proto.has_value()) << proto.error().message;
  const Json message = Json::parse(R"({
    "n": -7, "big": -9007199254740993, "size": 2,
    "parts": [{"x": 0.1, "y": [1.5, -2.5]}, {"x": -0.0, "y": [0, 1]}],
    "raw": "00ff", "rows": ["010203", "0a0b0c"], "grid": [[1, -2], [3, -4]],
    "yes": true, "one": 200, "name": "grün", "words": ["a", ""], "other": {"value": 5}})");
  const Json back =
      Json::parse(AsJson((*proto)->schema(), "p.outer_t", (*proto)->Convert(message)));
  const Json expected = Json::parse(R"({
    "n": -7, "big": "-9007199254740993", "size": 2,
    "parts": [{"x": 0.1, "y": [1.5, -2.5]}, {"x": -0.0, "y": [0, 1]}],
    "raw": "AP8=", "rows": ["AQID", "CgsM"], "grid": [1, -2, 3, -4],
    "yes": true, "one": 200, "name": "grün", "words": ["a", ""], "other": {"value": 5}})");
  EXPECT_EQ(back, expected) << back.dump(1);
}

TEST(LcmProtoTest, TextThatIsNoUtf8IsReplacedSinceTheFormatDemandsIt) {
  const auto schema = LcmSchema::Parse("package p; struct t { string s; }");
  ASSERT_TRUE(schema.has_value());
  const auto proto = LcmProto::Create(*schema, *schema->FindByName("p.t"));
  ASSERT_TRUE(proto.has_value());
  const Json message = {{"s", std::string("a\xFFz")}};
  EXPECT_EQ(Json::parse(AsJson((*proto)->schema(), "p.t", (*proto)->Convert(message)))["s"],
            "a\xEF\xBF\xBDz");
}

TEST(LcmProtoTest, PackagesThatNeedEachOtherAreRefused) {
  const auto schema = LcmSchema::Parse(
      "package p; struct a { q.b b; } struct c { int8_t x; } package q; struct b { p.c c; }");
  ASSERT_TRUE(schema.has_value());
  const auto proto = LcmProto::Create(*schema, *schema->FindByName("p.a"));
  ASSERT_FALSE(proto.has_value());
  EXPECT_NE(proto.error().message.find("p.a"), std::string::npos);
}

}  // namespace
}  // namespace morphbus::tools
