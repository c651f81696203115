#include "logger/log/description.h"

#include <fmt/format.h>
#include <google/protobuf/stubs/logging.h>

#include <memory>
#include <vector>

#include "bridge/description/program_words.h"
#include "bridge/module/module_instance.h"
#include "bridge/observe/description_finder.h"
#include "compiler/model/model_proto.h"
#include "compiler/model/run_description.pb.h"
#include "compiler/world/world_proto.h"
#include "logger/log/event_log.h"
#include "logger/log/run_log.h"

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
  // What ran, and how.
  facts->model_file = d.model_file();
  facts->robot = d.robot();
  facts->program_file = d.program_file();
  facts->mode = d.mode();
  facts->build = d.build();
  facts->started = d.started();
  facts->root_module = d.root_module();
  facts->world_hash = d.world_hash();
  facts->arithmetic = d.arithmetic();
  facts->still = d.still();
  facts->open = d.open();
  facts->model_hash = d.model_hash();
  facts->program_hash = d.program_hash();
  // What was done to it on purpose.
  facts->seed = d.seed();
  facts->random_seed = d.random_seed();
  facts->loss = d.loss();
  facts->faults_file = d.faults_file();
  facts->fault_rules = d.faults();
  facts->root_sensor = d.root_sensor();
  facts->root_noise_m = d.root_noise_m();
  facts->root_noise_rad = d.root_noise_rad();
}

}  // namespace

Result<DescriptionKey> ReadDescriptionKey(const std::string& description) {
  const Result<proto::RunDescription> d = Parse(description);
  if (!d) return tl::unexpected(d.error());
  return DescriptionKey{d->run(), d->model_hash(), d->build(), d->mode() == "realtime", d->open()};
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

std::vector<world::Obstacle> ObstaclesIn(const std::string& description) {
  // Without obstacles pictures only lack what stands around the robot, so that nothing is reported.
  proto::RunDescription d;
  if (!d.ParseFromString(description)) return {};
  Result<std::vector<world::Obstacle>> read = world::ReadWorld(d);
  return read ? std::move(*read) : std::vector<world::Obstacle>{};
}

Result<void> LoadImages(const std::string& description, bridge::ModuleImages* images) {
  const Result<proto::RunDescription> d = Parse(description);
  if (!d) return tl::unexpected(d.error());
  const auto bytes = [](const std::string& s) { return std::vector<uint8_t>(s.begin(), s.end()); };
  // The first image that cannot be used is the error; those behind it are not looked at.
  Result<void> added = images->AddProgram("the log's program", bytes(d->program_image()));
  for (const proto::KinematicsImage& type : d->kinematics()) {
    if (added) added = images->AddKinematics(type.type_name(), bytes(type.image()));
  }
  return added;
}

Result<std::string> DescriptionInLog(const std::string& path) {
  auto reader = EventLogReader::Open(path);
  if (!reader) return tl::unexpected(reader.error());
  // A log may hold parts of several runs' descriptions: the first one that is whole is taken.
  bridge::DescriptionFinder finder("");
  LogEvent event;
  while ((*reader)->Next(&event)) {
    auto whole = finder.Take(event.channel, event.data.data(), event.data.size());
    if (whole) return *std::move(whole);
  }
  return Fail(path + " does not hold the description of a run");
}

Result<std::string> ReadDescription(const std::string& path) {
  // A log is known by its beginning.
  if (BeginsAsLog(path)) return DescriptionInLog(path);
  // Anything else must be a description itself, which is never longer than the bus carries.
  auto bytes = LogBytes::Open(path);
  if (!bytes) return tl::unexpected(bytes.error());
  if ((*bytes)->file_size() > bridge::kMaxInfoBytes) {
    return Fail(path + " is neither a log nor the description of a run: it is too long");
  }
  std::string description((*bytes)->file_size(), '\0');
  (*bytes)->ReadAt(0, reinterpret_cast<uint8_t*>(description.data()), description.size());
  if (!Parse(description)) return Fail(path + " is neither a log nor the description of a run");
  return description;
}

Result<void> BorrowDescription(const std::string& description, uint64_t model_hash, RunLog* log) {
  Result<proto::RunDescription> d = Parse(description);
  if (!d) return tl::unexpected(d.error());
  // Its model must be the one of which the messages speak, or poses would be those of another
  // robot.
  if (d->model_hash() != model_hash) {
    return Fail(fmt::format("the description is of model {:016x}, the messages speak of {:016x}",
                            d->model_hash(), model_hash));
  }
  // What only another run did is not told of this one.
  if (d->run() != log->facts.run) {
    proto::RunDescription lent;
    lent.set_run(log->facts.run);
    lent.set_model(d->model());
    lent.set_model_file(d->model_file());
    lent.set_model_hash(d->model_hash());
    lent.set_robot(d->robot());
    lent.set_program_image(d->program_image());
    lent.set_program_file(d->program_file());
    lent.set_program_hash(d->program_hash());
    *lent.mutable_kinematics() = d->kinematics();
    lent.set_root_module(d->root_module());
    lent.set_tick_us(d->tick_us());
    lent.set_lcm_schema(d->lcm_schema());
    log->facts.problems.push_back("robot and program are those of run " + d->run() +
                                  ", whose description was lent to this log");
    *d = std::move(lent);
  }
  log->description = d->SerializeAsString();
  ApplyDescription(log->description, log);
  return {};
}

void WordFaults(const std::string& description, const std::map<uint64_t, std::string>& deployed,
                LogFacts* facts) {
  // Most runs have no such reports, and their images need not be verified then.
  if (facts->faults.empty() && facts->ended.faults.empty() && facts->prints.empty()) return;
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
  bridge::ProgramWords words(images.get(), has_program, d.program_hash(), d.program_file());
  words.deployed() = deployed;
  const auto place = [](const bridge::ReportWords& said, ProgramFact* fact) {
    fact->text = said.text;
    fact->file = said.file;
  };
  for (std::vector<FaultFact>* faults : {&facts->faults, &facts->ended.faults}) {
    for (FaultFact& fault : *faults) {
      const auto said = words.Fault(fault.program_hash, fault.type_name, fault.fault);
      place(said, &fault);
      fault.function = said.function;
      fault.task = said.task;
    }
  }
  for (PrintFact& print : facts->prints) {
    place(words.Print(print.program_hash, print.type_name, print.print), &print);
  }
}

}  // namespace morphbus::logger
