// Images with wrong bytes: refused, or safe to run.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <sstream>

#include "compiler/dynarole/compile.h"
#include "test/compiler/dynarole/fake_host.h"
#include "test/support/source_dir.h"
#include "test/vm/image_builder.h"
#include "vm/image/image.h"
#include "vm/image/opcodes.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {
namespace {

std::vector<uint8_t> CompileFile(const std::string& path) {
  std::ifstream file(test::SourcePath(path));
  std::stringstream text;
  text << file.rdbuf();
  dynarole::CompileResult result =
      dynarole::CompileProgram(path, text.str(), dynarole::TestKeywords());
  EXPECT_TRUE(result.image.has_value()) << path;
  return result.image.value_or(std::vector<uint8_t>());
}

// Either refused, or every role's code runs without harm under its budget (the sanitizers watch).
bool RefusedOrSafe(const std::vector<uint8_t>& image) {
  const auto program = std::make_unique<VerifiedProgram>();
  const VerifyError error =
      Verifier::Verify(image.data(), static_cast<uint32_t>(image.size()), program.get());
  if (error.message != nullptr) return true;
  for (int i = 0; i < program->num_roles(); ++i) dynarole::RunRoleNumber(*program, i);
  return false;
}

TEST(VerifierMutationTest, EveryByteOfAProgramMayBeWrong) {
  std::vector<uint8_t> image = CompileFile("test/programs/control.dyn");
  int accepted = 0;
  for (size_t i = 0; i < image.size(); ++i) {
    const uint8_t original = image[i];
    for (const int value : {0, 1, 2, 127, 128, 255, original ^ 1, original ^ 128, original + 1}) {
      image[i] = static_cast<uint8_t>(value);
      EXPECT_TRUE(image[i] == original || !VerifyMessage(image).empty()) << "without a new hash";
      Rehash(&image);
      if (!RefusedOrSafe(image)) ++accepted;
      image[i] = original;
    }
    Rehash(&image);
  }
  // Numbers and names may be others and the program still a program.
  EXPECT_GT(accepted, 0);
}

TEST(VerifierMutationTest, ManyBytesMayBeWrongAtOnce) {
  std::mt19937 random(7);
  for (const char* path : {"models/programs/quadruped.dyn", "test/programs/functions.dyn",
                           "test/programs/logic.dyn", "test/programs/structure.dyn"}) {
    const std::vector<uint8_t> original = CompileFile(path);
    for (int round = 0; round < 3000; ++round) {
      std::vector<uint8_t> image = original;
      const int changes = 1 + static_cast<int>(random() % 4);
      for (int k = 0; k < changes; ++k) {
        // Mostly behind the header, where more survives.
        const size_t at = random() % 8 == 0 ? random() % image.size()
                                            : image::kHeaderBytes +
                                                  random() % (image.size() - image::kHeaderBytes);
        image[at] = random() % 2 == 0 ? static_cast<uint8_t>(random())
                                      : static_cast<uint8_t>(random() % kNumOpcodes);
      }
      Rehash(&image);
      RefusedOrSafe(image);
    }
  }
}

TEST(VerifierMutationTest, NoiseIsRefused) {
  std::mt19937 random(11);
  for (int round = 0; round < 2000; ++round) {
    std::vector<uint8_t> image(random() % 400);
    for (uint8_t& byte : image) byte = static_cast<uint8_t>(random());
    EXPECT_NE(VerifyMessage(image), "");
  }
}

TEST(VerifierCorpusTest, KeptBadImagesAreRefused) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(test::SourcePath("test/malformed/image"))) {
    if (entry.path().extension() != ".image") continue;
    std::ifstream file(entry.path(), std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    EXPECT_NE(VerifyMessage(std::vector<uint8_t>(bytes.begin(), bytes.end())), "") << entry.path();
    ++files;
  }
  EXPECT_GE(files, 10);
}

}  // namespace
}  // namespace morphbus::vm
