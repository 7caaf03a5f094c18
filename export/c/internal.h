/* What the rooms share. Data flows one way: region, contact, samples and doubts, features,
   graph, decide. */
#ifndef EC_INTERNAL_H
#define EC_INTERNAL_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "edge_classify.h"

/* A sum that is fused with its product has other bits. gcc knows no pragma against it: where the
   processor has such an instruction for doubles, say that -ffp-contract=off is given. */
#if defined(__clang__) || !defined(__GNUC__)
#pragma STDC FP_CONTRACT OFF
#elif !defined(EC_NO_CONTRACTION)
#if defined(__FP_FAST_FMA) || defined(__FMA__) || defined(__FMA4__)
#error "compile with -ffp-contract=off -DEC_NO_CONTRACTION"
#elif defined(__ARM_FEATURE_FMA) && defined(__ARM_FP) && (__ARM_FP & 8)
#error "compile with -ffp-contract=off -DEC_NO_CONTRACTION"
#endif
#endif
#if defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || __FINITE_MATH_ONLY__
#error "compile without -ffast-math and the options of which it consists"
#endif
#if DBL_MANT_DIG != 53 || (FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 1)
#error "doubles must have 64 bits, and be computed as these, not in wider registers"
#endif

/* elementary.c: edge/elementary.py */
double ec_sin(double x);
double ec_cos(double x);
double ec_sqrt(double x);
double ec_log(double x);
double ec_logistic(double x);
double ec_rint(double x);

double ec_exp2(int power);
double ec_frexp(double x, int *power); /* x above 0 is a fraction from 0.5 to 1 times 2^power */

/* region.c */
typedef bool ec_set[EC_ROWS * EC_COLS];

typedef struct {
  uint32_t begin; /* of the active taxels, and the end of them */
  uint32_t end;
  uint32_t area;
  uint16_t peak;
  ec_set taxels;
} ec_region;

typedef enum { EC_CONTACT, EC_SKIN, EC_LEFT, EC_RIGHT, EC_NO_ZONE } ec_zone_name;
#define EC_ZONE_WIDTH 8

void ec_largest(
    const uint16_t *counts, const bool *valid, const ec_set previous, ec_set active,
    ec_region *region);
void ec_zone(
    ec_zone_name zone, const ec_set active, const ec_region *region, const uint16_t *counts,
    int64_t numbers[EC_ZONE_WIDTH]);

/* contact.c */
#define EC_NAN ((double)NAN)
#define EC_INFINITY ((double)INFINITY)
#define EC_AT_LEAST_1(n) ((n) ? (n) : 1)

/* What may be unknown in a frame, by its place in a row: the centroids of zones, along and around,
   then these. */
enum {
  EC_OF_STIFFNESS = 2 * EC_ZONES,
  EC_OF_MOTION,
  EC_OF_FORCE_MOTION,
  EC_OF_JOINTS,
  EC_UNSURE_VALUES = EC_OF_JOINTS + EC_JOINTS
};

/* A frame of a contact. */
typedef struct {
  double t; /* seconds from onset */
  double motions[2]; /* of the centroid, and of the force-weighted one */
  double joints[EC_AT_LEAST_1(EC_JOINTS)];
  int64_t zones[EC_AT_LEAST_1(EC_ZONES)][EC_ZONE_WIDTH];
  uint32_t cells[EC_AT_LEAST_1(EC_CELLS)];
  uint32_t kernel_cells[EC_AT_LEAST_1(EC_KERNEL_CELLS)];
  uint32_t area; /* 0 without contact */
  uint16_t peak;
  bool same; /* as the frame before it, bit for bit */
  /* samples.c fills in the others */
  bool is_spread[EC_AT_LEAST_1(EC_ZONES)]; /* whether spreads are known */
  double spreads[EC_AT_LEAST_1(EC_ZONES)][5];
  double unsure[EC_UNSURE_VALUES]; /* not a number where not known */
  double column[EC_AT_LEAST_1(EC_ZONES)]; /* of the centroid when it was last known */
  double turns[EC_AT_LEAST_1(EC_ZONES)]; /* in columns, that are added to it */
} ec_row;

typedef struct {
  bool is_known;
  bool is_settled; /* by a frame that no later reading replaces */
  double point[3];
} ec_start;

typedef struct {
  bool under_way;
  bool ended;
  bool missing_taxels;
  bool missing_pose;
  bool late; /* under way in the first frame */
  double onset_s;
  double age_s; /* of the last frame taken in */
  double touched_s; /* when it was last felt */
  uint32_t frames;
  bool has_row;
  ec_region region; /* when it was last seen */
  ec_start starts[2];
} ec_contact;

extern ec_contact ec_now;
int ec_follow(
    const uint16_t *counts, const bool *valid, double t, const double *joints,
    uint32_t first_point, bool is_busy);
bool ec_released(double touched_s, double now_s);
uint16_t ec_close(uint32_t point);

/* samples.c: the values of each course at the sample times of a decision point, and those of the
   channels of kernels */
#define EC_SAMPLES_OF_KERNELS 120
extern double ec_values[EC_POINTS][EC_AT_LEAST_1(EC_VALUES)];
extern uint16_t ec_channels[EC_POINTS][EC_AT_LEAST_1(EC_CHANNELS)][EC_SAMPLES_OF_KERNELS];
void ec_samples_begin(void);
void ec_samples_take(ec_row *row, uint32_t first_point);
void ec_samples_close(uint32_t point, ec_row *row);

