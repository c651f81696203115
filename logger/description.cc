#include "logger/description.h"

#include <google/protobuf/stubs/logging.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "bridge/info_parts.h"
#include "compiler/model/model_proto.h"
#include "compiler/model/run_description.pb.h"
#include "logger/run_log.h"

namespace morphbus::logger {
namespace {

Result<proto::RunDescription> Parse(const std::string& bytes) {
  const google::protobuf::LogSilencer silencer;  // We say ourselves what is wrong.
  proto::RunDescription description;
  if (!description.ParseFromString(bytes) || description.run().empty()) {
    return Fail("this is no description of a run");
  }
  return description;
}

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

Result<std::string> ReadDescriptionFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Fail("cannot open " + path + ": " + std::strerror(errno));
  std::string bytes;
  char chunk[65536];
  while (file.read(chunk, sizeof chunk) || file.gcount() > 0) {
    bytes.append(chunk, static_cast<size_t>(file.gcount()));
    if (bytes.size() > bridge::kMaxInfoBytes) {
      return Fail(path + " is larger than 16 MiB, too large for a run's description");
    }
  }
  return bytes;
}

void ApplyDescription(const std::string& description, RunLog* log) {
  const Result<proto::RunDescription> d = Parse(description);
  if (!d) {
    log->facts.problems.push_back("the run's description cannot be read");
    return;
  }
  CopyFacts(*d, &log->facts);
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
  auto shared = std::make_shared<const model::Model>(std::move(*model));
  const model::Robot* robot = shared->FindRobot(d->robot());
  if (robot == nullptr) {
    log->facts.problems.push_back("the model in the description has no robot '" + d->robot() + "'");
    return;
  }
  log->model = std::move(shared);
  log->robot = robot;
}

}  // namespace morphbus::logger
