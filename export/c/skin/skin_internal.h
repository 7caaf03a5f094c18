/* What the files of the skin share. */
#ifndef EC_SKIN_INTERNAL_H
#define EC_SKIN_INTERNAL_H

#include "skin.h"

/* A transaction of a set-up: `Step` in edge/wire/chips/chip.py. */
typedef struct {
  const uint8_t *out;
  const uint8_t *answer;
  const uint8_t *bits; /* of the answer that count */
  uint8_t out_size;
  uint8_t answer_size; /* 0: nothing is read */
  uint16_t wait;
} ec_script_step;

typedef struct {
  const ec_script_step *steps; /* the first identifies the chip, then its checks, then its settings */
  uint8_t checks;
  uint8_t count;
} ec_script;

enum { EC_AD7147, EC_MPR121, EC_BLOCK };

typedef struct {
  const ec_script *script;
  const int16_t *taxels; /* of each stage; -1: none */
  const uint8_t *pointer; /* of the register where the taxels begin */
  uint32_t first_byte; /* in ec_bytes */
  uint16_t bytes; /* of a reading */
  uint16_t stages;
  uint16_t highest; /* the largest value that is not saturated */
  uint8_t pointer_size;
  uint8_t kind;
  uint8_t bits;
  uint8_t bus;
  uint8_t address;
  uint8_t mux; /* its address; 0: none */
  uint8_t channel;
  bool rests_at_zero;
} ec_chip;

extern const ec_chip ec_chips[];
extern const uint16_t ec_first_chips[]; /* of each bus, and of none */
extern const uint8_t ec_retries[]; /* after each outcome */
extern const int8_t ec_signs[]; /* of each taxel: 1 where a touch raises its value, -1 where it lowers it */
extern const bool ec_working[]; /* has a chip, and is not dead */

/* Rest values, and what follows from the noise around them. */
typedef struct {
  uint32_t digest; /* of the skin */
  uint32_t stuck[EC_CHIPS]; /* equal readings in a row after which a chip is stuck */
  uint16_t rest[EC_TAXELS];
  uint16_t dead_band[EC_TAXELS];
  uint16_t is_known;
  uint16_t crc;
} ec_calibration;

extern const ec_calibration ec_exported;
extern ec_calibration ec_calibration_now;

uint64_t ec_time(void);
uint16_t ec_crc16(const uint8_t *bytes, size_t n);

/* chips.c: edge/wire/bus and edge/wire/skin/bus_reader.py */
typedef struct {
  uint64_t at; /* when it was last read */
  uint64_t began; /* when it was last tried */
  uint32_t damaged; /* readings in a row whose bytes made no sense */
  uint32_t unchanged; /* readings in a row with the same bytes */
  int16_t step; /* of its set-up; -1: none is under way */
  uint8_t check; /* the next of its checks */
  uint8_t turn; /* of readings with and without the identity */
  uint8_t credit;
  uint8_t error; /* why it is down */
  bool running;
  bool good; /* its bytes are a whole reading of a chip with its settings */
  bool has_settings;
} ec_slot;

extern ec_slot ec_slots[EC_CHIPS];
extern uint8_t ec_bytes[EC_BYTES];
bool ec_chips_begin(void);
void ec_chips_read(uint64_t deadline);

/* skin.c */
extern uint16_t ec_raw[EC_TAXELS];
extern bool ec_read[EC_TAXELS]; /* which raw values could be read */
extern uint16_t ec_sequence; /* of frames */
extern uint64_t ec_due; /* when the next frame is */

#endif
