// SPDX-License-Identifier: MIT
// A function that is handed down and called, not kept: what C++26 names std::function_ref.
#pragma once

#include <concepts>
#include <memory>
#include <type_traits>
#include <utility>

namespace risorius::core {

template <class Signature>
class FunctionRef;

/// Stands for a function or lambda that lives longer than it; two pointers, nothing allocated. A
/// function that takes one is compiled once, where a template is compiled for each lambda.
template <class Result, class... Args>
class FunctionRef<Result(Args...)> {
 public:
  template <class F>
    requires(!std::same_as<std::remove_cvref_t<F>, FunctionRef> &&
             std::is_invocable_r_v<Result, F&, Args...>)
  // NOLINTNEXTLINE(google-explicit-constructor): a lambda is given where it is wanted
  FunctionRef(F&& function)
      : object_(const_cast<void*>(static_cast<const void*>(std::addressof(function)))),
        call_([](void* object, Args... args) -> Result {
          return (*static_cast<std::remove_reference_t<F>*>(object))(std::forward<Args>(args)...);
        }) {}

  Result operator()(Args... args) const { return call_(object_, std::forward<Args>(args)...); }

 private:
  void* object_;
  Result (*call_)(void*, Args...);
};

}  // namespace risorius::core
