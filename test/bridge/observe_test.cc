// How listeners read a run: what is told of its messages, and that each is told once.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bridge/description/program_words.h"
#include "bridge/observe/description_finder.h"
#include "bridge/observe/gap_counter.h"
#include "bridge/observe/run_clock.h"
#include "bridge/observe/run_listener.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "compiler/dynarole/parameters.h"
#include "test/support/compiled.h"
#include "test/support/synthetic_log.h"
#include "test/support/toy_model.h"
#include "vm/image/image.h"
#include "vm/image/verifier.h"

namespace morphbus::bridge {
namespace {

using test::SyntheticEvent;

const std::vector<std::string> kModules = {"m1", "m2", "m3"};

/// The messages of a made-up run of so many ticks.
std::vector<SyntheticEvent> Events(int ticks) {
  test::SyntheticOptions options;
  options.ticks = ticks;
  return test::SyntheticEvents(options);
}

/// Counts what it is told, and compares single fields with what decoders say.
class Counter : public RunMessageHandler {
 public:
  bool Decodes(const RunMessage& message) override { return !skipped.contains(message.name.topic); }
  void OnChecked(const RunMessage& message) override { ++checked[message.name.topic]; }
  void OnRepeat(const RunMessage& /*message*/) override { ++repeats; }
  void OnClock(const RunMessage& message, morphbus::sim_clock_t&& clock) override {
    ++decoded[message.name.topic];
    EXPECT_EQ(PartOf(message).count, 1);
    ticks.push_back(clock.header.tick);
  }
  void OnSensors(const RunMessage& message, morphbus::sensors_t&& sensors) override {
    ++decoded[message.name.topic];
    EXPECT_EQ(PartOf(message).part, sensors.part);
    EXPECT_EQ(PartOf(message).count, sensors.num_parts);
  }
  void OnWorld(const RunMessage& message, morphbus::world_t&& world) override {
    ++decoded[message.name.topic];
    EXPECT_EQ(PartOf(message).part, world.part);
    EXPECT_EQ(PartOf(message).count, world.num_parts);
  }
  void OnTransform(const RunMessage& message, morphbus::transform_t&& transform) override {
    ++decoded[message.name.topic];
    EXPECT_EQ(message.name.process, kModules.at(static_cast<size_t>(message.module)));
    EXPECT_EQ(RoleAndPoseOf(message).role, transform.role);
    EXPECT_EQ(RoleAndPoseOf(message).has_pose, transform.has_pose != 0);
    EXPECT_EQ(RoleAndPoseOf(message).pose_stale, transform.pose_stale != 0);
    EXPECT_EQ(LinkPosesOf(message).size(), transform.link_poses.size());
  }
  void OnActuator(const RunMessage& message, morphbus::actuator_t&& actuator) override {
    ++decoded[message.name.topic];
    EXPECT_EQ(StatusCountOf(message), actuator.status_count);
  }
  void OnStatus(const RunMessage& message, morphbus::status_t&& /*status*/) override {
    ++decoded[message.name.topic];
    EXPECT_EQ(PartOf(message).count, 0);
  }

