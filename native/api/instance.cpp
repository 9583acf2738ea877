// SPDX-License-Identifier: MIT
// One character: its controls, its level of detail and its pose.
#include "rig/stages/instance.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "api/errors.h"
#include "api/face.h"
#include "core/finite.h"
#include "rig/stages/evaluate.h"
#include "rig/stages/tables.h"

using namespace risorius;

struct risorius_instance {
  explicit risorius_instance(std::shared_ptr<const api::Face> shared)
      : face(std::move(shared)),
        raw(face->rig.initial_controls.begin(),
            face->rig.initial_controls.begin() + face->rig.raw_count),
        gui(face->rig.gui_count),
        from_gui(face->rig.raw_count),
        work(rig::make_workspace(face->rig)),
        pose(rig::make_pose(face->rig)) {}

  std::shared_ptr<const api::Face> face;
  std::vector<float> raw, gui;
  std::vector<float> from_gui;  // raw controls from the table; scratch memory of risorius_set
  std::uint32_t lod = 0;
  rig::Workspace work;
  rig::Pose pose;                       // of RISORIUS_SETTLED
  std::optional<rig::Instance> latent;  // of RISORIUS_LATENT; has a pose of its own
  // The pose inside `latent`, after the first evaluation with RISORIUS_LATENT. Null before, and
  // always with RISORIUS_SETTLED; while it is null, values are read from `pose`.
  const rig::Pose* evaluated = nullptr;
};

namespace {

// An instance's values of a list of controls, joints, shapes or maps; null for another list.
const std::vector<float>* values_of(const risorius_instance& instance, risorius_list list) {
  const rig::Pose& pose = instance.evaluated != nullptr ? *instance.evaluated : instance.pose;
  switch (list) {
    case RISORIUS_RAW_CONTROLS:
      return &instance.raw;
    case RISORIUS_GUI_CONTROLS:
      return &instance.gui;
    case RISORIUS_JOINTS:
      return &pose.joints;
    case RISORIUS_SHAPES:
      return &pose.blend_shapes;
    case RISORIUS_MAPS:
      return &pose.animated_maps;
    default:
      return nullptr;
  }
}

// Sets the raw controls that GUI controls drive, by the face's table from GUI to raw controls.
// Other raw controls do not change.
void apply_table(risorius_instance& instance) {
  rig::gui_to_raw(instance.face->rig, instance.gui.data(), instance.from_gui.data());
  for (std::size_t i = 0; i < instance.raw.size(); ++i) {
    if (instance.face->gui_writes[i]) instance.raw[i] = instance.from_gui[i];
  }
}

risorius_status refuse_range(std::uint32_t first, std::uint32_t count, std::size_t size) {
  return api::guarded([&] {
    return api::refuse("first, count", std::to_string(count) + " controls from " +
                                           std::to_string(first) + " on, but there are " +
                                           std::to_string(size));
  });
}

risorius_status refuse_number(std::span<const float> values, std::uint32_t first) {
  std::size_t i = 0;
  while (core::is_finite(values[i])) ++i;
  return api::guarded([&] {
    return api::refuse("values[" + std::to_string(i) + "]",
                       "a finite number was expected, found " + std::to_string(values[i]) +
                           " for control " + std::to_string(first + i));
  });
}

}  // namespace

risorius_status risorius_create(const risorius_face* face, risorius_timing timing,
                                risorius_instance** instance) {
  if (face == nullptr) return api::refuse("face", "a face was expected, found NULL");
  if (instance == nullptr) return api::refuse("instance", "a place was expected, found NULL");
  if (timing != RISORIUS_SETTLED && timing != RISORIUS_LATENT) {
    return api::refuse("timing", "RISORIUS_SETTLED or RISORIUS_LATENT was expected");
  }
  return api::guarded([&] {
    auto made = std::make_unique<risorius_instance>(face->face);
    if (timing == RISORIUS_LATENT) made->latent.emplace(made->face->rig);
    *instance = made.release();
    return RISORIUS_OK;
  });
}

void risorius_destroy(risorius_instance* instance) { delete instance; }

risorius_status risorius_set(risorius_instance* instance, risorius_list list, uint32_t first,
                             uint32_t count, const float* values) {
  if (instance == nullptr) return api::refuse("instance", "an instance was expected, found NULL");
  if (list != RISORIUS_RAW_CONTROLS && list != RISORIUS_GUI_CONTROLS) {
    return api::refuse("list", "RISORIUS_RAW_CONTROLS or RISORIUS_GUI_CONTROLS was expected");
  }
  if (values == nullptr && count > 0)
    return api::refuse("values", "values were expected, found NULL");
  std::vector<float>& to = list == RISORIUS_RAW_CONTROLS ? instance->raw : instance->gui;
  if (first > to.size() || count > to.size() - first) {
    return refuse_range(first, count, to.size());
  }
  const std::span<const float> given(values, count);
  if (!core::all_finite(given)) return refuse_number(given, first);
  std::copy(given.begin(), given.end(), to.begin() + first);
  if (list == RISORIUS_GUI_CONTROLS) apply_table(*instance);
  return RISORIUS_OK;
}

risorius_status risorius_set_lod(risorius_instance* instance, uint32_t lod) {
  if (instance == nullptr) return api::refuse("instance", "an instance was expected, found NULL");
  const std::uint32_t count = instance->face->rig.lod_count;
  if (lod >= count) {
    return api::guarded([&] {
      return api::refuse("lod", "a LOD below " + std::to_string(count) + " was expected, found " +
                                    std::to_string(lod));
    });
  }
  instance->lod = lod;
  if (instance->latent) instance->latent->set_lod(lod);
  return RISORIUS_OK;
}

risorius_status risorius_evaluate(risorius_instance* instance) {
  if (instance == nullptr) return api::refuse("instance", "an instance was expected, found NULL");
  if (instance->latent) {
    instance->evaluated = &instance->latent->evaluate(instance->raw.data());
    return RISORIUS_OK;
  }
  rig::evaluate(instance->face->rig, instance->raw.data(), instance->lod, true, instance->work,
                instance->pose);
  return RISORIUS_OK;
}

const float* risorius_values(const risorius_instance* instance, risorius_list list,
                             uint32_t* count) {
  if (instance == nullptr) {
    return (void)api::refuse("instance", "an instance was expected, found NULL"), nullptr;
  }
  const std::vector<float>* values = values_of(*instance, list);
  if (values == nullptr) {
    return (void)api::refuse("list", "a list that has values was expected"), nullptr;
  }
  if (count != nullptr) *count = static_cast<std::uint32_t>(values->size());
  static const float kNothing = 0.0f;
  return values->empty() ? &kNothing : values->data();
}
