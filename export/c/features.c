/* A contact's series to the vector that is classified: edge/touch/features.py, zones.py,
   transforms.py, kernels.py. */
#include "internal.h"

/* Behind the vector, the arena is free until the graph is computed. */
static double *const columns = ec_arena + EC_WIDTH; /* [quantity][frame] of a zone */
static double *const valid_t = ec_arena + EC_WIDTH + EC_QUANTITIES * EC_FRAMES;
static double *const valid = ec_arena + EC_WIDTH + (EC_QUANTITIES + 1) * EC_FRAMES;
static double *const samples = ec_arena + EC_WIDTH + (EC_QUANTITIES + 2) * EC_FRAMES;

static const ec_row *felt[EC_FRAMES];
static uint32_t frames; /* of felt */

/* The frames in which the contact is felt, up to the end of the window. */
static void feel(double window_s) {
  uint32_t n = 0;
  uint32_t last = 0;
  while (n < ec_now.rows && ec_rows[n].t < window_s) n++;
  if (n < ec_now.rows) n++;
  for (uint32_t i = 0; i < n; i++) {
    if (ec_rows[i].area) last = i;
  }
  bool is_over = ec_released(ec_rows[last].t, ec_rows[n - 1].t);
  frames = 0;
  for (uint32_t i = 0; i < n; i++) {
    if (ec_rows[i].area || (is_over && i > last)) felt[frames++] = &ec_rows[i];
  }
}

static double absolute(double x) { return x < 0.0 ? -x : x; }

static double largest_of(const double *x, uint32_t n) {
  double largest = 0.0;
  for (uint32_t i = 0; i < n; i++) {
    if (absolute(x[i]) > largest) largest = absolute(x[i]);
  }
  return largest;
}

/* numpy's order of a sum, of at most 128 numbers. */
static double summed(const double *x, uint32_t n) {
  double sum = 0.0;
  uint32_t i = 0;
  if (n >= 8) {
    double r[8];
    for (i = 0; i < 8; i++) r[i] = x[i];
    for (; i < n - n % 8; i++) r[i % 8] += x[i];
    sum = ((r[0] + r[1]) + (r[2] + r[3])) + ((r[4] + r[5]) + (r[6] + r[7]));
  }
  for (; i < n; i++) sum += x[i];
  return sum;
}

/* From 0 on, below a turn. */
static double on_circle(double col) {
  if (col >= EC_COLS) return col - EC_COLS;
  return col < 0.0 ? col + EC_COLS : col;
}

/* A contact that crosses the seam goes on; it does not jump to the other end. */
static void unwrap(double *col) {
  double turns = 0.0;
  double before = EC_NAN;
  for (uint32_t i = 0; i < frames; i++) {
    if (col[i] != col[i]) continue;
    double now = on_circle(col[i]);
    if (before == before) {
      double step = now - before;
      double nearest = on_circle(step + 0.5 * EC_COLS) - 0.5 * EC_COLS;
      if (nearest == -0.5 * EC_COLS && step > 0.0) nearest = 0.5 * EC_COLS;
      turns += absolute(step) < 0.5 * EC_COLS ? 0.0 : nearest - step;
      col[i] = now + turns;
    } else {
      col[i] = now;
    }
    before = now;
  }
}

/* Variances and the covariance are whole numbers over force squared, so nothing cancels. */
static void spread(const int64_t *zone, double *q) {
  int64_t f = zone[2];
  int64_t r = zone[3];
  int64_t c = zone[4];
  double total = f > 1 ? (double)f : 1.0;
  double rows = (double)(f * zone[5] - r * r) / total / total;
  double cols = (double)(f * zone[7] - c * c) / total / total;
  double slant = (double)(f * zone[6] - r * c) / total / total;
  double across = rows - cols;
  double larger = 0.5 * (rows + cols + ec_sqrt(across * across + 4.0 * slant * slant));
  double determinant = rows * cols - slant * slant;
  if (!(determinant > 0.0)) determinant = 0.0;
  q[EC_Q_SPREAD_ALONG * EC_FRAMES] = ec_sqrt(rows);
  q[EC_Q_SPREAD_AROUND * EC_FRAMES] = ec_sqrt(cols);
  q[EC_Q_SLANT * EC_FRAMES] = slant;
  q[EC_Q_LENGTH * EC_FRAMES] = ec_sqrt(larger);
  q[EC_Q_WIDTH * EC_FRAMES] = ec_sqrt(larger > 0.0 ? determinant / larger : 0.0);
}

