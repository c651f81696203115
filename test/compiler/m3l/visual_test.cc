// How links look: parts, colours, meshes as they are, and that nothing but pictures knows of it.

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>

#include "compiler/m3l/compile.h"
#include "compiler/m3l/read_mesh.h"
#include "compiler/model/link_mass.h"
#include "compiler/model/model_proto.h"
#include "test/support/diagnostics_test.h"

namespace morphbus::m3l {
namespace {

/// A module of one link with these attributes.
std::string LinkWith(const std::string& attributes) {
  return "module A: unit=0.1\naxis z: origin=(0,0,1), direction=(0,0,2)\n"
         "link l: hull=box(size=(1,1,1))" +
         attributes + "\nrobot r: modules=(A m)\n";
}

model::Model ModelOf(const std::string& text, const std::string& name = "a.m3l") {
  const CompileOutput output = CompileText(name, text);
  EXPECT_TRUE(output.model) << source::Render(output.diagnostics, output.sources, false);
  return output.model.value_or(model::Model());
}

const model::Link& LinkOf(const model::Model& model) {
  return model.module_types.at(0).links.at(0);
}

TEST(VisualTest, ALinkLooksLikeItsHullUnlessItIsSaidOtherwise) {
  const model::Model plain = ModelOf(LinkWith(""));
  EXPECT_TRUE(LinkOf(plain).visual.empty());
  ASSERT_EQ(LinkOf(plain).Looks().size(), 1U);
  EXPECT_EQ(LinkOf(plain).Looks()[0].points, LinkOf(plain).hull);
  EXPECT_FALSE(LinkOf(plain).Looks()[0].color);
  const model::Model coloured = ModelOf(LinkWith(", colour=\"#ff8000\""));
  ASSERT_EQ(LinkOf(coloured).Looks().size(), 1U);
  EXPECT_EQ(LinkOf(coloured).Looks()[0].color, (Color{1.0, 128 / 255.0, 0.0}));
}

TEST(VisualTest, PartsHaveTheirOwnColourOrTheLinks) {
  const model::Model model = ModelOf(
      LinkWith(
          ", visual=sphere(radius=1) + cylinder(radius=1, length=2, axis=z, colour=\"#0000ff\")"
          " + convex(box(size=(1,1,1)), l.p), colour=\"#00ff00\"")
          .replace(LinkWith("").find("link l:"), 7, "link l: (point p: coords=(0,0,3))"));
  const std::vector<model::VisualPart>& parts = LinkOf(model).visual;
  ASSERT_EQ(parts.size(), 3U);
  EXPECT_EQ(parts[0].points.size(), 66U);
  EXPECT_EQ(parts[0].color, (Color{0.0, 1.0, 0.0}));
  EXPECT_EQ(parts[1].color, (Color{0.0, 0.0, 1.0}));
  EXPECT_EQ(parts[2].points.size(), 9U) << "a box, and a point above it";
  EXPECT_NEAR(parts[2].points.back().z(), 0.3, 1e-7);
}

/// The pyramid whose faces turn inward at one side is not convex: 6 triangles of 5 corners.
constexpr const char* kObj =
    "mtllib /dev/zero\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0.1 0.1 0.1\n"
    "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 5\nf 3 4 5\nf 4 2 5\n";

class VisualMeshTest : public ::testing::Test {
 protected:
  VisualMeshTest() { std::filesystem::create_directories(folder_); }
  ~VisualMeshTest() override { std::filesystem::remove_all(folder_); }
  void Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  [[nodiscard]] std::string ModelPath() const { return (folder_ / "a.m3l").string(); }

