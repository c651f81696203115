#include "test/compiler/emit/compiled_controllers.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "test/support/source_dir.h"

namespace morphbus::test {

namespace fs = std::filesystem;

namespace {

// GCC makes inline variables one for all libraries of a process unless it has this option; clang
// never does, and refuses the option.
#ifdef __clang__
constexpr const char* kOwnVariables = "";
#else
constexpr const char* kOwnVariables = "-fno-gnu-unique";
#endif

}  // namespace

CompiledControllers::CompiledControllers(const emit::Exported& world, size_t num_modules) {
  std::string name = testing::TempDir() + "morphbus-controllers-XXXXXX";
  if (mkdtemp(name.data()) == nullptr) {
    ADD_FAILURE() << "no scratch folder";
    return;
  }
  folder_ = name;
  // The main file is called like its folder.
  std::string main;
  for (const emit::CompanionFile& file : world.companions) {
    const fs::path path(file.path);
    std::ofstream(folder_ / path.filename()) << file.bytes;
    if (path.stem() == path.parent_path().filename()) main = path.filename().string();
  }
  // As in the Makefile, as strictly as our own sources. Each copy is to use its own functions, and
  // not those of the same name that the test program has.
  const std::string common = fmt::format("-O1 -fPIC -Wall -Wextra -Werror -isystem {} -I {}",
                                         SourcePath("test/export/webots_stub"), name);
  const std::string command = fmt::format(
      "cd {0} && {1} -std=c99 {2} -c morphbus_module.c && "
      "{3} -std=c++20 -ffp-contract=off {5} {2} -Dmain=controller_main -shared "
      "-Wl,-Bsymbolic -o controller.so {4} morphbus_vm.cc morphbus_module.o",
      name, MORPHBUS_C_COMPILER, common, MORPHBUS_CXX_COMPILER, main, kOwnVariables);
  // NOLINTNEXTLINE(cert-env33-c): a test's own folder.
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  for (size_t m = 0; m < num_modules; ++m) Load(folder_ / "controller.so", m);
}

void CompiledControllers::Load(const fs::path& library, size_t module) {
  // A file is loaded once only, so that each module has a file of its own.
  const fs::path copy = folder_ / fmt::format("controller{}.so", module);
  std::error_code error;
  fs::copy_file(library, copy, error);
  libraries_.push_back(dlopen(copy.c_str(), RTLD_NOW | RTLD_LOCAL));
  if (libraries_.back() == nullptr) {
    ADD_FAILURE() << dlerror();
    return;
  }
  // int controller_main(), by the name that C++ gives it.
  auto* const main = reinterpret_cast<int (*)()>(dlsym(libraries_.back(), "_Z15controller_mainv"));
  EXPECT_NE(main, nullptr);
  if (main != nullptr) mains_.emplace_back([main] { EXPECT_EQ(main(), 0); });
}

CompiledControllers::~CompiledControllers() {
  for (void* library : libraries_) {
    if (library != nullptr) dlclose(library);
  }
  if (!folder_.empty()) fs::remove_all(folder_);
}

}  // namespace morphbus::test
