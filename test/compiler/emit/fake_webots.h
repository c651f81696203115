#pragma once
// A Webots of one robot for tests of the generated controller: the functions of Webots' C interface
// (test/export/webots_stub) over modules that stand where the model has them. Motors reach their
// targets at once, but no module moves; sensors see nothing and are level; radio reaches as far as
// it does in the exported world.

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "compiler/emit/webots_docks.h"
#include "compiler/model/robot_model.h"

namespace morphbus::test {

class FakeWebots {
 public:
  /// The robot at its start values, docked connectors locked where they are not passive.
  FakeWebots(const model::Model& model, const model::Robot& robot);
  ~FakeWebots();
  FakeWebots(const FakeWebots&) = delete;
  FakeWebots& operator=(const FakeWebots&) = delete;

  /// Whose controller calls Webots from now on, of those that run in this thread.
  void Enter(int module) { current_ = module; }
  /// Lets time go on for all modules: what was sent arrives.
  void Step(int milliseconds);

  /// Runs the whole controllers of all modules, each in a thread of its own, as Webots runs them in
  /// processes. Time goes on when all have asked for it by wb_robot_step, which says after `steps`
  /// that the simulation ends. After each step, `look` is called.
  void Run(const std::vector<std::function<void()>>& controllers, int steps,
           const std::function<void()>& look);

  struct Motor {
    double position = 0.0;
    double velocity = 0.0;
  };
  struct Face {
    std::string name;
    emit::DockFace node;
    model::Pose X_WC = model::Pose::Identity();
    bool locked = false;
  };
  struct Packet {
    std::vector<unsigned char> bytes;
    Eigen::Vector3d direction;  ///< Of the emitter, from the receiver's frame.
  };
  struct Module {
    std::string name, custom_data;
    std::vector<std::string> devices;  ///< By tag - 1.
    std::map<std::string, Motor> motors;
    std::map<std::string, double> positions;
    std::vector<Face> faces;
    std::vector<std::vector<Packet>> inboxes;  ///< Of each face.
  };
  std::vector<Module>& modules() { return modules_; }

  // What the C functions call.
  Module& current() { return modules_[static_cast<size_t>(current_)]; }
  size_t FaceOf(const std::string& device);
  [[nodiscard]] int Presence(size_t face);
  void Send(size_t face, const void* bytes, int size);
  /// What wb_robot_step returns: -1 when the simulation ends.
  int StepOfController(int milliseconds);
  [[nodiscard]] double time() const { return time_; }
  static FakeWebots* instance();

 private:
  struct Sent {
    size_t module, face;
    std::vector<unsigned char> bytes;
  };
  emit::DockScale scale_;
  std::vector<Module> modules_;
  std::vector<Sent> sent_;
  static thread_local int current_;
  // Of Run.
  std::mutex mutex_;
  std::condition_variable stepped_;
  size_t num_controllers_ = 0;  ///< 0: time goes on by Step.
  size_t waiting_ = 0;
  int steps_ = 0, steps_left_ = 0;
  std::function<void()> look_;
  double time_ = 0.0;
};

}  // namespace morphbus::test
