#include "test/compiler/emit/compiled_c.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

namespace morphbus::test {

CompiledC::CompiledC(const emit::Exported& exported, const std::string& stem,
                     const std::string& options) {
  std::string name = testing::TempDir() + "morphbus-c99-XXXXXX";
  if (mkdtemp(name.data()) == nullptr) {
    ADD_FAILURE() << "no scratch folder";
    return;
  }
  folder_ = name;
  std::ofstream(folder_ / (stem + ".c")) << exported.text;
  for (const emit::CompanionFile& file : exported.companions) {
    std::ofstream(folder_ / file.path) << file.bytes;
  }
  const std::string library = (folder_ / (stem + ".so")).string();
  const std::string command = std::string(MORPHBUS_C_COMPILER) +
                              " -std=c99 -Wall -Wextra -Wpedantic -Wconversion -Werror -O0 "
                              "-shared -fPIC " +
                              options + " -o " + library + " " +
                              (folder_ / (stem + ".c")).string() + " -lm";
  // NOLINTNEXTLINE(cert-env33-c): a test's own folder.
  EXPECT_EQ(std::system(command.c_str()), 0) << exported.text;
  library_ = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library_ == nullptr) ADD_FAILURE() << dlerror();
}

CompiledC::~CompiledC() {
  if (library_ != nullptr) dlclose(library_);
  if (!folder_.empty()) std::filesystem::remove_all(folder_);
}

void* CompiledC::Find(const std::string& symbol) const {
  void* const found = library_ == nullptr ? nullptr : dlsym(library_, symbol.c_str());
  EXPECT_NE(found, nullptr) << symbol;
  return found;
}

}  // namespace morphbus::test
