// Names for what messages give as numbers, by the description of their run.

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "compiler/emit/kinematics.h"
#include "compiler/model/run_description.pb.h"
#include "test/support/synthetic_log.h"
#include "tools/spy/lcm_sources.h"
#include "tools/spy/spy_pages.h"
#include "tools/spy/spy_table.h"
#include "vm/image/fault.h"

namespace morphbus::tools {
namespace {

/// Whatever a run says of "one" (m1, m2, m3 of type Seg: links base and arm, joint bend, connectors
/// c0 and c1), heard by a spy.
class SpyNamesTest : public ::testing::Test {
 protected:
  /// Hears the run, with its description if that is to be.
  void Hear(bool described) {
    options_.description = described;
    options_.ticks = 10;
    options_.end = false;
    options_.on_actuator = [](const std::string& /*module*/, actuator_t* actuator) {
      actuator->joints[0].mode = joint_command_t::MODE_VELOCITY;
      connector_command_t open = {};
      open.connector = 1;
      actuator->connectors = {open};
      actuator->num_connectors = 1;
    };
    options_.on_status = [](const std::string& /*module*/, status_t* status) {
      task_t task = {};
      task.kind = 1;
      task.function_name = "Tip.swing";
      task.line = 7;
      status->tasks = {task};
      status->num_tasks = 1;
      // An answer to `inspect`, whole in one part.
      call_t call = {};
      call.function_name = "Tip.turn";
      call.line = 9;
      held_task_t held = {};
      held.routine_name = "Tip.swing";
      held.calls = {call};
      held.num_calls = 1;
      inspection_t inspection = {};
      inspection.num_parts = 1;
      inspection.tasks = {held};
      inspection.num_tasks = 1;
      status->inspections = {inspection};
      status->num_inspections = 1;
      fault_t fault = {};
      fault.code = static_cast<int16_t>(vm::FaultCode::kStalled);
      fault.role = fault.rival_role = fault.function_index = fault.keyword = -1;
      fault.ended_task = fault.task_function = -1;
      fault.link = fault.connector = -1;
      fault.limit = 2;
      status->faults = {fault};
      status->num_faults = 1;
    };
    for (const test::SyntheticEvent& event : test::SyntheticEvents(options_)) {
      table_.Take(event.channel, event.payload.data(), event.payload.size(), ++now_ns_);
    }
  }
  /// The fields of a channel's last message, by path.
  std::map<std::string, std::string> Fields(const std::string& channel) {
    std::map<std::string, std::string> out;
    const Result<MessageFields> fields = table_.FieldsOfLast(channel);
    if (!fields) return {{"problem", fields.error().message}};
    for (const MessageField& field : fields->fields) out[field.path] = field.value;
    return out;
  }
  std::string Page(const std::string& process) {
    SpyUi ui;
    ui.process = process;
    return PlainText(ProcessLines(table_.Snapshot(now_ns_), ui));
  }

