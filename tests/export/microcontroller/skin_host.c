/* The skin in C as a library: what the firmware gives is asked of Python. */
#include <string.h>

#include "skin_internal.h"

typedef struct {
  int (*i2c)(int bus, int address, const uint8_t *out, int n, uint8_t *in, int m);
  uint32_t (*clock)(uint32_t wait);
} firmware;

static firmware given;
static uint8_t memory[sizeof(ec_calibration)];
static bool is_kept;

void use(firmware functions) { given = functions; }

ec_i2c_outcome ec_i2c(
    uint8_t bus, uint8_t address, const uint8_t *out, size_t n, uint8_t *in, size_t m) {
  return (ec_i2c_outcome)given.i2c(bus, address, out, (int)n, in, (int)m);
}

uint32_t ec_clock_us(uint32_t wait_us) { return given.clock(wait_us); }

bool ec_load(void *bytes, size_t size) {
  if (is_kept) memcpy(bytes, memory, size);
  return is_kept;
}

bool ec_keep(const void *bytes, size_t size) {
  memcpy(memory, bytes, size);
  is_kept = true;
  return true;
}

/* A frame, and the raw values of those that could be read: whether it was due. */
bool poll(uint32_t now, double *t, uint16_t *counts, bool *valid, uint16_t *raw, bool *read) {
  ec_frame frame;
  if (!ec_skin_poll(now, &frame)) return false;
  *t = frame.t_s;
  memcpy(counts, frame.counts, sizeof ec_raw);
  memcpy(valid, frame.valid, sizeof ec_read);
  memcpy(raw, ec_raw, sizeof ec_raw);
  memcpy(read, ec_read, sizeof ec_read);
  return true;
}

void calibration(uint16_t *rest, uint16_t *dead_band, uint32_t *stuck) {
  memcpy(rest, ec_calibration_now.rest, sizeof ec_calibration_now.rest);
  memcpy(dead_band, ec_calibration_now.dead_band, sizeof ec_calibration_now.dead_band);
  memcpy(stuck, ec_calibration_now.stuck, sizeof ec_calibration_now.stuck);
}