  std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) /
      fmt::format("visual_{}", ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(VisualMeshTest, MeshesAreDrawnAsTheyAre) {
  Write("part.obj", kObj);
  // In glTF one triangle, and a node that moves it up by 2.
  Write(
      "part.gltf",
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],)"
      R"("nodes":[{"mesh":0,"translation":[0,0,2]}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},)"
      R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],)"
      R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],)"
      R"("buffers":[{"byteLength":42,"uri":"data:application/octet-stream;base64,)"
      R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA"}]})");
  const model::Model obj =
      ModelOf(LinkWith(", visual=mesh(\"part.obj\", colour=\"#102030\")"), ModelPath());
  ASSERT_EQ(LinkOf(obj).visual.size(), 1U);
  EXPECT_EQ(LinkOf(obj).visual[0].triangles.size(), 6U);
  EXPECT_EQ(LinkOf(obj).visual[0].points.size(), 5U) << "the inner one, too";
  EXPECT_NEAR(LinkOf(obj).visual[0].points[1].norm() + LinkOf(obj).visual[0].points[0].norm(), 0.1,
              1e-6)
      << "in model units";
  EXPECT_EQ(LinkOf(obj).visual[0].color, (Color{16 / 255.0, 32 / 255.0, 48 / 255.0}));
  const model::Model gltf = ModelOf(LinkWith(", visual=mesh(\"part.gltf\")"), ModelPath());
  ASSERT_EQ(LinkOf(gltf).visual.size(), 1U);
  EXPECT_EQ(LinkOf(gltf).visual[0].triangles.size(), 1U);
  for (const Eigen::Vector3d& p : LinkOf(gltf).visual[0].points) EXPECT_NEAR(p.z(), 0.2, 1e-6);
}

