// SPDX-License-Identifier: MIT
// The name of a field, which becomes text only if there is an error.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <string>

namespace risorius::dna::detail {

/// A field's name such as "geometry.meshes[3].positions[7]", stored as a few pointers: a check uses
/// thousands of names and rarely needs one as text. The pointers are not copied, so pass string
/// literals.
class Where {
 public:
  Where(const char* name) { add({name, kNone}); }
  Where operator+(const char* name) const { return with({name, kNone}); }
  Where operator[](std::size_t index) const { return with({"", index}); }

  std::string text() const {
    std::string out;
    for (std::size_t i = 0; i < size_; ++i) {
      out += parts_[i].name;
      if (parts_[i].index != kNone) out += "[" + std::to_string(parts_[i].index) + "]";
    }
    return out;
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  struct Part {
    const char* name = "";
    std::size_t index = kNone;
  };
  void add(Part part) {
    assert(size_ < parts_.size());
    parts_[size_++] = part;
  }
  Where with(Part part) const {
    Where more = *this;
    more.add(part);
    return more;
  }

  std::array<Part, 8> parts_;
  std::size_t size_ = 0;
};

}  // namespace risorius::dna::detail
