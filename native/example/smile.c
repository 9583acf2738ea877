/* SPDX-License-Identifier: MIT
 * smile: an example program with a face. It opens a DNA file, sets one control to 0.5 and to 1 at
 * the most and at the least detailed LOD, and prints each time the sum of the outputs and the
 * joint, shape and map with the largest output.
 *
 *     smile FILE.dna [CONTROL]
 */
#include <math.h>
#include <risorius.h>
#include <stdio.h>
#include <string.h>

static int complain(void) {
  const risorius_error* error = risorius_last_error();
  fprintf(stderr, "smile: %s: %s", error->code, error->message);
  if (error->field[0] != '\0') fprintf(stderr, " (%s)", error->field);
  if (error->offset >= 0) fprintf(stderr, " at byte %lld", (long long)error->offset);
  fprintf(stderr, "\n");
  return 1;
}

/* Index of the raw control with this name, or with this part after the last "." of its name;
 * otherwise 0. */
static uint32_t find_control(const risorius_face* face, const char* wanted) {
  const uint32_t count = risorius_count(face, RISORIUS_RAW_CONTROLS);
  for (uint32_t i = 0; wanted != NULL && i < count; ++i) {
    const char* name = risorius_name(face, RISORIUS_RAW_CONTROLS, i);
    const char* last = strrchr(name, '.');
    if (strcmp(name, wanted) == 0 || (last != NULL && strcmp(last + 1, wanted) == 0)) return i;
  }
  return 0;
}

static void print_most(const risorius_face* face, const risorius_instance* instance,
                       risorius_list list, const char* what) {
  const uint32_t names = risorius_count(face, list);
  uint32_t count = 0, most = 0;
  double sum = 0;
  const float* values = risorius_values(instance, list, &count);
  for (uint32_t i = 0; i < count; ++i) {
    sum += fabs((double)values[i]);
    if (fabs((double)values[i]) > fabs((double)values[most])) most = i;
  }
  if (count == 0) return;
  /* Joints have several numbers each. */
  printf("  %s: sum %.9g, most %s %.9g\n", what, sum,
         risorius_name(face, list, most / (count / names)), (double)values[most]);
}

static int play(const risorius_face* face, risorius_instance* instance, uint32_t control) {
  const uint32_t lods = risorius_count(face, RISORIUS_LODS);
  for (uint32_t lod = 0; lod < lods; lod += lods > 1 ? lods - 1 : 1) {
    if (risorius_set_lod(instance, lod) != RISORIUS_OK) return complain();
    for (int step = 1; step <= 2; ++step) {
      const float value = 0.5f * (float)step;
      if (risorius_set(instance, RISORIUS_RAW_CONTROLS, control, 1, &value) != RISORIUS_OK ||
          risorius_evaluate(instance) != RISORIUS_OK) {
        return complain();
      }
      printf("LOD %u, %s = %.1f\n", (unsigned)lod,
             risorius_name(face, RISORIUS_RAW_CONTROLS, control), (double)value);
      print_most(face, instance, RISORIUS_JOINTS, "joints");
      print_most(face, instance, RISORIUS_SHAPES, "shapes");
      print_most(face, instance, RISORIUS_MAPS, "maps");
    }
  }
  return 0;
}

int main(int argc, char** argv) {
  if (argc < 2) {
    fprintf(stderr, "smile FILE.dna [CONTROL]\n");
    return 2;
  }
  if (risorius_abi() != RISORIUS_ABI) {
    fprintf(stderr, "smile: made for ABI %d, found %u\n", RISORIUS_ABI, (unsigned)risorius_abi());
    return 1;
  }
  risorius_face* face = NULL;
  if (risorius_open_file(argv[1], NULL, &face) != RISORIUS_OK) return complain();
  printf("risorius %s: %u raw controls, %u joints, %u shapes, %u maps, %u LODs\n",
         risorius_version(), (unsigned)risorius_count(face, RISORIUS_RAW_CONTROLS),
         (unsigned)risorius_count(face, RISORIUS_JOINTS),
         (unsigned)risorius_count(face, RISORIUS_SHAPES),
         (unsigned)risorius_count(face, RISORIUS_MAPS),
         (unsigned)risorius_count(face, RISORIUS_LODS));
  risorius_instance* instance = NULL;
  if (risorius_create(face, RISORIUS_SETTLED, &instance) != RISORIUS_OK) {
    risorius_close(face);
    return complain();
  }
  const uint32_t control = find_control(face, argc > 2 ? argv[2] : NULL);
  const int code = risorius_count(face, RISORIUS_RAW_CONTROLS) > 0 ? play(face, instance, control) : 0;
  risorius_destroy(instance);
  risorius_close(face);
  return code;
}
