/* From the bytes of all chips to counts above a baseline that follows drift: edge/wire/skin/decoder.py,
   edge/wire/skin/lone.py and edge/wire/skin/skin.py, which say why. */
#include <string.h>

#include "skin_internal.h"

#define NEVER UINT32_MAX /* an age */
#define SCALE 4096 /* of the baseline */
#define FOLLOW 4 /* a step is at most a quarter of the distance */

/* Of a taxel. */
enum { VALID = 1, ACTIVE = 2, BROKEN = 4, AT_START = 8 };

ec_calibration ec_calibration_now;
uint16_t ec_raw[EC_TAXELS];
bool ec_read[EC_TAXELS];
uint16_t ec_sequence;
uint64_t ec_due;
static uint8_t before[EC_BYTES];
static uint8_t states[EC_TAXELS];
static int32_t baseline[EC_TAXELS];
/* How long a taxel has been touched or alone, and how long it has not been above the threshold. */
static uint32_t held_for[EC_TAXELS];
static uint32_t alone_for[EC_TAXELS];
static uint32_t silent_for[EC_TAXELS];
static uint16_t counts[EC_TAXELS];
static bool valid[EC_TAXELS];
static uint64_t start;
static uint64_t last;
static uint64_t touched_at; /* 0: never */

static int32_t clipped(int32_t x, int32_t low, int32_t high) {
  return x < low ? low : x > high ? high : x;
}

static int32_t floored(int32_t x, int32_t by) { return (x < 0 ? x - by + 1 : x) / by; }

static uint32_t older(uint32_t age, uint32_t by) { return age > NEVER - 1 - by ? NEVER - 1 : age + by; }

/* The values of a chip's stages, and which are intact. */
static void parse_ad7147(const uint8_t *bytes, uint16_t values[12], bool intact[12]) {
  bool is_one = (bytes[24] << 8 | bytes[25]) >> 4 == EC_IDENTITY;
  bool others = false;
  for (int i = 11; i >= 0; i--) {
    values[i] = (uint16_t)(bytes[2 * i] << 8 | bytes[2 * i + 1]);
    intact[i] = values[i] != 0 && is_one && (i || others);
    others |= intact[i];
  }
  int driven = 24;
  while (values[11] == 0xFFFF && driven && bytes[driven - 1] == 0xFF) driven--;
  for (int i = driven / 2; i < 12; i++) intact[i] = false;
}

static uint16_t unpacked(const uint8_t *bytes, uint32_t i, uint8_t bits) {
  const uint8_t *at = bytes + i * bits / 8;
  if (bits == 8) return *at;
  if (bits == 16) return (uint16_t)(at[0] << 8 | at[1]);
  return (uint16_t)(i % 2 ? (at[0] & 15) << 8 | at[1] : at[0] << 4 | at[1] >> 4);
}

/* Values of the taxels of a chip into ec_raw, and whether each is intact into ec_read; whether all that
   work are. */
static bool decode(const ec_chip *chip) {
  const uint8_t *bytes = ec_bytes + chip->first_byte;
  const ec_calibration *rest = &ec_calibration_now;
  uint16_t values[12];
  bool intact[12];
  bool all = true;
  if (EC_HAS_AD7147 && chip->kind == EC_AD7147) parse_ad7147(bytes, values, intact);
  for (uint16_t i = 0; i < chip->stages; i++) {
    int16_t taxel = chip->taxels[i];
    uint16_t value = 0;
    bool is_intact = true;
    if (taxel < 0) continue;
    if (EC_HAS_AD7147 && chip->kind == EC_AD7147) {
      value = values[i];
      is_intact = intact[i];
    } else if (EC_HAS_MPR121 && chip->kind == EC_MPR121) {
      value = (uint16_t)(bytes[2 * i] | bytes[2 * i + 1] << 8);
      is_intact = value != 0 && value < EC_SATURATED;
    } else if (EC_HAS_BLOCK) {
      value = unpacked(bytes + 2, i, chip->bits);
    }
    is_intact &= value <= chip->highest;
    if (rest->is_known) {
      int32_t away = value - rest->rest[taxel];
      is_intact &= -EC_REACH <= away && away <= EC_REACH;
    }
    ec_raw[taxel] = value;
    ec_read[taxel] = is_intact && ec_working[taxel];
    all &= is_intact || !ec_working[taxel];
  }
  return all;
}