TEST(MeshLimitTest, WhatWouldTakeTheLibraryLongIsRefusedBeforehand) {
  const auto why = [](const std::string& name, const std::string& bytes) {
    const Result<MeshTriangles> mesh = ParseAnyMesh(name, bytes);
    return mesh ? std::string("read") : mesh.error().message;
  };
  // Polygons of few corners become triangles.
  const Result<MeshTriangles> square =
      ParseAnyMesh("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  ASSERT_TRUE(square) << square.error().message;
  EXPECT_EQ(square->triangles.size(), 2U);
  std::string round = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf";
  for (int i = 0; i < 201; ++i) round += fmt::format(" {}", 1 + i % 4);
  EXPECT_EQ(why("a.obj", round + "\n"), "mesh 'a.obj' has a face of 201 corners, the most is 200");
  EXPECT_EQ(why("a.gltf", std::string(100'000, '[')), "mesh 'a.gltf' nests deeper than 64");
  EXPECT_EQ(why("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 99999999999999999999 2 3\n"),
            "mesh 'a.obj' has an index of more than 9 digits");
  using namespace std::string_literals;
  EXPECT_EQ(why("a.glb", "glTF\2\0\0\0\x18\0\0\0\xf0\xff\xff\xffJSON{}  "s),
            "mesh 'a.glb' has a part that is cut");
  EXPECT_EQ(why("a.glb", "glTF\2\0\0\0\xff\0\0\0\4\0\0\0JSON{}  "s),
            "mesh 'a.glb' is not as long as it says");
  std::string chain = R"({"asset":{"version":"2.0"},"nodes":[)";
  for (int i = 1; i <= 20'000; ++i) chain += fmt::format(R"({{"children":[{}]}},)", i);
  EXPECT_EQ(why("a.gltf", chain + "{}]}"), "mesh 'a.gltf' has more than 10000 nodes");
}

TEST(MeshFormatTest, BytesOfNoReaderAreNoFileOfTheNamesKind) {
  for (const char* name : {"a.gltf", "a.glb"}) {
    const Result<MeshTriangles> mesh = ParseAnyMesh(name, "{}");
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().message,
              fmt::format("mesh '{}' is no glTF file, which its name says it is", name));
  }
}

/// A binary STL of a strip of this many triangles that share no side with the one after the next.
std::string StripOf(size_t triangles) {
  std::string bytes(80, ' ');
  const auto append = [&](const void* data, size_t size) {
    bytes.append(static_cast<const char*>(data), size);
  };
  const auto count = static_cast<uint32_t>(triangles);
  append(&count, sizeof count);
  for (size_t i = 0; i < triangles; ++i) {
    // The normal, three corners, and two bytes that say nothing.
    const auto x = static_cast<float>(i);
    const std::array<float, 12> numbers = {0, 0, 1, x, 0, 0, x + 1, 0, 0, x, 1, 0};
    append(numbers.data(), sizeof numbers);
    bytes.append(2, '\0');
  }
  return bytes;
}

TEST_F(VisualMeshTest, MoreThanALogHasRoomForIsRefusedAtTheMesh) {
  // With their 38,001 corners they make 57,001 a link: 17 links have less than a million.
  constexpr size_t kTriangles = 19'000;
  Write("strip.stl", StripOf(kTriangles));
  const auto compile = [&](int links) {
    std::string text = "module A: unit=0.001\n";
    for (int l = 0; l < links; ++l) {
      text += fmt::format("link l{}: hull=box(size=(1,1,1)), visual=mesh(\"strip.stl\")\n", l);
    }
    for (int l = 1; l < links; ++l) {
      text += fmt::format("joint j{0}: type=fixed, pair=((l{0},up),(l0,down))\n", l);
    }
    return CompileText(ModelPath(), text +
                                        "axis up: origin=(0,0,0), direction=(0,0,1)\n"
                                        "axis down: origin=(0,0,0), direction=(0,0,-1)\n"
                                        "robot r: modules=(A m)\n");
  };
  const CompileOutput fits = compile(17);
  ASSERT_TRUE(fits.model) << source::Render(fits.diagnostics, fits.sources, false);
  EXPECT_LT(model::SerializeModel(*fits.model).size(), size_t{13} << 20U);
  const CompileOutput more = compile(18);
  EXPECT_FALSE(more.model);
  const std::string said = source::Render(more.diagnostics, more.sources, false);
  EXPECT_NE(said.find("link l17: hull=box(size=(1,1,1)), visual=mesh(\"strip.stl\")"),
            std::string::npos)
      << said;
  EXPECT_NE(said.find("with this, what is seen of all links has"), std::string::npos) << said;
  EXPECT_NE(said.find("the most is 1000000"), std::string::npos) << said;
}

class VisualErrorTest : public test::DiagnosticsTest {};

TEST_F(VisualErrorTest, WhatIsWrongIsSaidWhereItStands) {
  const auto compile = [&](const std::string& attributes) {
    const CompileOutput output = CompileText("a.m3l", LinkWith(attributes));
    EXPECT_FALSE(output.model);
    Collect(output.diagnostics, output.sources);
  };
  compile(", visual=sphere(radius=1, colour=\"blue\")");
  EXPECT_EQ(TextAt(TakeError("a colour is red, green and blue in hexadecimal").span), "\"blue\"");
  compile(", visual=sphere(radius=1, color=\"#0000ff\")");
  EXPECT_EQ(TakeError("'sphere' has no argument 'color'").hint, "did you mean 'colour'?");
  compile(", visual=sphere(radius=1, colour=\"#0000ff\", colour=\"#0000ff\")");
  TakeError("'colour' is given twice");
  compile(", visual=mesh(\"none.obj\")");
  EXPECT_EQ(TextAt(TakeError("none.obj").span), "\"none.obj\"");
  compile(", visual=mesh(\"none.step\")");
  TakeError("none.step");
  compile(", visual=ball(radius=1)");
  TakeError("a shape is written as convex(...), box(...)");
  const CompileOutput hull =
      CompileText("a.m3l", "module A:\nlink l: hull=box(size=(1,1,1), colour=\"#0000ff\")\n");
  Collect(hull.diagnostics, hull.sources);
  EXPECT_EQ(TakeError("a hull has no colour").hint,
            "colours stand in the parts of visual=, or as colour= of the link");
  const CompileOutput nothing =
      CompileText("a.m3l", "module A:\nlink l: (point p: coords=(0,0,0)) colour=\"#0000ff\"\n");
  Collect(nothing.diagnostics, nothing.sources);
  TakeError("there is nothing that has this colour");
}

TEST(VisualTest, NeitherHashNorMassNorShapeKnowHowALinkLooks) {
  const model::Model plain = ModelOf(LinkWith(""));
  const model::Model looks =
      ModelOf(LinkWith(", visual=sphere(radius=5, colour=\"#123456\") + box(size=(1,1,9))"));
  const std::string plain_bytes = model::SerializeModel(plain);
  const std::string looks_bytes = model::SerializeModel(looks);
  EXPECT_NE(plain_bytes, looks_bytes);
  EXPECT_EQ(model::WithoutLooks(looks_bytes), plain_bytes);
  EXPECT_EQ(model::ModelHash(looks_bytes), model::ModelHash(plain_bytes));
  EXPECT_EQ(LinkOf(plain).mass_kg, LinkOf(looks).mass_kg);
  EXPECT_EQ(model::ExtentOf(plain.module_types[0]), model::ExtentOf(looks.module_types[0]));
}

TEST(VisualTest, LooksSurviveTheModelsFileAndDamagedOnesAreRefused) {
  const model::Model looks =
      ModelOf(LinkWith(", visual=sphere(radius=5, colour=\"#123456\") + box(size=(1,1,9))"));
  const std::string bytes = model::SerializeModel(looks);
  const Result<model::Model> again = model::ParseModel(bytes);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(model::SerializeModel(*again), bytes);
  ASSERT_EQ(LinkOf(*again).visual.size(), 2U);
  EXPECT_EQ(LinkOf(*again).visual[0].points, LinkOf(looks).visual[0].points);
  const auto broken = [&](const std::function<void(proto::LinkLooks*)>& damage) {
    proto::Model message;
    EXPECT_TRUE(message.ParseFromString(bytes));
    damage(message.mutable_looks(0));
    const Result<model::Model> model = model::FromProto(message);
    return model ? "nothing" : model.error().message;
  };
  EXPECT_EQ(broken([](auto* l) { l->set_type(7); }), "damaged model: looks 0: module type 7 of 1");
  EXPECT_EQ(broken([](auto* l) { l->set_link(7); }), "damaged model: looks 0: link 7 of 1");
  EXPECT_EQ(broken([](auto* l) { l->clear_parts(); }), "damaged model: looks 0: 0 parts");
  EXPECT_EQ(broken([](auto* l) { l->mutable_parts(0)->add_points(1); }),
            "damaged model: looks 0: points");
  for (const float far : {2e6F, HUGE_VALF, std::nanf("")}) {
    EXPECT_EQ(broken([far](auto* l) { l->mutable_parts(0)->set_points(4, far); }),
              "damaged model: looks 0: points far away");
  }
  EXPECT_EQ(broken([](auto* l) {
              while (l->parts_size() < 51) *l->add_parts() = l->parts(0);
            }),
            "damaged model: looks 0: 51 parts");
  EXPECT_EQ(
      broken([](auto* l) { l->mutable_parts(0)->mutable_points()->Resize(3 * 70'000, 0.0F); }),
      "damaged model: looks 0: 70008 points and triangles");
  EXPECT_EQ(broken([](auto* l) { l->mutable_parts(0)->mutable_corners()->Resize(3 * 70'000, 0); }),
            "damaged model: looks 0: 70074 points and triangles");
  EXPECT_EQ(broken([](auto* l) { l->mutable_parts(0)->set_color(0x1000000); }),
            "damaged model: looks 0: color 0x1000000");
  EXPECT_EQ(broken([](auto* l) { l->mutable_parts(0)->add_corners(1); }),
            "damaged model: looks 0: corners");
  EXPECT_EQ(broken([](auto* l) {
              for (const int corner : {0, 1, 66}) l->mutable_parts(0)->add_corners(corner);
            }),
            "damaged model: looks 0: corner 66");
}

}  // namespace
}  // namespace morphbus::m3l
