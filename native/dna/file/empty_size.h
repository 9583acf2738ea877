// SPDX-License-Identifier: MIT
// The number of bytes that a value with empty lists and texts has in a file. It is the smallest
// size of an element of a list.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "dna/schema.h"

namespace risorius::dna::detail {

class EmptySize {
 public:
  std::uint32_t bytes = 0;

  template <class Body>
  void group(Name, Body body) {
    body();
  }
  void field(Name, const std::uint16_t&) { bytes += 2; }
  void field(Name, const std::uint32_t&) { bytes += 4; }
  void field(Name, const std::int32_t&) { bytes += 4; }
  void field(Name, const float&) { bytes += 4; }
  void field(Name, const std::string&) { bytes += 4; }
  template <class T>
  void field(Name, const core::Array<T>&) {
    bytes += 4;
  }
  template <std::size_t kPlanes>
  void field(Name, const core::PlanarArray<kPlanes>&) {
    bytes += 4 * kPlanes;
  }
  template <class T>
  void field(Name, const std::vector<T>&) {
    bytes += 4;
  }
  template <class T>
  void field(Name, const core::List<T>&) {
    bytes += 4;
  }
  template <class T>
  void field(Name, const T& v) {
    describe(*this, v);
  }
  template <class T>
  void sized(Name, const core::List<T>&, const LodMapping*) {
    bytes += 4;
  }
  void setups(Name, const core::List<TwistSwingSetup>&, bool) { bytes += 4; }
  void matrix(Name, const JointGroup&) { bytes += 4; }
  void faces(const Mesh&) { bytes += 4; }
  void skin(const Mesh&) { bytes += 4; }
  void targets(const Mesh&) { bytes += 4; }
};

template <class T>
struct EmptySizeOf {
  static std::uint32_t value() {
    EmptySize size;
    const T empty{};
    if constexpr (std::is_same_v<T, TwistSwingSetup>) {
      describe_setup(size, empty, true);
    } else {
      describe(size, empty);
    }
    return size.bytes;
  }
};
template <class T>
struct CountOnly {
  static std::uint32_t value() { return 4; }
};
template <>
struct EmptySizeOf<std::string> : CountOnly<std::string> {};
template <class T>
struct EmptySizeOf<core::Array<T>> : CountOnly<T> {};
template <class T>
struct EmptySizeOf<std::vector<T>> : CountOnly<T> {};
template <class T>
struct EmptySizeOf<core::List<T>> : CountOnly<T> {};
template <>
struct EmptySizeOf<std::pair<std::string, std::string>> {
  static std::uint32_t value() { return 8; }
};

template <class T>
std::uint32_t empty_size() {
  static const std::uint32_t size = EmptySizeOf<T>::value();
  return size;
}

}  // namespace risorius::dna::detail
