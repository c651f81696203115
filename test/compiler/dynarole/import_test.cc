// Programs of several files.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "compiler/dynarole/compile.h"
#include "compiler/m3l/compile.h"
#include "test/compiler/dynarole/fake_host.h"
#include "test/support/diagnostics_test.h"
#include "vm/image/disassembler.h"
#include "vm/image/source_places.h"
#include "vm/image/verifier.h"

namespace morphbus::dynarole {
namespace {

constexpr const char* kUser = "role A extends Module { startup s() { print(twice(4)); } }\n";
constexpr const char* kTwice = "function twice(int x) {\n  return 2 * x;\n}\n";

class ImportTest : public test::DiagnosticsTest {
 protected:
  /// Compiles `dir/main.dyn` among the files of the test, which no disk has.
  CompileResult Compile(const std::string& text, source::NameTable* names = nullptr) {
    const auto read = [this](const std::string& path) -> Result<std::string> {
      const auto file = files_.find(std::filesystem::path(path).lexically_normal());
      ++reads_[std::filesystem::path(path).filename()];
      if (file == files_.end()) return Fail("cannot read '" + path + "': no such file");
      return file->second;
    };
    CompileResult result =
        CompileProgram("dir/main.dyn", text, TestKeywords(), Dump::kNone, names, read);
    Collect(result.diagnostics, result.sources);
    return result;
  }
  /// A program without any diagnostic, verified. The result keeps its bytes.
  std::unique_ptr<vm::VerifiedProgram> Verified(const CompileResult& result) {
    auto program = std::make_unique<vm::VerifiedProgram>();
    EXPECT_TRUE(result.image && result.diagnostics.all().empty())
        << Render(result.diagnostics, result.sources, false);
    if (!result.image) return program;
    const vm::VerifyError error = vm::Verifier::Verify(
        result.image->data(), static_cast<uint32_t>(result.image->size()), program.get());
    EXPECT_EQ(error.message, nullptr) << error.message;
    return program;
  }

