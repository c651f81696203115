// What a module holds, on its way through STATUS (bridge/wire/held_state.h).

#include "bridge/wire/held_state.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "bridge/wire/codec.h"
#include "bridge/wire/status_codec.h"
#include "bridge/wire/wire_limits.h"
#include "vm/image/image.h"
#include "vm/limits.h"

namespace morphbus::bridge {
namespace {

/// A report and names for it: as long as they may be, or short ones.
vm::StatusReport Report(bool longest) {
  vm::StatusReport report{};
  report.role = 1;
  report.num_labels = longest ? vm::kMaxLabels : 2;
  report.num_tasks = 1;
  return report;
}
StatusNames Names(bool longest) {
  const std::string name(longest ? 300 : 5, 'n');
  StatusNames names;
  names.type_name = names.role_name = name;
  names.label_names.assign(vm::kMaxLabels, name);
  names.label_is_joint.assign(vm::kMaxLabels, true);
  names.task_functions = {name};
  return names;
}

/// A state of so many fields and tasks, all things with different names of this length.
HeldState StateOf(int fields, int tasks, int calls, int locals, size_t length) {
  int number = 0;
  const auto name = [&] {
    std::string text = std::to_string(++number);
    return text + std::string(length - std::min(length, text.size()), '_');
  };
  HeldState held;
  for (int f = 0; f < fields; ++f) held.fields.push_back({name(), "direction", name()});
  for (int t = 0; t < tasks; ++t) {
    HeldTask& task = held.tasks.emplace_back();
    task.kind = vm::TaskKind::kHandler;
    task.routine = name();
    task.wait = t % 2 == 0 ? vm::WaitKind::kSleep : vm::WaitKind::kMotion;
    task.until_us = t % 2 == 0 ? 1000000 * (t + 1) : 0;
    task.joint = t % 2 == 0 ? "" : name();
    for (int c = 0; c < calls; ++c) {
      HeldCall& call = task.calls.emplace_back(HeldCall{name(), 10 * t + c, {}});
      for (int v = 0; v < locals; ++v) call.locals.push_back({name(), "float", name()});
    }
  }
  return held;
}

/// The parts of what the messages carry, each of which has gone over the wire.
std::vector<morphbus::inspection_t> Parts(const std::vector<morphbus::status_t>& messages) {
  std::vector<morphbus::inspection_t> parts;
  for (const morphbus::status_t& message : messages) {
    std::vector<uint8_t> bytes;
    morphbus::status_t sent = message;
    sent.header = {};
    sent.header.protocol = morphbus::header_t::PROTOCOL;
    Encode(sent, &bytes);
    EXPECT_LE(bytes.size(), kMaxPayloadBytes);
    morphbus::status_t heard;
    const Result<void> decoded = Decode(bytes.data(), bytes.size(), {}, &heard);
    EXPECT_TRUE(decoded) << (decoded ? "" : decoded.error().message);
    parts.insert(parts.end(), heard.inspections.begin(), heard.inspections.end());
  }
  return parts;
}

/// All that a state says, in order; texts cut to `most` bytes.
std::vector<std::string> TextsOf(const HeldState& held, size_t most) {
  std::vector<std::string> texts;
  const auto add = [&](const std::string& text) { texts.push_back(text.substr(0, most)); };
  const auto add_value = [&](const HeldValue& value) {
    add(value.name);
    add(value.type);
    add(value.value);
  };
  for (const HeldValue& field : held.fields) add_value(field);
  for (const HeldTask& task : held.tasks) {
    add(std::to_string(static_cast<int>(task.kind)) + std::to_string(static_cast<int>(task.wait)) +
        " " + std::to_string(task.until_us));
    add(task.routine);
    add(task.joint);
    for (const HeldCall& call : task.calls) {
      add(call.function);
      add(std::to_string(call.line));
      for (const HeldValue& local : call.locals) add_value(local);
    }
  }
  return texts;
}

std::vector<morphbus::status_t> Told(const HeldState& held, bool longest) {
  return ToStatus(Report(longest), Names(longest), 3, 1, vm::kMaxJoints, &held);
}

TEST(HeldStateTest, WhatIsSmallFitsIntoOneStatus) {
  const HeldState held = StateOf(3, 2, 1, 2, 10);
  const std::vector<morphbus::status_t> messages = Told(held, false);
  ASSERT_EQ(messages.size(), 1U);
  EXPECT_EQ(messages.front().num_tasks, 1) << "besides what a STATUS says anyway";
  const Result<HeldState> again = JoinHeld(Parts(messages));
  ASSERT_TRUE(again);
  EXPECT_EQ(TextsOf(*again, 1000), TextsOf(held, 1000));
}

TEST(HeldStateTest, TheLargestStateComesInPartsThatFitAndAreJoinedAgain) {
  const HeldState held =
      StateOf(vm::kMaxFields, vm::kMaxTasks, vm::kMaxCallDepth, vm::image::kMaxLocals, 40);
  const std::vector<morphbus::status_t> messages = Told(held, false);
  EXPECT_GT(messages.size(), 10U);
  const Result<HeldState> again = JoinHeld(Parts(messages));
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(TextsOf(*again, 1000), TextsOf(held, 1000));
}

TEST(HeldStateTest, BesideTheLongestLabelsThereIsRoomForTheLongestNames) {
  const HeldState held =
      StateOf(vm::kMaxFields, vm::kMaxTasks, vm::kMaxCallDepth, vm::image::kMaxLocals, 300);
  const Result<HeldState> again = JoinHeld(Parts(Told(held, true)));
  ASSERT_TRUE(again) << again.error().message;
  // Cut, but never below 24 bytes.
  EXPECT_EQ(TextsOf(*again, 24), TextsOf(held, 24));
}

TEST(HeldStateTest, TasksWithoutCallsAndCallsWithoutLocalsAreTold) {
  for (const HeldState& held : {StateOf(0, 3, 0, 0, 8), StateOf(0, 2, 2, 0, 8), HeldState()}) {
    const Result<HeldState> again = JoinHeld(Parts(Told(held, false)));
    ASSERT_TRUE(again);
    EXPECT_EQ(TextsOf(*again, 1000), TextsOf(held, 1000));
  }
}

TEST(HeldStateTest, BehindFaultsAndPrintsItHasMessagesOfItsOwn) {
  vm::StatusReport report = Report(false);
  report.num_faults = vm::kMaxFaultsPerTick;
  report.num_prints = vm::kMaxPrintsPerTick;
  const HeldState held = StateOf(2, 1, 1, 1, 10);
  const std::vector<morphbus::status_t> messages = ToStatus(report, Names(false), 3, 1, 2, &held);
  EXPECT_EQ(Parts(messages).size(), 1U);
  EXPECT_EQ(messages.back().num_inspections, 1);
  EXPECT_EQ(messages.back().num_faults + messages.back().num_prints, 0);
}

TEST(HeldStateTest, NobodyIsToldWhoHasNotAsked) {
  EXPECT_TRUE(Parts(ToStatus(Report(false), Names(false), 3, 1, 2)).empty());
}

TEST(HeldStateTest, AMissingPartIsNoticed) {
  const std::vector<morphbus::inspection_t> all = Parts(Told(StateOf(4, 12, 6, 16, 40), false));
  ASSERT_GT(all.size(), 2U);
  EXPECT_FALSE(JoinHeld({}));
  for (size_t i = 0; i < all.size(); ++i) {
    std::vector<morphbus::inspection_t> some = all;
    some.erase(some.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_FALSE(JoinHeld(some)) << "without part " << i;
    for (size_t p = 0; p < some.size(); ++p) {
      some[p].part = static_cast<int16_t>(p);
      some[p].num_parts = static_cast<int16_t>(some.size());
    }
    // Even if the numbers say otherwise nothing is read beyond what is there.
    (void)JoinHeld(some);
  }
}

}  // namespace
}  // namespace morphbus::bridge