/* Decode all chips; a chip that serves damaged bytes, or the same for too long, is counted. */
static void decode_all(uint64_t began) {
  for (uint16_t i = 0; i < EC_CHIPS; i++) {
    const ec_chip *chip = &ec_chips[i];
    ec_slot *slot = &ec_slots[i];
    bool fresh = slot->at >= began;
    if (memcmp(before + chip->first_byte, ec_bytes + chip->first_byte, chip->bytes)) {
      slot->unchanged = 0;
    } else if (fresh && slot->unchanged < ec_calibration_now.stuck[i]) {
      slot->unchanged++;
    }
    bool stuck = slot->unchanged >= ec_calibration_now.stuck[i];
    bool damaged = !decode(chip) || stuck;
    bool good = slot->good && !stuck && slot->at && slot->at + EC_OLDEST >= began;
    for (uint16_t j = 0; j < chip->stages; j++) {
      if (chip->taxels[j] >= 0) ec_read[chip->taxels[j]] &= good;
    }
    if (fresh && slot->good) slot->damaged = damaged ? slot->damaged + 1 : 0;
  }
  memcpy(before, ec_bytes, sizeof before);
}

/* How many of the up to eight neighbours of a taxel have all bits of a mask, among these. */
static uint8_t beside(int32_t row, int32_t col, uint8_t mask, uint8_t bits) {
  uint8_t count = 0;
  for (int32_t r = row - 1; r <= row + 1; r++) {
    for (int32_t c = col - 1; c <= col + 1; c++) {
      int32_t at = EC_SKIN_WRAPS && EC_SKIN_COLS > 2 ? (c + EC_SKIN_COLS) % EC_SKIN_COLS : c;
      bool is_inside = r >= 0 && r < EC_SKIN_ROWS && at >= 0 && at < EC_SKIN_COLS;
      if (!is_inside || (r == row && at == col)) continue;
      count = (uint8_t)(count + ((states[r * EC_SKIN_COLS + at] & mask) == bits));
    }
  }
  return count;
}

/* Find taxels that are broken: above the threshold alone, for longer than a touch. */
static void follow_lone(uint64_t t, uint32_t since) {
  for (uint32_t i = 0; i < EC_TAXELS; i++) {
    bool touched = ec_read[i] && counts[i] > EC_TOUCH_COUNTS;
    states[i] &= BROKEN | AT_START;
    if (ec_read[i]) states[i] |= VALID;
    if (touched && !(states[i] & BROKEN)) states[i] |= ACTIVE;
    silent_for[i] = touched ? 0 : silent_for[i] == NEVER ? NEVER : older(silent_for[i], since);
  }
  for (uint32_t i = 0; i < EC_TAXELS; i++) {
    int32_t row = (int32_t)(i / EC_SKIN_COLS);
    int32_t col = (int32_t)(i % EC_SKIN_COLS);
    bool active = states[i] & ACTIVE;
    bool lone = active && beside(row, col, ACTIVE, ACTIVE) == 0 &&
                beside(row, col, VALID | BROKEN, VALID) >= EC_FEWEST_NEIGHBOURS;
    if (alone_for[i] != NEVER) alone_for[i] = older(alone_for[i], since);
    if (lone && alone_for[i] == NEVER) {
      alone_for[i] = 0;
      states[i] &= (uint8_t)~AT_START;
      if (t - start <= EC_LONE_START) states[i] |= AT_START;
    }
    if (silent_for[i] >= EC_SILENT || (active && !lone)) alone_for[i] = NEVER;
  }
  /* Only now, as neighbours are those of the frame before. */
  for (uint32_t i = 0; i < EC_TAXELS; i++) {
    uint32_t limit = states[i] & AT_START ? EC_ALONE_AT_START : EC_ALONE;
    if (alone_for[i] != NEVER && alone_for[i] >= limit) states[i] |= BROKEN;
    if (silent_for[i] >= EC_SILENT) states[i] &= (uint8_t)~BROKEN;
  }
}

