// SPDX-License-Identifier: MIT
// If memory runs out, the C API reports it and throws nothing; a later call with enough memory
// succeeds.
#include <atomic>
#include <cstdlib>
#include <new>

#include "api/opened.h"

namespace {

std::atomic<long> left{-1};  // calls of new that still succeed; -1: all

void* given(std::size_t bytes) noexcept {
  if (left == 0) return nullptr;
  if (left > 0) --left;
  return std::malloc(bytes > 0 ? bytes : 1);
}

}  // namespace

void* operator new(std::size_t bytes) {
  if (void* p = given(bytes)) return p;
  throw std::bad_alloc();
}
void* operator new[](std::size_t bytes) { return operator new(bytes); }
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return given(bytes); }
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return given(bytes); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, const std::nothrow_t&) noexcept { std::free(p); }
void operator delete[](void* p, const std::nothrow_t&) noexcept { std::free(p); }

namespace risorius {
namespace {

using namespace testing_support;

TEST(ApiStarved, EachAllocationThatFailsIsAnErrorAndTheNextTryWorks) {
  const std::vector<std::uint8_t> bytes = read_file(golden_path("tiny_v28"));
  int refused = 0;
  for (long allowed = 0; allowed < 100000; allowed = allowed * 9 / 8 + 1) {
    risorius_face* face = nullptr;
    risorius_instance* instance = nullptr;
    left = allowed;
    risorius_status status = risorius_open_memory(bytes.data(), bytes.size(), nullptr, &face);
    if (status == RISORIUS_OK) status = risorius_create(face, RISORIUS_LATENT, &instance);
    left = -1;
    ASSERT_TRUE(status == RISORIUS_OK || status == RISORIUS_OUT_OF_MEMORY)
        << risorius_last_error()->message;
    risorius_destroy(instance);
    risorius_close(face);
    if (status == RISORIUS_OK) {
      EXPECT_GT(refused, 10);
      return;
    }
    EXPECT_STREQ(risorius_last_error()->code, "out_of_memory");
    EXPECT_EQ(instance, nullptr);
    ++refused;
  }
  FAIL() << "it never succeeded";
}

TEST(ApiStarved, AnErrorWithoutMemoryForItsWordsKeepsItsStatus) {
  const std::vector<std::uint8_t> bytes(3, 7);
  for (long allowed = 0; allowed < 20; ++allowed) {
    risorius_face* face = nullptr;
    left = allowed;
    const risorius_status status = risorius_open_memory(bytes.data(), bytes.size(), nullptr, &face);
    left = -1;
    ASSERT_TRUE(status == RISORIUS_BAD_FILE || status == RISORIUS_OUT_OF_MEMORY);
    EXPECT_EQ(risorius_last_error()->status, status);
    EXPECT_NE(*risorius_last_error()->message, '\0');
  }
}

}  // namespace
}  // namespace risorius
