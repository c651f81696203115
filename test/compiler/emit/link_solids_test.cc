#include "compiler/emit/link_solids.h"

#include <gtest/gtest.h>

#include "test/compiler/solver/known_modules.h"

namespace morphbus::emit {
namespace {

TEST(LinkSolids, LooksAreSolidMeshesWithTheirColours) {
  model::Model model = test::MtranModel();
  model::VisualPart plate;
  plate.color = Color{1.0, 0.5, 0.0};
  plate.points = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.1, 0}, {0, 0.1, 0}};
  model.module_types[0].links[1].visual = {plate};
  LinkSolids solids(model);
  const std::vector<LookMesh>& looks = solids.Looks(0, 1);
  ASSERT_EQ(looks.size(), 1u);
  EXPECT_EQ(looks[0].name, "MTRAN." + model.module_types[0].links[1].name + ".look1");
  EXPECT_EQ(looks[0].color, plate.color);
  EXPECT_EQ(looks[0].points.size(), 8u) << "with a thickness";
  EXPECT_TRUE(solids.Looks(0, 0).empty()) << "like its hull";
}

TEST(LinkSolids, MassesAndHullsAreTheModelsAndWorkedOutOnce) {
  const model::Model model = test::MtranModel();
  LinkSolids solids(model);
  const model::ModuleType& type = model.module_types[0];
  for (int link = 0; link < static_cast<int>(type.links.size()); ++link) {
    const model::LinkMass mass = model::ComputeLinkMass(type, link);
    EXPECT_EQ(solids.Mass(0, link).mass_kg, mass.mass_kg);
    EXPECT_EQ(solids.Mass(0, link).p_LoLcm_L, mass.p_LoLcm_L);
    EXPECT_EQ(solids.Mass(0, link).I_Lcm_L, mass.I_Lcm_L);
    const std::vector<std::vector<Eigen::Vector3d>> parts = model::SolidParts(type, link);
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_EQ(solids.Parts(0, link), parts);
    EXPECT_EQ(solids.Faces(0, link).front().vertices, model::ComputeHull(parts.front()).vertices);
  }
  // The first answers still stand where they stood.
  EXPECT_EQ(&solids.Mass(0, 0), &solids.Mass(0, 0));
  EXPECT_EQ(&solids.Parts(0, 0), &solids.Parts(0, 0));
  EXPECT_EQ(&solids.Faces(0, 0), &solids.Faces(0, 0));
  EXPECT_EQ(&solids.Looks(0, 0), &solids.Looks(0, 0));
}

}  // namespace
}  // namespace morphbus::emit
