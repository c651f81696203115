#include "logger/log/description.h"

#include <google/protobuf/stubs/logging.h>

#include <memory>
#include <vector>

#include "bridge/module/module_instance.h"
#include "compiler/model/model_proto.h"
#include "compiler/model/run_description.pb.h"
#include "logger/log/run_log.h"
#include "vm/image/fault_text.h"

namespace morphbus::logger {
namespace {

/// Reads the protobuf; whatever else it may hold, a description names its run.
Result<proto::RunDescription> Parse(const std::string& bytes) {
  const google::protobuf::LogSilencer silencer;  // We say ourselves what is wrong.
  proto::RunDescription description;
  if (!description.ParseFromString(bytes) || description.run().empty()) {
    return Fail("this is no description of a run");
  }
  return description;
}

/// What a reader wants to know of the run besides its model.
void CopyFacts(const proto::RunDescription& d, LogFacts* facts) {
  facts->has_description = true;
  facts->model_file = d.model_file();
  facts->robot = d.robot();
  facts->program_file = d.program_file();
  facts->mode = d.mode();
  facts->build = d.build();
  facts->started = d.started();
  facts->root_module = d.root_module();
  facts->world_hash = d.world_hash();
  facts->still = d.still();
  facts->model_hash = d.model_hash();
  facts->program_hash = d.program_hash();
  facts->seed = d.seed();
  facts->loss = d.loss();
}

}  // namespace

Result<DescriptionKey> ReadDescriptionKey(const std::string& description) {
  const Result<proto::RunDescription> d = Parse(description);
  if (!d) return tl::unexpected(d.error());
  return DescriptionKey{d->run(), d->model_hash(), d->build(), d->mode() == "realtime"};
}

void ApplyDescription(const std::string& description, RunLog* log) {
  // Whatever is wrong, the log stays readable: it only lacks its model.
  const Result<proto::RunDescription> d = Parse(description);
  if (!d) {
    log->facts.problems.push_back("the run's description cannot be read");
    return;
  }
  CopyFacts(*d, &log->facts);
  // The model must be usable, and the very one that the messages speak of.
  Result<model::Model> model = model::ParseModel(d->model());
  if (!model) {
    log->facts.problems.push_back("the model in the description cannot be used: " +
                                  model.error().message);
    return;
  }
  if (model::ModelHash(d->model()) != d->model_hash()) {
    log->facts.problems.push_back("the model in the description is not the one its hash names");
    return;
  }
  // The robot points into the model, so the log keeps both together.
  auto shared = std::make_shared<const model::Model>(std::move(*model));
  const model::Robot* robot = shared->FindRobot(d->robot());
  if (robot == nullptr) {
    log->facts.problems.push_back("the model in the description has no robot '" + d->robot() + "'");
    return;
  }
  log->model = std::move(shared);
  log->robot = robot;
}

void WordFaults(const std::string& description, const std::map<uint64_t, std::string>& deployed,
                LogFacts* facts) {
  if (facts->faults.empty()) return;
  // Without a description there are no images either, and of damaged ones there are no names; the
  // sentences have numbers then.
  const proto::RunDescription d = Parse(description).value_or(proto::RunDescription());
  const auto bytes = [](const std::string& s) { return std::vector<uint8_t>(s.begin(), s.end()); };
  const auto images = std::make_unique<bridge::ModuleImages>();
  const bool has_program = images->AddProgram("program", bytes(d.program_image())).has_value();
  // A damaged image leaves its type without names; the faults of other types keep theirs.
  for (const proto::KinematicsImage& type : d.kinematics()) {
    if (!images->AddKinematics(type.type_name(), bytes(type.image()))) continue;
  }
  // A program deployed during the run is not in the description; its source is named in its image.
  std::vector<std::unique_ptr<bridge::ModuleImages>> others;
  for (const auto& [hash, image] : deployed) {
    auto other = std::make_unique<bridge::ModuleImages>();
    if (other->AddProgram("program", bytes(image))) others.push_back(std::move(other));
  }
  // Each fault is worded with the images that it speaks of.
  for (FaultFact& fault : facts->faults) {
    vm::FaultContext context;
    if (has_program && images->program().hash() == fault.program_hash) {
      context.program = &images->program();
      fault.file = d.program_file();
    }
    for (const auto& other : others) {
      if (other->program().hash() != fault.program_hash) continue;
      context.program = &other->program();
      const vm::Text source = other->program().source_name();
      fault.file.assign(source.data, source.size);
    }
    context.kinematics = images->FindKinematics(fault.type_name);
    fault.text = vm::FaultSentence(fault.fault, context);
    fault.function = vm::FaultFunction(fault.fault, context.program);
  }
}

}  // namespace morphbus::logger
