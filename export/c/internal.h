/* What the rooms share. Data flows one way: region, contact, samples and doubts, features,
   formula, decide. */
#ifndef EC_INTERNAL_H
#define EC_INTERNAL_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "edge_classify.h"
#include "image.h"

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
  EC_OF_STIFFNESS = 2 * EC_MOST_ZONES,
  EC_OF_MOTION,
  EC_OF_FORCE_MOTION,
  EC_OF_JOINTS,
  EC_UNSURE_VALUES = EC_OF_JOINTS + EC_MOST_JOINTS
};

/* A frame of a contact. */
typedef struct {
  double t; /* seconds from onset */
  double motions[2]; /* of the centroid, and of the force-weighted one */
  double joints[EC_AT_LEAST_1(EC_MOST_JOINTS)];
  int64_t zones[EC_AT_LEAST_1(EC_MOST_ZONES)][EC_ZONE_WIDTH];
  uint32_t cells[EC_AT_LEAST_1(EC_MOST_CELLS)];
  uint32_t kernel_cells[EC_AT_LEAST_1(EC_MOST_KERNEL_CELLS)];
  uint32_t area; /* 0 without contact */
  uint16_t peak;
  bool same; /* as the frame before it, bit for bit */
  /* samples.c fills in the others */
  bool is_spread[EC_AT_LEAST_1(EC_MOST_ZONES)]; /* whether spreads are known */
  double spreads[EC_AT_LEAST_1(EC_MOST_ZONES)][5];
  double unsure[EC_UNSURE_VALUES]; /* not a number where not known */
  double column[EC_AT_LEAST_1(EC_MOST_ZONES)]; /* of the centroid when it was last known */
  double turns[EC_AT_LEAST_1(EC_MOST_ZONES)]; /* in columns, that are added to it */
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

/* samples.c: the values of each series at the sample times of a decision point, and those of the
   channels of kernels */
#define EC_SAMPLES_OF_KERNELS 120
extern double ec_values[EC_MOST_POINTS][EC_AT_LEAST_1(EC_MOST_VALUES)];
extern uint16_t ec_channels[EC_MOST_POINTS][EC_AT_LEAST_1(EC_MOST_CHANNELS)][EC_SAMPLES_OF_KERNELS];
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

/* image.c: the model, by the names of its numbers and tables */
ec_refusal ec_open(const void *address);

#define EC_NUMBER(name) (ec_model_now.header->numbers.name)
#define EC_SIZE(name) (ec_model_now.header->sizes.name)
#define EC_TRIALS (ec_model_now.header->trials)
#define EC_RELEASE_S EC_NUMBER(release_s)
#define EC_RADIUS_M EC_NUMBER(radius_m)
#define EC_ROW0_Z_M EC_NUMBER(row0_z_m)
#define EC_ALONG EC_NUMBER(along)
#define EC_AROUND EC_NUMBER(around)
#define EC_SCALE EC_NUMBER(scale)
#define EC_WINDOW_S EC_NUMBER(window_s)
#define EC_LONG_STEP_S EC_NUMBER(long_step_s)
#define EC_FORCE_FLOOR EC_NUMBER(force_floor)
#define EC_LENGTH_FLOOR EC_NUMBER(length_floor)
#define EC_THRESHOLD_COUNTS EC_NUMBER(threshold_counts)
#define EC_ONSET EC_NUMBER(onset)
#define EC_COLUMN_ANGLES EC_NUMBER(column_angles)
#define EC_DOF EC_NUMBER(dof)
#define EC_LINKS EC_NUMBER(link_count)
#define EC_DEBOUNCE EC_NUMBER(debounce)
#define EC_REPEATS EC_NUMBER(repeats)
#define EC_EARLY EC_NUMBER(early)
#define EC_NAMING EC_NUMBER(naming)
#define EC_POINTS EC_SIZE(points)
#define EC_TASKS EC_SIZE(tasks)
#define EC_SPACES EC_SIZE(spaces)
#define EC_FEATURES EC_SIZE(features)
#define EC_WIDTH EC_SIZE(width)
#define EC_SAMPLED EC_SIZE(sampled)
#define EC_JOINTS EC_SIZE(joints)
#define EC_LONG_STEPS EC_SIZE(long_steps)
#define EC_CELLS EC_SIZE(cells)
#define EC_KERNEL_CELLS EC_SIZE(kernel_cells)
#define EC_ZONE_CHANNELS EC_SIZE(zone_channels)
#define EC_CHANNELS EC_SIZE(channels)
#define EC_HAS_OUTLIERS (EC_MOST_HAS_OUTLIERS && EC_SIZE(has_outliers))
#define ec_angles ec_model_now.angles
#define ec_links ec_model_now.links
#define ec_limits ec_model_now.limits
#define ec_alive ec_model_now.alive
#define ec_zone_names ec_model_now.zone_names /* EC_NO_ZONE comes last */
#define ec_cell_of_taxel ec_model_now.cell_of_taxel
#define ec_kernel_cell_of_taxel ec_model_now.kernel_cell_of_taxel
#define ec_sampled ec_model_now.sampled
#define ec_features ec_model_now.features
#define ec_windows_s ec_model_now.windows_s
#define ec_tasks ec_model_now.tasks

#define EC_READABLE(valid, i) (ec_alive[i] && (!(valid) || (valid)[i]))

enum { EC_FIXED, EC_REVOLUTE, EC_CONTINUOUS, EC_PRISMATIC };

/* The features, by the names of edge/features/names.py and quantities.py. */
enum { EC_QUANTITIES };
enum { EC_T_NONE, EC_T_LOG, EC_T_SQRT, EC_T_RELATIVE };
enum { EC_S_, EC_S_RATE, EC_S_MEAN, EC_S_DEVIATION, EC_S_ROUGHNESS };
enum { EC_DOUBLES, EC_FLOATS, EC_PALETTE }; /* types of values */

#define EC_PROBE 0.3
#define EC_PROBES 8

/* formula.c */
typedef struct {
  int16_t label; /* -1: the vector is refused */
  uint16_t votes[EC_AT_LEAST_1(EC_MOST_LABELS)];
  uint16_t neighbours[EC_MOST_NEIGHBOURS + 1]; /* trials, from the nearest on */
  double distances[EC_MOST_NEIGHBOURS + 1];
  double label_distances[EC_AT_LEAST_1(EC_MOST_LABELS)];
} ec_answer;

typedef struct {
  double outlier_score;
  double known_distance;
  bool out_of_range;
} ec_scores;

extern double ec_vector[EC_AT_LEAST_1(EC_MOST_WIDTH)];
extern ec_answer ec_answers[EC_AT_LEAST_1(EC_MOST_TASKS)];
extern ec_scores ec_scores_now;
void ec_formula_begin(void);
bool ec_formula_slice(uint32_t point);

#endif
