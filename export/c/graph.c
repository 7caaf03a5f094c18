/* The exported graph, as edge/decide/graph.py computes it, for one vector, in slices. All that
   decides is made of whole numbers below 2^53, so that the order of sums changes no bit. */
#include "internal.h"

#define TWO_53 9007199254740992.0

double ec_arena[EC_ARENA];

static struct {
  uint32_t point;
  uint32_t step;
  uint32_t begin; /* of the step's parts, which the next slice computes */
  uint32_t end;
} now;

/* What a slice does about, in numbers of a matrix; other operators take as long for SHARE of them. */
#define SLICE 2048
#define SHARE 16

/* Sizes of a step that goes along an axis: before it, along it and behind it, and how many numbers
   it makes of those along it. */
enum { BEFORE, ALONG, BEHIND, COUNT };

/* A number of the arena or of a table. */
static double at(uint32_t place, uint32_t i) {
  if (place < EC_ARENA) return ec_arena[place + i];
  const ec_table *table = &ec_tables[place - EC_ARENA];
  i += now.point * table->stride;
  switch (table->type) {
    case EC_INT8: return ((const int8_t *)table->data)[i];
    case EC_INT16: return ((const int16_t *)table->data)[i];
    case EC_INT32: return ((const int32_t *)table->data)[i];
    case EC_FLOAT32: return (double)((const float *)table->data)[i];
    case EC_PALETTE: return table->palette[((const uint8_t *)table->data)[i]];
    default: return ((const double *)table->data)[i];
  }
}

/* The sizes are others here: of the output, and of the inputs, each as many or 1. */
static void element_wise(const ec_step *step) {
  const uint16_t *inputs = step->inputs;
  double *out = ec_arena + step->outputs[0];
  for (uint32_t i = now.begin; i < now.end; i++) {
    double x = at(inputs[0], step->sizes[1] > 1 ? i : 0);
    double y = step->sizes[2] ? at(inputs[1], step->sizes[2] > 1 ? i : 0) : 0.0;
    double z = step->sizes[3] ? at(inputs[2], step->sizes[3] > 1 ? i : 0) : 0.0;
    switch (step->operator) {
      case EC_ADD: out[i] = x + y; break;
      case EC_SUB: out[i] = x - y; break;
      case EC_MUL: out[i] = x * y; break;
      case EC_DIV: out[i] = x / y; break;
      case EC_MAX: out[i] = x > y || x != x ? x : y; break;
      case EC_LESSOREQUAL: out[i] = x <= y ? 1.0 : 0.0; break;
      case EC_WHERE: out[i] = x != 0.0 ? y : z; break;
      case EC_CLIP: out[i] = x < y ? y : x > z ? z : x; break;
      case EC_ROUND: out[i] = ec_rint(x); break;
      case EC_SQUEEZE: out[i] = x; break;
      default: out[i] = ec_sqrt(x);
    }
  }
}

/* The sums of a packed matrix's columns, row by row. Below 2^53 they do not depend on the order; those
   of a vector that is refused may wrap around. */
static struct {
  const uint8_t *row;
  uint64_t sums[EC_AT_LEAST_1(EC_MOST_COLUMNS)];
  uint64_t squares;
  double excess;
  int bits; /* behind the point, of a factor */
} product;

static void begin_product(const ec_table *matrix) {
  product.row = (const uint8_t *)matrix->data + now.point * matrix->stride;
  product.squares = 0;
  product.excess = 0.0;
  product.bits = 0;
  for (uint32_t j = 0; j < matrix->columns; j++) product.sums[j] = 0;
}

/* A number of at most 25 bits that begins at a bit. */
static inline int32_t unpacked(const uint8_t *row, uint32_t bit, uint32_t bits) {
  const uint8_t *p = row + bit / 8;
  uint32_t word = p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
  word = word >> bit % 8 & (((uint32_t)1 << bits) - 1);
  return (int32_t)(word - ((uint32_t)1 << (bits - 1)));
}

