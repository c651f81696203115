#include "compiler/base/quantity.h"

#include <gtest/gtest.h>

#include <numbers>

namespace morphbus {
namespace {

/// What is no number with a unit that anything has.
constexpr const char* kNoQuantities[] = {"",    "s",   "deg", "%",      " 1",    "1 s", "1m",
                                         "+-1", "nan", "inf", "1e999s", "1deg2", "1%%"};

TEST(Quantity, PlainNumbersHaveNoUnit) {
  EXPECT_EQ(ReadPlainNumber("-2.5e1"), -25.0);
  EXPECT_EQ(ReadPlainNumber("+2.5"), 2.5);
  for (const char* text : {"1s", "1rad", "1%", "0x1"})
    EXPECT_EQ(ReadPlainNumber(text), std::nullopt);
}

TEST(Quantity, SecondsAndMillisecondsAreRead) {
  EXPECT_EQ(ReadSeconds("2.5"), 2.5);
  EXPECT_EQ(ReadSeconds("2.5s"), 2.5);
  EXPECT_EQ(ReadSeconds("300ms"), 0.3);
  EXPECT_EQ(ReadSeconds("-1e3ms"), -1.0);
}

TEST(Quantity, RadiansAndDegreesAreRead) {
  EXPECT_EQ(ReadRadians("-2.5"), -2.5);
  EXPECT_EQ(ReadRadians("2.5rad"), 2.5);
  EXPECT_EQ(ReadRadians("180deg"), std::numbers::pi);
  EXPECT_EQ(ReadRadians("-9e1deg"), -std::numbers::pi / 2);
}

TEST(Quantity, FractionsAndPercentagesAreRead) {
  EXPECT_EQ(ReadFraction("0.2"), 0.2);
  EXPECT_EQ(ReadFraction("20%"), 0.2);
  EXPECT_EQ(ReadFraction("7%"), 0.07);
  EXPECT_EQ(ReadFraction("100%"), 1.0);
  // These leave open what is meant, or cannot be.
  for (const char* text : {"20", "1.01", "101%", "-0.1", "-5%"}) {
    EXPECT_EQ(ReadFraction(text), std::nullopt) << text;
  }
}

TEST(Quantity, NothingElseIsOne) {
  for (const char* text : kNoQuantities) {
    EXPECT_EQ(ReadPlainNumber(text), std::nullopt) << text;
    EXPECT_EQ(ReadSeconds(text), std::nullopt) << text;
    EXPECT_EQ(ReadRadians(text), std::nullopt) << text;
    EXPECT_EQ(ReadFraction(text), std::nullopt) << text;
  }
}

TEST(Quantity, UnitsAreThoseOfTheQuantity) {
  EXPECT_EQ(ReadSeconds("1deg"), std::nullopt);
  EXPECT_EQ(ReadRadians("1s"), std::nullopt);
  EXPECT_EQ(ReadFraction("1ms"), std::nullopt);
}

TEST(Quantity, OptionsAreLeftAPlainNumberOrAreToldWhatIsExpected) {
  std::string text = "20%";
  EXPECT_EQ(MakePlain(kFractionReader, &text), "");
  EXPECT_EQ(text, "0.2");
  text = "2500ms";
  EXPECT_EQ(MakePlain(kSecondsReader, &text), "");
  EXPECT_EQ(text, "2.5");
  text = "20";
  EXPECT_EQ(MakePlain(kFractionReader, &text),
            "expected a fraction, 0 to 1, such as 0.2 or 20%, not '20'");
  EXPECT_EQ(text, "20");
}

}  // namespace
}  // namespace morphbus
