// What a module's participant is made of: what it takes from its neighbours, from SENSORS and from
// what its predecessor saved.

#include <gtest/gtest.h>

#include <morphbus/sim_clock_t.hpp>
#include <morphbus/transform_t.hpp>

#include "bridge/bus/inproc_bus.h"
#include "bridge/lockstep/module/module_lockstep.h"
#include "bridge/lockstep/module/module_snapshot.h"
#include "bridge/lockstep/module/neighbour_mail.h"
#include "bridge/lockstep/module/tick_inputs.h"
#include "bridge/wire/vm_codec.h"
#include "test/bridge/fake_run.h"

namespace morphbus::bridge {
namespace {

using Taken = ModuleLockstep::Taken;

/// A machine that computes tick 1 next, in which module 7 is mated.
ModuleLockstep AtTickOne(bool realtime) {
  ModuleLockstep machine({realtime, {}});
  ModuleLockstep::Actions out;
  machine.Begin(0, 0, &out);
  EXPECT_EQ(machine.OnSensors(0, 0, 1, true, {7}, 0, &out), Taken::kFresh);
  return machine;
}

TEST(ModuleLockstep, KeepsAloneWhichTicksOfANeighbourAreThere) {
  ModuleLockstep machine = AtTickOne(false);
  ModuleLockstep::Actions out;
  EXPECT_EQ(machine.NewestOf(7), -1);
  EXPECT_EQ(machine.OnTransform(7, 0, 0, 0, &out), Taken::kFresh);
  EXPECT_EQ(machine.OnTransform(7, 0, 0, 0, &out), Taken::kKnown);
  EXPECT_EQ(machine.OnTransform(7, 2, 1, 0, &out), Taken::kImpossible) << "another's number";
  EXPECT_EQ(machine.OnTransform(7, 2, 2, 0, &out), Taken::kImpossible) << "we have not answered 1";
  EXPECT_EQ(machine.OnTransform(7, 1, 1, 0, &out), Taken::kFresh) << "it was quicker than we";
  EXPECT_TRUE(machine.Has(7, 0) && machine.Has(7, 1));
  EXPECT_EQ(machine.NewestOf(7), 1);
  machine.Forget(7);
  EXPECT_FALSE(machine.Has(7, 0) || machine.Has(7, 1));
  EXPECT_EQ(machine.OnTransform(7, 0, 0, 0, &out), Taken::kFresh) << "it may come again";
}

TEST(ModuleLockstep, InRealTimeNumbersStayBehindAndOnlyTheNewestCounts) {
  ModuleLockstep machine = AtTickOne(true);
  ModuleLockstep::Actions out;
  EXPECT_EQ(machine.OnTransform(7, 3, 9, 0, &out), Taken::kFresh);
  EXPECT_EQ(machine.OnTransform(7, 2, 7, 0, &out), Taken::kKnown);
  EXPECT_TRUE(machine.Has(7, 9));
  EXPECT_FALSE(machine.Has(7, 7));
}

TEST(ModuleLockstep, WhatComesOnceTheRunGoesOnWithoutItIsForOthers) {
  ModuleLockstep machine = AtTickOne(false);
  ModuleLockstep::Actions out;
  machine.OnLeave(0, &out);
  EXPECT_EQ(machine.OnTransform(7, 0, 0, 0, &out), Taken::kForOthers);
  EXPECT_EQ(machine.OnTransform(7, 90, 90, 0, &out), Taken::kForOthers);
  EXPECT_EQ(machine.OnSensors(90, 0, 1, true, {}, 0, &out), Taken::kForOthers);
}

/// A machine that has left before tick 1, with no word from the sim for so many seconds since.
ModuleLockstep LeftBeforeTickOne(bool realtime, int seconds) {
  ModuleLockstep machine = AtTickOne(realtime);
  ModuleLockstep::Actions out;
  machine.OnLeave(0, &out);
  const int64_t silence_us = int64_t{1'000'000} * seconds;
  while (!machine.done() && machine.next_deadline_us() <= silence_us) {
    machine.OnTime(machine.next_deadline_us(), &out);
  }
  return machine;
}

TEST(ModuleLockstep, WhoHasLeftIsThereUntilTheSimHasHeardIt) {
  // The sim stands still for a while, and asks again: what was said to it got lost.
  ModuleLockstep machine = LeftBeforeTickOne(false, 8);
  ModuleLockstep::Actions out;
  machine.OnLeave(8'000'000, &out);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].kind, ModuleAction::Kind::kEndAck);
  // SENSORS of the tick that it has answered come once more; those of the next one say it all.
  machine.OnSensors(0, 0, 1, true, {7}, 8'000'000, &out);
  machine.OnProgress(1, 8'000'000, &out);
  EXPECT_FALSE(machine.done());
  machine.OnSensors(1, 0, 1, true, {}, 8'000'000, &out);
  EXPECT_TRUE(machine.done());
  EXPECT_EQ(out.back().kind, ModuleAction::Kind::kFinish);
  // So does whatever comes of a later tick.
  machine = LeftBeforeTickOne(false, 1);
  machine.OnProgress(2, 1'000'000, &out);
  EXPECT_TRUE(machine.done());
  machine = LeftBeforeTickOne(false, 1);
  machine.OnClock(2, morphbus::sim_clock_t::PHASE_END, 1'000'000, &out);
  EXPECT_TRUE(machine.done());
}

