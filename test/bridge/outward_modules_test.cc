// What modules say of themselves, as it leaves the bus: roles, faults, prints.

#include <gtest/gtest.h>

#include <map>
#include <optional>

#include "test/bridge/outward_collector.h"

namespace morphbus::bridge {
namespace {

TEST(OutwardModules, RolesLabelsAndSignsAreThoseOfStatus) {
  std::map<std::string, morphbus::status_t> last;
  test::SyntheticOptions options;
  options.on_status = [&](const std::string& module, morphbus::status_t* message) {
    last[module] = *message;
  };
  const auto modules = Convert(options).Of<morphbus::Modules>(OutwardTopic::kModules);
  ASSERT_FALSE(modules.empty());
  // It is sent when something changes, and not in every tick.
  EXPECT_LT(modules.size(), 5u);
  const auto run = Model(options);
  for (const morphbus::ModuleState& state : modules.back().modules()) {
    const morphbus::status_t& status = last[state.module()];
    const model::ModuleType& type = run->TypeOf(run->robot->FindModule(state.module()).value());
    EXPECT_EQ(state.role(), status.role_name);
    // The description has no program, so that a role's name alone decides.
    EXPECT_EQ(state.color(), CssColor(RoleColors().Of(status.role_name)));
    ASSERT_EQ(state.labels_size(), static_cast<int>(status.labels.size()));
    for (int i = 0; i < state.labels_size(); ++i) {
      const morphbus::label_t& label = status.labels[i];
      EXPECT_EQ(state.labels(i).name(), label.name);
      if (label.kind == morphbus::label_t::KIND_JOINT) {
        EXPECT_EQ(state.labels(i).joint(), type.joints[label.index].name);
      } else {
        EXPECT_EQ(state.labels(i).link(), type.links[label.index].name);
      }
    }
    for (const morphbus::JointSign& sign : state.signs()) {
      EXPECT_EQ(sign.sign(), status.joint_sign[type.FindJoint(sign.joint()).value()]);
    }
  }
}

TEST(OutwardModules, AFaultComesWithItsSourceLine) {
  test::SyntheticOptions options;
  options.on_status = [](const std::string& module, morphbus::status_t* status) {
    if (module != "m2" || status->header.tick != 0) return;
    morphbus::fault_t fault = {};
    fault.code = 1;
    fault.role = fault.rival_role = fault.function_index = fault.keyword = -1;
    fault.ended_task = fault.task_function = -1;
    fault.joint = fault.link = fault.connector = -1;
    fault.line = 2;
    status->num_faults = 1;
    status->faults = {fault};
  };
  const Collector collector = Convert(options, [](uint64_t, const std::string&) {
    return SourceTexts{"first\nsecond\nthird\n", {}};
  });
  const auto faults = collector.Of<morphbus::Fault>(OutwardTopic::kFaults);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].module(), "m2");
  EXPECT_EQ(faults[0].line(), 2u);
  EXPECT_EQ(faults[0].source_line(), "second");
  EXPECT_FALSE(faults[0].text().empty());
  const auto lines = collector.Of<foxglove::Log>(OutwardTopic::kLog);
  ASSERT_FALSE(lines.empty());
  EXPECT_EQ(lines[0].level(), foxglove::Log::ERROR);
  EXPECT_EQ(lines[0].message(), faults[0].text());
}

TEST(OutwardModules, WhatAProgramPrintsComesWithItsPlace) {
  test::SyntheticOptions options;
  options.on_status = [](const std::string& module, morphbus::status_t* status) {
    if (module != "m2" || status->header.tick != 0) return;
    morphbus::print_t print = {};
    print.text = 3;
    print.line = 7;
    status->num_prints = 1;
    status->prints = {print};
  };
  const Collector collector = Convert(options);
  const auto prints = collector.Of<morphbus::Print>(OutwardTopic::kPrints);
  ASSERT_EQ(prints.size(), 1u);
  EXPECT_EQ(prints[0].module(), "m2");
  EXPECT_EQ(prints[0].line(), 7u);
  // The made-up run has no program that could tell the text of this number.
  EXPECT_EQ(prints[0].text(), "text 3 of a program that is not known here");
  const auto lines = collector.Of<foxglove::Log>(OutwardTopic::kLog);
  ASSERT_FALSE(lines.empty());
  EXPECT_EQ(lines[0].level(), foxglove::Log::INFO);
  EXPECT_EQ(lines[0].name(), "m2");
  EXPECT_EQ(lines[0].message(), prints[0].text());
  EXPECT_EQ(lines[0].line(), 7u);
}

TEST(OutwardModules, AStatusThatComesLateIsToldWhileTheRunHoldsStill) {
  const test::SyntheticOptions options;
  Collector collector;
  Converter converter(Model(options), "src", nullptr);
  const auto take = [&](const test::SyntheticEvent& event) {
    converter.Take(event.channel, event.payload.data(), event.payload.size(), collector.sink());
  };
  // The run holds at its first tick: all that its processes say of it comes, STATUS last.
  std::vector<test::SyntheticEvent> statuses;
  std::optional<test::SyntheticEvent> clock;
  for (const test::SyntheticEvent& event : test::SyntheticEvents(options)) {
    if (event.channel.ends_with("/CLOCK")) {
      if (clock) break;
      clock = event;
    }
    if (event.channel.ends_with("/STATUS")) {
      statuses.push_back(event);
    } else {
      take(event);
    }
  }
  ASSERT_TRUE(clock);
  ASSERT_FALSE(statuses.empty());
  for (const test::SyntheticEvent& event : statuses) take(event);
  // The sim repeats its CLOCK, byte for byte; the second time there is nothing new.
  take(*clock);
  EXPECT_FALSE(converter.paused());
  take(*clock);
  EXPECT_TRUE(converter.paused()) << "who came later did not hear the command";
  EXPECT_EQ(collector.Of<morphbus::Clock>(OutwardTopic::kClock).size(), 1U);
  const auto modules = collector.Of<morphbus::Modules>(OutwardTopic::kModules);
  ASSERT_EQ(modules.size(), 1U);
  for (const morphbus::ModuleState& state : modules[0].modules()) {
    EXPECT_EQ(state.incarnation(), 1U) << state.module();
  }
}

}  // namespace
}  // namespace morphbus::bridge
