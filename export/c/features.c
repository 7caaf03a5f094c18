/* The values of a contact at sample times to the vector that is classified: edge/features/vector.py,
   transforms.py, kernels.py. It is made in slices. */
#include "internal.h"

static double summed_up[EC_AT_LEAST_1(EC_MOST_SUMMED)];

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
    double value = x[i];
    x[i] = (x[i + 1] - before) / (2.0 * step_s);
    before = value;
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

static struct {
  uint32_t feature;
  uint32_t row; /* or the convolution */
  double *out;
  const uint8_t *mix;
  const int32_t *bias;
  uint8_t heavy[3];
} now;

/* The values of some rows of a feature. */
static void block(const ec_feature *feature, uint32_t point, uint32_t rows) {
  const ec_time_series *series = &ec_sampled[feature->series];
  uint32_t n = series->samples;
  uint32_t size = rows * n;
  double step_s = ec_windows_s[point] / (n - 1);
  double *x = feature->summary <= EC_S_RATE ? now.out : summed_up;
  const double *values = ec_values[point] + series->place + now.row * n;
  for (uint32_t i = 0; i < size; i++) {
    x[i] = values[i];
    if (feature->quantity == EC_Q_TAXEL_FORCE) x[i] = x[i] / EC_SCALE;
    if (feature->quantity == EC_Q_JOINT_CHANGE) x[i] = x[i] - values[i - i % n];
  }
  for (uint32_t i = 0; i < 3 && feature->transforms[i]; i++) {
    transform(feature->transforms[i], x, size, i ? 1.0 : feature->floor);
  }
  for (uint32_t row = 0; row < rows; row++, x += n) {
    if (feature->summary == EC_S_RATE) to_rate(x, n, step_s);
    if (feature->summary > EC_S_RATE) *now.out++ = summary(feature->summary, x, n);
  }
  if (feature->summary <= EC_S_RATE) now.out += size;
}

/* Whether the rows of a feature depend on each other. */
static bool is_whole(const ec_feature *feature) {
  for (uint32_t i = 0; i < 3; i++) {
    if (feature->transforms[i] == EC_T_RELATIVE) return true;
  }
  return false;
}

#define SAMPLES EC_SAMPLES_OF_KERNELS
#define MOST_REACH 32
#define KERNELS 84
#define DILATIONS 4

static void first_taps(void) {
  for (uint8_t i = 0; i < 3; i++) now.heavy[i] = i;
}

/* The next three of nine taps. */
static void next_taps(void) {
  uint8_t *heavy = now.heavy;
  uint32_t i = 2;
  while (i > 0 && heavy[i] == 6 + i) i--;
  heavy[i]++;
  for (; i < 2; i++) heavy[i + 1] = (uint8_t)(heavy[i] + 1);
}

/* The share of the samples at which a kernel's result is above each of its biases. Three taps weigh
   2, and six -1: thrice these, less the sum of all nine. */
static void convolve(const ec_kernels *kernels, uint32_t point) {
  static int32_t padded[MOST_REACH + SAMPLES + MOST_REACH];
  static int32_t results[SAMPLES];
  int32_t *mixed = padded + MOST_REACH;
  uint32_t level = now.row / KERNELS;
  int32_t dilation = 1 << level;
  uint32_t first = kernels == ec_model_now.kernels ? EC_ZONE_CHANNELS : 0;
  for (int32_t s = 0; s < SAMPLES; s++) mixed[s] = 0;
  for (uint32_t count = *now.mix++; count > 0; count--) {
    const uint16_t *values = ec_channels[point][first + *now.mix++];
    for (int32_t s = 0; s < SAMPLES; s++) mixed[s] += values[s];
  }
  const int32_t *a = mixed + (now.heavy[0] - 4) * dilation;
  const int32_t *b = mixed + (now.heavy[1] - 4) * dilation;
  const int32_t *c = mixed + (now.heavy[2] - 4) * dilation;
  for (int32_t phase = 0; phase < dilation; phase++) {
    int32_t sum = 0;
    for (int32_t tap = -4; tap < 4; tap++) sum += mixed[phase + tap * dilation];
    for (int32_t s = phase; s < SAMPLES; s += dilation) {
      sum += mixed[s + 4 * dilation];
      results[s] = 3 * (a[s] + b[s] + c[s]) - sum;
      sum -= mixed[s - 4 * dilation];
    }
  }
  int32_t reach = (now.row % KERNELS + level) % 2 ? 4 * dilation : 0;
  for (uint8_t i = 0; i < kernels->biases_of_dilation[level]; i++) {
    int32_t above = 0;
    int32_t bias = *now.bias++;
    for (int32_t s = reach; s < SAMPLES - reach; s++) above += results[s] > bias;
    *now.out++ = (double)above / (SAMPLES - 2 * reach);
  }
  if (now.row % KERNELS == KERNELS - 1) {
    first_taps();
  } else {
    next_taps();
  }
}

static void begin_kernels(const ec_kernels *kernels) {
  now.mix = ec_model_now.bytes + kernels->mixes;
  now.bias = ec_model_now.longs + kernels->biases;
  first_taps();
}

/* Before the first slice. */
void ec_vector_begin(void) {
  now.feature = 0;
  now.row = 0;
  now.out = ec_vector;
}

/* Make a part of the features of a decision point, in ec_vector; whether it was the last. */
bool ec_vector_slice(uint32_t point) {
  const ec_feature *feature = &ec_features[now.feature];
  uint32_t rows = DILATIONS * KERNELS;
  uint32_t step = 1;
  bool is_of_zones = feature->quantity == EC_Q_ZONE_KERNELS;
  bool is_of_taxels = feature->quantity == EC_Q_TAXEL_KERNELS;
  if (EC_MOST_CHANNELS && (is_of_zones || is_of_taxels)) {
    const ec_kernels *kernels = &ec_model_now.kernels[is_of_zones];
    if (now.row == 0) begin_kernels(kernels);
    convolve(kernels, point);
  } else {
    rows = ec_sampled[feature->series].rows;
    if (is_whole(feature)) step = rows;
    block(feature, point, step);
  }
  now.row += step;
  if (now.row < rows) return false;
  now.row = 0;
  now.feature++;
  return now.feature == EC_FEATURES;
}
