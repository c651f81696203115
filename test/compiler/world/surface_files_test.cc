// Meshes and height maps that worlds name: what is read, where it lies, and what is refused.

#include "compiler/world/surface_files.h"

#include <gtest/gtest.h>
#include <png.h>

#include "compiler/m3l/read_mesh.h"
#include "compiler/model/run_description.pb.h"
#include "compiler/world/sdf_world.h"
#include "compiler/world/world_proto.h"
#include "test/support/source_dir.h"

namespace morphbus::world {
namespace {

using Eigen::Vector3d;

/// A PNG by libpng's own writer.
std::string Png(int columns, int rows, uint32_t format, const void* pixels) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(columns);
  image.height = static_cast<png_uint_32>(rows);
  image.format = format;
  std::string bytes(1 << 16, '\0');
  png_alloc_size_t size = bytes.size();
  EXPECT_NE(png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels, 0, nullptr), 0);
  bytes.resize(size);
  return bytes;
}

std::string ErrorOf(const std::string& bytes) {
  const Result<Heights> read = ParseHeights(bytes);
  EXPECT_FALSE(read);
  return read ? "" : read.error().message;
}

/// A world of one static model whose collision has this geometry.
std::string World(const std::string& geometry) {
  return "<sdf version='1.9'><world name='w'><model name='m'><static>true</static><link name='l'>"
         "<collision name='c'><geometry>" +
         geometry + "</geometry></collision></link></model></world></sdf>";
}

TEST(SurfaceFiles, GreyPicturesOfEightAndSixteenBitsAreHeights) {
  const std::vector<uint8_t> bytes = {0, 128, 255, 1, 2, 3};
  const Result<Heights> eight = ParseHeights(Png(3, 2, PNG_FORMAT_GRAY, bytes.data()));
  ASSERT_TRUE(eight) << eight.error().message;
  EXPECT_EQ(eight->columns, 3);
  EXPECT_EQ(eight->rows, 2);
  EXPECT_EQ(eight->samples, (std::vector<uint16_t>{0, 128 * 257, 65535, 257, 2 * 257, 3 * 257}));
  const std::vector<uint16_t> words = {0, 256, 65535, 7};
  const Result<Heights> sixteen = ParseHeights(Png(2, 2, PNG_FORMAT_LINEAR_Y, words.data()));
  ASSERT_TRUE(sixteen) << sixteen.error().message;
  EXPECT_EQ(sixteen->samples, words);
}

TEST(SurfaceFiles, PicturesThatAreNoHeightsAreRefused) {
  const std::vector<uint8_t> pixels(3 * 300 * 2, 9);
  EXPECT_EQ(ErrorOf("P5"), "is no PNG file");
  EXPECT_EQ(ErrorOf(Png(2, 2, PNG_FORMAT_RGB, pixels.data())),
            "is no grey picture of 8 or 16 bits a pixel without transparency");
  EXPECT_EQ(ErrorOf(Png(300, 2, PNG_FORMAT_GRAY, pixels.data())),
            "has 300 x 2 pixels; from 2 to 257 a side are possible");
  EXPECT_NE(ErrorOf(Png(2, 1, PNG_FORMAT_GRAY, pixels.data())).find("has 2 x 1"),
            std::string::npos);
  // Cut anywhere, or with a wrong bit.
  const std::string whole = Png(20, 20, PNG_FORMAT_GRAY, pixels.data());
  for (size_t length = 0; length < whole.size(); ++length) {
    EXPECT_FALSE(ParseHeights(whole.substr(0, length))) << length;
  }
  // Before the end, of 12 bytes, stands the checksum of the pixels.
  std::string damaged = whole;
  damaged[whole.size() - 14] = static_cast<char>(damaged[whole.size() - 14] ^ 4);
  EXPECT_NE(ErrorOf(damaged).find("cannot be read: "), std::string::npos);
}

TEST(SurfaceFiles, TheFirstRowOfAHeightMapIsAtPlusYAndItsBrightestPixelAtItsHeight) {
  // Brightest in the second column of the first row.
  const TriangleMesh mesh =
      MeshOf({3, 2, {0, 1000, 0, 500, 0, 0}}, Vector3d(4, 2, 0.5), Vector3d(10, 20, 30));
  ASSERT_EQ(mesh.points.size(), 6U);
  EXPECT_EQ(mesh.points[0], Vector3d(8, 21, 30));
  EXPECT_EQ(mesh.points[1], Vector3d(10, 21, 30.5));
  EXPECT_EQ(mesh.points[3], Vector3d(8, 19, 30.25));
  ASSERT_EQ(mesh.triangles.size(), 4U);
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d normal =
        (mesh.points[b] - mesh.points[a]).cross(mesh.points[c] - mesh.points[a]);
    EXPECT_GT(normal.z(), 0.0) << "all face up";
  }
}

