#include "logger/show/drawing.h"

#include <cairo.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <regex>
#include <utility>

#include "logger/show/labels.h"
#include "logger/show/projection.h"
#include "sim/rigid_body_model.h"
#include "test/sim/mtran.h"
#include "test/sim/toy_robots.h"

namespace morphbus::logger {
namespace {

using Eigen::Vector3d;

SceneHull Cube(const Vector3d& centre, const Color& color = {0.2, 0.4, 0.8}) {
  const Vector3d half = Vector3d::Constant(0.05);
  return {sim::test::BoxCorners(centre - half, centre + half), model::Pose::Identity(), color};
}

class DrawingTest : public ::testing::Test {
 protected:
  DrawingTest() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(::testing::TempDir()) /
              (std::string("morphbus_drawing_") + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~DrawingTest() override { std::filesystem::remove_all(folder_); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  static Drawing OneCube() {
    Drawing drawing;
    drawing.title = "a cube";
    drawing.panels.push_back(
        {{{Cube({0, 0.05, 0})}, {{"m1", {0, 0.05, 0}}}, true}, View::kSide, ""});
    return drawing;
  }

  std::filesystem::path folder_;
};

TEST(ProjectionTest, ViewsShowNorthUpAndEastWhereTheySay) {
  const Vector3d north = Vector3d::UnitX();
  const Vector3d up = Vector3d::UnitY();
  const Vector3d east = Vector3d::UnitZ();
  const Projection side(View::kSide);
  EXPECT_EQ(side.Direction(north), Vector3d(1, 0, 0));
  EXPECT_EQ(side.Direction(up), Vector3d(0, 1, 0));
  EXPECT_EQ(side.Direction(east), Vector3d(0, 0, 1));
  EXPECT_TRUE(side.sees_ground_edge_on());
  const Projection top(View::kTop);
  EXPECT_EQ(top.Direction(north), Vector3d(1, 0, 0));
  EXPECT_EQ(top.Direction(up), Vector3d(0, 0, 1));
  EXPECT_EQ(top.Direction(east), Vector3d(0, -1, 0));
  EXPECT_FALSE(top.sees_ground_edge_on());
  const Projection front(View::kFront);
  EXPECT_EQ(front.Direction(north), Vector3d(0, 0, 1));
  EXPECT_EQ(front.Direction(up), Vector3d(0, 1, 0));
  EXPECT_EQ(front.Direction(east), Vector3d(-1, 0, 0));
  const Projection three_quarter(View::kThreeQuarter);
  for (const Vector3d& direction : {north, up, east}) {
    EXPECT_GT(three_quarter.Direction(direction).z(), 0.0);  // all three look at the viewer
  }
  EXPECT_NEAR(three_quarter.Direction(up).x(), 0.0, 1e-12);  // up is up
}

TEST(ProjectionTest, GroundPointsProjectBackToWhereTheyWereSeen) {
  const Projection projection(View::kThreeQuarter);
  const Vector3d p = projection.GroundPointAt(0.3, -0.2);
  EXPECT_NEAR(p.y(), 0.0, 1e-12);
  EXPECT_NEAR((projection.Project(p).head<2>() - Eigen::Vector2d(0.3, -0.2)).norm(), 0.0, 1e-12);
}

TEST(VisibleFacesTest, ACubeShowsOneFaceSidewaysAndThreeFromACorner) {
  const Scene scene{{Cube({0, 0, 0})}, {}, false};
  EXPECT_EQ(VisibleFaces(scene, Projection(View::kSide)).size(), 1u);
  EXPECT_EQ(VisibleFaces(scene, Projection(View::kThreeQuarter)).size(), 3u);
}

TEST(VisibleFacesTest, EdgesAreDrawnWhereABodyBendsSharplyOrEnds) {
  // A prism of 24 sides about up: seen from the side, of its sides only the ends are drawn, and the
  // two outermost lines between sides.
  SceneHull prism;
  for (int i = 0; i < 24; ++i) {
    const double angle = 2 * EIGEN_PI * i / 24;
    for (const double y : {0.0, 1.0}) {
      prism.points_L.emplace_back(std::cos(angle), y, std::sin(angle));
    }
  }
  const std::vector<VisibleFace> faces =
      VisibleFaces({{prism}, {}, false}, Projection(View::kSide));
  ASSERT_EQ(faces.size(), 12u);
  int upright = 0, level = 0;
  for (const VisibleFace& face : faces) {
    ASSERT_EQ(face.edges.size(), face.outline.size());
    for (size_t i = 0; i < face.outline.size(); ++i) {
      if (!face.edges[i]) continue;
      const Eigen::Vector2d side = face.outline[(i + 1) % 4] - face.outline[i];
      ++(std::abs(side.y()) > std::abs(side.x()) ? upright : level);
    }
  }
  EXPECT_EQ(level, 24);
  EXPECT_EQ(upright, 2);
  // A mesh of two triangles in a plane has no edge between them.
  SceneHull square;
  square.points_L = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  square.triangles = {{0, 1, 2}, {0, 2, 3}};
  int drawn = 0;
  for (const VisibleFace& face : VisibleFaces({{square}, {}, false}, Projection(View::kSide))) {
    drawn += static_cast<int>(std::count(face.edges.begin(), face.edges.end(), true));
  }
  EXPECT_EQ(drawn, 4);
}

TEST(VisibleFacesTest, TheNearerHullIsPaintedLast) {
  const Color red = {0.9, 0, 0};
  const Color blue = {0, 0, 0.9};
  for (const double east : {0.2, -0.2}) {
    const Scene scene{{Cube({0, 0, 0}, red), Cube({0, 0, east}, blue)}, {}, false};
    const std::vector<VisibleFace> faces = VisibleFaces(scene, Projection(View::kSide));
    ASSERT_EQ(faces.size(), 2u);
    EXPECT_EQ(faces.back().color[0] == 0.0, east > 0.0);
  }
}

TEST(VisibleFacesTest, ALargeHullBehindASmallOneIsPaintedFirstThoughItsCentreIsNearer) {
  // A long slab whose near end sticks out, and a small cube resting on its far end.
  SceneHull slab{sim::test::BoxCorners({-0.05, -0.05, -0.5}, {0.05, 0.05, 0.5}),
                 model::Pose::Identity(),
                 {0, 0.9, 0}};
  const Scene scene{{Cube({0, 0.1, -0.4}, {0.9, 0, 0}), slab}, {}, false};
  const std::vector<VisibleFace> faces = VisibleFaces(scene, Projection(View::kThreeQuarter));
  EXPECT_EQ(faces.front().color[0], 0.0);
  EXPECT_EQ(faces.back().color[1], 0.0);
}

TEST(VisibleFacesTest, AHullWithinAnotherIsNotPaintedWhereverItsMiddleIs) {
  // A box in the upper near corner of a larger one: its middle is nearer to the viewer.
  const Vector3d corner(0.1, 0.1, 0.1);
  const SceneHull large{sim::test::BoxCorners(-corner, corner), model::Pose::Identity(), {0, 0, 1}};
  for (const double inset : {0.02, 0.0}) {
    SceneHull small{sim::test::BoxCorners({0.02, 0.02, 0.02}, corner.array() - inset),
                    model::Pose::Identity(),
                    {1, 0, 0}};
    for (const View view : {View::kSide, View::kTop, View::kFront, View::kThreeQuarter}) {
      for (const Scene& scene :
           {Scene{{large, small}, {}, false}, Scene{{small, large}, {}, false}}) {
        for (const VisibleFace& face : VisibleFaces(scene, Projection(view))) {
          EXPECT_EQ(face.color[0], 0.0) << inset;
        }
      }
    }
    // What stands out of it is seen.
    small.points_L = sim::test::BoxCorners({0.02, 0.02, 0.02}, corner.array() + 0.02);
    const Scene scene{{large, small}, {}, false};
    EXPECT_EQ(VisibleFaces(scene, Projection(View::kThreeQuarter)).size(), 6u);
  }
}

/// A square frame as a mesh, in the north-up plane: its outline is that of a plate, and it has a
/// hole.
SceneHull Frame() {
  SceneHull frame;
  for (const double side : {0.1, 0.2}) {
    for (const auto& [x, y] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
      for (const double z : {-0.1, 0.1}) frame.points_L.emplace_back(side * x, side * y, z);
    }
  }
  for (int k = 0; k < 4; ++k) {
    const int a = 2 * k, b = 2 * ((k + 1) % 4);
    // To the west and to the east, then inside and outside.
    for (const int z : {0, 1}) {
      frame.triangles.push_back({a + z, b + z, 8 + a + z});
      frame.triangles.push_back({b + z, 8 + b + z, 8 + a + z});
    }
    for (const int ring : {0, 8}) {
      frame.triangles.push_back({ring + a, ring + b, ring + a + 1});
      frame.triangles.push_back({ring + b, ring + b + 1, ring + a + 1});
    }
  }
  return frame;
}

TEST(VisibleFacesTest, WhatStandsInTheHoleOfAMeshIsSeen) {
  SceneHull cube = Cube({0, 0, 0});
  cube.owner = 1;
  const Scene scene{{Frame(), cube}, {}, false};
  int of_cube = 0;
  for (const VisibleFace& face : VisibleFaces(scene, Projection(View::kSide))) {
    of_cube += face.owner == 1 ? 1 : 0;
  }
  EXPECT_EQ(of_cube, 1);
}

/// A ball as a mesh of many corners.
SceneHull FineBall(const Vector3d& centre, int owner) {
  constexpr int kRings = 60;
  constexpr int kSegments = 100;
  SceneHull ball;
  ball.owner = owner;
  for (int i = 0; i <= kRings; ++i) {
    for (int j = 0; j < kSegments; ++j) {
      const double a = EIGEN_PI * i / kRings, b = 2 * EIGEN_PI * j / kSegments;
      ball.points_L.push_back(centre + 0.1 * Vector3d(std::sin(a) * std::cos(b), std::cos(a),
                                                      std::sin(a) * std::sin(b)));
      if (i == kRings) continue;
      const int here = i * kSegments + j, next = i * kSegments + (j + 1) % kSegments;
      ball.triangles.push_back({here, next, here + kSegments});
      ball.triangles.push_back({next, next + kSegments, here + kSegments});
    }
  }
  return ball;
}

TEST(VisibleFacesTest, MeshesOfManyCornersAreOrderedLikeOtherBodies) {
  // Seen from the east: a wall, the ball before it, and a small cube before the ball.
  SceneHull small = Cube({0, 0, 0.16});
  small.owner = 2;
  SceneHull wall = Cube({0, 0, 0});
  wall.owner = 0;
  for (Vector3d& p : wall.points_L) p = {4 * p.x(), 4 * p.y(), p.z() > 0 ? -0.11 : -0.13};
  const Scene scene{{small, FineBall({0, 0, 0}, 1), wall}, {}, false};
  std::vector<int> order;
  for (const VisibleFace& face : VisibleFaces(scene, Projection(View::kSide))) {
    if (order.empty() || order.back() != face.owner) order.push_back(face.owner);
  }
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2}));
}

TEST(VisibleFacesTest, OfTwoEqualHullsOneIsPainted) {
  const Scene scene{{Cube({0, 0, 0}), Cube({0, 0, 0})}, {}, false};
  EXPECT_EQ(VisibleFaces(scene, Projection(View::kSide)).size(), 1u);
}

TEST(VisibleFacesTest, HullsThatCoverEachOtherInARingAreAllPainted) {
  std::vector<SceneHull> hulls;
  for (int k = 0; k < 3; ++k) {
    model::Pose X = model::Pose::Identity();
    X.linear() = (Eigen::AngleAxisd(2.0943951 * k, Vector3d::UnitZ()) *
                  Eigen::AngleAxisd(0.3, Vector3d::UnitX()))
                     .toRotationMatrix();
    X.translation() = X.linear() * Vector3d(0.0, 0.1, 0.0);
    hulls.push_back({sim::test::BoxCorners({-0.3, -0.02, -0.02}, {0.3, 0.02, 0.02}), X, {1, 1, 1}});
  }
  EXPECT_GE(VisibleFaces({hulls, {}, false}, Projection(View::kSide)).size(), 3u);
}

TEST(VisibleFacesTest, FlatHullsAreSeenEdgeOn) {
  const SceneHull plate{
      {{0.1, 0, 0}, {0, 0, 0.1}, {-0.1, 0, 0}}, model::Pose::Identity(), {1, 1, 1}};
  EXPECT_GE(VisibleFaces({{plate}, {}, false}, Projection(View::kSide)).size(), 1u);
}

TEST(VisibleFacesTest, FacesTowardsTheLightAreBrighter) {
  const Scene scene{{Cube({0, 0, 0}, {0.5, 0.5, 0.5})}, {}, false};
  double brightest = 0.0;
  double highest = -1.0;
  double brightness_of_highest = 0.0;
  for (const VisibleFace& face : VisibleFaces(scene, Projection(View::kThreeQuarter))) {
    double v = 0.0;
    for (const Eigen::Vector2d& p : face.outline) v += p.y() / 4.0;
    brightest = std::max(brightest, face.color[0]);
    if (v > highest) {
      highest = v;
      brightness_of_highest = face.color[0];
    }
  }
  EXPECT_EQ(brightness_of_highest, brightest);
}

/// Where the names of cubes stand that are seen from the side. Cells are 2 mm wide, type is 10 mm
/// high.
std::vector<PlacedLabel> LabelsOf(const std::vector<std::pair<std::string, Vector3d>>& cubes) {
  Scene scene;
  for (int i = 0; i < static_cast<int>(cubes.size()); ++i) {
    scene.hulls.push_back(Cube(cubes[i].second));
    scene.hulls.back().owner = i;
    scene.names.push_back({cubes[i].first, cubes[i].second, i});
  }
  const Projection projection(View::kSide);
  return PlaceLabels(scene, VisibleFaces(scene, projection), projection,
                     {{-0.3, -0.2}, {0.3, 0.2}, 0.002, 0.006, 0.01});
}

TEST(LabelsTest, ANameStandsOnItsModule) {
  const std::vector<PlacedLabel> labels = LabelsOf({{"m1", {0.1, 0, 0}}});
  ASSERT_EQ(labels.size(), 1u);
  EXPECT_LT((labels[0].centre - Eigen::Vector2d(0.1, 0)).norm(), 0.003);
  EXPECT_FALSE(labels[0].tip);
}

TEST(LabelsTest, AHiddenModuleHasNoName) {
  const std::vector<PlacedLabel> labels = LabelsOf({{"behind", {0, 0, 0}}, {"front", {0, 0, 0.3}}});
  ASSERT_EQ(labels.size(), 1u);
  EXPECT_EQ(labels[0].text, "front");
}

TEST(LabelsTest, AHalfHiddenModuleHasItsNameOnTheHalfThatIsSeen) {
  const std::vector<PlacedLabel> labels = LabelsOf({{"m1", {0, 0, 0}}, {"m2", {0.05, 0, 0.3}}});
  ASSERT_EQ(labels.size(), 2u);
  EXPECT_FALSE(labels[0].tip);
  EXPECT_LT(labels[0].centre.x(), 0.0);
  EXPECT_GT(labels[0].centre.x(), -0.05);
}

TEST(LabelsTest, AModuleOfWhichTooLittleIsSeenHasItsNameBesideItWithALine) {
  const std::vector<PlacedLabel> labels =
      LabelsOf({{"a long name", {0, 0, 0}}, {"m2", {0.01, 0, 0.3}}});
  ASSERT_EQ(labels.size(), 2u);
  ASSERT_TRUE(labels[0].tip);
  EXPECT_LT(labels[0].tip->x(), -0.04);
  EXPECT_GT(labels[0].tip->x(), -0.05);
  const Eigen::Vector2d d = labels[0].centre.cwiseAbs();
  EXPECT_TRUE(d.x() > 0.05 + 0.033 - 0.011 || d.y() > 0.055) << d.transpose();  // on nobody
}

TEST(LabelsTest, NamesNeverCoverEachOther) {
  std::vector<std::pair<std::string, Vector3d>> cubes;
  for (int i = 0; i < 6; ++i) cubes.push_back({"module", {0.004 * i, 0.012 * i, 0.01 * i}});
  const std::vector<PlacedLabel> labels = LabelsOf(cubes);
  EXPECT_GT(labels.size(), 1u);
  for (size_t i = 0; i < labels.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const Eigen::Vector2d d = (labels[i].centre - labels[j].centre).cwiseAbs();
      EXPECT_TRUE(d.x() > 0.035 || d.y() > 0.009) << i << " " << j;
    }
  }
}

