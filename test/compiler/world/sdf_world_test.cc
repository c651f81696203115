// Obstacles from SDFormat worlds, and what is wrong with those that cannot be read.

#include "compiler/world/sdf_world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "test/support/source_dir.h"

namespace morphbus::world {
namespace {

using Eigen::Vector3d;

/// A world of one static model with this in it.
std::string World(const std::string& inside) {
  return "<sdf version=\"1.9\"><world name=\"w\"><model name=\"m\"><static>true</static>" + inside +
         "</model></world></sdf>";
}

std::string Collision(const std::string& geometry, const std::string& more = "") {
  return "<link name=\"l\"><collision name=\"c\">" + more + "<geometry>" + geometry +
         "</geometry></collision></link>";
}

std::string ErrorOf(const std::string& text) {
  const auto read = ReadSdfText(text);
  EXPECT_FALSE(read);
  return read ? "" : read.error().message;
}

TEST(SdfWorld, TheYardHasAWallAPostWithAKnobAndARamp) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const Result<int> file = sources.AddFile(test::SourcePath("models/yard.sdf"));
  ASSERT_TRUE(file);
  const auto world = ReadSdfWorld(sources, *file, {}, &diagnostics);
  ASSERT_TRUE(world) << source::Render(diagnostics, sources, false);
  const std::vector<Obstacle>* const obstacles = &world->obstacles;
  ASSERT_EQ(obstacles->size(), 4U) << "the ground is none";
  EXPECT_EQ(world->ground_friction, 0.7);
  EXPECT_EQ((*obstacles)[0].name, "wall.link.box");
  // North stays x, up is y, and west, SDFormat's y, is -z.
  EXPECT_LT(((*obstacles)[0].X_WO.translation() - Vector3d(1, 0.1, 0)).norm(), 1e-12);
  EXPECT_LT(((*obstacles)[1].X_WO.translation() - Vector3d(-1.2, 0.15, -0.8)).norm(), 1e-12);
  EXPECT_LT(((*obstacles)[2].X_WO.translation() - Vector3d(-1.2, 0.35, -0.8)).norm(), 1e-12);
  EXPECT_EQ((*obstacles)[3].friction, 1.2);
  // A negative pitch lifts the north end of the ramp.
  const Vector3d along = (*obstacles)[3].X_WO.linear().col(0);
  EXPECT_NEAR(along.y(), std::sin(20 * std::numbers::pi / 180), 1e-12);
  EXPECT_GT(along.x(), 0.9);
}

TEST(SdfWorld, PosesOfModelLinkAndCollisionFollowEachOther) {
  const auto read = ReadSdfText(World(
      "<pose>1 0 0 0 0 1.5707963267948966</pose><link name=\"l\"><pose>1 0 0 0 0 0</pose>"
      "<collision name=\"c\"><pose rotation_format=\"quat_xyzw\">0 0 2  0 0 0 1</pose><geometry>"
      "<sphere><radius>.5</radius></sphere></geometry></collision></link>"));
  ASSERT_TRUE(read) << read.error().message;
  // A quarter turn about up sends the link's x to SDFormat's y, which is -z here.
  EXPECT_LT((read->at(0).X_WO.translation() - Vector3d(1, 2, -1)).norm(), 1e-12);
  EXPECT_EQ(read->at(0).size.x(), 0.5);
}

TEST(SdfWorld, APlaneFacesAlongItsNormal) {
  const auto read = ReadSdfText(World(Collision("<plane><normal>0 1 1</normal></plane>")));
  ASSERT_TRUE(read) << read.error().message;
  const Vector3d normal = read->at(0).X_WO.linear().col(2);
  EXPECT_LT((normal - Vector3d(0, 1, -1).normalized()).norm(), 1e-12);
}

TEST(SdfWorld, WhatCannotBeHadIsSaidWithItsLine) {
  const std::string box = "<box><size>1 1 1</size></box>";
  EXPECT_EQ(ErrorOf("<sdf>\n<world name='w'>\n<model name='m'/></world></sdf>"),
            "line 3: model 'm' is not static");
  EXPECT_NE(ErrorOf("<sdf>\n<model name='m'/></sdf>").find("line 2: <model> is not supported"),
            std::string::npos);
  EXPECT_NE(ErrorOf("<sdf><world name='w'></sdf>").find("this is no XML"), std::string::npos);
  EXPECT_NE(ErrorOf("<robot/>").find("this is no SDFormat"), std::string::npos);
  EXPECT_NE(ErrorOf("").find("this is no XML"), std::string::npos);
  for (const auto& [inside, part] : std::initializer_list<std::pair<std::string, std::string>>{
           {Collision("<mesh><uri>a.stl</uri></mesh>"), "'a.stl' is not at hand"},
           {Collision("<mesh/>"), "<mesh> needs <uri>"},
           {Collision("<mesh><uri>model://a.stl</uri></mesh>"), "a uri of 'model://'"},
           {Collision("<mesh><uri>a.stl</uri><submesh/></mesh>"), "<submesh> is not supported"},
           {Collision("<mesh><uri>a.stl</uri><scale>1 0 1</scale></mesh>"), "a scale is not 0"},
           {Collision("<mesh optimization='convex_hull'><uri>a</uri></mesh>"), "optimization"},
           {Collision("<heightmap/>"), "<heightmap> needs <uri>"},
           {Collision("<heightmap><uri>a</uri><size>1 1 0</size></heightmap>"),
            "the sides of a height map are at least 1e-06 metres"},
           {Collision("<polyline/>"), "a <polyline> is not supported"},
           {Collision("<box/>"), "<box> needs <size>"},
           {Collision("<box><size>1 1</size></box>"), "<size> needs 3 numbers"},
           {Collision("<box><size>1 1 1 1</size></box>"), "<size> has more than 3 numbers"},
           {Collision("<box><size>1 0 1</size></box>"),
            "the sides of a box are at least 1e-06 metres"},
           {Collision("<box><size>1 nan 1</size></box>"), "<size> needs 3 numbers"},
           {Collision("<sphere><radius>-1</radius></sphere>"), "<radius> is at least 1e-06 metres"},
           {Collision("<cylinder><radius>1</radius></cylinder>"), "<cylinder> needs <length>"},
           {Collision("<plane><normal>0 0 0</normal></plane>"), "a normal of length zero"},
           {Collision(box, "<pose relative_to='x'>0 0 0 0 0 0</pose>"), "relative to 'x'"},
           {Collision(box, "<pose relative_to='world'>0 0 0 0 0 0</pose>"), "relative to 'world'"},
           {Collision(box, "<pose relative_to='__model__'>0 0 0 0 0 0</pose>"),
            "relative to '__model__'"},
           {Collision(box, "<surface><friction><ode><mu>11</mu></ode></friction></surface>"),
            "friction is from 0 to 10"},
           {"<include/>", "<include> is not supported here"},
           {"<joint name='j'/>", "<joint> is not supported here"}}) {
    EXPECT_NE(ErrorOf(World(inside)).find(part), std::string::npos) << part << "\n"
                                                                    << ErrorOf(World(inside));
  }
}

}  // namespace
}  // namespace morphbus::world
