// Images with wrong bytes: refused, or safe to run.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <random>
#include <sstream>
#include <string>

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

TEST(VerifierCorpusTest, KeptBadImagesAreRefusedForWhatIsWrongWithThem) {
  // The folder's files are also what fuzzing begins with.
  std::map<std::string, std::string> messages = {
      {"bad_hash", "hash does not fit the content"},
      {"empty", "shorter than a header"},
      {"growing_loop", "stack differs at a join"},
      {"header_only", "sections are larger than the image"},
      {"jump_into_operand", "jump into an instruction"},
      {"jump_outside", "target of a jump is not among the joins"},
      {"local_name_outside", "text lies outside the strings"},
      {"local_without_name", "notes name other locals"},
      {"nan_constant", "constant is not a value of its type"},
      {"older_version", "image version is not known"},
      {"past_end", "function runs past its end"},
      {"recursion", "functions call each other in a circle"},
      {"role_extends_itself", "roles extend each other in a circle"},
      {"section_outside", "sections are larger than the image"},
      {"too_many_functions", "sections are larger than the image"},
      {"trailing_byte", "notes have another size"},
      {"truncated", "size in the header is not that of the image"},
      {"underflow", "stack underflow"},
      {"wrong_type", "operand of the wrong type"}};
  for (const auto& entry :
       std::filesystem::directory_iterator(test::SourcePath("test/malformed/image"))) {
    if (entry.path().extension() != ".image") continue;
    std::ifstream file(entry.path(), std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    const std::string name = entry.path().stem();
    EXPECT_EQ(VerifyMessage(std::vector<uint8_t>(bytes.begin(), bytes.end())), messages[name])
        << name;
    messages.erase(name);
  }
  EXPECT_TRUE(messages.empty()) << messages.begin()->first << " is gone";
}

}  // namespace
}  // namespace morphbus::vm