TEST_F(DrawingTest, SuffixDecidesTheFormat) {
  EXPECT_NE(RenderPicture(OneCube(), "x.svg")->find("<svg"), std::string::npos);
  EXPECT_EQ(RenderPicture(OneCube(), "x.png")->substr(0, 8), "\x89PNG\r\n\x1a\n");
  const Result<std::string> other = RenderPicture(OneCube(), "x.gif");
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().message.find(".svg or .png"), std::string::npos);
}

TEST_F(DrawingTest, NoPanelsAreNoPicture) { EXPECT_FALSE(RenderPicture(Drawing(), "x.svg")); }

TEST_F(DrawingTest, SameSceneGivesSameBytes) {
  // PNG: cairo numbers the groups of an SVG over the life of the process.
  EXPECT_TRUE(*RenderPicture(OneCube(), "a.png") == *RenderPicture(OneCube(), "b.png"));
}

TEST_F(DrawingTest, AnEmptySceneIsAnEmptyPicture) {
  Drawing drawing;
  drawing.panels.push_back({});
  drawing.panels.push_back({{}, View::kTop, "from above"});
  drawing.columns = 2;
  EXPECT_TRUE(RenderPicture(drawing, "empty.png"));
}

/// How many pixels of a rectangle are as dark as texts.
int InkIn(const Raster& raster, int left, int top, int right, int bottom) {
  int ink = 0;
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) {
      const uint8_t* pixel = &raster.rgba[4 * (static_cast<size_t>(y) * raster.width + x)];
      ink += std::max({pixel[0], pixel[1], pixel[2]}) < 80 ? 1 : 0;
    }
  }
  return ink;
}