  test::SyntheticOptions options_;
  SpyTable table_{*LcmSchema::Parse(LcmSources())};
  int64_t now_ns_ = 1;
};

TEST_F(SpyNamesTest, JointsAndLinksAndModulesHaveTheirNames) {
  Hear(true);
  auto fields = Fields("synth/m2/ACTUATOR");
  EXPECT_EQ(fields["joints[bend].mode"], "VELOCITY");
  EXPECT_EQ(fields["module_id"], "m2");
  EXPECT_EQ(fields["connectors[0].connector"], "c1");
  fields = Fields("synth/SIM/SENSORS");
  EXPECT_TRUE(fields.contains("modules[m1].joint_position_si[bend]")) << fields.size();
  EXPECT_EQ(fields["modules[m1].docked[c1].mate_module"], "m2");
  EXPECT_EQ(fields["modules[m1].docked[c1].mate_connector"], "c0");
  fields = Fields("synth/m2/TRANSFORM");
  EXPECT_TRUE(fields.contains("link_poses[arm].position_m[0]"));
  EXPECT_EQ(fields["root_module"], "m1");
  fields = Fields("synth/SIM/WORLD");
  EXPECT_TRUE(fields.contains("bodies[m1.base].position_m[2]"));
  EXPECT_EQ(fields["bodies[m1.base].link"], "base");
  fields = Fields("synth/m3/STATUS");
  EXPECT_EQ(fields["labels[0].kind"], "JOINT");
  EXPECT_EQ(fields["labels[0].index"], "bend");
  EXPECT_EQ(fields["labels[1].index"], "base");
  EXPECT_EQ(fields["tasks[0].kind"], "behavior");
  EXPECT_EQ(Fields("synth/SIM/CLOCK")["phase"], "END");
}

TEST_F(SpyNamesTest, AModulesPageNamesItsJointsAndLinks) {
  Hear(true);
  const std::string page = Page("synth/m3");
  for (const char* line : {"bend: bend", "near: base", "far: arm", "convention   bend +1",
                           "Tip.swing at synthetic.dyn:7", "  in Tip.turn, synthetic.dyn:9"}) {
    EXPECT_NE(page.find(line), std::string::npos) << line << "\n" << page;
  }
}

TEST_F(SpyNamesTest, WithoutADescriptionThereAreNumbers) {
  Hear(false);
  auto fields = Fields("synth/m2/ACTUATOR");
  EXPECT_EQ(fields["joints[0].mode"], "VELOCITY") << "the type's constants are always known";
  EXPECT_EQ(fields["module_id"], "1");
  EXPECT_TRUE(Fields("synth/SIM/WORLD").contains("bodies[0].link"));
  const std::string page = Page("synth/m3");
  for (const char* line : {"near: link 0", "Tip.swing at line 7", "  in Tip.turn, line 9"}) {
    EXPECT_NE(page.find(line), std::string::npos) << line << "\n" << page;
  }
  // It may lie in the run's folder.
  table_.KnowDescription(test::SyntheticDescription("one", "synth"), now_ns_);
  EXPECT_EQ(Fields("synth/m2/ACTUATOR")["module_id"], "m2");
}

TEST_F(SpyNamesTest, FaultsNameJoints) {
  Hear(false);
  EXPECT_NE(Page("synth/m3").find("s: joint 0 stalled"), std::string::npos) << Page("synth/m3");
  proto::RunDescription description;
  ASSERT_TRUE(description.ParseFromString(test::SyntheticDescription("one", "synth")));
  proto::KinematicsImage& image = *description.add_kinematics();
  image.set_type_name("Seg");
  image.set_image(*emit::KinematicsImage(test::SyntheticModel(), 0, description.model_hash()));
  table_.KnowDescription(description.SerializeAsString(), now_ns_);
  EXPECT_NE(Page("synth/m3").find("s: joint bend stalled"), std::string::npos) << Page("synth/m3");
  EXPECT_EQ(Fields("synth/m3/STATUS")["faults[0].joint"], "bend");
  EXPECT_EQ(Fields("synth/m3/STATUS")["faults[0].text"].find("\"joint bend stalled"), 0u);
}

TEST_F(SpyNamesTest, ADescriptionIsThatOfItsRunAndModelAlone) {
  // Messages of another model, under the name of the run that was described.
  table_.KnowDescription(test::SyntheticDescription("one", "synth"), 1);
  options_.on_world = [](world_t* world) { world->header.model_hash = 5; };
  Hear(false);
  EXPECT_TRUE(Fields("synth/SIM/WORLD").contains("bodies[0].link"));
  EXPECT_EQ(Fields("synth/m2/ACTUATOR")["module_id"], "m2");
  // The description of another run.
  SpyTable other(*LcmSchema::Parse(LcmSources()));
  other.KnowDescription(test::SyntheticDescription("one", "other"), 1);
  EXPECT_FALSE(other.Snapshot(1).Run("synth"));
  table_.KnowDescription("no description at all", 2);
  EXPECT_EQ(Fields("synth/m2/ACTUATOR")["module_id"], "m2");
}

TEST(MessageFieldsTest, ConstantsOfAnyTypeNameTheirValues) {
  const LcmSchema schema = *LcmSchema::Parse(
      "package cart; struct wheel_t { int8_t mode; int32_t gear; int8_t model; int64_t a_hash; "
      "const int8_t MODE_OFF = 0, MODE_ON = 0x1, GEAR_LOW = 1; const double MODE_X = 2.0; }");
  const LcmType* type = schema.FindByName("cart.wheel_t");
  const auto value = [&](const char* name, int64_t number) {
    Json message = {{"mode", 1}, {"gear", 1}, {"model", 1}, {"a_hash", -1}};
    message[name] = number;
    for (const MessageField& field : FieldsOf(message, {&schema, type}).fields) {
      if (field.path == name) return field.value;
    }
    return std::string();
  };
  EXPECT_EQ(value("mode", 0), "OFF");
  EXPECT_EQ(value("mode", 1), "ON");
  EXPECT_EQ(value("mode", 2), "2") << "a double is no mode";
  EXPECT_EQ(value("gear", 1), "LOW");
  EXPECT_EQ(value("model", 1), "1");
  EXPECT_EQ(value("a_hash", -1), "-1") << "what others call a hash is a number to us";
}

}  // namespace
}  // namespace morphbus::tools
