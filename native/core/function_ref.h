// SPDX-License-Identifier: MIT
// A function argument that is called but not stored, like std::function_ref of C++26.
#pragma once

#include <concepts>
#include <memory>
#include <type_traits>
#include <utility>

namespace risorius::core {

template <class Signature>
class FunctionRef;

/// A reference to a function or lambda, which must outlive the reference. The reference has two
/// pointers and allocates nothing. A function with a FunctionRef parameter is compiled once,
/// whereas a template is compiled for each lambda.
template <class Result, class... Args>
class FunctionRef<Result(Args...)> {
 public:
  template <class F>
    requires(!std::same_as<std::remove_cvref_t<F>, FunctionRef> &&
             std::is_invocable_r_v<Result, F&, Args...>)
  // NOLINTNEXTLINE(google-explicit-constructor): a lambda converts implicitly
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