/* A whole number; 0 for one that is not finite, of a vector that is refused. */
static int64_t whole(double x) { return x > -TWO_53 && x < TWO_53 ? (int64_t)x : 0; }

/* Most factors have 32 bits, of which many processors multiply two in one instruction. */
static void multiply_small(int32_t factor, const uint8_t *row, uint32_t bits, uint32_t size) {
  uint64_t *sum = product.sums;
  for (uint32_t bit = 0; bit < size; bit += bits, sum++) {
    *sum += (uint64_t)((int64_t)factor * unpacked(row, bit, bits));
  }
}

static void multiply_large(int64_t factor, const uint8_t *row, uint32_t bits, uint32_t size) {
  uint64_t *sum = product.sums;
  for (uint32_t bit = 0; bit < size; bit += bits, sum++) {
    *sum += (uint64_t)factor * (uint64_t)(int64_t)unpacked(row, bit, bits);
  }
}

/* Add the products of a factor and the next row; a row of 0 bits is one of zeros. */
static void multiply(int64_t factor, uint32_t columns) {
  const uint8_t *row = product.row + 1;
  uint32_t bits = *product.row;
  uint32_t size = columns * bits;
  product.row = row + (size + 7) / 8;
  if (factor > INT32_MIN && factor < INT32_MAX) {
    if (factor != 0) multiply_small((int32_t)factor, row, bits, size);
  } else {
    multiply_large(factor, row, bits, size);
  }
}

static void end_product(const ec_table *matrix, const ec_step *step) {
  double *out = ec_arena + step->outputs[0];
  double unit = ec_exp2(-matrix->shift - product.bits);
  for (uint32_t j = 0; j < step->sizes[COUNT]; j++) {
    out[j] = j < matrix->columns ? (double)(int64_t)product.sums[j] * unit : 0.0;
  }
}

/* Squared weights of coordinates, which are powers of two, have no more: BESIDE in
   train/model/novelty.py. */
#define FRACTION_BITS 8

/* x (n) times a packed matrix (n, m), plus m numbers of a Gemm. */
static void packed_product(const ec_step *step) {
  const ec_table *matrix = &ec_tables[step->inputs[1] - EC_ARENA];
  double *out = ec_arena + step->outputs[0];
  uint32_t n = step->sizes[ALONG];
  if (now.begin == 0) {
    begin_product(matrix);
    for (uint32_t i = 0; i < n; i++) {
      double x = at(step->inputs[0], i);
      if (x != ec_rint(x)) product.bits = FRACTION_BITS;
    }
  }
  for (uint32_t i = now.begin; i < now.end; i++) {
    double x = at(step->inputs[0], i) * ec_exp2(product.bits);
    multiply(whole(x), matrix->columns);
  }
  if (now.end < n) return;
  end_product(matrix, step);
  for (uint32_t j = 0; step->operator == EC_GEMM && j < step->sizes[COUNT]; j++) {
    out[j] += at(step->inputs[2], j);
  }
}

/* Features, less their means and times their gains, rounded and cut off, times a packed matrix; how
   much was cut off; and the sum of their squares. */
enum { MEANS, GAINS, LIMIT, MATRIX, COLUMNS };

