#include "tools/launch/run_outcome.h"

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
  fault.file = "walk.dyn";
  fault.fault.line = 12;
  return fault;
}

TEST(FaultTest, APlaceInTheSourceIsNamedAsInDiagnostics) {
  const Json json = FaultJson(SomeFault());
  EXPECT_EQ(json["line"], 12);
  EXPECT_EQ(FaultText(SomeFault()),
            "    3.20 s  m2     walk.dyn:12: division by zero (in Head.behave)");
}

TEST(FaultTest, WithoutAPlaceNoneIsMadeUp) {
  logger::FaultFact fault = SomeFault();
  fault.fault.line = 0;
  fault.function.clear();
  const Json json = FaultJson(fault);
  for (const char* key : {"file", "line", "function"}) EXPECT_TRUE(json[key].is_null()) << key;
  EXPECT_EQ(FaultText(fault), "    3.20 s  m2     division by zero");
}

}  // namespace
}  // namespace morphbus::tools
