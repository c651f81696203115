#pragma once
// Images for modules of FakeRobot (test/bridge/fake_run.h).

#include <cstdint>
#include <vector>

namespace morphbus::bridge {

/// Two joints, three links; connector 1 of one module fits connector 0 of the next by number 5.
std::vector<uint8_t> FakeKinematics();

/// A program without roles: the VM only spreads poses and bodies. Programs with other settle ticks
/// have other hashes.
std::vector<uint8_t> EmptyProgram(uint16_t settle_ticks = 3);

}  // namespace morphbus::bridge
