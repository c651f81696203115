#include "bridge/wire/codec.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cfenv>
#include <limits>
#include <morphbus/actuator_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/info_part_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/world_t.hpp>
#include <random>

#include "bridge/wire/arithmetic_hash.h"
#include "bridge/wire/info_parts.h"
#include "bridge/wire/own_sensors.h"
#include "bridge/wire/stream_hash.h"
#include "bridge/wire/wire_peek.h"
#include "bridge/wire/wire_size.h"
#include "test/bridge/sample_messages.h"
#include "vm/limits.h"

namespace morphbus::bridge {
namespace {

/// Makes the CRC fit again after bytes were changed, as a forger would.
void Forge(std::vector<uint8_t>* bytes) {
  if (bytes->size() >= 12) PatchCrc(bytes->data(), bytes->size());
}

TEST(Crc, IsTheCrc32OfTheMessageWithItsFieldZero) {
  // An independent bit-by-bit CRC-32 (reflected, polynomial 0xedb88320).
  const auto reference = [](const std::vector<uint8_t>& bytes) {
    uint32_t crc = 0xffffffff;
    for (const uint8_t byte : bytes) {
      crc ^= byte;
      for (int i = 0; i < 8; ++i) crc = crc & 1 ? crc >> 1 ^ 0xedb88320 : crc >> 1;
    }
    return ~crc;
  };
  const std::string check = "123456789";
  EXPECT_EQ(reference({check.begin(), check.end()}), 0xcbf43926u) << "the CRC's own check value";
  for (const SampleMessage& sample : SampleMessages()) {
    std::vector<uint8_t> bytes = sample.bytes;
    const uint32_t stored = static_cast<uint32_t>(bytes[8]) << 24 |
                            static_cast<uint32_t>(bytes[9]) << 16 |
                            static_cast<uint32_t>(bytes[10]) << 8 | bytes[11];
    std::fill(bytes.begin() + 8, bytes.begin() + 12, 0);
    EXPECT_EQ(stored, reference(bytes)) << sample.type;
  }
}

TEST(Codec, EveryTypeSurvivesEncodingAndDecoding) {
  for (const SampleMessage& sample : SampleMessages()) {
    const auto again = sample.recode(sample.bytes.data(), sample.bytes.size());
    ASSERT_TRUE(again) << sample.type << ": " << again.error().message;
    EXPECT_EQ(*again, sample.bytes) << sample.type;
    EXPECT_LE(sample.bytes.size(), kMaxPayloadBytes) << sample.type;
  }
}

TEST(Codec, AModuleGetsItsOwnReadingOfAPartAndAllOfTheOrders) {
  for (const SampleMessage& sample : SampleMessages()) {
    if (sample.type != std::string("sensors_t")) continue;
    morphbus::sensors_t all;
    ASSERT_TRUE(Decode(sample.bytes.data(), sample.bytes.size(), {}, &all));
    ASSERT_GT(all.modules.size(), 1U);
    ASSERT_GT(all.requests.size() + all.pieces.size() + all.root_poses.size(), 2U);
    ASSERT_FALSE(all.inspected.empty());
    // The whole message, one with the last order only, and one without orders.
    for (const int orders : {2, 1, 0}) {
      if (orders < 2) {
        all.requests.clear();
        all.pieces.clear();
        all.root_poses.clear();
        all.num_requests = all.num_pieces = all.num_root_poses = 0;
      }
      if (orders < 1) {
        all.inspected.clear();
        all.num_inspected = 0;
      }
      std::vector<uint8_t> bytes;
      Encode(all, &bytes);
      std::vector<std::pair<uint16_t, std::string>> names;
      PeekReadings(bytes.data(), [&](const PeekedReading& reading) {
        names.emplace_back(reading.module_id, reading.name);
      });
      ASSERT_EQ(names.size(), all.modules.size());
      // For each module, and for one that is not in it: as if the others were not there.
      morphbus::sensors_t own;
      for (size_t i = 0; i <= all.modules.size(); ++i) {
        const bool mine = i < all.modules.size();
        const auto id = static_cast<uint16_t>(mine ? all.modules[i].module_id : 999);
        if (mine) {
          EXPECT_EQ(names[i].first, id);
          EXPECT_EQ(names[i].second, all.modules[i].name);
        }
        ASSERT_TRUE(DecodeOwnSensors(bytes.data(), bytes.size(), {}, id, &own));
        morphbus::sensors_t expected = all;
        expected.modules.clear();
        if (mine) expected.modules.push_back(all.modules[i]);
        expected.num_modules = static_cast<int16_t>(expected.modules.size());
        std::vector<uint8_t> own_bytes, expected_bytes;
        own.header.crc32 = expected.header.crc32;
        Encode(own, &own_bytes);
        Encode(expected, &expected_bytes);
        EXPECT_EQ(own_bytes, expected_bytes);
      }
    }
  }
}

TEST(Codec, NoTypeIsTakenForAnother) {
  const std::vector<SampleMessage> samples = SampleMessages();
  for (const SampleMessage& message : samples) {
    for (const SampleMessage& reader : samples) {
      const bool taken = reader.recode(message.bytes.data(), message.bytes.size()).has_value();
      EXPECT_EQ(taken, message.type == reader.type) << message.type << " as " << reader.type;
    }
  }
}

TEST(Codec, EveryFlippedBitIsNoticed) {
  for (const SampleMessage& sample : SampleMessages()) {
    for (size_t i = 0; i < sample.bytes.size(); ++i) {
      for (int bit = 0; bit < 8; ++bit) {
        std::vector<uint8_t> bytes = sample.bytes;
        bytes[i] = static_cast<uint8_t>(bytes[i] ^ 1 << bit);
        EXPECT_FALSE(sample.recode(bytes.data(), bytes.size())) << sample.type << " byte " << i;
      }
    }
  }
}

TEST(Codec, EveryCutAndEveryExtraByteIsRefusedEvenWithAFittingCrc) {
  for (const SampleMessage& sample : SampleMessages()) {
    for (size_t size = 0; size <= sample.bytes.size() + 1; ++size) {
      if (size == sample.bytes.size()) continue;
      std::vector<uint8_t> bytes = sample.bytes;
      bytes.resize(size);
      Forge(&bytes);
      EXPECT_FALSE(sample.recode(bytes.data(), bytes.size())) << sample.type << " size " << size;
    }
  }
}

TEST(Codec, AForgedByteIsRefusedOrStillDecodesToTheSameBytes) {
  // Whatever is accepted must mean exactly its bytes: no length, text or flag is read leniently.
  for (const SampleMessage& sample : SampleMessages()) {
    for (size_t i = 0; i < sample.bytes.size(); ++i) {
      // What the bus has made sure of means nothing any more.
      if (i >= kAuthOffset && i < kContentOffset) continue;
      for (int value = 0; value < 256; ++value) {
        std::vector<uint8_t> bytes = sample.bytes;
        bytes[i] = static_cast<uint8_t>(value);
        Forge(&bytes);
        const auto again = sample.recode(bytes.data(), bytes.size());
        if (again) {
          ASSERT_EQ(*again, bytes) << sample.type << " byte " << i << " = " << value;
        }
      }
    }
  }
}

TEST(Codec, ForgedNoiseNeverCrashesOrGrowsMemory) {
  std::mt19937 random(1);
  for (const SampleMessage& sample : SampleMessages()) {
    for (int round = 0; round < 3000; ++round) {
      std::vector<uint8_t> bytes = sample.bytes;
      for (int k = 0; k < 6; ++k) {
        const size_t at = 24 + random() % (bytes.size() - 24);
        for (size_t i = at; i < std::min(bytes.size(), at + 4); ++i) {
          bytes[i] = static_cast<uint8_t>(random() % 3 == 0 ? 0xff : random());
        }
      }
      Forge(&bytes);
      const auto again = sample.recode(bytes.data(), bytes.size());
      if (again) {
        EXPECT_EQ(*again, bytes);
      }
    }
  }
}

TEST(Codec, ExpectationsAreChecked) {
  const SampleMessage sample = SampleMessages()[5];
  ASSERT_EQ(sample.type, "actuator_t");
  morphbus::actuator_t out;
  const auto decode = [&](uint64_t model, uint64_t program) {
    return Decode(sample.bytes.data(), sample.bytes.size(), {model, program}, &out).has_value();
  };
  const uint64_t model = 0x1122334455667788, program = ~model + 1;
  EXPECT_TRUE(decode(0, 0));
  EXPECT_TRUE(decode(model, program));
  EXPECT_FALSE(decode(model + 1, program));
  EXPECT_FALSE(decode(model, program + 1));
}

TEST(Codec, AnotherProtocolIsRefusedWithBothNumbers) {
  std::vector<uint8_t> bytes = SampleMessages()[0].bytes;
  bytes[23] = 3;
  Forge(&bytes);
  morphbus::transform_t out;
  const auto result = Decode(bytes.data(), bytes.size(), {}, &out);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().message, "the message speaks protocol 3, this build 2");
}

template <class M, class Change>
std::string WhyRefused(size_t sample, const Change& change) {
  const SampleMessage message = SampleMessages()[sample];
  M m;
  EXPECT_TRUE(Decode(message.bytes.data(), message.bytes.size(), {}, &m));
  change(&m);
  std::vector<uint8_t> bytes;
  Encode(m, &bytes);
  M out;
  const auto result = Decode(bytes.data(), bytes.size(), {}, &out);
  return result ? "" : result.error().message;
}

TEST(Codec, ImpossibleValuesAreRefusedByFieldAndPlace) {
  using morphbus::actuator_t, morphbus::health_t, morphbus::info_part_t, morphbus::sensors_t,
      morphbus::transform_t;
  const double nan = std::nan("");
  const auto infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(WhyRefused<sensors_t>(1, [](sensors_t*) {}), "");
  const auto expect = [](const std::string& why, const std::string& field_and_what) {
    EXPECT_EQ(why.substr(0, why.find(" (byte ")), field_and_what);
  };
  expect(WhyRefused<sensors_t>(1, [&](sensors_t* m) { m->modules[0].joint_position_si[1] = nan; }),
         "sensors_t.modules[0].joint_position_si[1] is not a finite number");
  expect(WhyRefused<sensors_t>(
             1, [&](sensors_t* m) { m->modules[1].joint_velocity_si[0] = infinity; }),
         "sensors_t.modules[1].joint_velocity_si[0] is not a finite number");
  expect(
      WhyRefused<sensors_t>(1, [&](sensors_t* m) { m->modules[1].joint_effort_si[1] = infinity; }),
      "sensors_t.modules[1].joint_effort_si[1] is not a finite number");
  expect(WhyRefused<actuator_t>(5, [&](actuator_t* m) { m->joints[0].target_si = nan; }),
         "actuator_t.joints[0].target_si is not a finite number");
  expect(WhyRefused<actuator_t>(5, [&](actuator_t* m) { m->joints[0].mode = 3; }),
         "actuator_t.joints[0].mode is out of range");
  expect(WhyRefused<transform_t>(
             0, [](transform_t* m) { m->docked[0].connector = vm::kMaxConnectors; }),
         "transform_t.docked[0].connector is out of range");
  expect(WhyRefused<transform_t>(0,
                                 [](transform_t* m) {
                                   for (float& q : m->link_poses[1].orientation_wxyz) q = 0;
                                 }),
         "transform_t.link_poses[1].orientation_wxyz is not of unit length");
  expect(WhyRefused<sensors_t>(1, [](sensors_t* m) { m->part = 2; }),
         "sensors_t.part is not below num_parts");
  expect(WhyRefused<transform_t>(0, [](transform_t* m) { m->fragments[0].offset = 257; }),
         "transform_t.fragments[0].offset puts the piece beyond the package's end");
  expect(WhyRefused<transform_t>(0,
                                 [](transform_t* m) {
                                   m->fragments[0].bytes.clear();
                                   m->fragments[0].size = 0;
                                 }),
         "transform_t.fragments[0].size is out of range");
  expect(WhyRefused<health_t>(8, [](health_t* m) { m->lateness[0].late = 6; }),
         "health_t.lateness[0].late is above missed");
  expect(WhyRefused<info_part_t>(10, [](info_part_t* m) { --m->total_bytes; }),
         "info_part_t.size is above total_bytes");
  expect(WhyRefused<transform_t>(0,
                                 [](transform_t* m) {
                                   m->body_entries.resize(49);
                                   m->num_body_entries = 49;
                                 }),
         "transform_t.num_body_entries is out of range");
  expect(WhyRefused<sensors_t>(1, [](sensors_t* m) { m->header.tick = -1; }),
         "sensors_t.header.tick is out of range");
  // The place: fingerprint (8 bytes) and header (56), and nothing before the field.
  EXPECT_EQ(WhyRefused<transform_t>(0, [](transform_t* m) { m->module_id = -1; }),
            "transform_t.module_id is out of range (byte 64)");
}

TEST(Codec, FieldsStandWhereTheLayoutSays) {
  // By these two the kernel tells what a module need not be woken for.
  for (const int8_t phase : {int8_t{0}, int8_t{1}, int8_t{2}}) {
    morphbus::sim_clock_t clock = {};
    clock.phase = phase;
    std::vector<uint8_t> bytes;
    Encode(clock, &bytes);
    EXPECT_EQ(bytes[OffsetOf<morphbus::sim_clock_t>("phase")], phase);
  }
  for (const int16_t part : {int16_t{0}, int16_t{1}, int16_t{0x0203}}) {
    morphbus::sensors_t sensors = {};
    sensors.part = part;
    sensors.num_parts = 0x0204;
    std::vector<uint8_t> bytes;
    Encode(sensors, &bytes);
    EXPECT_EQ(PeekInteger<int16_t>(&bytes[OffsetOf<morphbus::sensors_t>("part")]), part);
  }
}

TEST(Codec, SizesOfTheLayoutAreThoseOfTheEncoder) {
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

TEST(Codec, ATextWithANulInsideIsRefused) {
  SampleMessage sample = SampleMessages()[1];
  ASSERT_EQ(sample.type, "sensors_t");
  const std::string name("m1", 3);
  const auto at = std::search(sample.bytes.begin(), sample.bytes.end(), name.begin(), name.end());
  ASSERT_NE(at, sample.bytes.end());
  *at = 0;
  Forge(&sample.bytes);
  const auto result = sample.recode(sample.bytes.data(), sample.bytes.size());
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message.find(".name does not end with its only NUL"), std::string::npos);
}

TEST(Codec, MessagesOverADatagramAreRefused) {
  morphbus::sensors_t sensors;
  sensors.header.protocol = morphbus::header_t::PROTOCOL;
  sensors.header.tick = sensors.header.sim_time_us = sensors.header.sequence = 0;
  sensors.part = 0;
  sensors.num_parts = 1;
  sensors.num_requests = sensors.num_pieces = sensors.num_root_poses = sensors.num_inspected = 0;
  morphbus::module_sensors_t reading;
  reading.module_id = 0;
  reading.name = "m";
  reading.num_joints = reading.num_sensor_values = reading.num_docked = 0;
  sensors.modules.assign(200, reading);
  sensors.num_modules = 200;
  std::vector<uint8_t> bytes;
  Encode(sensors, &bytes);
  ASSERT_GT(bytes.size(), kMaxPayloadBytes);
  EXPECT_FALSE(Decode(bytes.data(), bytes.size(), {}, &sensors));
}

TEST(Info, PartsComeTogetherInAnyOrder) {
  std::string description;
  for (int i = 0; i < 10000; ++i) description += static_cast<char>(i * 7);
  for (const std::string& text : {description, std::string(), std::string("x")}) {
    std::vector<morphbus::info_part_t> parts = SplitInfo(text);
    InfoAssembler assembler;
    std::optional<std::string> whole;
    for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
      EXPECT_LE(static_cast<size_t>(part->getEncodedSize()), kMaxPayloadBytes);
      EXPECT_FALSE(whole.has_value());
      if (part != parts.rbegin()) {
        EXPECT_FALSE(assembler.Take(parts.back())) << "repeats do no harm";
      }
      whole = assembler.Take(*part);
    }
    ASSERT_TRUE(whole.has_value());
    EXPECT_EQ(*whole, text);
  }
}

