#pragma once
// Copies fields between a struct of the wire and one of the VM, for codecs that list what
// corresponds to what once, for both ways.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <utility>

#include "vm/module_api.h"

namespace morphbus::bridge {

/// Copies one number; whichever side is not const is written.
template <class Wire, class Vm>
void CopyOne(Wire& wire, Vm& vm) {
  using To = std::remove_const_t<Wire>;
  if constexpr (std::is_same_v<std::remove_const_t<Vm>, vm::Cell>) {
    // Arguments travel as the 32 bits of their cells; the program knows which are numbers.
    if constexpr (std::is_const_v<Wire>) {
      vm = vm::Cell::Int(wire);
    } else {
      wire = vm.AsInt();
    }
  } else if constexpr (std::is_const_v<Wire>) {
    vm = static_cast<Vm>(wire);
  } else if constexpr (std::is_same_v<To, int32_t> && std::is_same_v<const Vm, const int64_t>) {
    // Ticks of body entries travel in 32 bits: over a year of ticks of 20 ms; beyond that they stay
    // at the end of the range.
    wire = static_cast<To>(std::clamp<int64_t>(vm, INT32_MIN, INT32_MAX));
  } else {
    wire = static_cast<To>(vm);
  }
}

/// Copies fields between a struct of the wire and one of the VM, whichever way: the one that is
/// read is const. Both list their fields in the same order.
template <class... Wire, class... Vm>
void Copy(std::tuple<Wire&...> wire, std::tuple<Vm&...> vm) {
  [&]<size_t... I>(std::index_sequence<I...>) {
    (CopyOne(std::get<I>(wire), std::get<I>(vm)), ...);
  }
  (std::index_sequence_for<Wire...>());
}

/// Copies a list, element by element: on the wire a length and a vector, in the VM a length and an
/// array. Decode has seen to it that lengths fit the VM's arrays.
template <class Elements, class Array, class WireLength, class VmLength, class CopyElement>
void CopyList(WireLength& wire_length, Elements& wire, VmLength& vm_length, Array& vm,
              const CopyElement& copy) {
  Copy(std::tie(wire_length), std::tie(vm_length));
  if constexpr (!std::is_const_v<Elements>) wire.resize(static_cast<size_t>(vm_length));
  for (size_t i = 0; i < static_cast<size_t>(vm_length); ++i) copy(wire[i], vm[i]);
}

/// A value of the program, as the 32 bits of its cell.
constexpr auto kCell = [](auto& wire, auto& vm) { CopyOne(wire, vm); };

}  // namespace morphbus::bridge
