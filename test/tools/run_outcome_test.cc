#include "tools/run_outcome.h"

#include <gtest/gtest.h>

namespace morphbus::tools {
namespace {

logger::FaultFact SomeFault() {
  logger::FaultFact fault;
  fault.time_us = 3'200'000;
  fault.module = "m2";
  fault.role = "Head";
  fault.text = "division by zero";
  fault.function = "Head.behave";
  fault.line = 12;
  return fault;
}

TEST(FaultTest, APlaceInTheSourceIsNamedAsInDiagnostics) {
  const Json json = FaultJson(SomeFault(), "walk.dyn");
  EXPECT_EQ(json["line"], 12);
  EXPECT_EQ(FaultText(json), "    3.20 s  m2     walk.dyn:12: division by zero (Head.behave)");
}

TEST(FaultTest, WithoutAPlaceNoneIsMadeUp) {
  logger::FaultFact fault = SomeFault();
  fault.line = 0;
  fault.function.clear();
  const Json json = FaultJson(fault, "walk.dyn");
  for (const char* key : {"file", "line", "function"}) EXPECT_TRUE(json[key].is_null()) << key;
  EXPECT_EQ(FaultText(json), "    3.20 s  m2     division by zero");
}

}  // namespace
}  // namespace morphbus::tools
