/* Rest values of taxels that follow slow drift: edge/wire/skin/decoder.py. */
#include "baseline.h"

#define SCALE 4096
#define FOLLOW 4 /* a step is at most a quarter of the distance */

static int32_t floored(int32_t x, int32_t by) { return (x < 0 ? x - by + 1 : x) / by; }

static int32_t clipped(int32_t x, int32_t low, int32_t high) {
  return x < low ? low : x > high ? high : x;
}

void ec_baseline_begin(ec_baseline *taxels, uint32_t n, const uint16_t *rest, uint16_t limit) {
  for (uint32_t i = 0; i < n; i++) {
    taxels[i].now = rest[i] * SCALE;
    taxels[i].low = taxels[i].now - limit * SCALE;
    taxels[i].high = taxels[i].now + limit * SCALE;
  }
}

void ec_baseline_above(
    const ec_baseline *taxels, uint32_t n, const uint16_t *raw, int32_t sign, int32_t dead_band,
    uint16_t *counts) {
  for (uint32_t i = 0; i < n; i++) {
    int32_t above = (raw[i] - floored(taxels[i].now + SCALE / 2, SCALE)) * sign;
    counts[i] = (uint16_t)(above < dead_band ? 0 : clipped(above, 0, 65535));
  }
}

void ec_baseline_follow(
    ec_baseline *taxels, uint32_t n, const uint16_t *raw, const bool *valid, int32_t step) {
  for (uint32_t i = 0; i < n; i++) {
    int32_t error = floored(raw[i] * SCALE - taxels[i].now + FOLLOW / 2, FOLLOW);
    if (valid && !valid[i]) error = 0;
    int32_t moved = taxels[i].now + clipped(error, -step, step);
    taxels[i].now = clipped(moved, taxels[i].low, taxels[i].high);
  }
}
