/* Rest values of taxels that follow slow drift, as edge/wire/skin/decoder.py has them: a firmware may use
   this to make the counts that ec_push takes, or its own. */
#ifndef EC_BASELINE_H
#define EC_BASELINE_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  int32_t now; /* in 1/4096 counts */
  int32_t low;
  int32_t high;
} ec_baseline;

/* Start from raw counts with nothing touching; the baseline stays within the limit of them. */
void ec_baseline_begin(ec_baseline *taxels, uint32_t n, const uint16_t *rest, uint16_t limit);

/* Counts above the baseline, 0 within the dead band (at least 1); sign: 1 where a touch raises the raw
   value, -1 where it lowers it. */
void ec_baseline_above(
    const ec_baseline *taxels, uint32_t n, const uint16_t *raw, int32_t sign, int32_t dead_band,
    uint16_t *counts);

/* Follow the drift of the valid taxels by at most a step of 1/4096 counts; call it for each frame
   while nothing touches, which ec_is_touched says. */
void ec_baseline_follow(
    ec_baseline *taxels, uint32_t n, const uint16_t *raw, const bool *valid, int32_t step);

#ifdef __cplusplus
}
#endif

#endif