static void project(const ec_step *step) {
  const uint16_t *inputs = step->inputs;
  const ec_table *matrix = &ec_tables[inputs[MATRIX] - EC_ARENA];
  const uint16_t *columns = 0;
  double limit = at(inputs[LIMIT], 0);
  if (inputs[COLUMNS] != EC_NOWHERE) columns = ec_tables[inputs[COLUMNS] - EC_ARENA].data;
  if (now.begin == 0) begin_product(matrix);
  for (uint32_t i = now.begin; i < now.end; i++) {
    uint32_t feature = columns ? columns[i] : i;
    double x = (ec_arena[feature] - at(inputs[MEANS], feature)) * at(inputs[GAINS], i);
    double rounded = ec_rint(x);
    double inside = rounded < -limit ? -limit : rounded > limit ? limit : rounded;
    if (inside != rounded) product.excess += rounded < 0.0 ? inside - rounded : rounded - inside;
    int32_t factor = inside == inside ? (int32_t)inside : 0; /* no limit is beyond 2^24 */
    product.squares += (uint64_t)((int64_t)factor * factor);
    multiply(factor, matrix->columns);
  }
  if (now.end < step->sizes[ALONG]) return;
  end_product(matrix, step);
  if (step->outputs[1] != EC_NOWHERE) ec_arena[step->outputs[1]] = product.excess;
  if (step->outputs[2] != EC_NOWHERE) ec_arena[step->outputs[2]] = (double)product.squares;
}

/* 0 where all numbers are finite. */
static void finite(const ec_step *step) {
  if (now.begin == 0) product.excess = 0.0;
  for (uint32_t i = now.begin; i < now.end; i++) {
    double zero = at(step->inputs[0], i) * 0.0;
    product.excess += zero;
  }
  ec_arena[step->outputs[0]] = product.excess;
}

/* x (n) times any matrix (n, m), plus m numbers of a Gemm. */
static void gemm(const ec_step *step) {
  uint32_t n = step->sizes[ALONG];
  uint32_t m = step->sizes[COUNT];
  for (uint32_t j = now.begin; j < now.end; j++) {
    double sum = 0.0;
    for (uint32_t i = 0; i < n; i++) {
      sum += at(step->inputs[0], i) * at(step->inputs[1], i * m + j);
    }
    if (step->operator == EC_GEMM) sum += at(step->inputs[2], j);
    ec_arena[step->outputs[0] + j] = sum;
  }
}

static void reduce(const ec_step *step) {
  uint32_t x = step->inputs[0];
  double *out = ec_arena + step->outputs[0];
  uint32_t along = step->sizes[ALONG];
  uint32_t behind = step->sizes[BEHIND];
  for (uint32_t i = now.begin; i < now.end; i++) {
    double sum = 0.0;
    for (uint32_t j = 0; j < along; j++) {
      double value = at(x, (i / behind * along + j) * behind + i % behind);
      if (step->operator == EC_REDUCEL1 && value < 0.0) value = -value;
      if (step->operator == EC_REDUCESUMSQUARE) value *= value;
      sum += value;
    }
    out[i] = step->operator == EC_REDUCEMEAN ? sum / along : sum;
  }
}

/* The k smallest of each row, in order, and their places; of equal ones the first comes first. */
static void top_k(const ec_step *step) {
  uint32_t x = step->inputs[0];
  uint32_t k = step->sizes[COUNT];
  for (uint32_t row = now.begin; row < now.end; row++) {
    double *values = ec_arena + step->outputs[0] + row * k;
    double *places = ec_arena + step->outputs[1] + row * k;
    uint32_t count = 0;
    for (uint32_t i = 0; i < step->sizes[ALONG]; i++) {
      double value = at(x, row * step->sizes[ALONG] + i);
      if (count == k && !(value < values[k - 1])) continue;
      uint32_t place = count < k ? count++ : k - 1;
      for (; place > 0 && value < values[place - 1]; place--) {
        values[place] = values[place - 1];
        places[place] = places[place - 1];
      }
      values[place] = value;
      places[place] = i;
    }
  }
}

/* Indices below 0 count from the end. */
static void gather(const ec_step *step) {
  uint32_t x = step->inputs[0];
  double *out = ec_arena + step->outputs[0];
  uint32_t along = step->sizes[ALONG];
  uint32_t behind = step->sizes[BEHIND];
  for (uint32_t i = 0; i < step->sizes[BEFORE]; i++) {
    for (uint32_t j = 0; j < step->sizes[COUNT]; j++) {
      double index = at(step->inputs[1], j);
      uint32_t place = (uint32_t)(index < 0.0 ? index + along : index);
      for (uint32_t l = 0; l < behind; l++) *out++ = at(x, (i * along + place) * behind + l);
    }
  }
}

