// SPDX-License-Identifier: MIT
// Evaluates a frame of several faces in several threads. The tasks are one begin() for each face,
// which evaluates its rig and bones, and one write() for each block of 1,024 vertices of a mesh.
#include <algorithm>
#include <atomic>
#include <system_error>
#include <thread>

#include "rig/direct/direct_face.h"

namespace risorius::rig {
namespace {

// Starting a thread takes as long as skinning this many vertices.
constexpr std::size_t kWorthAThread = 8192;
constexpr std::size_t kMostThreads = 64;

// One list of tasks for all threads: first the begin() of each face, then the blocks of all meshes.
// A thread that takes a block waits until the begin() of the block's face has finished. Threads
// share ownership of the list: the caller waits until all tasks are done, not until each thread has
// started, which takes longer than a frame on a busy machine. A thread that starts too late finds
// no task.
class Work {
 public:
  Work(std::span<DirectFace* const> faces, std::span<FaceFrame> frames)
      : faces_(faces), frames_(frames), begun_(faces.size()) {
    for (std::size_t f = 0; f < faces.size(); ++f) {
      for (std::size_t t = 0; t < frames[f].targets.size(); ++t) {
        const Skin& skin = *faces[f]->parts().meshes[frames[f].targets[t].mesh].skin;
        meshes_.push_back({f, t, blocks_});
        blocks_ += skin.block_count();
        vertices_ += skin.vertex_count;
      }
    }
  }

  std::size_t vertices() const { return vertices_; }

  void run() noexcept {
    const std::size_t count = faces_.size() + blocks_;
    for (std::size_t i = next_++; i < count; i = next_++) {
      if (i < faces_.size()) {
        begin(i);
      } else {
        write(i - faces_.size());
      }
      done_.fetch_add(1, std::memory_order_release);
    }
  }

  void wait() const noexcept {
    const std::size_t count = faces_.size() + blocks_;
    while (done_.load(std::memory_order_acquire) != count) std::this_thread::yield();
  }

 private:
  struct Mesh {
    std::size_t face, target, first;  // first: number of its first block among all blocks
  };

  void begin(std::size_t f) noexcept {
    faces_[f]->begin(frames_[f]);
    for (Target& target : frames_[f].targets) {
      target.written = faces_[f]->is_due(frames_[f], target);
    }
    begun_[f].store(true, std::memory_order_release);
  }

  void write(std::size_t block) noexcept {
    const auto after = std::ranges::upper_bound(meshes_, block, {}, &Mesh::first);
    const Mesh& mesh = *(after - 1);
    while (!begun_[mesh.face].load(std::memory_order_acquire)) std::this_thread::yield();
    const Target& target = frames_[mesh.face].targets[mesh.target];
    if (!target.written) return;
    faces_[mesh.face]->write(target, static_cast<std::uint32_t>(block - mesh.first));
  }

  std::span<DirectFace* const> faces_;
  std::span<FaceFrame> frames_;
  std::vector<std::atomic<bool>> begun_;
  std::vector<Mesh> meshes_;  // sorted by first block; meshes without blocks are never found
  std::size_t blocks_ = 0, vertices_ = 0;
  std::atomic<std::size_t> next_{0}, done_{0};
};

}  // namespace

void evaluate_faces(std::span<DirectFace* const> faces, std::span<FaceFrame> frames,
                    std::size_t threads) {
  const auto work = std::make_shared<Work>(faces, frames);
  if (threads == 0) {
    threads = std::max(1u, std::thread::hardware_concurrency());
    threads = std::clamp<std::size_t>(work->vertices() / kWorthAThread, 1, threads);
  }
  for (std::size_t t = 1; t < std::min(threads, kMostThreads); ++t) {
    try {
      std::thread([work] { work->run(); }).detach();
      // If the system has no more threads, the calling thread does the remaining work.
    } catch (const std::system_error&) {
      break;
    }
  }
  work->run();
  work->wait();
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (const Target& target : frames[f].targets) {
      if (target.written) faces[f]->end(target);
    }
  }
}

}  // namespace risorius::rig