  std::set<Topic> skipped;
  std::map<Topic, int> decoded, checked;
  std::vector<int64_t> ticks;
  int repeats = 0;
};

RunListener::Kind Give(const SyntheticEvent& event, RunListener* listener, Counter* counter) {
  return listener->Take(event.channel, event.payload.data(), event.payload.size(), counter);
}

/// The same event with a damaged byte in its middle.
SyntheticEvent Damaged(SyntheticEvent event) {
  event.payload[event.payload.size() / 2] ^= 1;
  return event;
}

TEST(RunListenerTest, EachMessageIsToldOnceAndRepeatsAndOlderOnesAreNot) {
  RunListener listener("synth", 0, kModules);
  Counter counter;
  int numbered = 0;
  for (const SyntheticEvent& event : Events(20)) {
    EXPECT_EQ(Give(event, &listener, &counter), RunListener::Kind::kNew) << event.channel;
    EXPECT_EQ(Give(event, &listener, &counter), RunListener::Kind::kRepeat) << event.channel;
    ++numbered;
  }
  EXPECT_EQ(counter.repeats, numbered);
  // Every tick has a CLOCK, and the one after the last as well.
  EXPECT_EQ(counter.decoded[Topic::kClock], 21);
  EXPECT_EQ(counter.decoded[Topic::kTransform], 20 * 3);
  EXPECT_EQ(counter.decoded[Topic::kActuator], 20 * 3);
  EXPECT_TRUE(std::is_sorted(counter.ticks.begin(), counter.ticks.end()));
}

TEST(RunListenerTest, ADamagedMessageTakesNoNumberAway) {
  RunListener listener("synth", 0, kModules);
  Counter counter;
  for (const SyntheticEvent& event : Events(5)) {
    EXPECT_EQ(Give(Damaged(event), &listener, &counter), RunListener::Kind::kBad);
    EXPECT_EQ(Give(event, &listener, &counter), RunListener::Kind::kNew) << event.channel;
  }
}

TEST(RunListenerTest, OtherRunsModelsModulesAndTimesAreLeftOut) {
  const std::vector<SyntheticEvent> events = Events(100);
  Counter counter;
  RunListener of_other("walk", 0, kModules), of_model("synth", 4711, kModules),
      of_one("synth", 0, {"m1"}), late("synth", 0, kModules);
  bool began = false;
  for (const SyntheticEvent& event : events) {
    EXPECT_EQ(Give(event, &of_other, &counter), RunListener::Kind::kOther);
    EXPECT_EQ(Give(event, &of_model, &counter), RunListener::Kind::kBad);
    const ChannelName name = *ParseChannel(event.channel);
    if (name.process == "m2" || name.process == "m3") {
      EXPECT_EQ(Give(event, &of_one, &counter), RunListener::Kind::kOther);
    }
    // Who has heard the first tick only believes nothing of a tick so far ahead.
    const RunMessage message =
        *OpenMessage(event.channel, event.payload.data(), event.payload.size());
    if (name.topic == Topic::kClock && !std::exchange(began, true)) {
      EXPECT_EQ(Give(event, &late, &counter), RunListener::Kind::kNew);
    } else if (name.topic == Topic::kWorld && message.header.tick > 64) {
      EXPECT_EQ(Give(event, &late, &counter), RunListener::Kind::kBad);
    }
  }
  EXPECT_TRUE(counter.decoded[Topic::kWorld] == 0);
}

TEST(RunMessageTest, WhatIsNotDecodedIsCheckedAllTheSame) {
  Counter counter;
  counter.skipped = {Topic::kTransform};
  int transforms = 0;
  for (SyntheticEvent event : Events(5)) {
    const auto message = OpenMessage(event.channel, event.payload.data(), event.payload.size());
    ASSERT_TRUE(message.has_value());
    EXPECT_TRUE(ReadMessage(*message, &counter).has_value());
    if (message->name.topic != Topic::kTransform) continue;
    ++transforms;
    // A message of another type on this channel is refused, and says nothing.
    const std::string channel = Channel("synth", "m1", Topic::kActuator);
    const auto other = OpenMessage(channel, event.payload.data(), event.payload.size());
    EXPECT_FALSE(ReadMessage(*other, &counter).has_value());
    EXPECT_FALSE(DecodeAs<morphbus::actuator_t>(*other).has_value());
    EXPECT_TRUE(DecodeAs<morphbus::transform_t>(*message).has_value());
  }
  EXPECT_EQ(counter.checked[Topic::kTransform], transforms);
  EXPECT_EQ(counter.decoded[Topic::kTransform], 0);
}

TEST(DescriptionFinderTest, PutsTheDescriptionTogetherInAnyOrder) {
  std::vector<SyntheticEvent> events = Events(1);
  std::reverse(events.begin(), events.end());
  DescriptionFinder any(""), right("synth"), wrong("walk");
  std::optional<std::string> found, named;
  for (const SyntheticEvent& event : events) {
    const uint8_t* data = event.payload.data();
    if (auto whole = any.Take(event.channel, data, event.payload.size())) found = whole;
    if (auto whole = right.Take(event.channel, data, event.payload.size())) named = whole;
    EXPECT_FALSE(wrong.Take(event.channel, data, event.payload.size()).has_value());
  }
  const std::string description = test::SyntheticDescription("one", "synth");
  EXPECT_TRUE(found == description && named == description);
}

TEST(RunClockTest, CommandsHoldTheRunSetItsSpeedAndLoseModules) {
  RunClock clock;
  EXPECT_EQ(clock.tick(), -1);
  const auto take = [&clock](int64_t tick, const std::vector<std::string>& controls) {
    morphbus::sim_clock_t message = {};
    message.header.tick = tick;
    message.header.sim_time_us = 20'000 * tick;
    message.tick_us = 20'000;
    message.controls = controls;
    clock.Take(message);
  };
  take(1, {"pause"});
  EXPECT_TRUE(clock.paused());
  EXPECT_FALSE(clock.speed().has_value());
  take(2, {"resume", "speed 2", "lose m3", "a command of a later version"});
  EXPECT_FALSE(clock.paused());
  EXPECT_EQ(clock.speed(), 2.0);
  EXPECT_TRUE(clock.lost().contains("m3"));
  // A run that makes steps holds again when they are done, whoever held it before.
  take(3, {"step 2"});
  EXPECT_TRUE(clock.paused());
  EXPECT_EQ(clock.time_us(), 60'000);
  EXPECT_FALSE(clock.ended());
}

TEST(RunClockTest, APushLastsAsLongAsItWasAskedFor) {
  RunClock clock;
  const auto take = [&clock](int64_t tick, const std::vector<std::string>& controls) {
    morphbus::sim_clock_t message = {};
    message.header.tick = tick;
    message.header.sim_time_us = 20'000 * tick;
    message.tick_us = 20'000;
    message.controls = controls;
    clock.Take(message);
    return clock.pushes().size();
  };
  // Along a vector of any length; without a time it lasts one tick.
  EXPECT_EQ(take(5, {"push m5.active_block 0,3,4 10 0.06", "push m1 WEST 2"}), 2U);
  EXPECT_EQ(clock.pushes()[0].module, "m5");
  EXPECT_EQ(clock.pushes()[0].link, "active_block");
  EXPECT_NEAR(clock.pushes()[0].force_W[1], 6.0, 1e-12);
  EXPECT_NEAR(clock.pushes()[0].force_W[2], 8.0, 1e-12);
  EXPECT_NEAR(clock.pushes()[1].force_W[2], -2.0, 1e-12);
  EXPECT_EQ(take(6, {}), 1U);
  EXPECT_EQ(take(7, {}), 1U);
  EXPECT_EQ(take(8, {}), 0U);
}

TEST(RunClockTest, ARunWhoseClockComesAgainHoldsStill) {
  RunClock clock;
  morphbus::sim_clock_t tick{};
  tick.header.tick = 7;
  clock.Take(tick);
  clock.Repeat();
  EXPECT_FALSE(clock.paused()) << "the bus may have doubled it";
  clock.Repeat();
  EXPECT_TRUE(clock.paused());
  tick.header.tick = 8;
  clock.Take(tick);
  EXPECT_FALSE(clock.paused());
  tick.header.tick = 9;
  tick.phase = morphbus::sim_clock_t::PHASE_END;
  clock.Take(tick);
  clock.Repeat();
  clock.Repeat();
  EXPECT_FALSE(clock.paused()) << "it has ended";
}

TEST(ProgramWordsTest, TheRunsOwnProgramHasItsFileAlsoWithoutItsImage) {
  const auto run = std::make_shared<RunModel>();
  run->program_hash = 7;
  run->program_file = "models/walk.dyn";
  ProgramWords words(run);
  vm::Fault fault{};
  fault.function = 3;
  fault.line = 12;
  EXPECT_EQ(words.Fault(7, "Seg", fault).place.file, "models/walk.dyn");
  EXPECT_EQ(words.Fault(7, "Seg", fault).function, "function 3");
  EXPECT_EQ(words.Fault(8, "Seg", fault).place.file, "");
  // Nor has a program that was deployed a name if its image is damaged.
  words.deployed()[8] = "damaged";
  EXPECT_EQ(words.Fault(8, "Seg", fault).place.file, "");
  vm::PrintReport print{};
  print.text = 3;
  EXPECT_EQ(words.Print(8, "Seg", print).text, "text 3 of a program that is not known here");
}

TEST(ProgramWordsTest, TheRunsOwnProgramIsItsOwnWhateverIsSet) {
  // What a run began with, and what a set made of it, have one source.
  const std::vector<uint8_t> source = test::ProgramFrom(
      "param n = 1 in [0, 9]; role A extends Module { behavior b() { self.sleepcs(n); } }",
      test::ToyModel());
  const auto with = [&source](const char* value) {
    vm::VerifiedProgram program;
    vm::Verifier::Verify(source.data(), static_cast<uint32_t>(source.size()), &program);
    return dynarole::WithParameter(program, "n", value).value_or("");
  };
  const auto run = std::make_shared<RunModel>();
  const std::string began = with("5"), later = with("7");
  ASSERT_TRUE(run->images.AddProgram("program", {began.begin(), began.end()}));
  run->has_program = true;
  run->program_hash = run->images.program().hash();
  run->program_file = "models/walk.dyn";
  ProgramWords words(run);
  const auto hash_of = [](const auto& image) {
    return vm::image::ReadU64(reinterpret_cast<const uint8_t*>(image.data()) + vm::image::kHashAt);
  };
  words.deployed()[hash_of(later)] = later;
  EXPECT_EQ(words.Fault(hash_of(later), "Seg", {}).place.file, "models/walk.dyn");
  for (const uint64_t hash : {run->program_hash, hash_of(later)}) {
    EXPECT_EQ(words.SourceHash(hash), hash_of(source));
  }
  EXPECT_EQ(words.SourceHash(8), 8u) << "of a program that is not known its own";
}

TEST(GapCounterTest, CountsWhatIsMissingAsASetOfNumbersDoes) {
  // Numbers with losses, repetitions and late ones; the other way keeps all of them.
  std::mt19937 random(3);
  GapCounter gaps;
  std::set<int64_t> had;
  int64_t next = 100;
  std::vector<int64_t> held;
  const auto take = [&](int64_t number) {
    EXPECT_EQ(gaps.Take(number), had.insert(number).second);
  };
  take(next++);
  for (int i = 0; i < 20'000; ++i) {
    const unsigned dice = random() % 10;
    if (dice == 0) {
      ++next;
    } else if (dice == 1) {
      held.push_back(next++);
    } else if (dice == 2 && !held.empty()) {
      take(held.back());
      held.pop_back();
    } else if (dice == 3) {
      take(next - 1 > 100 && had.contains(next - 1) ? next - 1 : next++);
    } else {
      take(next++);
    }
    if (held.size() > 5) held.erase(held.begin());
  }
  const int64_t expected = *had.rbegin() - 100 + 1 - static_cast<int64_t>(had.size());
  EXPECT_EQ(gaps.lost(), expected);
}

TEST(GapCounterTest, ASenderThatBeginsAnewIsFollowed) {
  GapCounter gaps;
  for (int64_t i = 50'000; i < 50'010; ++i) gaps.Take(i);
  for (int64_t i = 0; i < 100; ++i) gaps.Take(i);
  EXPECT_EQ(gaps.lost(), 0);
  // Or with numbers far above, as the run's processes do.
  GapCounter above;
  for (const int64_t begin : {int64_t{7}, int64_t{1} << 32, int64_t{3} << 48}) {
    for (int64_t i = 0; i < 100; ++i) EXPECT_TRUE(above.Take(begin + i));
    EXPECT_FALSE(above.Take(begin));
  }
  EXPECT_EQ(above.lost(), 0);
  gaps.Take(102);
  EXPECT_EQ(gaps.lost(), 2);
}

TEST(GapCounterTest, NumbersThatNobodyCountsToDoNoHarm) {
  GapCounter gaps;
  const int64_t most = std::numeric_limits<int64_t>::max();
  gaps.Take(0);
  for (const int64_t number : {most, most - 1, int64_t{-1}, std::numeric_limits<int64_t>::min()}) {
    gaps.Take(number);
  }
  EXPECT_EQ(gaps.lost(), 0) << "no sender has come so far";
}

}  // namespace
}  // namespace morphbus::bridge