static uint16_t above(uint32_t i) {
  int32_t now = floored(baseline[i] + SCALE / 2, SCALE);
  int32_t change = (ec_raw[i] - now) * ec_signs[i];
  return (uint16_t)(change < ec_calibration_now.dead_band[i] ? 0 : clipped(change, 0, 65535));
}

static void follow_drift(uint32_t i) {
  int32_t rest = ec_calibration_now.rest[i] * SCALE;
  int32_t error = floored(ec_raw[i] * SCALE - baseline[i] + FOLLOW / 2, FOLLOW);
  int32_t moved = baseline[i] + clipped(error, -EC_DRIFT_STEP, EC_DRIFT_STEP);
  baseline[i] = clipped(moved, rest - EC_DRIFT_LIMIT_COUNTS * SCALE, rest + EC_DRIFT_LIMIT_COUNTS * SCALE);
}

static void assemble(uint64_t t) {
  uint32_t since = t - last < NEVER ? (uint32_t)(t - last) : NEVER - 1;
  bool is_known = ec_calibration_now.is_known;
  bool touched = false;
  decode_all(t);
  for (uint32_t i = 0; i < EC_TAXELS; i++) counts[i] = ec_read[i] ? above(i) : 0;
  for (uint32_t i = 0; i < EC_TAXELS; i++) {
    bool goes_on = held_for[i] != NEVER;
    held_for[i] = counts[i] <= EC_TOUCH_COUNTS ? NEVER : goes_on ? older(held_for[i], since) : 0;
  }
  if (is_known && EC_TOUCH_COUNTS) follow_lone(t, since);
  for (uint32_t i = 0; i < EC_TAXELS; i++) {
    valid[i] = ec_read[i] && !(states[i] & BROKEN);
    if (!valid[i]) counts[i] = 0;
    touched |= counts[i] > EC_TOUCH_COUNTS;
  }
  if (touched) touched_at = t;
  bool settled = !touched_at || t - touched_at >= EC_SETTLE;
  for (uint32_t i = 0; is_known && i < EC_TAXELS; i++) {
    bool held = held_for[i] != NEVER && held_for[i] >= EC_HELD;
    if (held || (valid[i] && settled)) follow_drift(i);
  }
  last = t;
  ec_sequence++;
}

bool ec_is_calibrated(void) { return ec_calibration_now.is_known; }

bool ec_skin_begin(void) {
  ec_calibration *rest = &ec_calibration_now;
  size_t size = offsetof(ec_calibration, crc);
  bool is_kept = ec_load(rest, sizeof *rest) && rest->digest == ec_exported.digest &&
                 rest->crc == ec_crc16((const uint8_t *)rest, size);
  if (!is_kept) *rest = ec_exported;
  memset(before, 0, sizeof before);
  memset(states, 0, sizeof states);
  memset(ec_raw, 0, sizeof ec_raw);
  memset(ec_read, 0, sizeof ec_read);
  for (uint32_t i = 0; i < EC_TAXELS; i++) {
    baseline[i] = rest->rest[i] * SCALE;
    held_for[i] = alone_for[i] = silent_for[i] = NEVER;
  }
  start = last = ec_due = touched_at = 0;
  return ec_chips_begin();
}

/* The clock begins with what it wraps at, so that no time is 0. */
static double seconds(uint64_t t) { return (double)(t - (UINT64_C(1) << 32)) / EC_HZ; }

double ec_now_s(void) { return seconds(ec_time()); }

bool ec_skin_poll(uint32_t now_us, ec_frame *frame) {
  uint64_t now = ec_time();
  uint64_t t = now - (uint32_t)((uint32_t)now - now_us);
  if (!start) start = ec_due = t;
  if (t < ec_due) return false;
  ec_due += (1 + (t - ec_due) / EC_PERIOD) * EC_PERIOD; /* ticks that have passed are skipped */
  ec_chips_read(t + EC_PERIOD - EC_LONGEST_STEP);
  assemble(t);
  frame->t_s = seconds(t);
  frame->counts = counts;
  frame->valid = valid;
  return true;
}

uint16_t ec_chips_running(void) {
  uint16_t running = 0;
  for (uint16_t i = 0; i < EC_CHIPS; i++) running = (uint16_t)(running + ec_slots[i].running);
  return running;
}
