#pragma once
// The controller of a module in Webots, with marks like @TYPE@ for what differs from type to type:
// the files in webots_controller/, built in.

namespace morphbus::emit {

extern const char* const kWebotsModuleHeader;
extern const char* const kWebotsModuleSource;
extern const char* const kWebotsMain;
extern const char* const kWebotsMakefile;

}  // namespace morphbus::emit
