/* Rest values and noise of a skin that nothing touches: edge/app/commands/calibrate.py, which says why. */
#include <math.h>
#include <string.h>

#include "skin_internal.h"

static uint16_t valid[EC_TAXELS];
static uint32_t totals[EC_TAXELS];
static union {
  uint64_t sum;
  double noise;
} squares[EC_TAXELS];
static ec_calibration measured;

typedef uint64_t key(uint32_t i, const void *about);

static uint32_t count(key *of, const void *about) {
  uint32_t n = 0;
  for (uint32_t i = 0; i < EC_TAXELS; i++) n += of(i, about) != UINT64_MAX;
  return n;
}

/* The key of a rank, from 0; those of UINT64_MAX do not count. Doubles that are not negative have the
   order of their bits. */
static uint64_t kth(key *of, const void *about, uint32_t k) {
  uint64_t low = 0;
  uint64_t high = UINT64_MAX - 1;
  while (low < high) {
    uint64_t middle = low + (high - low) / 2;
    uint32_t below = 0;
    for (uint32_t i = 0; i < EC_TAXELS; i++) below += of(i, about) <= middle;
    if (below > k) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

static uint64_t noise_bits(uint32_t i, const void *about) {
  uint64_t bits;
  (void)about;
  if (!ec_working[i]) return UINT64_MAX;
  memcpy(&bits, &squares[i].noise, sizeof bits);
  return bits;
}

static double noise_of_rank(uint32_t k) {
  double noise;
  uint64_t bits = kth(noise_bits, NULL, k);
  memcpy(&noise, &bits, sizeof noise);
  return noise;
}

/* Rest values of the taxels of a kind of chip, or how far they are from the middle. */
typedef struct {
  const uint8_t *kinds;
  int32_t middle;
  uint8_t kind;
} of_kind;

static uint64_t rest_of(uint32_t i, const void *about) {
  const of_kind *those = about;
  return those->kinds[i] == those->kind ? measured.rest[i] : UINT64_MAX;
}

static uint64_t away_of(uint32_t i, const void *about) {
  const of_kind *those = about;
  int32_t away = measured.rest[i] - those->middle;
  if (those->kinds[i] != those->kind) return UINT64_MAX;
  return (uint64_t)(away < 0 ? -away : away);
}

static int32_t twice_median(key *of, const of_kind *those) {
  uint32_t n = count(of, those);
  if (!n) return 0;
  return (int32_t)(kth(of, those, (n - 1) / 2) + kth(of, those, n / 2));
}

static void add_up(void) {
  for (uint32_t i = 0; i < EC_TAXELS; i++) {
    if (!ec_read[i]) continue;
    valid[i]++;
    totals[i] += ec_raw[i];
    squares[i].sum += (uint32_t)ec_raw[i] * ec_raw[i];
  }
}

/* The mean as a rest value, and the standard deviation in place of the squares. */
static void sum_up(uint32_t i) {
  int64_t n = valid[i];
  int64_t divisor = n ? n : 1;
  int64_t total = totals[i];
  int64_t mean = (2 * total + divisor) / (2 * divisor);
  int64_t deviations = (int64_t)squares[i].sum - 2 * mean * total + n * mean * mean;
  int64_t remainder = total - n * mean;
  double square = (double)(remainder * remainder) / (double)divisor;
  double variance = ((double)deviations - square) / (double)(n > 1 ? n - 1 : 1);
  measured.rest[i] = (uint16_t)mean;
  squares[i].noise = sqrt(variance > 0.0 ? variance : 0.0);
}

static uint16_t dead_band(double noise) {
  double band = ceil(EC_DEAD_BAND_SIGMA * noise);
  return (uint16_t)(band < EC_DEAD_BAND_COUNTS ? EC_DEAD_BAND_COUNTS : band > 65535.0 ? 65535.0 : band);
}

/* As a calibration in a file has it. */
static double rounded(double noise) { return rint(noise * 1000.0) / 1000.0; }

static double repeat_chance(double noise) {
  double variance = noise * noise;
  if (variance < EC_COARSE) return 1.0 - 2.0 * variance + 1.5 * (variance * variance);
  return EC_REPEATS_OF_1 / noise;
}

static uint32_t stuck_limit(uint16_t number) {
  const ec_chip *chip = &ec_chips[number];
  double chance = 1.0;
  double together = 1.0;
  if (chip->kind == EC_BLOCK) return ec_exported.stuck[number];
  for (uint16_t i = 0; i < chip->stages; i++) {
    if (chip->taxels[i] >= 0) chance *= repeat_chance(rounded(squares[chip->taxels[i]].noise));
  }
  for (uint32_t conversions = 1; conversions <= EC_STUCK_FRAMES; conversions++) {
    together *= chance;
    if (together > EC_CHANCE) continue;
    uint32_t frames = EC_FRAMES_OF_CONVERSION * conversions;
    return frames < EC_STUCK_FRAMES ? frames : EC_STUCK_FRAMES;
  }
  return UINT32_MAX;
}

static bool all_readable(uint16_t frames) {
  for (uint16_t c = 0; c < EC_CHIPS; c++) {
    const ec_chip *chip = &ec_chips[c];
    for (uint16_t i = 0; i < chip->stages; i++) {
      int16_t taxel = chip->taxels[i];
      if (taxel < 0 || !ec_working[taxel]) continue;
      uint16_t rest = measured.rest[taxel];
      if (2 * valid[taxel] < frames || rest >= chip->highest) return false;
      if (rest == 0 && !chip->rests_at_zero) return false;
    }
  }
  return true;
}

static bool any_restless(void) {
  uint32_t n = count(noise_bits, NULL);
  double median = (noise_of_rank((n - 1) / 2) + noise_of_rank(n / 2)) / 2.0;
  for (uint32_t i = 0; i < EC_TAXELS; i++) {
    if (squares[i].noise > EC_NOISY * median + EC_NOISY_COUNTS) return true;
  }
  return false;
}

/* By how much each taxel rests as under a touch. */
static void find_changes(int32_t changes[EC_TAXELS]) {
  for (uint32_t i = 0; i < EC_TAXELS; i++) {
    int32_t moved = measured.rest[i] - ec_calibration_now.rest[i];
    bool counts = ec_calibration_now.is_known && ec_working[i];
    changes[i] = counts ? (moved < 0 ? -moved : moved) : 0;
  }
  if (ec_calibration_now.is_known) return;
  static uint8_t kinds[EC_TAXELS]; /* of what works, and 1; 0: none */
  for (uint16_t c = 0; c < EC_CHIPS; c++) {
    for (uint16_t i = 0; i < ec_chips[c].stages; i++) {
      int16_t taxel = ec_chips[c].taxels[i];
      if (taxel >= 0 && ec_working[taxel]) kinds[taxel] = (uint8_t)(ec_chips[c].kind + 1);
    }
  }
  for (uint16_t c = 0; c < EC_CHIPS; c++) {
    of_kind those = {kinds, 0, (uint8_t)(ec_chips[c].kind + 1)};
    bool is_first = true;
    for (uint16_t i = 0; i < c; i++) is_first &= ec_chips[i].kind != ec_chips[c].kind;
    if (!is_first) continue;
    those.middle = twice_median(rest_of, &those) / 2;
    int32_t usual = EC_STANDING_OUT * twice_median(away_of, &those) / 2;
    for (uint32_t i = 0; i < EC_TAXELS; i++) {
      int32_t beyond = (measured.rest[i] - those.middle) * ec_signs[i] - usual;
      if (kinds[i] == those.kind && beyond > 0) changes[i] = beyond;
    }
  }
}

/* Whether taxels side by side have moved as under a touch. */
static bool any_touched(void) {
  static int32_t changes[EC_TAXELS];
  int32_t limit = ec_calibration_now.is_known && EC_SKIN_THRESHOLD > 0 ? EC_SKIN_THRESHOLD : EC_SKIN_ONSET;
  if (EC_SKIN_ONSET == 0) return false;
  find_changes(changes);
  for (uint32_t i = 0; i < EC_TAXELS; i++) {
    uint32_t col = i % EC_SKIN_COLS;
    bool is_last = col == EC_SKIN_COLS - 1;
    if (changes[i] <= limit) continue;
    if (i + EC_SKIN_COLS < EC_TAXELS && changes[i + EC_SKIN_COLS] > limit) return true;
    if (!is_last && changes[i + 1] > limit) return true;
    if (is_last && EC_SKIN_WRAPS && EC_SKIN_COLS > 1 && changes[i - col] > limit) return true;
  }
  return false;
}

static bool any_deaf(void) {
  for (uint32_t i = 0; EC_SKIN_THRESHOLD && i < EC_TAXELS; i++) {
    if (ec_working[i] && dead_band(squares[i].noise) >= EC_SKIN_THRESHOLD) return true;
  }
  return false;
}

ec_calibration_outcome ec_calibrate(uint16_t frames, bool nothing_touches) {
  ec_frame frame;
  memset(valid, 0, sizeof valid);
  memset(totals, 0, sizeof totals);
  memset(squares, 0, sizeof squares);
  memset(&measured, 0, sizeof measured);
  for (uint16_t taken = 0; taken < frames;) {
    uint64_t now = ec_time();
    uint32_t wait = now < ec_due ? (uint32_t)(ec_due - now) : 0;
    if (!ec_skin_poll(ec_clock_us(wait), &frame)) continue;
    add_up();
    taken++;
  }
  for (uint32_t i = 0; i < EC_TAXELS; i++) sum_up(i);
  if (frames < EC_FEWEST_FRAMES || !all_readable(frames)) return EC_UNREADABLE;
  if (any_restless()) return EC_RESTLESS;
  if (any_touched()) return EC_TOUCHED;
  if (any_deaf()) return EC_DEAF;
  if (!ec_calibration_now.is_known && !nothing_touches) return EC_FIRST;
  for (uint32_t i = 0; i < EC_TAXELS; i++) measured.dead_band[i] = dead_band(rounded(squares[i].noise));
  for (uint16_t i = 0; i < EC_CHIPS; i++) measured.stuck[i] = stuck_limit(i);
  measured.digest = ec_exported.digest;
  measured.is_known = true;
  measured.crc = ec_crc16((const uint8_t *)&measured, offsetof(ec_calibration, crc));
  if (!ec_keep(&measured, sizeof measured)) return EC_NOT_KEPT;
  ec_skin_begin();
  return EC_CALIBRATED;
}
