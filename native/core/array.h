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

#include "core/buffer.h"

namespace risorius::core {

/// An immutable array of numbers. Copies share the buffer, which lives as long as any copy, so that
/// a NumPy view can keep a copy. To change a value, assign a new Array.
template <class T>
class Array {
 public:
  Array() = default;
  Array(Buffer<T> values) : size_(values.size()), values_(values.release()) {}
  Array(std::vector<T> values) : size_(values.size()) {
    if (values.empty()) return;
    auto owner = std::make_shared<const std::vector<T>>(std::move(values));
    const T* first = owner->data();
    values_ = std::shared_ptr<const T>(std::move(owner), first);
  }
  Array(std::initializer_list<T> values) : Array(std::vector<T>(values)) {}
  Array(const Array&) = default;
  Array& operator=(const Array&) = default;
  Array(Array&& other) noexcept
      : size_(std::exchange(other.size_, 0)), values_(std::move(other.values_)) {}
  Array& operator=(Array&& other) noexcept {
    size_ = std::exchange(other.size_, 0);
    values_ = std::move(other.values_);
    return *this;
  }

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const T* data() const { return values_.get(); }
  const T* begin() const { return data(); }
  const T* end() const { return data() + size_; }
  const T& operator[](std::size_t i) const { return values_.get()[i]; }
  std::span<const T> span() const { return {data(), size_}; }
  operator std::span<const T>() const { return span(); }
  std::shared_ptr<const void> owner() const { return values_; }
  bool operator==(const Array& other) const { return std::ranges::equal(span(), other.span()); }

 private:
  std::size_t size_ = 0;
  std::shared_ptr<const T> values_;
};

/// kPlanes (2 or 3) parallel planes of n floats in one buffer, for 3 planes x0..xn-1 y0..yn-1
/// z0..zn-1, as DNA files store them. Python sees float32[n, planes] with strides.
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

/// A list of structs. A copy of a list copies its structs. Assigning a list replaces its storage; a
/// pointer from element_ptr() keeps the old storage alive, so that a Python object can still refer
/// to an element of it.
template <class T>
class List {
 public:
  List() : items_(std::make_shared<std::vector<T>>()) {}
  List(std::vector<T> items) : items_(std::make_shared<std::vector<T>>(std::move(items))) {}
  List(const List& other) : List(*other.items_) {}
  // A moved-from list is an empty list. Its empty storage must be allocated, which may throw.
  // NOLINTNEXTLINE(bugprone-unsafe-to-allow-exceptions)
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
