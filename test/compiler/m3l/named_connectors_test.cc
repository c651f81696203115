// Conditions that name connectors, and directions that their files do not give.

#include <set>

#include "compiler/m3l/compile.h"
#include "test/support/diagnostics_test.h"

namespace morphbus::m3l {
namespace {

/// Two kinds of cubes that know nothing of each other: faces front and back of A with corners at
/// half of its side, faces in and out of B, which is twice as large, at a quarter.
constexpr const char* kModules = R"(
module A:
point front: (point _1: coords=(1,.5,0)) (point _2: coords=(1,0,.5)) (point _3: coords=(1,-.5,0)) (point _4: coords=(1,0,-.5))
             coords=(1,0,0), connector, kind="plug"
point back: (point _1: coords=(-1,.5,0)) (point _2: coords=(-1,0,-.5)) (point _3: coords=(-1,-.5,0)) (point _4: coords=(-1,0,.5))
            coords=(-1,0,0), connector, kind="socket"
link l: grouping=(front, back), hull=box(size=(2,2,2))
axis up: origin=(0,0,0), direction=(0,1,0)
module B:
point in: (point top: coords=(-2,.5,0)) (point east: coords=(-2,0,.5)) (point low: coords=(-2,-.5,0))
          coords=(-2,0,0), connector, kind="socket"
point out: (point top: coords=(2,.5,0)) (point east: coords=(2,0,.5)) (point low: coords=(2,-.5,0))
           coords=(2,0,0), connector, kind="plug"
link l: grouping=(in, out), hull=box(size=(4,4,4))
axis up: origin=(0,0,0), direction=(0,1,0)
)";

std::string Connection(const std::string& conditions) {
  return std::string(kModules) + "connection C: members=(A a, B b), conditions=(" + conditions +
         ")\nrobot r: modules=(A a)\n";
}

/// The pairs of connectors that the connection joins, each once.
std::set<std::string> PairsOf(const std::string& conditions, size_t options) {
  const CompileOutput output = CompileText("a.m3l", Connection(conditions));
  EXPECT_TRUE(output.model) << source::Render(output.diagnostics, output.sources, false);
  std::set<std::string> pairs;
  if (!output.model) return pairs;
  const model::ConnectionType& type = output.model->connection_types[0];
  EXPECT_EQ(type.options.size(), options) << conditions;
  for (const model::ConnectionOption& option : type.options) {
    pairs.insert(output.model->module_types[0].connectors[option.connector_a].name + "-" +
                 output.model->module_types[1].connectors[option.connector_b].name);
  }
  return pairs;
}

using Pairs = std::set<std::string>;

TEST(NamedConnectors, AreThoseThatTheConditionNamesAndNoOthers) {
  EXPECT_EQ(
      PairsOf(
          "a.front coincident b.in and a.front antiparallel b.in and a.front._1 parallel b.in.top",
          1),
      Pairs{"front-in"});
  EXPECT_EQ(PairsOf("(a.front coincident b.in or a.back coincident b.out) and a.point p "
                    "antiparallel b.point q "
                    "and p._1 parallel q.top",
                    2),
            (Pairs{"front-in", "back-out"}));
  EXPECT_EQ(
      PairsOf("a.front coincident b.point q and a.front antiparallel q and a.up parallel b.up and "
              "a.front.kind != q.kind",
              1),
      Pairs{"front-in"});
}

TEST(NamedConnectors, LookTheWayOutAndTheirSubPointsAwayFromTheirCentre) {
  // Each of the four sub-points of a may be the one that looks the way of b's top.
  EXPECT_EQ(PairsOf("a.front coincident b.in and a.front antiparallel b.in and a.front.point "
                    "parallel b.in.top",
                    4),
            Pairs{"front-in"});
  // A direction is no part of the model.
  const CompileOutput output = CompileText(
      "a.m3l",
      Connection("a.front coincident b.in and a.front antiparallel b.in and a.up parallel b.up"));
  ASSERT_TRUE(output.model);
  for (const model::ModuleType& type : output.model->module_types) {
    for (const model::Connector& connector : type.connectors)
      EXPECT_TRUE(connector.normals.empty());
  }
}

class NamedConnectorErrors : public test::DiagnosticsTest {
 protected:
  void Compile(const std::string& conditions) {
    const CompileOutput output = CompileText("a.m3l", Connection(conditions));
    EXPECT_FALSE(output.model) << conditions;
    Collect(output.diagnostics, output.sources);
  }
};

TEST_F(NamedConnectorErrors, SayWhatIsThere) {
  Compile("a.fornt coincident b.in and a.up parallel b.up");
  EXPECT_EQ(TakeError("module 'A' has no connector 'fornt'").hint, "did you mean 'front'?");
  Compile("a.front._5 coincident b.in and a.up parallel b.up");
  EXPECT_EQ(TakeError("connector 'front' of 'A' has no sub-point '_5'").hint,
            "sub-points are _1, _2, _3, _4");
  Compile("a.front coincident b.in and a.front.knd==\"plug\"");
  EXPECT_EQ(TakeError("connector 'front' of 'A' has no attribute 'knd'").hint,
            "did you mean 'kind'?");
  Compile("a.front coincident b.in and a.front==\"plug\"");
  EXPECT_EQ(TakeError("expected an attribute").hint, "such as a.front.gender");
  Compile("a.front coincident b.in and a.kind==\"plug\"");
  EXPECT_EQ(TakeError("'a' is a whole module").hint, "name one of its connectors: a.front");
  Compile("a.front coincident a.back");
  TakeError("both sides belong to member 'a'");
  TakeError("the conditions name no connector of 'b'");
  Compile("a.up parallel b.up");
  EXPECT_EQ(TakeError("the conditions name no connector of 'a'").hint,
            "write a.point p_a where it is first used, or one by its name, such as a.front");
  TakeError("the conditions name no connector of 'b'");
  Compile("a.front coincident b.in and a.upp parallel b.up");
  EXPECT_EQ(TakeError("module 'A' has no axis and no connector 'upp'").hint, "did you mean 'up'?");
  Compile("a.front coincident b.in");
  TakeError("turn");
}

}  // namespace
}  // namespace morphbus::m3l