static void pad(const ec_step *step) {
  uint32_t x = step->inputs[0];
  double *out = ec_arena + step->outputs[0];
  for (uint32_t i = 0; i < step->sizes[ALONG]; i++) out[i] = at(x, i);
  out[step->sizes[ALONG]] = at(step->inputs[2], 0);
}

static void arg_max(const ec_step *step) {
  uint32_t x = step->inputs[0];
  uint32_t best = 0;
  for (uint32_t i = 1; i < step->sizes[ALONG]; i++) {
    if (at(x, i) > at(x, best)) best = i;
  }
  ec_arena[step->outputs[0]] = best;
}

static bool is_packed(const ec_step *step) {
  return step->inputs[1] >= EC_ARENA && ec_tables[step->inputs[1] - EC_ARENA].type == EC_PACKED;
}

/* How many parts a step has, and how many of them a slice takes. */
static uint32_t parts(const ec_step *step, uint32_t *at_once) {
  const uint16_t *sizes = step->sizes;
  uint32_t matrix = step->inputs[step->operator == EC_PROJECT ? MATRIX : 1];
  uint32_t along = sizes[ALONG];
  uint32_t columns = matrix >= EC_ARENA ? ec_tables[matrix - EC_ARENA].columns : 0;
  *at_once = SLICE / SHARE;
  switch (step->operator) {
    case EC_GEMM:
    case EC_MATMUL:
      *at_once = 1 + SLICE / (is_packed(step) ? columns : SHARE * along);
      return is_packed(step) ? along : sizes[COUNT];
    case EC_PROJECT: *at_once = 1 + SLICE / (SHARE + columns); return along;
    case EC_FINITE: return along;
    case EC_REDUCEL1:
    case EC_REDUCESUM:
    case EC_REDUCESUMSQUARE:
    case EC_REDUCEMEAN:
      *at_once = 1 + *at_once / along;
      return (uint32_t)sizes[BEFORE] * sizes[BEHIND];
    case EC_TOPK: *at_once = 1 + *at_once / along; return sizes[BEFORE];
    case EC_GATHER:
    case EC_GATHERELEMENTS:
    case EC_GATHERND:
    case EC_PAD:
    case EC_ARGMAX: return 1;
    default: return sizes[0];
  }
}

static void compute(const ec_step *step) {
  switch (step->operator) {
    case EC_GEMM:
    case EC_MATMUL:
      if (is_packed(step)) {
        packed_product(step);
      } else {
        gemm(step);
      }
      break;
    case EC_PROJECT: project(step); break;
    case EC_FINITE: finite(step); break;
    case EC_REDUCEL1:
    case EC_REDUCESUM:
    case EC_REDUCESUMSQUARE:
    case EC_REDUCEMEAN: reduce(step); break;
    case EC_TOPK: top_k(step); break;
    case EC_GATHER:
    case EC_GATHERELEMENTS:
    case EC_GATHERND: gather(step); break;
    case EC_PAD: pad(step); break;
    case EC_ARGMAX: arg_max(step); break;
    default: element_wise(step);
  }
}

/* Before the first slice. */
void ec_graph_begin(void) {
  now.step = 0;
  now.begin = 0;
}

/* Compute a part of the graph, of the features at the arena's beginning; whether it was the last. */
bool ec_graph_slice(uint32_t point) {
  const ec_step *step = &ec_steps[now.step];
  uint32_t at_once;
  uint32_t count = parts(step, &at_once);
  now.point = point;
  now.end = count - now.begin < at_once ? count : now.begin + at_once;
  compute(step);
  now.begin = now.end;
  if (now.begin < count) return false;
  now.begin = 0;
  now.step++;
  return now.step == EC_STEPS;
}
