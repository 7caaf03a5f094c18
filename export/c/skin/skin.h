/* Reads the skin: from its chips to counts above a baseline that follows drift, by the rules of
   `edge-classify run` (edge/wire/bus, edge/wire/chips and edge/wire/skin). No heap, no recursion.

   Compile every .c file of this folder with -std=c99 -ffp-contract=off. */
#ifndef EC_SKIN_H
#define EC_SKIN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "skin_data.h"

#ifdef __cplusplus
extern "C" {
#endif

#define EC_TAXELS (EC_SKIN_ROWS * EC_SKIN_COLS)

/* How a transaction ended: edge/wire/bus/protocol.py. */
typedef enum {
  EC_I2C_DONE,
  EC_I2C_NACK,    /* nothing acknowledged the address */
  EC_I2C_BROKEN,  /* the transfer broke off */
  EC_I2C_HUNG,    /* until the firmware's time limit, as long as `timeout_s` in skin.toml */
  EC_I2C_LOST,    /* another master won the bus */
  EC_I2C_REFUSED, /* the adapter does not carry this */
  EC_I2C_OTHER,
  EC_I2C_WRONG /* of this program alone: an answer is not what it should be */
} ec_i2c_outcome;

/* The firmware gives these four. */

/* Write n bytes to a chip, then read m bytes from it behind a repeated start; n or m may be 0. Where
   both are, free a bus on which no chip answers, or do nothing. bus: its place in skin.toml. */
ec_i2c_outcome ec_i2c(
    uint8_t bus, uint8_t address, const uint8_t *out, size_t n, uint8_t *in, size_t m);

/* Wait for so many microseconds, and tell the time in microseconds; it may wrap. */
uint32_t ec_clock_us(uint32_t wait_us);

/* Bring what was kept last, or false; and keep bytes where they survive. */
bool ec_load(void *bytes, size_t size);
bool ec_keep(const void *bytes, size_t size);

typedef struct {
  double t_s; /* when its reading began, on the clock; it does not wrap */
  const uint16_t *counts; /* above the baseline, by rows; 0 of those that are not valid */
  const bool *valid; /* which could be read, and are neither dead nor broken */
} ec_frame;

/* Set all chips up; false: none answers, or an adapter refuses the transactions. */
bool ec_skin_begin(void);

/* Read a frame if it is due by the time of the clock, and bring chips back that have failed. */
bool ec_skin_poll(uint32_t now_us, ec_frame *frame);

/* The time on the clock of the frames. */
double ec_now_s(void);

/* How many chips run, of EC_CHIPS. */
uint16_t ec_chips_running(void);

/* Whether rest values are known, by the skin file or by ec_calibrate; counts mean nothing before. */
bool ec_is_calibrated(void);

typedef enum {
  EC_CALIBRATED,
  EC_UNREADABLE, /* a taxel could not be read, or rests at an end of its range */
  EC_RESTLESS,   /* a taxel varies far more than the others */
  EC_TOUCHED,    /* taxels side by side rest as under a touch */
  EC_DEAF,       /* the noise of a taxel reaches the contact threshold */
  EC_FIRST,      /* a first calibration needs nothing_touches */
  EC_NOT_KEPT    /* by ec_keep */
} ec_calibration_outcome;

/* Measure rest values and noise by so many frames (at least 20), keep them, and begin anew.
   nothing_touches: a person says so, as the first time nothing tells a skin that is pressed as a
   whole. */
ec_calibration_outcome ec_calibrate(uint16_t frames, bool nothing_touches);

/* Serve raw values over a serial port, as a `block` of 16 bits, which `edge-classify record` reads with
   record.toml: call it for each byte that has come. A taxel that could not be read is 65535. */
void ec_record(uint8_t byte, void (*put)(uint8_t byte));

#ifdef __cplusplus
}
#endif

#endif
