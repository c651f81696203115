#include "tools/machine/machine_findings.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sim/arithmetic.h"

namespace morphbus::tools {
namespace {

/// What a burst of 4,160 messages to a socket became.
Burst BurstOf(int asked, int got, int kept) {
  Burst burst;
  burst.sent = 2 * kNeededMessages;
  burst.kept = kept;
  burst.asked_bytes = asked;
  burst.got_bytes = got;
  return burst;
}

// net.core.rmem_max is one for the whole machine, also for root of a network of its own, so what is
// found where it is too low is judged here and not measured.
TEST(MachineFindings, ABufferThatTheKernelCutIsMendedInTheKernel) {
  const Finding finding = JudgeBuffer(BurstOf(4'194'304, 212'992, 166));
  EXPECT_EQ(finding.health, Health::kWarning);
  EXPECT_EQ(finding.mend,
            "echo net.core.rmem_max=4194304 | sudo tee /etc/sysctl.d/60-morphbus.conf && sudo "
            "sysctl --system");
}

TEST(MachineFindings, ABufferForWhichTheUrlAsksTooLittleIsMendedInTheUrl) {
  const Finding finding = JudgeBuffer(BurstOf(20'000, 20'000, 30));
  EXPECT_EQ(finding.health, Health::kWarning);
  EXPECT_EQ(finding.mend.find("export LCM_DEFAULT_URL='udpm://"), 0U) << finding.mend;
}

TEST(MachineFindings, ABufferIsJudgedByWhatItKeepsAndNotByItsSize) {
  EXPECT_EQ(JudgeBuffer(BurstOf(4'194'304, 212'992, kNeededMessages)).health, Health::kGood);
  const Finding finding = JudgeBuffer(BurstOf(4'194'304, 4'194'304, kNeededMessages - 1));
  EXPECT_EQ(finding.health, Health::kWarning);
  EXPECT_FALSE(finding.mend.empty());
}

TEST(MachineFindings, AKernelThatRefusesFiltersIsMendedByMoreMemoryForThem) {
  const Finding refused = JudgeFilter(8192, 700, false);
  EXPECT_EQ(refused.health, Health::kWarning);
  EXPECT_NE(refused.text.find("net.core.optmem_max is 8192 bytes"), std::string::npos);
  EXPECT_TRUE(refused.mend.starts_with("echo net.core.optmem_max=131072"));
  const Finding taken = JudgeFilter(20480, 700, true);
  EXPECT_EQ(taken.health, Health::kGood);
  EXPECT_TRUE(taken.mend.empty());
}

TEST(MachineFindings, LimitsAreRaisedByTheShellUpToTheHardLimitAndByRootBeyond) {
  EXPECT_EQ(JudgeFiles({64, 524'288}).mend, "ulimit -n 4096");
  EXPECT_EQ(JudgeFiles({64, 1024}).mend, "sudo prlimit --pid $$ --nofile=4096");
  EXPECT_EQ(JudgeProcesses({100, RLIM_INFINITY}).mend, "ulimit -u 4096");
  EXPECT_EQ(JudgeProcesses({100, 100}).mend, "sudo prlimit --pid $$ --nproc=4096");
  for (const Finding& finding : {JudgeFiles({512, 512}), JudgeProcesses({256, 256}),
                                 JudgeFiles({RLIM_INFINITY, RLIM_INFINITY})}) {
    EXPECT_EQ(finding.health, Health::kGood) << finding.text;
    EXPECT_EQ(finding.mend, "");
  }
}

TEST(MachineFindings, AnArithmeticThatIsNotTheUsualOneIsWarnedOf) {
  const Finding usual = JudgeArithmetic(std::string(sim::kUsualArithmetic));
  EXPECT_EQ(usual.health, Health::kGood);
  const Finding other = JudgeArithmetic("0123456789abcdef");
  EXPECT_EQ(other.health, Health::kWarning);
  for (const std::string_view fingerprint :
       {std::string_view("0123456789abcdef"), sim::kUsualArithmetic}) {
    EXPECT_NE(other.text.find(fingerprint), std::string::npos) << other.text;
  }
}

TEST(MachineFindings, AClockThatNobodySetsIsWarnedOf) {
  EXPECT_EQ(JudgeClock(true).health, Health::kGood);
  EXPECT_EQ(JudgeClock(true).mend, "");
  EXPECT_EQ(JudgeClock(false).health, Health::kWarning);
  EXPECT_EQ(JudgeClock(false).mend, "sudo timedatectl set-ntp true");
}

TEST(MachineFindings, ATimerIsJudgedByItsMedianForOneLateWakeIsNoHarm) {
  EXPECT_EQ(JudgeTimer({80, 0.1, 0.2, 0.1, 0.3}).health, Health::kGood);
  const Finding finding = JudgeTimer({6, 0.1, 7, 8, 0.2});
  EXPECT_EQ(finding.health, Health::kWarning);
  EXPECT_EQ(finding.mend, "sudo renice -n -10 -p $$");
  EXPECT_NE(finding.text.find("wakes 6.00 ms late (worst of 5: 8.00)"), std::string::npos);
}

}  // namespace
}  // namespace morphbus::tools
