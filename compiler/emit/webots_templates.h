#pragma once
// The controller of a module in Webots, with marks like @TYPE@ for what differs from type to type:
// the files in webots_controller/, built in.

namespace morphbus::emit {

/// A controller is made of these files, with one of the two main programs: the first holds every
/// joint, the second runs a VM. CMake puts their text into the program, and
/// emit/webots.cc replaces the marks.
extern const char* const kWebotsModuleHeader;
extern const char* const kWebotsModuleSource;
extern const char* const kWebotsMain;
extern const char* const kWebotsVmMain;
extern const char* const kWebotsMakefile;

}  // namespace morphbus::emit
