#include <morphbus/model/model.h>

#include <utility>

#include "compiler/model/model_proto.h"
#include "tools/libraries/model_content.h"

namespace morphbus {

Model::Model(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

Model Model::FromBytes(std::string_view bytes) {
  Result<model::Model> model = model::ParseModel(bytes);
  if (!model) throw Failure(model.error().message);
  return Model(std::make_shared<Content>(std::move(*model)));
}

std::string Model::Bytes() const { return model::SerializeModel(content_->model); }

uint64_t Model::Hash() const { return model::ModelHash(Bytes()); }

const std::vector<ModuleType>& Model::module_types() const { return content_->module_types; }

const std::vector<ConnectionType>& Model::connection_types() const {
  return content_->connection_types;
}

std::vector<std::string> Model::RobotNames() const {
  std::vector<std::string> names;
  for (const model::Robot& robot : content_->model.robots) names.push_back(robot.name);
  return names;
}

Robot Model::robot(std::string_view name) const {
  const std::vector<model::Robot>& robots = content_->model.robots;
  if (name.empty() && robots.size() != 1) {
    throw Failure(robots.empty() ? "the model defines no robot"
                                 : "the model has several robots: name one of them");
  }
  for (const model::Robot& robot : robots) {
    if (name.empty() || robot.name == name) {
      return Robot(std::make_shared<Robot::Content>(content_, robot));
    }
  }
  ThrowUnknown("robot", name, RobotNames());
}

}  // namespace morphbus
