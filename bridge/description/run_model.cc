#include "bridge/description/run_model.h"

#include <google/protobuf/stubs/logging.h>

#include <utility>

#include "compiler/model/forward_kinematics.h"
#include "compiler/model/model_proto.h"
#include "compiler/model/run_description.pb.h"
#include "compiler/world/world_proto.h"

namespace morphbus::bridge {
namespace {

/// Reads the protobuf; whatever else it may hold, a description names its run.
Result<proto::RunDescription> Parse(const std::string& bytes) {
  const google::protobuf::LogSilencer silencer;  // The error below says what is wrong.
  proto::RunDescription d;
  if (!d.ParseFromString(bytes) || d.run().empty()) {
    return Fail("this is no description of a run");
  }
  return d;
}

DescribedRun ValuesOf(const proto::RunDescription& d) {
  DescribedRun out;
  out.has_description = true;
  // What ran, and how.
  out.run = d.run();
  out.model_file = d.model_file();
  out.robot_name = d.robot();
  out.program_file = d.program_file();
  out.mode = d.mode();
  out.build = d.build();
  out.started = d.started();
  out.root_module = d.root_module();
  out.world_hash = d.world_hash();
  out.arithmetic = d.arithmetic();
  out.still = d.still();
  out.open = d.open();
  out.model_hash = d.model_hash();
  out.program_hash = d.program_hash();
  // What was done to it on purpose.
  out.seed = d.seed();
  out.random_seed = d.random_seed();
  out.noise_seed = d.noise_seed();
  out.loss = d.loss();
  out.faults_file = d.faults_file();
  out.fault_rules = d.faults();
  out.attributes.assign(d.attributes().begin(), d.attributes().end());
  out.root_sensor = d.root_sensor();
  out.root_noise_m = d.root_noise_m();
  out.root_noise_rad = d.root_noise_rad();
  return out;
}

/// Takes over the model, which must be usable, and the very one that the messages speak of.
Result<void> TakeRobot(const proto::RunDescription& d, RunModel* run) {
  Result<model::Model> model = model::ParseModel(d.model());
  if (!model) {
    return Fail("the model in the description cannot be used: " + model.error().message);
  }
  if (model::ModelHash(d.model()) != d.model_hash()) {
    return Fail("the model in the description is not the one its hash names");
  }
  run->model = *std::move(model);
  run->robot = run->model.FindRobot(d.robot());
  if (run->robot == nullptr) {
    return Fail("the model in the description has no robot '" + d.robot() + "'");
  }
  // The root is one of the robot's modules.
  run->root = RootLinkOf(*run->robot,
                         run->robot->FindModule(d.root_module()).value_or(run->robot->root_module));
  run->X_RL_start =
      model::ForwardKinematics(run->model, *run->robot, model::StartValues(*run->robot)).X_RL;
  return {};
}

/// Verifies all images, and keeps those that are sound. The first error.
Result<void> TakeImages(const proto::RunDescription& d, RunModel* run) {
  // A damaged image leaves the other ones of use: only what it names is then told by numbers.
  const auto bytes = [](const std::string& s) { return std::vector<uint8_t>(s.begin(), s.end()); };
  Result<void> all = run->images.AddProgram("the run's program", bytes(d.program_image()));
  run->has_program = all.has_value();
  if (run->has_program) run->parameters = dynarole::ParametersOf(run->images.program());
  for (const proto::KinematicsImage& type : d.kinematics()) {
    const Result<void> added = run->images.AddKinematics(type.type_name(), bytes(type.image()));
    // Of several errors the first is told.
    if (all) all = added;
  }
  return all;
}

}  // namespace

model::LinkRef RootLinkOf(const model::Robot& robot, int module) {
  // Only of its own root module the robot says which link is meant.
  return {module, module == robot.root_module ? robot.root_link : 0};
}

Result<DescribedRun> ReadDescribedRun(const std::string& description) {
  return Parse(description).map(ValuesOf);
}

Result<std::shared_ptr<const RunModel>> ReadRunModel(const std::string& description) {
  const Result<proto::RunDescription> d = Parse(description);
  if (!d) return tl::unexpected(d.error());
  auto run = std::make_shared<RunModel>();
  static_cast<DescribedRun&>(*run) = ValuesOf(*d);
  run->tick_us = d->tick_us();
  run->speed = d->speed();
  // What is wrong with one part is kept as a sentence, since a reader may need another part only.
  if (const Result<void> taken = TakeRobot(*d, run.get()); !taken) {
    run->problem = taken.error().message;
  }
  // The robot can be seen without its world, and faults have numbers without images.
  run->obstacles = world::ReadWorld(*d).value_or(std::vector<world::Obstacle>());
  if (const Result<void> taken = TakeImages(*d, run.get()); !taken) {
    run->images_problem = taken.error().message;
  }
  return run;
}

Result<std::shared_ptr<const RunModel>> ReadRunWithRobot(const std::string& description) {
  Result<std::shared_ptr<const RunModel>> run = ReadRunModel(description);
  // Without a robot nothing can be shown or run again, whatever else is known.
  if (run && (*run)->robot == nullptr) return Fail((*run)->problem);
  return run;
}

}  // namespace morphbus::bridge
