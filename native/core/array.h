// SPDX-License-Identifier: MIT
// The two containers of a Dna: Array (numbers) and List (structs).
#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace risorius::core {

/// An immutable array of numbers. Copies share the buffer, which lives as long as any copy, so a
/// NumPy view may hold one. To change a value, assign a new Array.
template <class T>
class Array {
 public:
  Array() = default;
  Array(std::vector<T> values)
      : buffer_(values.empty() ? nullptr
                               : std::make_shared<const std::vector<T>>(std::move(values))) {}
  Array(std::initializer_list<T> values) : Array(std::vector<T>(values)) {}

  std::size_t size() const { return buffer_ ? buffer_->size() : 0; }
  bool empty() const { return size() == 0; }
  const T* data() const { return buffer_ ? buffer_->data() : nullptr; }
  const T* begin() const { return data(); }
  const T* end() const { return data() + size(); }
  const T& operator[](std::size_t i) const { return (*buffer_)[i]; }
  std::span<const T> span() const { return {data(), size()}; }
  operator std::span<const T>() const { return span(); }
  std::shared_ptr<const void> owner() const { return buffer_; }
  bool operator==(const Array& other) const { return std::ranges::equal(span(), other.span()); }

 private:
  std::shared_ptr<const std::vector<T>> buffer_;
};

/// Three (or two) parallel planes of n floats in one buffer: x0..xn-1 y0..yn-1 z0..zn-1, as the
/// format stores them. Python sees float32[n, planes] with strides.
template <std::size_t kPlanes>
struct PlanarArray {
  Array<float> values;  // size = kPlanes * count()

  std::size_t count() const { return values.size() / kPlanes; }
  std::span<const float> plane(std::size_t p) const {
    return values.span().subspan(p * count(), count());
  }
  float at(std::size_t i, std::size_t p) const { return values[p * count() + i]; }
  bool operator==(const PlanarArray&) const = default;
};
using Vec3Array = PlanarArray<3>;
using Vec2Array = PlanarArray<2>;

/// A list of structs with value semantics (copies are deep). Its storage is replaced as a whole and
/// kept alive by element_ptr(), so that Python may hold an element of a list that was replaced.
template <class T>
class List {
 public:
  List() : items_(std::make_shared<std::vector<T>>()) {}
  List(std::vector<T> items) : items_(std::make_shared<std::vector<T>>(std::move(items))) {}
  List(const List& other) : List(*other.items_) {}
  List(List&& other) noexcept(false) : List() { items_.swap(other.items_); }
  List& operator=(List other) {
    items_.swap(other.items_);
    return *this;
  }

  std::size_t size() const { return items_->size(); }
  bool empty() const { return items_->empty(); }
  T& operator[](std::size_t i) { return (*items_)[i]; }
  const T& operator[](std::size_t i) const { return (*items_)[i]; }
  auto begin() { return items_->begin(); }
  auto end() { return items_->end(); }
  auto begin() const { return std::as_const(*items_).begin(); }
  auto end() const { return std::as_const(*items_).end(); }
  std::shared_ptr<T> element_ptr(std::size_t i) const {
    return std::shared_ptr<T>(items_, &(*items_)[i]);
  }
  bool operator==(const List& other) const { return *items_ == *other.items_; }

 private:
  std::shared_ptr<std::vector<T>> items_;
};

}  // namespace risorius::core
