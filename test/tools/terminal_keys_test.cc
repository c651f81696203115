#include "tools/base/terminal_keys.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <string>
#include <vector>

namespace morphbus::tools {
namespace {

std::vector<TerminalKey> KeysOf(std::string bytes, bool complete = true) {
  std::vector<TerminalKey> keys;
  while (const std::optional<TerminalKey> key = TakeKey(&bytes, complete)) keys.push_back(*key);
  return keys;
}

using Kind = TerminalKey::Kind;

TEST(TerminalKeysTest, CharactersAndSequencesAreToldApart) {
  const std::vector<TerminalKey> expected = {{Kind::kCharacter, ' '}, {Kind::kLeft, 0},
                                             {Kind::kCharacter, 'q'}, {Kind::kRight, 0},
                                             {Kind::kPageUp, 0},      {Kind::kPageDown, 0},
                                             {Kind::kHome, 0},        {Kind::kCharacter, '+'}};
  EXPECT_EQ(KeysOf(" \x1B[Dq\x1BOC\x1B[5~\x1B[6~\x1B[H+"), expected);
}

TEST(TerminalKeysTest, UnknownSequencesAreOneKeyAndNoneOfTheirCharactersIsTyped) {
  // F5, control and an arrow, and a mouse's report.
  EXPECT_EQ(KeysOf("\x1B[15~\x1B[1;5C\x1B[<0;10;20M"),
            std::vector<TerminalKey>(3, {Kind::kOther, 0}));
}

TEST(TerminalKeysTest, AnUnfinishedSequenceWaitsForItsEndUnlessThereIsNone) {
  EXPECT_TRUE(KeysOf("\x1B[", false).empty());
  EXPECT_TRUE(KeysOf("\x1B", false).empty());
  EXPECT_EQ(KeysOf("\x1B[", true), std::vector<TerminalKey>({{Kind::kOther, 0}}));
  EXPECT_EQ(KeysOf("\x1B", true), std::vector<TerminalKey>({{Kind::kOther, 0}}));
}

TEST(TerminalKeysTest, FromAPipeCharactersAreKeysAndItsEndIsTold) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  TerminalKeys keys(ends[0]);
  EXPECT_FALSE(keys.Next().has_value());
  EXPECT_FALSE(keys.ended());
  ASSERT_EQ(write(ends[1], " \n", 2), 2);
  close(ends[1]);
  EXPECT_EQ(keys.Next(), (TerminalKey{Kind::kCharacter, ' '}));
  EXPECT_EQ(keys.Next(), (TerminalKey{Kind::kCharacter, '\n'}));
  EXPECT_FALSE(keys.Next().has_value());
  EXPECT_TRUE(keys.ended());
  close(ends[0]);
}

}  // namespace
}  // namespace morphbus::tools