/* doubts.c */
void ec_doubts_begin(void);
void ec_doubts_take(const ec_row *row);
uint16_t ec_doubts(const ec_row *row, double window_s);

/* features.c */
void ec_vector_begin(void);
bool ec_vector_slice(uint32_t point);

/* model.c: the skin and the arm */
typedef struct {
  double angle_deg;
  double step_deg; /* to the next column */
} ec_angle;

enum { EC_FIXED, EC_REVOLUTE, EC_CONTINUOUS, EC_PRISMATIC };

typedef struct {
  double axis[3];
  double step[12]; /* before the motion: the first three rows of a transform */
  double after[3]; /* the fixed step after it */
  uint8_t kind;
} ec_link;

/* Of a joint that features are made of. */
typedef struct {
  double low;
  double high;
  double still_s; /* how long an angle stayed the same in training */
} ec_limit;

extern const ec_limit ec_limits[];
extern const ec_angle ec_angles[];
extern const ec_link ec_links[];
extern const bool ec_alive[];
#define EC_READABLE(valid, i) (ec_alive[i] && (!(valid) || (valid)[i]))
extern const uint8_t ec_zone_names[]; /* EC_NO_ZONE comes last */
extern const int16_t ec_cell_of_taxel[];
extern const int16_t ec_kernel_cell_of_taxel[];

/* model.c: the features, by the names of edge/features/names.py */
enum { EC_T_NONE, EC_T_LOG, EC_T_SQRT, EC_T_RELATIVE };
enum { EC_S_, EC_S_RATE, EC_S_MEAN, EC_S_DEVIATION, EC_S_ROUGHNESS };

/* A quantity of a zone at some times of the window; several features may be made of it. */
typedef struct {
  uint16_t samples;
  uint16_t rows; /* cells or joints */
  uint8_t zone; /* index in ec_zone_names */
  uint8_t quantity;
  uint32_t place; /* of the first in ec_values */
} ec_course;

typedef struct {
  double floor; /* of the first transform, where it is a logarithm */
  uint8_t course;
  uint8_t quantity;
  uint8_t transforms[3];
  uint8_t summary;
} ec_feature;

typedef struct {
  const int8_t *shifts; /* of each channel */
  const int32_t *biases;
  const uint8_t *mixes; /* of each convolution: how many channels, and which */
  uint8_t biases_of_dilation[4];
} ec_kernels;

extern const ec_course ec_courses[];
extern const ec_feature ec_features[];
extern const ec_kernels ec_taxel_kernels;
extern const ec_kernels ec_zone_kernels;

/* model.c: the numbers of graph.c, each in the smallest type that holds it exactly. Of a palette, a
   byte for each says which of some doubles it is. Rows of a packed matrix begin with the bits of a
   number, and then have these. */
typedef float float32_t;
typedef double float64_t;
enum { EC_INT8, EC_INT16, EC_INT32, EC_FLOAT32, EC_FLOAT64, EC_PALETTE, EC_PACKED };

typedef struct {
  const void *data;
  const double *palette;
  uint32_t stride; /* from a decision point to the next; 0 where they share the numbers */
  uint16_t columns; /* of a packed matrix */
  uint8_t type;
  uint8_t shift; /* a packed number is so many times halved */
} ec_table;

#define EC_NOWHERE 65535

/* A node of the graph. Places below EC_ARENA are in the arena; the others are tables. */
typedef struct {
  uint16_t inputs[5];
  uint16_t outputs[3];
  uint16_t sizes[4];
  uint8_t operator;
} ec_step;

enum {
  EC_ADD, EC_SUB, EC_MUL, EC_DIV, EC_MAX, EC_LESSOREQUAL, EC_WHERE, EC_CLIP, EC_ROUND, EC_SQUEEZE,
  EC_SQRT, EC_GEMM, EC_MATMUL, EC_REDUCEL1, EC_REDUCESUM, EC_REDUCESUMSQUARE, EC_REDUCEMEAN,
  EC_TOPK, EC_GATHER, EC_GATHERELEMENTS, EC_GATHERND, EC_PAD, EC_ARGMAX, EC_PROJECT, EC_FINITE
};

extern const ec_table ec_tables[];
extern const ec_step ec_steps[];
extern const double ec_windows_s[];

/* model.c: the tasks, and places of the graph's outputs in the arena */
typedef struct {
  double slope;
  double intercept;
  double doubt;
} ec_curve;

typedef struct {
  const ec_curve *curves; /* of each decision point */
  ec_curve rule_curve;
  double rule_confidence; /* above 1: a fixed window */
  uint8_t rule_last;
  bool has_rule;
  struct {
    uint32_t label, scores, distances, neighbours, label_distances; /* 0: none */
  } places;
  uint16_t labels;
  uint16_t k;
  const uint8_t *indices[2]; /* of a product: the factors' label of each label; or NULL */
  uint8_t factors[2];
} ec_task;

extern const ec_task ec_tasks[];
extern const double ec_typical[]; /* of each decision point */
extern const double ec_novel[];
extern const double ec_remote[];
extern const double ec_middles[];
extern const double ec_slopes[];
extern const uint64_t ec_checksum; /* of the outputs for features that are all EC_PROBE */
#define EC_PROBE 0.3
#define EC_PROBES 8

/* graph.c: edge/decide/graph.py */
extern double ec_arena[EC_ARENA];
void ec_graph_begin(void);
bool ec_graph_slice(uint32_t point);

#endif
