// Boxes, cylinders, spheres, meshes, several parts a link, constants, and sensors.

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "compiler/m3l/compile.h"
#include "compiler/m3l/read_mesh.h"
#include "compiler/model/convex_hull.h"
#include "compiler/model/link_mass.h"
#include "compiler/model/model_proto.h"
#include "test/support/diagnostics_test.h"

namespace morphbus::m3l {
namespace {

using Eigen::Vector3d;

/// A module of one link with this hull; `more` stands before the module and `members` behind it.
std::string Module(const std::string& hull, const std::string& more = "",
                   const std::string& members = "") {
  return more + "module A: unit=0.1\naxis z: origin=(0,0,1), direction=(0,0,2)\n" +
         "link l: (point p: coords=(0,0,0)) hull=" + hull + "\n" + members;
}

model::ModuleType TypeOf(const std::string& text) {
  const CompileOutput output = CompileText("a.m3l", text);
  EXPECT_TRUE(output.model) << source::Render(output.diagnostics, output.sources, false);
  return output.model ? output.model->module_types.at(0) : model::ModuleType{};
}

std::string FirstError(const std::string& text, const std::string& name = "a.m3l") {
  const CompileOutput output = CompileText(name, text);
  EXPECT_FALSE(output.model);
  return output.diagnostics.all().empty() ? "" : output.diagnostics.all().front().message;
}

TEST(ShapesTest, ABoxHasTheVolumeOfItsSidesAndLiesWhereItIsPut) {
  const model::ModuleType type = TypeOf(Module("box(size=(1,2,3), at=(4,0,0))"));
  const model::Link& link = type.links.at(0);
  EXPECT_EQ(link.hull.size(), 8U);
  EXPECT_TRUE(link.part_ends.empty());
  EXPECT_NEAR(model::HullVolume(link.hull), 6e-3, 1e-15);
  EXPECT_NEAR(link.mass_kg, 3.0, 1e-12);
  EXPECT_LT((model::ComputeLinkMass(type, 0).p_LoLcm_L - Vector3d(0.4, 0, 0)).norm(), 1e-12);
}

TEST(ShapesTest, ACylinderIsAPrismRoundItsAxis) {
  for (const int sides : {3, 24, 100}) {
    const model::ModuleType type =
        TypeOf(Module(fmt::format("cylinder(radius=2, length=1, axis=z, sides={})", sides)));
    const std::vector<Vector3d>& hull = type.links.at(0).hull;
    ASSERT_EQ(hull.size(), 2U * sides);
    // A regular polygon's area, times the length.
    const double area = 0.5 * sides * 0.04 * std::sin(2 * std::numbers::pi / sides);
    EXPECT_NEAR(model::HullVolume(hull), area * 0.1, 1e-12);
    for (const Vector3d& p : hull) {
      EXPECT_NEAR(p.head<2>().norm(), 0.2, 1e-12);
      EXPECT_NEAR(std::abs(p.z() - 0.1), 0.05, 1e-12)
          << "in the middle of it lies the axis' origin";
    }
  }
}

TEST(ShapesTest, ASphereHasItsCornersOnItAndLooksTheSameAfterQuarterTurns) {
  const std::vector<Vector3d> hull =
      TypeOf(Module("sphere(radius=1, at=(0,1,0))")).links.at(0).hull;
  EXPECT_EQ(model::ComputeHull(hull).vertices.size(), 66U);
  const Vector3d middle(0, 0.1, 0);
  for (const Vector3d& p : hull) {
    EXPECT_NEAR((p - middle).norm(), 0.1, 1e-12);
    const Vector3d r = p - middle;
    const Vector3d turned = middle + Vector3d(-r.y(), r.x(), r.z());
    EXPECT_TRUE(std::any_of(hull.begin(), hull.end(),
                            [&](const Vector3d& q) { return (q - turned).norm() < 1e-12; }));
  }
  EXPECT_GT(model::HullVolume(hull), 0.85 * 4.0 / 3.0 * std::numbers::pi * 1e-3);
}

TEST(ShapesTest, SeveralPartsAreKeptApartAndWeighTogether) {
  const model::ModuleType type = TypeOf(
      Module("box(size=(1,1,1), at=(-1,0,0)) + box(size=(1,1,1), at=(1,0,0)) + sphere(radius=.5)"));
  const model::Link& link = type.links.at(0);
  EXPECT_EQ(link.part_ends, (std::vector<int>{8, 16, 82}));
  ASSERT_EQ(link.Parts().size(), 3U);
  EXPECT_EQ(link.Parts()[1].size(), 8U);
  const double sphere = model::HullVolume(link.Parts()[2]);
  EXPECT_NEAR(link.mass_kg, 500 * (2e-3 + sphere), 1e-9);
  // Two cubes 0.2 m apart and a ball between them: by the parallel axis theorem.
  const model::LinkMass mass = model::ComputeLinkMass(type, 0);
  EXPECT_LT(mass.p_LoLcm_L.norm(), 1e-12);
  const double cubes = 2 * 0.5 * (0.01 / 6 + 0.01);
  const double ball =
      model::ComputeMassProperties(model::ComputeHull(link.Parts()[2])).inertia(2, 2);
  EXPECT_NEAR(mass.I_Lcm_L(2, 2), cubes + 500 * ball, 1e-9);
}

TEST(ShapesTest, PartsAndSensorsSurviveTheModelsFile) {
  const std::string text =
      Module("box(size=(1,1,1)) + box(size=(1,1,1), at=(2,0,0))", "",
             "sensor ir: type=distance, link=l, origin=(1,0,0), direction=(3,0,0), range=5, "
             "noise=.1\nsensor up: type=tilt, link=l, origin=(0,0,0), direction=(0,1,0)\n"
             "sensor skin: type=contact, link=l, origin=(0,0,1), direction=(0,0,1)\n");
  const CompileOutput output = CompileText("a.m3l", text);
  ASSERT_TRUE(output.model) << source::Render(output.diagnostics, output.sources, false);
  const auto read = model::FromProto(model::ToProto(*output.model));
  ASSERT_TRUE(read) << read.error().message;
  const model::ModuleType& type = read->module_types.at(0);
  EXPECT_EQ(type.links.at(0).part_ends, (std::vector<int>{8, 16}));
  ASSERT_EQ(type.sensors.size(), 3U);
  EXPECT_EQ(type.sensors[0].type, model::SensorType::kDistance);
  EXPECT_NEAR(type.sensors[0].range_m, 0.5, 1e-15);
  EXPECT_NEAR(type.sensors[0].noise, 0.01, 1e-15);
  EXPECT_EQ(type.sensors[0].direction, Vector3d(1, 0, 0));
  EXPECT_LT((type.sensors[0].p_MoSo_M - Vector3d(0.1, 0, 0)).norm(), 1e-15);
  EXPECT_EQ(type.sensors[2].name, "skin");
}

TEST(ShapesTest, ConstantsStandForNumbersWhereverNumbersStand) {
  const std::string text = Module("box(size=(w, 2*w, w/2))", "const w = 2 const h = w + 1\n",
                                  "const later = h*2\npoint c: coords=(later, 0, -h), connector, "
                                  "size=w\nlink k: grouping=(c)\n") +
                           "axis m: origin=(0,0,0), direction=(0,0,-1)\n"
                           "joint j: type=revolute, value=[-h,h], pair=((l,z),(k,m))\n";
  const model::ModuleType type = TypeOf(text);
  EXPECT_NEAR(model::HullVolume(type.links.at(0).hull), 8e-3, 1e-15);
  EXPECT_LT((type.connectors.at(0).p_MoCo_M - Vector3d(0.6, 0, -0.3)).norm(), 1e-15);
  EXPECT_EQ(std::get<double>(type.connectors[0].attributes.at("size")), 2.0);
  EXPECT_EQ(type.joints.at(0).upper, 3.0);
}

/// A folder of its own for files of a test, which goes with it.
class MeshTest : public ::testing::Test {
 protected:
  MeshTest() {
    std::string pattern = (std::filesystem::temp_directory_path() / "meshXXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~MeshTest() override { std::filesystem::remove_all(folder_); }

  void Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  [[nodiscard]] std::string Model() const { return (folder_ / "a.m3l").string(); }

  std::filesystem::path folder_;
};

/// A tetrahedron with a right angle at the origin and legs of 1, as text.
std::string TextStl() {
  const Vector3d p[4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  std::string text = "solid wedge\n";
  for (const auto& face : faces) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int i : face) text += fmt::format("vertex {} {} {}\n", p[i].x(), p[i].y(), p[i].z());
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid wedge\n";
}

/// So many triangles with corners on a sphere, binary.
std::string BinaryStl(uint32_t triangles) {
  std::string bytes(80, ' ');
  const auto add = [&bytes](uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(value >> shift));
  };
  add(triangles);
  for (uint32_t i = 0; i < triangles; ++i) {
    for (int k = 0; k < 3; ++k) add(0);
    for (uint32_t corner = 0; corner < 3; ++corner) {
      const double z = 1 - 2.0 * (i + 0.3 * corner + 0.1) / triangles;
      const double turn = 2.4 * (3 * i + corner);
      const double r = std::sqrt(1 - z * z);
      for (const double x : {r * std::cos(turn), r * std::sin(turn), z}) {
        add(std::bit_cast<uint32_t>(static_cast<float>(x)));
      }
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

TEST_F(MeshTest, AMeshIsItsConvexHullInModelUnits) {
  Write("wedge.stl", TextStl());
  const CompileOutput output = CompileText(Model(), Module("mesh(\"wedge.stl\")"));
  ASSERT_TRUE(output.model) << source::Render(output.diagnostics, output.sources, false);
  const std::vector<Vector3d>& hull = output.model->module_types[0].links[0].hull;
  EXPECT_EQ(hull.size(), 4U);
  EXPECT_NEAR(model::HullVolume(hull), 1e-3 / 6, 1e-12);
}

TEST_F(MeshTest, BinaryFilesAreReadToo) {
  const auto hull = MeshHull("ball.stl", BinaryStl(40));
  ASSERT_TRUE(hull) << hull.error().message;
  EXPECT_EQ(hull->size(), 120U);
}

TEST_F(MeshTest, WhatIsWrongWithAFileIsSaidAtItsName) {
  const std::string name = "mesh(\"x.stl\")";
  EXPECT_NE(FirstError(Module(name), Model()).find("no such file"), std::string::npos);
  Write("x.stl", "something else");
  EXPECT_NE(FirstError(Module(name), Model()).find("is no STL file"), std::string::npos);
  Write("x.stl", BinaryStl(10).substr(0, 300));
  EXPECT_NE(FirstError(Module(name), Model()).find("or one that was cut"), std::string::npos);
  Write("x.stl", BinaryStl(kMaxTriangles + 1));
  EXPECT_NE(FirstError(Module(name), Model()).find("50001 triangles, the most is 50000"),
            std::string::npos);
  Write("x.stl", BinaryStl(400));
  EXPECT_NE(FirstError(Module(name), Model()).find("has 1200 corners, the most is 500"),
            std::string::npos);
  Write("x.stl", "solid nothing\nendsolid nothing\n");
  EXPECT_FALSE(FirstError(Module(name), Model()).empty());
  std::string nan = BinaryStl(10);
  for (int i = 0; i < 4; ++i) nan[84 + 12 + i] = '\xff';
  Write("x.stl", nan);
  EXPECT_NE(FirstError(Module(name), Model()).find("not finite"), std::string::npos);
  std::filesystem::create_directory(folder_ / "folder.stl");
  EXPECT_NE(FirstError(Module("mesh(\"folder.stl\")"), Model()).find("not a regular file"),
            std::string::npos);
}

}  // namespace
}  // namespace morphbus::m3l