/* The quantities of a zone in all felt frames. */
static void measure(uint32_t index) {
  for (uint32_t i = 0; i < frames; i++) {
    const int64_t *zone = felt[i]->zones[index];
    double *q = columns + i;
    double force = (double)zone[2];
    double area = (double)zone[1];
    q[EC_Q_MAX_FORCE * EC_FRAMES] = (double)zone[0] / EC_SCALE;
    q[EC_Q_FORCE * EC_FRAMES] = force / EC_SCALE;
    q[EC_Q_AREA * EC_FRAMES] = area;
    q[EC_Q_PRESSURE * EC_FRAMES] = force / ((area > 1.0 ? area : 1.0) * EC_SCALE);
    q[EC_Q_ALONG * EC_FRAMES] = force > 0.0 ? (double)zone[3] / force : EC_NAN;
    q[EC_Q_AROUND * EC_FRAMES] = force > 0.0 ? (double)zone[4] / force : EC_NAN;
    q[EC_Q_STIFFNESS * EC_FRAMES] =
        (force / EC_SCALE + EC_FORCE_FLOOR) / (felt[i]->motions[1] + EC_LENGTH_FLOOR);
    if (EC_SPREADS) spread(zone, q);
  }
  if (EC_WRAPS) unwrap(columns + EC_Q_AROUND * EC_FRAMES);
}

/* A value of a frame; not a number where it cannot be known. */
static double value(const ec_feature *feature, uint32_t row, uint32_t frame) {
  switch (feature->quantity) {
    case EC_Q_REGION_MAX_FORCE: return felt[frame]->peak / EC_SCALE;
    case EC_Q_REGION_AREA: return felt[frame]->area;
    case EC_Q_REGION_MOTION: return felt[frame]->motions[0];
    case EC_Q_REGION_FORCE_MOTION: return felt[frame]->motions[1];
    case EC_Q_TAXEL_FORCE: return felt[frame]->cells[row];
    case EC_Q_JOINT_ANGLE:
    case EC_Q_JOINT_CHANGE: return felt[frame]->joints[row];
    default: return columns[feature->quantity * EC_FRAMES + frame];
  }
}

/* A row at times uniform in the window, interpolated between the frames that know it. */
static void sample(const ec_feature *feature, uint32_t row, double step_s, double *out) {
  uint32_t n = 0;
  for (uint32_t i = 0; i < frames; i++) {
    double x = value(feature, row, i);
    if (x != x) continue;
    valid_t[n] = felt[i]->t;
    valid[n++] = x;
  }
  uint32_t after = 0;
  for (uint32_t i = 0; i < feature->samples; i++) {
    double t = i * step_s;
    while (after < n && valid_t[after] <= t) after++;
    out[i] = n ? valid[0] : 0.0;
    if (n < 2) continue;
    uint32_t high = after < 1 ? 1 : after > n - 1 ? n - 1 : after;
    double step = valid_t[high] - valid_t[high - 1];
    if (step == 0.0) step = 1.0;
    double fraction = (t - valid_t[high - 1]) / step;
    fraction = fraction < 0.0 ? 0.0 : fraction > 1.0 ? 1.0 : fraction;
    double low = valid[high - 1];
    out[i] = fraction == 1.0 ? valid[high] : low + fraction * (valid[high] - low);
  }
  double first = out[0];
  for (uint32_t i = 0; i < feature->samples; i++) {
    if (feature->quantity == EC_Q_TAXEL_FORCE) out[i] = out[i] / EC_SCALE;
    if (feature->quantity == EC_Q_JOINT_CHANGE) out[i] = out[i] - first;
  }
}

/* size: of all rows of the feature. */
static void transform(uint8_t kind, double *x, uint32_t size, double floor) {
  double largest = largest_of(x, size);
  for (uint32_t i = 0; i < size; i++) {
    if (kind == EC_T_LOG) {
      x[i] = x[i] + floor > 0.0 ? ec_log(x[i] + floor) : 0.0;
    } else if (kind == EC_T_SQRT) {
      double root = ec_sqrt(absolute(x[i]));
      x[i] = x[i] < 0.0 ? -root : root;
    } else {
      x[i] = largest > 0.0 ? x[i] / largest : 0.0;
    }
  }
}

static void to_rate(double *x, uint32_t n, double step_s) {
  double before = x[0];
  x[0] = (x[1] - x[0]) / step_s;
  for (uint32_t i = 1; i + 1 < n; i++) {
    double now = x[i];
    x[i] = (x[i + 1] - before) / (2.0 * step_s);
    before = now;
  }
  x[n - 1] = (x[n - 1] - before) / step_s;
}

/* The samples become others. */
static double summary(uint8_t kind, double *x, uint32_t n) {
  if (kind == EC_S_ROUGHNESS) {
    for (uint32_t i = 0; i + 1 < n; i++) x[i] = absolute(x[i + 1] - x[i]);
    return summed(x, n - 1) / (n - 1);
  }
  if (kind == EC_S_MEAN) return summed(x, n) / n;
  double largest = largest_of(x, n);
  int power = 0;
  if (largest > 0.0) ec_frexp(largest, &power);
  int half = power / 2;
  for (uint32_t i = 0; i < n; i++) x[i] = x[i] * ec_exp2(-half) * ec_exp2(half - power);
  double mean = summed(x, n) / n;
  for (uint32_t i = 0; i < n; i++) x[i] = (x[i] - mean) * (x[i] - mean);
  return ec_sqrt(summed(x, n) / n) * ec_exp2(half) * ec_exp2(power - half);
}