TEST(Info, ALaterDescriptionOfTheSameSizeReplacesTheFormerOne) {
  const std::string first(10000, 'a');
  std::string second = first;
  // Both are alike but for a part in their middle.
  second[5000] = 'b';
  InfoAssembler assembler;
  const auto take_all = [&](const std::string& text) {
    std::optional<std::string> whole;
    for (const morphbus::info_part_t& part : SplitInfo(text)) {
      if (std::optional<std::string> told = assembler.Take(part)) whole = told;
    }
    return whole;
  };
  EXPECT_EQ(take_all(first), first);
  EXPECT_EQ(take_all(first), std::nullopt);
  EXPECT_EQ(take_all(second), second);
  EXPECT_EQ(take_all(first), first);
}

TEST(ArithmeticHash, IsThatOfEveryMachine) {
  EXPECT_EQ(HexText(ArithmeticHash()), "17830331269ab023");
}

TEST(ArithmeticHash, TellsAnotherRounding) {
  std::fesetround(FE_UPWARD);
  const uint64_t upward = EvaluateArithmetic();
  std::fesetround(FE_TONEAREST);
  EXPECT_NE(upward, ArithmeticHash());
  EXPECT_EQ(EvaluateArithmetic(), ArithmeticHash());
}

TEST(WireHash, IsThatOfTheTypes) {
  EXPECT_NE(WireHash(), 0u);
  EXPECT_EQ(WireHash(), WireHash());
}

}  // namespace
}  // namespace morphbus::bridge
