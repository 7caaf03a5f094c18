/* The exported graph, as edge/model/graph.py computes it, for one vector. All that decides is made
   of whole numbers below 2^53, so that the order of sums changes no bit. */
#include "internal.h"

double ec_arena[EC_ARENA];

static uint32_t now; /* the decision point */

/* Sizes of a step that goes along an axis: before it, along it and behind it, and how many numbers
   it makes of those along it. */
enum { BEFORE, ALONG, BEHIND, COUNT };

/* A number of the arena or of a table. */
static double at(uint32_t place, uint32_t i) {
  if (place < EC_ARENA) return ec_arena[place + i];
  const ec_table *table = &ec_tables[place - EC_ARENA];
  i += now * table->stride;
  switch (table->type) {
    case EC_INT8: return ((const int8_t *)table->data)[i];
    case EC_INT16: return ((const int16_t *)table->data)[i];
    case EC_INT32: return ((const int32_t *)table->data)[i];
    case EC_FLOAT32: return (double)((const float *)table->data)[i];
    default: return ((const double *)table->data)[i];
  }
}

/* The sizes are others here: of the output, and of the inputs, each as many or 1. */
static void element_wise(const ec_step *step) {
  const uint32_t *inputs = step->inputs;
  double *out = ec_arena + step->outputs[0];
  for (uint32_t i = 0; i < step->sizes[0]; i++) {
    double x = at(inputs[0], step->sizes[1] > 1 ? i : 0);
    double y = at(inputs[1], step->sizes[2] > 1 ? i : 0);
    double z = at(inputs[2], step->sizes[3] > 1 ? i : 0);
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

/* Whether all factors are whole numbers of 32 bits; then `factors` has them. */
static int32_t factors[EC_WIDTH];

static bool are_whole(uint32_t x, uint32_t n) {
  for (uint32_t i = 0; i < n; i++) {
    double factor = at(x, i);
    if (!(factor > -2147483648.0 && factor < 2147483648.0)) return false;
    factors[i] = (int32_t)factor;
    if (factors[i] != factor) return false;
  }
  return true;
}

/* A column's sum of products in integers, which many processors have faster than doubles. */
static double whole_sum(const ec_table *matrix, uint32_t n, uint32_t i, uint32_t m) {
  int64_t sum = 0;
  i += now * matrix->stride;
  for (uint32_t k = 0; k < n; k++, i += m) {
    switch (matrix->type) {
      case EC_INT8: sum += (int64_t)factors[k] * ((const int8_t *)matrix->data)[i]; break;
      case EC_INT16: sum += (int64_t)factors[k] * ((const int16_t *)matrix->data)[i]; break;
      default: sum += (int64_t)factors[k] * ((const int32_t *)matrix->data)[i];
    }
  }
  return (double)sum;
}

/* x (n) times a matrix (n, m), plus m numbers of a Gemm. */
static void gemm(const ec_step *step) {
  uint32_t x = step->inputs[0];
  uint32_t matrix = step->inputs[1];
  uint32_t n = step->sizes[ALONG];
  uint32_t m = step->sizes[COUNT];
  const ec_table *table = matrix < EC_ARENA ? 0 : &ec_tables[matrix - EC_ARENA];
  bool whole = table && table->type <= EC_INT32 && are_whole(x, n);
  for (uint32_t j = 0; j < m; j++) {
    double sum = whole ? whole_sum(table, n, j, m) : 0.0;
    for (uint32_t i = 0; !whole && i < n; i++) sum += at(x, i) * at(matrix, i * m + j);
    if (step->operator == EC_GEMM) sum += at(step->inputs[2], j);
    ec_arena[step->outputs[0] + j] = sum;
  }
}

static void reduce(const ec_step *step) {
  uint32_t x = step->inputs[0];
  double *out = ec_arena + step->outputs[0];
  uint32_t along = step->sizes[ALONG];
  uint32_t behind = step->sizes[BEHIND];
  for (uint32_t i = 0; i < step->sizes[BEFORE] * behind; i++) {
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
  for (uint32_t row = 0; row < step->sizes[BEFORE]; row++) {
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

void ec_graph(uint32_t point) {
  now = point;
  for (const ec_step *step = ec_steps; step < ec_steps + EC_STEPS; step++) {
    switch (step->operator) {
      case EC_GEMM:
      case EC_MATMUL: gemm(step); break;
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
}
