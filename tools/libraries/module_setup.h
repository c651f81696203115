#pragma once
// What a module of a robot is made of: images, and what it is told before it starts.

#include <morphbus/dynarole/program.h>
#include <morphbus/model/model.h>

#include <cstdint>
#include <memory>

#include "bridge/module/module_images.h"
#include "bridge/module/module_instance.h"

namespace morphbus {

/// The verified images of the program and of all types that a robot has, these by the names of the
/// types. Throws Failure where the VM cannot hold one.
std::unique_ptr<bridge::ModuleImages> ImagesOf(const Robot& robot, const Program& program);

/// The hash by which the members of a run name the robot's model.
uint64_t ModelHashOf(const Robot& robot);

/// What a module is told, but for its run: the one that carries the robot frame knows where it is.
/// `module` is a good place in Robot::modules.
bridge::ModuleSpec SpecOf(const Robot& robot, int module);

}  // namespace morphbus
