#include "logger/log/description.h"

#include <fmt/format.h>

#include "bridge/description/program_words.h"
#include "bridge/description/run_model.h"
#include "bridge/observe/description_finder.h"
#include "compiler/model/run_description.pb.h"
#include "logger/log/event_log.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

void ApplyDescription(const std::string& description, RunLog* log) {
  // Whatever is wrong, the log stays readable: it only lacks its model.
  const auto read = bridge::ReadRunModel(description);
  if (!read) {
    log->facts.problems.push_back("the run's description cannot be read");
    return;
  }
  // The log shares the description with all that was made of it.
  log->described = *read;
  // A run is called as its channels are.
  const std::string run = log->facts.run;
  static_cast<bridge::DescribedRun&>(log->facts) = *log->described;
  log->facts.parameters = log->described->parameters;
  log->facts.run = run;
  log->robot = log->described->robot;
  if (log->robot == nullptr) {
    log->facts.problems.push_back(log->described->problem);
  } else {
    log->model = {log->described, &log->described->model};
  }
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
  // Only what parses as a description with a run's name counts as one.
  if (!bridge::ReadDescribedRun(description)) {
    return Fail(path + " is neither a log nor the description of a run");
  }
  return description;
}

Result<void> BorrowDescription(const std::string& description, uint64_t model_hash, RunLog* log) {
  const auto read = bridge::ReadDescribedRun(description);
  if (!read) return tl::unexpected(read.error());
  // Its model must be the one of which the messages speak, or poses would be those of another
  // robot.
  if (read->model_hash != model_hash) {
    return Fail(fmt::format("the description is of model {:016x}, the messages speak of {:016x}",
                            read->model_hash, model_hash));
  }
  log->description = description;
  // What only another run did is not told of this one.
  if (read->run != log->facts.run) {
    proto::RunDescription d, lent;
    d.ParseFromString(description);
    lent.set_run(log->facts.run);
    lent.set_model(d.model());
    lent.set_model_file(d.model_file());
    lent.set_model_hash(d.model_hash());
    lent.set_robot(d.robot());
    lent.set_program_image(d.program_image());
    lent.set_program_file(d.program_file());
    lent.set_program_hash(d.program_hash());
    *lent.mutable_kinematics() = d.kinematics();
    lent.set_root_module(d.root_module());
    lent.set_tick_us(d.tick_us());
    lent.set_lcm_schema(d.lcm_schema());
    log->facts.problems.push_back("robot and program are those of run " + read->run +
                                  ", whose description was lent to this log");
    log->description = lent.SerializeAsString();
  }
  ApplyDescription(log->description, log);
  return {};
}

void WordFaults(RunLog* log) {
  LogFacts* facts = &log->facts;
  bridge::ProgramWords words(log->described);
  // Programs that were deployed have words of their own, which their images hold.
  words.deployed() = log->deployed;
  const auto place = [](const bridge::ReportWords& said, ProgramFact* fact) {
    fact->text = said.text;
    fact->file = said.place.file;
    return static_cast<uint16_t>(said.place.line);
  };
  // Faults that ended a task are listed a second time, and get the same words.
  for (std::vector<FaultFact>* faults : {&facts->faults, &facts->ended.faults}) {
    for (FaultFact& fault : *faults) {
      const auto said = words.Fault(fault.program_hash, fault.type_name, fault.fault);
      fault.fault.line = place(said, &fault);
      fault.function = said.function;
      fault.task = said.task;
    }
  }
  for (PrintFact& print : facts->prints) {
    print.print.line = place(words.Print(print.program_hash, print.type_name, print.print), &print);
  }
}

}  // namespace morphbus::logger