/* The values of a feature. */
static void block(const ec_feature *feature, double window_s, double *out) {
  uint32_t n = feature->samples;
  double step_s = window_s / (n - 1);
  double *x = feature->summary <= EC_S_RATE ? out : samples;
  for (uint32_t row = 0; row < feature->rows; row++) sample(feature, row, step_s, x + row * n);
  for (uint32_t i = 0; i < 3 && feature->transforms[i]; i++) {
    transform(feature->transforms[i], x, feature->rows * n, i ? 1.0 : feature->floor);
  }
  for (uint32_t row = 0; row < feature->rows; row++, x += n) {
    if (feature->summary == EC_S_RATE) to_rate(x, n, step_s);
    if (feature->summary > EC_S_RATE) *out++ = summary(feature->summary, x, n);
  }
}

#define SAMPLES 120
#define BITS 14

/* A channel, held between frames, times a power of two and cut off. No sum of a skin that export
   accepts reaches 2^48, so that the product fits. */
static int32_t channel(const ec_kernels *kernels, const ec_row *row, uint32_t index) {
  int64_t x = row->kernel_cells[kernels == &ec_zone_kernels ? 0 : index];
  if (kernels == &ec_zone_kernels) x = row->zones[index / EC_ZONE_WIDTH][index % EC_ZONE_WIDTH];
  int8_t shift = kernels->shifts[index];
  x = shift > 0 ? x * ((int64_t)1 << shift) : x >> -shift;
  return (int32_t)(x < (1 << BITS) - 1 ? x : (1 << BITS) - 1);
}

/* The results of a kernel at all samples; a tap is heavy if it is one of three. */
static void convolve(
    const int32_t *mixed, const uint8_t heavy[3], int32_t dilation, int32_t *results) {
  for (int32_t s = 0; s < SAMPLES; s++) {
    results[s] = 0;
    for (int32_t tap = 0; tap < 9; tap++) {
      int32_t at = s + (tap - 4) * dilation;
      int32_t weight = tap == heavy[0] || tap == heavy[1] || tap == heavy[2] ? 2 : -1;
      if (at >= 0 && at < SAMPLES) results[s] += weight * mixed[at];
    }
  }
}

/* The next three of nine taps. */
static void next_taps(uint8_t heavy[3]) {
  uint32_t i = 2;
  while (i > 0 && heavy[i] == 6 + i) i--;
  heavy[i]++;
  for (; i < 2; i++) heavy[i + 1] = (uint8_t)(heavy[i] + 1);
}

/* The share of the samples at which each kernel's result is above its biases. */
static void shares(const ec_kernels *kernels, double window_s, double *out) {
  const ec_row *rows[SAMPLES];
  const uint8_t *mix = kernels->mixes;
  const int32_t *bias = kernels->biases;
  double step_s = window_s / (SAMPLES - 1);
  for (uint32_t i = 0, frame = 0; i < SAMPLES; i++) {
    while (frame + 1 < frames && felt[frame + 1]->t <= i * step_s + 1e-6) frame++;
    rows[i] = felt[frame];
  }
  for (int32_t level = 0; level < 4; level++) {
    int32_t dilation = 1 << level;
    uint8_t heavy[3] = {0, 1, 2};
    for (int32_t kernel = 0; kernel < 84; kernel++) {
      int32_t mixed[SAMPLES] = {0};
      int32_t results[SAMPLES];
      uint32_t count = *mix++;
      for (uint32_t i = 0; i < count; i++, mix++) {
        for (uint32_t s = 0; s < SAMPLES; s++) mixed[s] += channel(kernels, rows[s], *mix);
      }
      convolve(mixed, heavy, dilation, results);
      next_taps(heavy);
      int32_t reach = (kernel + level) % 2 ? 4 * dilation : 0;
      for (uint8_t i = 0; i < kernels->biases_of_dilation[level]; i++, bias++) {
        int32_t above = 0;
        for (int32_t s = reach; s < SAMPLES - reach; s++) above += results[s] > *bias;
        *out++ = (double)above / (SAMPLES - 2 * reach);
      }
    }
  }
}

/* The features of the window from onset on, at the arena's beginning. */
void ec_vector(double window_s) {
  feel(window_s);
  for (uint32_t i = 0; i < EC_ZONES + 1; i++) {
    uint8_t zone = ec_zone_names[i];
    double *out = ec_arena;
    if (zone != EC_NO_ZONE) measure(i);
    for (const ec_feature *feature = ec_features; feature < ec_features + EC_FEATURES; feature++) {
      uint32_t values = feature->summary > EC_S_RATE ? 1 : feature->samples;
      if (feature->zone == zone) {
        switch (feature->quantity) {
          case EC_Q_TAXEL_KERNELS: shares(&ec_taxel_kernels, window_s, out); break;
          case EC_Q_ZONE_KERNELS: shares(&ec_zone_kernels, window_s, out); break;
          default: block(feature, window_s, out);
        }
      }
      out += feature->rows * values;
    }
  }
}
