// Any bytes as a serialized model: refused, or a model that comes back unchanged and whose robots
// can be posed; never a crash.

#include <cstdint>
#include <string_view>

#include "compiler/model/forward_kinematics.h"
#include "compiler/model/model_proto.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace morphbus::model;  // Everything under test.
  const auto model = ParseModel({reinterpret_cast<const char*>(data), size});
  if (!model) return 0;
  const std::string bytes = SerializeModel(*model);
  const auto again = ParseModel(bytes);
  if (!again || SerializeModel(*again) != bytes) __builtin_trap();
  for (const Robot& robot : model->robots) {
    if (robot.modules.size() <= 100) ForwardKinematics(*model, robot, StartValues(robot));
  }
  return 0;
}