  std::map<std::string, std::string> files_;
  std::map<std::string, int> reads_;
};

/// Where the first instruction of a function stands.
vm::SourcePlace PlaceOf(const vm::VerifiedProgram& program, const std::string& function,
                        const std::string& called = "") {
  for (int f = 0; f < program.num_functions(); ++f) {
    const vm::Text name = program.function_name(f);
    if (std::string(name.data, name.size) != function) continue;
    return vm::SourceFiles(program).Of(program.LineOf(f, 0), called);
  }
  return {};
}

TEST_F(ImportTest, PathsAreRelativeToTheImportingFile) {
  files_ = {{"dir/sub/middle.dyn", "import \"../../top.dyn\";\n"}, {"top.dyn", kTwice}};
  Verified(Compile(std::string("import \"sub/middle.dyn\";\n") + kUser));
}

TEST_F(ImportTest, AFileThatIsReachedTwiceIsReadOnce) {
  files_ = {{"dir/left.dyn", "import \"twice.dyn\";\nconst l = 1;\n"},
            {"dir/right.dyn", "import \"./sub/../twice.dyn\";\nimport \"twice.dyn\";\n"},
            {"dir/twice.dyn", kTwice}};
  Verified(Compile(std::string("import \"left.dyn\";\nimport \"right.dyn\";\n") + kUser));
  EXPECT_EQ(reads_["twice.dyn"], 1);
}

TEST_F(ImportTest, WhatIsImportedCountsAsIfItStoodThere) {
  // The same text as one file, and as two of which the import stands last.
  const std::string shared = std::string(kTwice) +
                             "param p = 3 in [1, 5];\nenum E { X, Y }\n"
                             "abstract role B extends Module { z = Y; }\n";
  const std::string own =
      "enum F { V }\nrole A extends B { startup s() { print(twice(z), p, V); } }\n";
  files_ = {{"dir/lib.dyn", shared}};
  const CompileResult one = Compile(shared + own);
  const CompileResult two = Compile(own + "import \"lib.dyn\";\n");
  const auto a = Verified(one);
  const auto b = Verified(two);
  // What runs is the same; the notes tell other lines, and the hashes differ with them.
  const auto runs = [](const vm::VerifiedProgram& program) {
    return std::vector<uint8_t>(program.bytes() + vm::image::kCountsAt,
                                program.bytes() + program.run_size());
  };
  EXPECT_EQ(runs(*a), runs(*b));
  EXPECT_EQ(a->num_imported_files(), 0);
  EXPECT_EQ(b->num_imported_files(), 1);
}

TEST_F(ImportTest, FunctionsThatNothingCallsCostNothing) {
  files_ = {{"dir/lib.dyn",
             "const k = 2;\nfunction never(x) {\n  return nothing(x);\n}\n"
             "function nothing(x) {\n  return k;\n}\n"}};
  const std::string role = "role A extends Module { startup s() { print(1); } }\n";
  const CompileResult with = Compile("import \"lib.dyn\";\n" + role);
  const CompileResult without = Compile("// Imports nothing.\n" + role);
  Verified(with);
  EXPECT_EQ(with.image, without.image);
  // Those of the program's own file are checked and warned of.
  const CompileResult own = Compile(role + "function never(int x) {\n  return x;\n}\n");
  ASSERT_EQ(own.diagnostics.all().size(), 1U);
  EXPECT_EQ(own.diagnostics.all()[0].message, "function 'never' is never called");
  TakeWarning("function 'never' is never called");
}

TEST_F(ImportTest, LinesAreToldWithTheirFiles) {
  files_ = {{"lib/twice.dyn", kTwice},
            {"dir/legs.dyn",
             "import \"../lib/twice.dyn\";\n\n"
             "abstract role L extends Module {\n"
             "  startup t() {\n    print(twice(1));\n  }\n}\n"}};
  const CompileResult result =
      Compile("import \"legs.dyn\";\nrole A extends L {\n  startup s() { print(twice(2)); }\n}\n");
  const auto program = Verified(result);
  EXPECT_EQ(PlaceOf(*program, "A.s"), (vm::SourcePlace{"main.dyn", 3}));
  EXPECT_EQ(PlaceOf(*program, "L.t"), (vm::SourcePlace{"legs.dyn", 5}));
  EXPECT_EQ(PlaceOf(*program, "Module.twice"), (vm::SourcePlace{"../lib/twice.dyn", 2}));
  // From the folder of the path by which the program is known, if that is its own file.
  EXPECT_EQ(PlaceOf(*program, "A.s", "x/main.dyn"), (vm::SourcePlace{"x/main.dyn", 3}));
  EXPECT_EQ(PlaceOf(*program, "L.t", "x/main.dyn"), (vm::SourcePlace{"x/legs.dyn", 5}));
  EXPECT_EQ(PlaceOf(*program, "L.t", "x/main.image"), (vm::SourcePlace{"legs.dyn", 5}));
  // And back.
  const vm::SourceFiles files(*program);
  for (const vm::SourcePlace& place :
       {vm::SourcePlace{"main.dyn", 3}, vm::SourcePlace{"../lib/twice.dyn", 2}}) {
    EXPECT_EQ(files.Of(files.LineOfAll(place)), place);
  }
  EXPECT_EQ(files.Of(files.LineOfAll({"twice.dyn", 2})), (vm::SourcePlace{"../lib/twice.dyn", 2}));
  EXPECT_EQ(files.LineOfAll({"", 3}), 3);
  EXPECT_EQ(files.LineOfAll({"other.dyn", 3}), 0);
  // Listings tell both.
  const std::string listing =
      vm::DisassembleImage(result.image->data(), static_cast<uint32_t>(result.image->size()));
  EXPECT_NE(listing.find("; line 3\n"), std::string::npos) << listing;
  EXPECT_NE(listing.find("; ../lib/twice.dyn:2\n"), std::string::npos) << listing;
}

TEST_F(ImportTest, NotesWhoseFilesAreOutOfOrderAreRefused) {
  files_ = {{"dir/twice.dyn", kTwice}};
  const CompileResult result = Compile(std::string("import \"twice.dyn\";\n") + kUser);
  Verified(result);
  std::vector<uint8_t> image = *result.image;
  const auto verify = [&image] {
    const uint32_t begin = vm::image::ReadU32(image.data() + vm::image::kSizeAt);
    const auto size = static_cast<uint32_t>(image.size());
    const auto seal = [&image](uint32_t at, uint64_t hash) {
      for (uint32_t i = 0; i < 8; ++i) image[at + i] = static_cast<uint8_t>(hash >> 8 * i);
    };
    seal(vm::image::kNotesHashAt, vm::image::HashOfNotes(image.data() + begin, size - begin));
    seal(vm::image::kHashAt, vm::image::HashOf(image.data(), begin));
    const auto program = std::make_unique<vm::VerifiedProgram>();
    const char* message = vm::Verifier::Verify(image.data(), size, program.get()).message;
    return std::string(message == nullptr ? "" : message);
  };
  EXPECT_EQ(verify(), "");
  // The last record is the first line and the name of the file.
  const size_t at = image.size() - vm::image::kImportedFileBytes;
  const uint8_t first = image[at];
  image[at] = 1;
  EXPECT_EQ(verify(), "files are not sorted");
  image[at] = first;
  image[at + 2] = 0xff;
  EXPECT_NE(verify(), "");
  image.pop_back();
  EXPECT_EQ(verify(), "notes have another size");
}

TEST_F(ImportTest, ACycleNamesTheChain) {
  files_ = {{"dir/b.dyn", "import \"c.dyn\";\n"}, {"dir/c.dyn", "\nimport \"main.dyn\";\n"}};
  EXPECT_FALSE(Compile(std::string("import \"b.dyn\";\n") + kTwice + kUser).image);
  const source::Diagnostic d = TakeError("import cycle: 'main.dyn' is itself still being read");
  EXPECT_EQ(LineOf(d.span), 2);
  ASSERT_EQ(d.notes.size(), 2U);
  EXPECT_EQ(TextAt(d.notes[0].span), "\"b.dyn\"");
  EXPECT_EQ(d.notes[0].message, "which imports 'b.dyn' here");
  EXPECT_EQ(TextAt(d.notes[1].span), "\"c.dyn\"");
}

TEST_F(ImportTest, AClashOfNamesIsToldAtBothPlaces) {
  files_ = {{"dir/a.dyn", kTwice}, {"dir/b.dyn", std::string("\n") + kTwice}};
  const CompileResult result =
      Compile(std::string("import \"a.dyn\";\nimport \"b.dyn\";\n") + kUser);
  EXPECT_FALSE(result.image);
  const std::string text = Render(result.diagnostics, result.sources, false);
  EXPECT_NE(text.find("dir/b.dyn:2:10: error: 'twice' is declared twice"), std::string::npos)
      << text;
  EXPECT_NE(text.find("dir/a.dyn:1:10: note: first declared here"), std::string::npos) << text;
  TakeError("'twice' is declared twice");
}

TEST_F(ImportTest, AllFilesTogetherAreBounded) {
  files_ = {{"dir/large.dyn", std::string(600'000, ' ')},
            {"dir/more.dyn", std::string(600'000, ' ')}};
  EXPECT_FALSE(Compile("import \"large.dyn\";\nimport \"more.dyn\";\n").image);
  EXPECT_EQ(LineOf(TakeError("with this file the program is larger than 1 MiB").span), 2);
  // Lines are counted with 16 bits.
  files_ = {{"dir/long.dyn", std::string(65'536, '\n') + kTwice}};
  EXPECT_FALSE(Compile(std::string("import \"long.dyn\";\n") + kUser).image);
  TakeError("the program's files have more than 65535 lines together");
  std::string constants;
  for (int i = 0; i < 150; ++i) constants += "const k@" + std::to_string(i) + " = 1;\n";
  const auto with = [&constants](char c) {
    std::string text = constants;
    std::replace(text.begin(), text.end(), '@', c);
    return text;
  };
  files_ = {{"dir/a.dyn", with('a')}, {"dir/b.dyn", with('b')}};
  EXPECT_FALSE(
      Compile(std::string("import \"a.dyn\";\nimport \"b.dyn\";\n") + kTwice + kUser).image);
  TakeError("too many constants");
}

TEST_F(ImportTest, ImportsNestToABoundedDepth) {
  for (int i = 0; i < 100; ++i) {
    files_["dir/f" + std::to_string(i) + ".dyn"] =
        "import \"f" + std::to_string(i + 1) + ".dyn\";\n";
  }
  EXPECT_FALSE(Compile("import \"f0.dyn\";\n").image);
  TakeError("imports nest deeper than 64");
}

TEST_F(ImportTest, WhatIsNoTextIsToldInItsFile) {
  files_ = {{"dir/latin.dyn", "// caf\xe9\n"}};
  EXPECT_FALSE(Compile(std::string("import \"latin.dyn\";\n") + kTwice + kUser).image);
  EXPECT_EQ(TakeError("byte \\xe9 is not UTF-8").span.file, 1);
}

TEST_F(ImportTest, ABinaryFileIsToldOnceWhereItIsImported) {
  files_ = {{"dir/some.image", std::string("DYNI\x01\0\x02\x03 |'", 12)}};
  EXPECT_FALSE(Compile(std::string("import \"some.image\";\n") + kTwice + kUser).image);
  EXPECT_EQ(TakeError("this is a binary file, not a program").span.file, 0);
}

TEST_F(ImportTest, FilesAreReadFromDisk) {
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / "dynarole_import";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder / "sub");
  std::ofstream(folder / "sub/twice.dyn") << kTwice;
  const auto compile = [&](const std::string& path) {
    CompileResult result =
        CompileProgram(folder / "main.dyn", "import \"" + path + "\";\n" + kUser, TestKeywords());
    Collect(result.diagnostics, result.sources);
    return result.image.has_value();
  };
  EXPECT_TRUE(compile("sub/twice.dyn"));
  EXPECT_FALSE(compile("sub"));
  TakeError("sub': not a regular file");
  EXPECT_FALSE(compile("lost.dyn"));
  TakeError("lost.dyn': no such file");
  std::filesystem::permissions(folder / "sub/twice.dyn", std::filesystem::perms::none);
  std::ifstream readable(folder / "sub/twice.dyn");
  // Whoever may read everything is no test of that.
  if (!readable.is_open()) {
    EXPECT_FALSE(compile("sub/twice.dyn"));
    TakeError("sub/twice.dyn': ");
  }
  std::filesystem::remove_all(folder);
}

TEST_F(ImportTest, EitherLanguageIsKnownByWhatItImports) {
  EXPECT_FALSE(Compile("import \"mtran.m3l\"\n").image);
  TakeError("this is an M3L model, not a program");
  const m3l::CompileOutput model =
      m3l::CompileText("walk.m3l", std::string("import \"lib.dyn\";\n") + kUser);
  Collect(model.diagnostics, model.sources);
  TakeError("this is a DynaRole program, not a model");
}

TEST_F(ImportTest, EditorsKnowTheNamesOfAllFiles) {
  files_ = {{"dir/lib.dyn", std::string(kTwice) + "function other(x) {\n  return x;\n}\n"}};
  source::NameTable names;
  const CompileResult result = Compile(std::string("import \"lib.dyn\";\n") + kUser, &names);
  Verified(result);
  EXPECT_TRUE(std::ranges::any_of(
      names.things, [](const source::NamedThing& thing) { return thing.name == "other"; }));
  // The call means the function of the other file.
  const size_t call = result.sources.text(0).find("twice");
  const source::NameUse* use = names.At(0, call);
  ASSERT_NE(use, nullptr);
  const bool declared = std::ranges::any_of(names.uses, [&](const source::NameUse& other) {
    return other.thing == use->thing && other.declares && other.span.file == 1;
  });
  EXPECT_TRUE(declared);
  ASSERT_EQ(result.imports.size(), 1U);
  EXPECT_EQ(result.imports[0].path, "lib.dyn");
}

TEST_F(ImportTest, AFileForOthersIsCheckedByItself) {
  source::NameTable names;
  const CompileResult result = Compile(kTwice, &names);
  EXPECT_TRUE(result.is_library);
  TakeError(kNoRoles);
  EXPECT_TRUE(std::ranges::any_of(
      names.things, [](const source::NamedThing& thing) { return thing.name == "twice"; }));
  EXPECT_FALSE(Compile("// Nothing.\n").is_library);
  TakeError(kNoRoles);
}

}  // namespace
}  // namespace morphbus::dynarole