TEST(SurfaceFiles, AMirroredMeshKeepsItsOutside) {
  const TriangleMesh mesh = {{Vector3d::Zero(), Vector3d::UnitX(), Vector3d::UnitY()}, {{0, 1, 2}}};
  const TriangleMesh mirrored = Scaled(mesh, Vector3d(-2, 1, 1));
  const auto& [a, b, c] = mirrored.triangles[0];
  EXPECT_GT(
      (mirrored.points[b] - mirrored.points[a]).cross(mirrored.points[c] - mirrored.points[a]).z(),
      0.0);
}

TEST(SurfaceFiles, ADescriptionHoldsWhatTheWorldsFilesHeld) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const std::string path = test::SourcePath("models/terrain.sdf");
  const Result<int> file = sources.AddFile(path);
  ASSERT_TRUE(file);
  const auto world = ReadSdfWorld(sources, *file, FilesBeside(path), &diagnostics);
  ASSERT_TRUE(world) << source::Render(diagnostics, sources, false);
  ASSERT_EQ(world->obstacles.size(), 2U);
  EXPECT_EQ(world->obstacles[0].mesh->triangles.size(), 8U);
  EXPECT_EQ(world->obstacles[0].mesh->points.size(), 10U) << "shared corners are one";
  EXPECT_EQ(world->obstacles[0].friction, 1.2);
  EXPECT_EQ(world->obstacles[1].mesh->points.size(), 33U * 33U);
  // Millimetres became metres, and the map lies where its <pos> says.
  double top = 0;
  for (const Vector3d& p : world->obstacles[0].mesh->points) top = std::max(top, p.z());
  EXPECT_NEAR(top, 0.15, 1e-7);
  EXPECT_EQ(world->obstacles[1].mesh->points[0], Vector3d(-3, 1, 0));
  // The same to the bit without the files.
  proto::RunDescription description;
  description.set_world(std::string(sources.text(*file)));
  KeepSurfaces(world->surfaces, &description);
  const auto again = ReadWorld(description);
  ASSERT_TRUE(again) << again.error().message;
  ASSERT_EQ(again->size(), 2U);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(again->at(i).mesh->points, world->obstacles[i].mesh->points);
    EXPECT_EQ(again->at(i).mesh->triangles, world->obstacles[i].mesh->triangles);
  }
  // A damaged one is refused.
  proto::RunDescription bad = description;
  bad.mutable_world_meshes(0)->set_corners(0, 10);
  EXPECT_EQ(ReadWorld(bad).error().message, "terrain/ridges.stl has a triangle without a corner");
  bad = description;
  bad.mutable_world_heights(0)->mutable_samples()->resize(7);
  EXPECT_EQ(ReadWorld(bad).error().message, "file://terrain/bumps.png is cut");
  bad.clear_world_heights();
  EXPECT_NE(ReadWorld(bad).error().message.find("'file://terrain/bumps.png' is not at hand"),
            std::string::npos);
}

TEST(SurfaceFiles, FilesThatCannotBeUsedAreErrorsAtTheirUri) {
  for (const auto& [geometry, part] : std::initializer_list<std::pair<std::string, std::string>>{
           {"<mesh><uri>none.stl</uri></mesh>", "none.stl"},
           {"<mesh><uri>terrain/bumps.png</uri></mesh>", "is no STL file"},
           {"<heightmap><uri>terrain/ridges.stl</uri></heightmap>", "is no PNG file"},
           {"<mesh><uri>terrain/ridges.stl</uri><scale>1e4 1 1</scale></mesh>",
            "reaches more than 100000 m away"}}) {
    source::SourceSet sources;
    source::Diagnostics diagnostics;
    const std::string name = test::SourcePath("models/made.sdf");
    const int file = sources.AddText(name, World(geometry));
    EXPECT_FALSE(ReadSdfWorld(sources, file, FilesBeside(name), &diagnostics)) << geometry;
    EXPECT_NE(source::Render(diagnostics, sources, false).find(part), std::string::npos)
        << source::Render(diagnostics, sources, false);
  }
}

TEST(SurfaceFiles, AWorldHasABoundedNumberOfTriangles) {
  Surfaces surfaces;
  surfaces.heights["h"] = {257, 257, std::vector<uint16_t>(257 * 257, 1)};
  std::string map = "<heightmap><uri>h</uri></heightmap>";
  std::string links;
  for (int i = 0; i < 4; ++i) {
    links += "</geometry></collision><collision name='c'><geometry>" + map;
  }
  const auto read = ReadSdfText(World(map + links), surfaces);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("more than 400000 triangles"), std::string::npos);
}

}  // namespace
}  // namespace morphbus::world
