// bridge/wire/message_layout.h against the .lcm files and lcm-gen's encoder.

#include "bridge/wire/message_layout.h"

#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <string>
#include <vector>

#include "bridge/wire/codec.h"
#include "bridge/wire/health_layout.h"
#include "bridge/wire/wire_size.h"

namespace morphbus::bridge {
namespace {

/// Names of a struct's fields in the order of its .lcm file, as a visitor of its layout is told.
class FieldNames {
 public:
  int64_t Int8(const char* name, int64_t, int64_t) { return Add(name); }
  int64_t Int16(const char* name, int64_t, int64_t) { return Add(name); }
  int64_t Int32(const char* name, int64_t, int64_t) { return Add(name); }
  int64_t Int64(const char* name, int64_t, int64_t) { return Add(name); }
  int64_t Count8(const char* name, int64_t) { return Add(name); }
  int64_t Count16(const char* name, int64_t) { return Add(name); }
  int64_t Count32(const char* name, int64_t) { return Add(name); }
  void Bool(const char* name) { Add(name); }
  void Hash(const char* name) { Add(name); }
  void Floats(const char* name, int64_t) { Add(name); }
  void Doubles(const char* name, int64_t) { Add(name); }
  void FloatQuaternion(const char* name) { Add(name); }
  void DoubleQuaternion(const char* name) { Add(name); }
  void Bytes(const char* name, int64_t) { Add(name); }
  void Text(const char* name, size_t) { Add(name); }
  void Texts(const char* name, int64_t, size_t) { Add(name); }
  template <class M>
  void Struct(const char* name) {
    Add(name);
    Check<M>();
  }
  template <class M>
  void Structs(const char* name, int64_t) {
    Struct<M>(name);
  }
  void Refuse(const char*, const char*) {}

  /// Compares with the .lcm file, here and in all structs that this one holds.
  template <class M>
  static void Check() {
    FieldNames visitor;
    Walk(visitor, layout::As<M>());
    const std::string path = std::string(MORPHBUS_LCM_FOLDER "/") + M::getTypeName() + ".lcm";
    std::ifstream file(path);
    ASSERT_TRUE(file) << path;
    const std::regex field(R"(^\s*(?!const|struct|package)[\w.]+\s+(\w+)\s*(\[.*\])?;.*)");
    std::vector<std::string> declared;
    for (std::string line; std::getline(file, line);) {
      std::smatch match;
      if (std::regex_match(line, match, field)) declared.push_back(match[1]);
    }
    EXPECT_EQ(visitor.names_, declared) << M::getTypeName();
  }

 private:
  /// Arrays have one element, so that what repeats is named once.
  int64_t Add(const char* name) {
    names_.emplace_back(name);
    return 1;
  }
  std::vector<std::string> names_;
};

TEST(Layout, NamesEveryFieldOfEveryMessageInItsOrder) {
  FieldNames::Check<morphbus::sensors_t>();
  FieldNames::Check<morphbus::world_t>();
  FieldNames::Check<morphbus::sim_clock_t>();
  FieldNames::Check<morphbus::transform_t>();
  FieldNames::Check<morphbus::actuator_t>();
  FieldNames::Check<morphbus::status_t>();
  FieldNames::Check<morphbus::resend_t>();
  FieldNames::Check<morphbus::progress_t>();
  FieldNames::Check<morphbus::totals_t>();
  FieldNames::Check<morphbus::verdict_t>();
  FieldNames::Check<morphbus::leave_t>();
  FieldNames::Check<morphbus::admit_t>();
  FieldNames::Check<morphbus::replay_batch_t>();
  FieldNames::Check<morphbus::replay_follow_t>();
  FieldNames::Check<morphbus::hello_t>();
  FieldNames::Check<morphbus::health_t>();
  FieldNames::Check<morphbus::info_part_t>();
  FieldNames::Check<morphbus::control_t>();
  FieldNames::Check<morphbus::log_end_t>();
}

TEST(Layout, TheKernelFiltersByTheFieldsBehindTheHeader) {
  // The bytes at the place, of CLOCK's phase and of SENSORS' part, follow the fields.
  for (const int8_t phase : {int8_t{0}, int8_t{1}, int8_t{2}}) {
    morphbus::sim_clock_t clock = {};
    clock.phase = phase;
    std::vector<uint8_t> bytes;
    Encode(clock, &bytes);
    EXPECT_EQ(bytes[kFirstFieldOffset], phase);
  }
  for (const int16_t part : {int16_t{0}, int16_t{1}, int16_t{0x0203}}) {
    morphbus::sensors_t sensors = {};
    sensors.part = part;
    sensors.num_parts = 0x0204;
    std::vector<uint8_t> bytes;
    Encode(sensors, &bytes);
    EXPECT_EQ(bytes[kFirstFieldOffset] << 8 | bytes[kFirstFieldOffset + 1], part);
  }
}

TEST(Layout, SizesAreThoseOfTheEncoder) {
  const morphbus::body_pose_t body = {};
  EXPECT_EQ(static_cast<int>(LargestSize<morphbus::body_pose_t>()), body._getEncodedSizeNoHash());
  const morphbus::contact_force_t contact = {};
  EXPECT_EQ(static_cast<int>(LargestSize<morphbus::contact_force_t>()),
            contact._getEncodedSizeNoHash());
  morphbus::world_t world = {};
  world.num_bodies = world.num_contacts = 0;
  EXPECT_EQ(static_cast<int>(SizeWithoutArrays<morphbus::world_t>()), world.getEncodedSize());
  morphbus::invocation_t invocation = {};
  invocation.num_arguments = vm::kMaxArguments;
  EXPECT_EQ(static_cast<int>(LargestSize<morphbus::invocation_t>()),
            invocation._getEncodedSizeNoHash());
}

}  // namespace
}  // namespace morphbus::bridge