TEST(ModuleLockstep, WhoHasLeftDoesNotStayForEver) {
  EXPECT_FALSE(LeftBeforeTickOne(false, 9).done());
  EXPECT_TRUE(LeftBeforeTickOne(false, 10).done());
  // In real time the sim goes on whether it has heard it or not.
  EXPECT_TRUE(LeftBeforeTickOne(true, 1).done());
}

/// SENSORS with the readings of a chain of three modules.
morphbus::sensors_t ChainOfThree() {
  FakeRobot robot(3);
  morphbus::sensors_t sensors;
  robot.Sense(&sensors.modules);
  sensors.part = 0;
  sensors.num_parts = 1;
  sensors.num_modules = 3;
  sensors.num_requests = sensors.num_pieces = sensors.num_inspected = sensors.num_root_poses = 0;
  return sensors;
}

TEST(ModuleParticipant, InRealTimeANeighbourThatWasNeverHeardHasSaidNothing) {
  InprocHub hub;
  const std::unique_ptr<Bus> own = hub.Connect(), other = hub.Connect();
  VirtualTime time;
  FakeController controller(1);
  FakeRunOptions options;
  options.realtime = true;
  ModuleParticipant module(own.get(), &controller, &time, FakeRun(options).ModuleOptions(1));
  module.Start();
  Ledger ledger;
  Outbox sim(other.get(), {"test", "SIM", kFakeModel, 0}, &ledger);
  for (int64_t tick = 0; tick < 6; ++tick) {
    morphbus::sensors_t sensors = ChainOfThree();
    sim.Send("test/SIM/SENSORS", tick, tick * 20'000, &sensors);
    hub.HandleAll();
  }
  EXPECT_EQ(controller.computed, (std::vector<int64_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(controller.missing_messages, 2 * 5) << "of both, in all ticks but the first";
}

/// A module's mail, and a neighbour that speaks.
struct MailStage {
  /// The neighbour m8 says TRANSFORM of a tick.
  void Say(int64_t tick) {
    FakeController controller(7);
    vm::TickOutput output;
    controller.Tick({}, &output);
    morphbus::transform_t transform;
    ToTransform(output.message, &transform);
    outbox.Send("test/m8/TRANSFORM", tick, 0, &transform);
    hub.HandleAll();
  }

  InprocHub hub;
  std::unique_ptr<Bus> own = hub.Connect(), other = hub.Connect();
  Ledger ledger, other_ledger;
  Outbox outbox = Outbox(other.get(), {"test", "m8", kFakeModel, 0}, &other_ledger);
  std::vector<uint16_t> heard;
  NeighbourMail mail =
      NeighbourMail(own.get(), "test", kFakeModel, &ledger,
                    [this](uint16_t mate, const uint8_t*, size_t) { heard.push_back(mate); });
};

TEST(NeighbourMail, WhatWasSaidBeforeTheNeighbourWasKnownIsTakenOnce) {
  MailStage stage;
  stage.mail.ListenToAll();
  stage.Say(0);
  EXPECT_TRUE(stage.heard.empty()) << "nobody is known yet";
  EXPECT_EQ(stage.mail.BoxOf(7), nullptr);
  stage.mail.Listen(7, "m8");
  // This bus keeps it until then; others hand it to the mail, which does.
  stage.hub.HandleAll();
  EXPECT_EQ(stage.heard, std::vector<uint16_t>{7});
  ASSERT_NE(stage.mail.BoxOf(7), nullptr);
  EXPECT_EQ(stage.mail.BoxOf(7)->name, "m8");
  stage.mail.Listen(7, "m8");
  stage.hub.HandleAll();
  EXPECT_EQ(stage.heard.size(), 1u);
  stage.mail.ListenToKnown();
  stage.Say(1);
  EXPECT_EQ(stage.heard, (std::vector<uint16_t>{7, 7}));
  // Who is no neighbour any more is not listened to.
  EXPECT_EQ(stage.mail.ForgetAllBut({3}), std::vector<uint16_t>{7});
  stage.Say(2);
  EXPECT_EQ(stage.heard.size(), 2u);
  EXPECT_EQ(stage.mail.BoxOf(7), nullptr);
}

TEST(NeighbourMail, BoxesOfFormerNeighboursMakeRoomInTheEnd) {
  MailStage stage;
  uint16_t next = 0;
  while (!stage.mail.full()) {
    stage.mail.Listen(next, "n" + std::to_string(next));
    ++next;
    ASSERT_LT(next, 10'000);
  }
  EXPECT_GT(next, vm::kMaxNeighbours);
  EXPECT_EQ(stage.mail.ForgetAllBut({0, 1}).size(), next - 2u);
  EXPECT_FALSE(stage.mail.full());
}

TEST(TickInputs, ReadsTheModulesOwnReadingAlone) {
  const morphbus::sensors_t sensors = ChainOfThree();
  const TickInputs inputs({"m2", 1, 2, 2, 0});
  vm::TickInput input;
  EXPECT_FALSE(inputs.Read(sensors.modules[0], &input)) << "m1's";
  ASSERT_TRUE(inputs.Read(sensors.modules[1], &input));
  std::vector<uint16_t> mates;
  inputs.AddMates(input, &mates);
  inputs.AddMates(input, &mates);
  EXPECT_EQ(mates, (std::vector<uint16_t>{0, 2})) << "each once";
  EXPECT_FALSE(TickInputs({"m2", 1, 3, 2, 0}).Read(sensors.modules[1], &input)) << "two joints";
}

TEST(TickInputs, OrdersAreForTheModuleTheyNameAndForOneTick) {
  morphbus::sensors_t sensors = ChainOfThree();
  sensors.requests.resize(3);
  sensors.pieces.resize(2);
  for (morphbus::invoke_request_t& request : sensors.requests) {
    request = {};
    request.module_id = 1;
  }
  sensors.requests[1].module_id = 2;
  for (int16_t i = 0; i < 2; ++i) {
    sensors.pieces[i].module_id = i;
    sensors.pieces[i].bytes = {static_cast<uint8_t>(40 + i)};
  }
  sensors.inspected = {1};
  TickInputs inputs({"m2", 1, 2, 2, 0});
  vm::TickInput input;
  ASSERT_TRUE(inputs.Read(sensors.modules[1], &input));
  inputs.Take(input, sensors);
  FakeController controller(1);
  vm::TickOutput output;
  const vm::NeighbourMessage message;
  std::vector<uint16_t> asked;
  const auto message_of = [&](uint16_t mate) {
    asked.push_back(mate);
    return mate == 0 ? &message : nullptr;
  };
  inputs.Compute(4, 80'000, message_of, &controller, &output);
  EXPECT_EQ(controller.computed, std::vector<int64_t>{4});
  EXPECT_EQ(controller.requests, 2);
  EXPECT_EQ(controller.deployed, std::vector<uint8_t>{41});
  EXPECT_EQ(controller.missing_messages, 1);
  EXPECT_EQ(asked, (std::vector<uint16_t>{0, 2}));
  EXPECT_TRUE(inputs.TakeInspection());
  EXPECT_FALSE(inputs.TakeInspection());
  // The next tick comes without orders.
  inputs.Take(input, ChainOfThree());
  inputs.Compute(5, 100'000, message_of, &controller, &output);
  EXPECT_EQ(controller.requests, 2);
  EXPECT_EQ(controller.deployed.size(), 1u);
}

TEST(ModuleSnapshot, GoesOnAsItWasAndALaterIncarnationKeepsOnlyWhatWasSaid) {
  MailStage stage;
  stage.Say(0);
  FakeController controller(7);
  vm::TickOutput output;
  controller.Tick({}, &output);
  std::vector<uint8_t> state, snapshot;
  controller.Save(&state);
  SnapshotHead head;
  head.next_tick = 5;
  head.incarnation = 2;
  WriteSnapshot(head, &controller, stage.outbox, &snapshot);
  for (const uint32_t incarnation : {2u, 3u}) {
    FakeController next(7);
    Outbox outbox(stage.other.get(), {"test", "m8", kFakeModel, 0}, &stage.ledger);
    SnapshotHead expected;
    expected.incarnation = incarnation;
    const Result<SnapshotHead> read = ReadSnapshot(snapshot, expected, &next, &outbox);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->next_tick, 5);
    EXPECT_EQ(outbox.count("test/m8/TRANSFORM"), 1);
    std::vector<uint8_t> loaded;
    next.Save(&loaded);
    EXPECT_EQ(loaded == state, incarnation == 2);
  }
  SnapshotHead other;
  other.program_hash = 1;
  const Result<SnapshotHead> refused = ReadSnapshot(snapshot, other, &controller, &stage.outbox);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "the snapshot is of another module, program or build");
}

}  // namespace
}  // namespace morphbus::bridge
