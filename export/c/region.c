/* The active taxels of a frame, the largest region of them, and the whole numbers of zones:
   edge/touch/region.py, components.py, grid.py, edge/features/zones.py. */
#include "internal.h"

#define TAXELS (EC_ROWS * EC_COLS)

static uint16_t waiting[TAXELS];
static uint16_t labels[TAXELS]; /* 0: not active or not reached yet */

/* The taxels next to one; the count of them. */
static uint32_t neighbours(uint32_t taxel, uint32_t beside[4]) {
  uint32_t row = taxel / EC_COLS;
  uint32_t col = taxel % EC_COLS;
  uint32_t count = 0;
  if (row > 0) beside[count++] = taxel - EC_COLS;
  if (row + 1 < EC_ROWS) beside[count++] = taxel + EC_COLS;
  if (col > 0) beside[count++] = taxel - 1;
  if (col + 1 < EC_COLS) beside[count++] = taxel + 1;
  if (EC_WRAPS && col == 0) beside[count++] = taxel + EC_COLS - 1;
  if (EC_WRAPS && col + 1 == EC_COLS) beside[count++] = taxel + 1 - EC_COLS;
  return count;
}

typedef struct {
  uint32_t area;
  uint32_t overlap;
  uint16_t peak;
} component;

/* Label the taxels connected to one. */
static component flood(
    uint32_t seed, uint16_t label, const ec_set active, const uint16_t *counts,
    const ec_set previous) {
  component whole = {0, 0, 0};
  uint32_t left = 0;
  labels[seed] = label;
  waiting[left++] = (uint16_t)seed;
  while (left > 0) {
    uint32_t taxel = waiting[--left];
    uint32_t beside[4];
    whole.area++;
    whole.overlap += previous[taxel];
    if (counts[taxel] > whole.peak) whole.peak = counts[taxel];
    for (uint32_t i = neighbours(taxel, beside); i-- > 0;) {
      if (active[beside[i]] && !labels[beside[i]]) {
        labels[beside[i]] = label;
        waiting[left++] = (uint16_t)beside[i];
      }
    }
  }
  return whole;
}

/* The largest area comes first, then the larger overlap with the region followed so far, then the
   higher peak, then the lower index. */
static bool is_before(component a, component b) {
  if (a.area != b.area) return a.area > b.area;
  if (a.overlap != b.overlap) return a.overlap > b.overlap;
  return a.peak > b.peak;
}

/* The active taxels, and their largest region. */
void ec_largest(
    const uint16_t *counts, const bool *valid, const ec_set previous, ec_set active,
    ec_region *region) {
  component best = {0, 0, 0};
  uint16_t best_label = 0;
  uint16_t label = 0;
  uint32_t begin = TAXELS;
  uint32_t end = 0;
  for (uint32_t i = 0; i < TAXELS; i++) {
    active[i] = counts[i] > EC_THRESHOLD_COUNTS && EC_READABLE(valid, i);
    labels[i] = 0;
    if (!active[i]) continue;
    if (begin == TAXELS) begin = i;
    end = i + 1;
  }
  for (uint32_t i = begin; i < end; i++) {
    if (!active[i] || labels[i]) continue;
    component next = flood(i, ++label, active, counts, previous);
    if (is_before(next, best)) {
      best = next;
      best_label = label;
    }
  }
  region->begin = begin;
  region->end = end;
  region->area = best.area;
  region->peak = best.peak;
  for (uint32_t i = 0; i < TAXELS; i++) region->taxels[i] = best.area && labels[i] == best_label;
}

/* The column at which to cut a circle so that the weights' variance is least. */
static uint32_t best_cut(const int64_t weights[EC_COLS]) {
  int64_t total = 0;
  int64_t first = 0;
  int64_t second = 0;
  for (int64_t col = 0; col < EC_COLS; col++) {
    total += weights[col];
    first += col * weights[col];
    second += col * col * weights[col];
  }
  uint32_t best = 0;
  int64_t lowest = total * second - first * first;
  for (int64_t col = 0; col < EC_COLS; col++) {
    if (weights[col] == 0) continue;
    first += EC_COLS * weights[col];
    second += EC_COLS * (EC_COLS + 2 * col) * weights[col];
    int64_t variance = total * second - first * first;
    if (variance < lowest) {
      best = (uint32_t)col + 1;
      lowest = variance;
    }
  }
  return best;
}

/* Where a circle of columns is cut for some taxels. */
static uint32_t cut_of(const bool *taxels, const ec_region *region, const uint16_t *counts) {
  int64_t weights[EC_COLS] = {0};
  uint32_t col = region->begin % EC_COLS;
  for (uint32_t i = region->begin; i < region->end; i++) {
    if (taxels[i]) weights[col] += counts ? counts[i] : 1;
    if (++col == EC_COLS) col = 0;
  }
  return best_cut(weights);
}

/* Of a row: no sum of 25 columns exceeds 32 bits. */
#if EC_COLS <= 25
typedef uint32_t sum_of_row;
#else
typedef uint64_t sum_of_row;
#endif

/* Largest count, taxels, sum of counts, and the sums of counts times row, column, row squared, row
   times column, column squared. Without counts each taxel counts 1. */
void ec_zone(
    ec_zone_name zone, const ec_set active, const ec_region *region, const uint16_t *counts,
    int64_t numbers[EC_ZONE_WIDTH]) {
  const bool *taxels = zone == EC_CONTACT ? region->taxels : active;
  uint32_t first = zone == EC_RIGHT ? EC_COLS / 2 : 0;
  uint32_t last = zone == EC_LEFT ? EC_COLS / 2 : EC_COLS;
  bool is_round = EC_WRAPS && (zone == EC_CONTACT || zone == EC_SKIN);
  uint32_t cut = is_round ? cut_of(taxels, region, counts) : 0;
  for (uint32_t i = 0; i < EC_ZONE_WIDTH; i++) numbers[i] = 0;
  uint32_t end = (region->end + EC_COLS - 1) / EC_COLS;
  for (uint32_t row = region->begin / EC_COLS; row < end; row++) {
    sum_of_row force = 0;
    sum_of_row cols = 0;
    sum_of_row squares = 0;
    for (uint32_t col = first; col < last; col++) {
      if (!taxels[row * EC_COLS + col]) continue;
      uint32_t count = counts ? counts[row * EC_COLS + col] : 1;
      uint32_t turned = col < cut ? col + EC_COLS : col;
      sum_of_row product = (sum_of_row)count * turned;
      if (count > numbers[0]) numbers[0] = count;
      numbers[1]++;
      force += count;
      cols += product;
      squares += product * turned;
    }
    if (force == 0) continue;
    numbers[2] += (int64_t)force;
    numbers[3] += (int64_t)force * row;
    numbers[4] += (int64_t)cols;
    numbers[5] += (int64_t)force * row * row;
    numbers[6] += (int64_t)cols * row;
    numbers[7] += (int64_t)squares;
  }
}
