/* The model as data: what model.bin holds. export/image.py reads its records here; all are of numbers
   that stand at multiples of their size, and places count in the table of their type. */
#ifndef EC_IMAGE_H
#define EC_IMAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "model.h"

#define EC_MAGIC 0x314D4345u /* "ECM1": another format has another number */
#define EC_NOWHERE UINT32_MAX

typedef struct {
  double release_s; /* the skin: SkinLayout in edge/touch/layout.py */
  double radius_m;
  double row0_z_m;
  double along;
  double around;
  double scale;
  double window_s;
  double long_step_s;
  double force_floor;
  double length_floor;
  uint32_t threshold_counts;
  uint32_t onset;
  uint32_t column_angles;
  uint32_t dof;
  uint32_t link_count;
  uint32_t debounce;
  uint32_t repeats;
  uint32_t early;
  uint32_t naming; /* the task that names objects; EC_NOWHERE: none is unknown */
  uint32_t text; /* the name of the model */
  uint32_t calibrated; /* whether answers have a confidence */
  uint32_t unused;
  uint64_t checksum; /* of the outputs for features that are all EC_PROBE */
} ec_numbers;

/* A model may have at most so much of each as the program's memory has room for: EC_MOST. */
typedef struct {
  uint32_t points; /* of decision */
  uint32_t tasks;
  uint32_t labels;
  uint32_t neighbours;
  uint32_t nearest; /* of all labels of a task, those that count for its distances */
  uint32_t components;
  uint32_t spaces;
  uint32_t features;
  uint32_t width;
  uint32_t summed; /* numbers of a feature that are summed up together */
  uint32_t sampled;
  uint32_t values; /* of all series */
  uint32_t joints;
  uint32_t long_steps;
  uint32_t zones;
  uint32_t cells;
  uint32_t kernel_cells;
  uint32_t zone_channels;
  uint32_t channels;
  uint32_t motion; /* from here on 0 or 1 */
  uint32_t force_motion;
  uint32_t centroids;
  uint32_t spreads;
  uint32_t has_outliers;
} ec_sizes;

typedef struct {
  double angle_deg;
  double step_deg; /* to the next column */
} ec_angle;

typedef struct {
  double axis[3];
  double step[12]; /* before the motion: the first three rows of a transform */
  double after[3]; /* the fixed step after it */
  uint64_t kind;
} ec_link;

/* Of a joint that features are made of. */
typedef struct {
  double low;
  double high;
  double still_s; /* how long an angle stayed the same in training */
} ec_limit;

/* A quantity of a zone at some times of the window; several features may be made of it. */
typedef struct {
  uint32_t place; /* of the first in ec_values */
  uint16_t samples;
  uint16_t rows; /* cells or joints */
  uint16_t zone; /* index in zone_names */
  uint16_t quantity;
} ec_time_series;

typedef struct {
  double floor; /* of the first transform, where it is a logarithm */
  uint16_t series;
  uint8_t quantity;
  uint8_t transforms[3];
  uint8_t summary;
  uint8_t unused;
} ec_feature;

typedef struct {
  uint32_t shifts; /* of each channel, in bytes */
  uint32_t biases; /* in longs */
  uint32_t mixes; /* of each convolution: how many channels, and which; in bytes */
  uint8_t biases_of_dilation[4];
} ec_kernels;

/* Numbers, of which some are alike or halves of doubles. */
typedef struct {
  uint32_t place; /* in doubles or floats; of a palette, in bytes, which of its numbers each is */
  uint32_t palette; /* in doubles */
  uint32_t type;
} ec_series;

/* Features, less their means and times their gains, become whole steps, and these whole coordinates. A
   matrix stands in bytes, row by row: the bits of a number, and then these. */
typedef struct {
  double most_steps;
  double factor; /* of the sums of products */
  double limit; /* of a coordinate */
  ec_series means; /* of all features */
  ec_series gains; /* of those that are taken */
  uint32_t columns; /* which are taken, in words; EC_NOWHERE: all */
  uint32_t matrix;
  uint32_t count; /* of the features that are taken */
  uint32_t components;
} ec_projection;

/* Of a decision point. */
typedef struct {
  ec_projection projection;
  double factor;
  double limit;
  double typical;
  double outlying;
  double far;
  double middle;
  double slope;
  ec_series nearness;
  ec_series weighted_nearness;
  uint32_t whitening; /* a matrix */
  uint32_t rows; /* by components: a matrix */
  uint32_t weights; /* squares of those of coordinates, times 2^EC_FRACTION_BITS; in words */
  uint32_t unused;
} ec_doubt;

#define EC_FRACTION_BITS 8

/* Of a task at a decision point. */
typedef struct {
  double unit;
  double scale; /* of distances to labels */
  double curve[3]; /* slope, intercept and doubt of the confidence */
  uint32_t rows; /* by components: a matrix */
  uint32_t components;
} ec_place;

typedef struct {
  double rule_curve[3];
  double rule_confidence; /* above 1: a fixed window */
  uint32_t text; /* its name and those of its labels */
  uint32_t trials; /* the label of each, in words; 65535: none */
  uint32_t counts; /* how many trials are near, of each label, in words; EC_NOWHERE: none */
  uint32_t indices[2]; /* of a product: the factors' label of each label, in words; or EC_NOWHERE */
  uint16_t labels;
  uint16_t k;
  uint16_t space;
  uint8_t factors[2];
  uint8_t rule_last;
  uint8_t has_rule;
  uint8_t unused[2];
} ec_task;

/* The tables, in their order. */
#define EC_TABLES(X)                                                                              \
  X(ec_angle, angles) X(ec_link, links) X(ec_limit, limits) X(ec_feature, features)               \
  X(ec_time_series, sampled) X(ec_kernels, kernels) X(ec_task, tasks) X(ec_place, places)         \
  X(ec_projection, projections) X(ec_doubt, doubts) X(double, windows_s) X(double, doubles)       \
  X(float, floats) X(int32_t, longs) X(uint16_t, words) X(int16_t, cell_of_taxel)                 \
  X(int16_t, kernel_cell_of_taxel) X(uint8_t, alive) X(uint8_t, zone_names) X(uint8_t, bytes)

typedef struct {
  uint32_t magic;
  uint32_t header_digest; /* CRC-32 of the rest of the header */
  uint32_t digest; /* CRC-32 of the tables */
  uint32_t size; /* of all, in bytes */
  uint32_t program; /* EC_PROGRAM: the skin and the quantities that a program measures */
  uint32_t trials;
  ec_numbers numbers;
  ec_sizes sizes;
  uint32_t tables[20]; /* where they begin, in bytes from the header on */
} ec_header;

typedef struct {
  const ec_header *header;
#define EC_POINTER(type, name) const type *name;
  EC_TABLES(EC_POINTER)
} ec_model_tables;

extern ec_model_tables ec_model_now;

#endif