TEST_F(DrawingTest, ADotThatIsNarrowerThanItsTextHasItBelow) {
  // White letters beside the dot could not be read on a light ground.
  Drawing drawing;
  drawing.panels.push_back({Scene(), View::kSide, ""});
  drawing.panels[0].scene.ground = false;
  drawing.panels[0].scene.marks.push_back({"front", {0, 0, 0}});
  const Raster raster = *RenderRaster(drawing, 1);
  // Without bodies the panel is a square of 760 pixels, below and beside margins of 38 and 16.
  const int u = 16 + 380, v = 38 + 380;
  EXPECT_GT(InkIn(raster, u - 20, v + 6, u + 20, v + 18), 20);
  EXPECT_EQ(InkIn(raster, u - 20, v - 18, u + 20, v + 6), 0);
}

/// The boxes of the names in an SVG, by the paths of their borders, which are 3 pixels wide.
std::vector<Eigen::AlignedBox2d> BoxesOfNames(const std::string& svg) {
  const std::regex path(R"re(<path[^>]*stroke-width(:3;|="3")[^>]* d="([^"]*)")re");
  const std::regex point(R"(([-.\d]+) ([-.\d]+))");
  std::vector<Eigen::AlignedBox2d> boxes;
  for (std::sregex_iterator name(svg.begin(), svg.end(), path), end; name != end; ++name) {
    const std::string places = (*name)[2];
    Eigen::AlignedBox2d& box = boxes.emplace_back();
    for (std::sregex_iterator at(places.begin(), places.end(), point); at != end; ++at) {
      box.extend(Eigen::Vector2d(std::stod((*at)[1]), std::stod((*at)[2])));
    }
  }
  return boxes;
}

TEST_F(DrawingTest, NamesOfWideLettersDoNotCoverEachOther) {
  // Modules in a row, each narrower than its name.
  Drawing drawing;
  drawing.panels.push_back({Scene(), View::kSide, ""});
  for (int i = 0; i < 20; ++i) {
    drawing.panels[0].scene.hulls.push_back(Cube({0.1 * i, 0.05, 0}));
    drawing.panels[0].scene.hulls.back().owner = i;
    drawing.panels[0].scene.names.push_back({"mmmm", {0.1 * i, 0.05, 0}, i});
  }
  drawing.panels[0].extent = {Eigen::Vector2d(-0.5, -1.0), Eigen::Vector2d(3.5, 1.5)};
  const std::vector<Eigen::AlignedBox2d> boxes = BoxesOfNames(*RenderPicture(drawing, "x.svg"));
  ASSERT_EQ(boxes.size(), 20u);
  for (size_t i = 0; i < boxes.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      EXPECT_FALSE(boxes[i].intersects(boxes[j])) << i << " " << j;
    }
  }
}

TEST_F(DrawingTest, TheHullIsWhereItShouldBeInItsColor) {
  Drawing drawing = OneCube();
  drawing.panels[0].scene.hulls[0].color = {0.9, 0.1, 0.1};
  drawing.panels[0].scene.names.clear();
  std::ofstream(Path("x.png"), std::ios::binary) << *RenderPicture(drawing, "x.png");
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create_from_png(Path("x.png").c_str()), cairo_surface_destroy);
  const int width = cairo_image_surface_get_width(surface.get());
  const int height = cairo_image_surface_get_height(surface.get());
  const unsigned char* data = cairo_image_surface_get_data(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  const auto is_red = [&](int x, int y) {
    const unsigned char* bgr = data + y * stride + 4 * x;
    return bgr[2] > 2 * bgr[1] && bgr[2] > 100;
  };
  EXPECT_TRUE(is_red(width / 2, height / 2));
  EXPECT_FALSE(is_red(4, height / 2));
  EXPECT_FALSE(is_red(width / 2, height - 4));
}

TEST_F(DrawingTest, AllModulesOfARobotAreDrawnWithTheirNames) {
  const auto model = sim::test::MtranModel();
  const model::Robot& robot = model->robots[0];
  const Scene scene =
      SceneOf(*model, robot, sim::PlaceOnGround(*model, robot), std::vector<Color>(9));
  // Each link as it looks: in several parts.
  size_t parts = 0;
  for (int m = 0; m < 9; ++m) {
    for (const model::Link& link : model->TypeOf(robot, m).links) parts += link.visual.size();
  }
  EXPECT_GT(parts, 27u);
  EXPECT_EQ(scene.hulls.size(), parts);
  ASSERT_EQ(scene.names.size(), 9u);
  EXPECT_EQ(scene.names[4].text, "m5");
  EXPECT_LT((scene.names[4].p_W - Vector3d(-0.0325, 0.033, 0)).norm(), 0.01);
  Drawing drawing;
  drawing.title = "quadruped";
  for (const View view : {View::kSide, View::kTop, View::kFront, View::kThreeQuarter}) {
    drawing.panels.push_back({scene, view, ""});
  }
  drawing.columns = 2;
  EXPECT_TRUE(RenderPicture(drawing, "quadruped.png"));
}

}  // namespace
}  // namespace morphbus::logger
