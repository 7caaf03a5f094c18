/* Chips on their buses, read in every frame and brought back after a failure: edge/wire/bus and
   edge/wire/skin/bus_reader.py, which say why. Buses are read one after the other. */
#include <string.h>

#include "skin_internal.h"

#define UNKNOWN (-1)

typedef struct {
  uint8_t address;
  uint8_t expected;
  int16_t control; /* the connected channels as bits, or UNKNOWN */
  bool verify;
} mux;

typedef struct {
  mux muxes[8]; /* in the order in which they first answered */
  uint8_t mux_count;
  uint8_t number;
  bool lost;
  uint16_t first;
  uint16_t end;
  int32_t hung; /* the chip that hung last in this frame; -1: none */
  uint32_t frame;
  uint64_t rest_until;
} reader;

ec_slot ec_slots[EC_CHIPS];
uint8_t ec_bytes[EC_BYTES];
static reader readers[EC_BUSES];
static uint64_t last_time;

uint64_t ec_time(void) {
  last_time += (uint32_t)(ec_clock_us(0) - (uint32_t)last_time);
  return last_time;
}

uint16_t ec_crc16(const uint8_t *bytes, size_t n) {
  uint16_t crc = 0xFFFF;
  for (size_t i = 0; i < n; i++) {
    crc = (uint16_t)(crc ^ bytes[i] << 8);
    for (int bit = 0; bit < 8; bit++) crc = (uint16_t)(crc << 1 ^ (crc & 0x8000 ? 0x1021 : 0));
  }
  return crc;
}

/* edge/wire/bus/retrying.py */
static ec_i2c_outcome carry(
    uint8_t bus, uint8_t address, const uint8_t *out, size_t n, uint8_t *in, size_t m) {
  for (uint8_t failures = 0;; failures++) {
    ec_i2c_outcome outcome = ec_i2c(bus, address, out, n, in, m);
    if (outcome == EC_I2C_DONE || failures >= ec_retries[outcome]) return outcome;
  }
}

/* edge/wire/bus/tca9548a.py */
static ec_i2c_outcome ask_control(const reader *bus, const mux *m, uint8_t *control) {
  return carry(bus->number, m->address, NULL, 0, control, 1);
}

static ec_i2c_outcome write_control(reader *bus, mux *m, uint8_t control) {
  uint8_t read_back = control;
  m->control = UNKNOWN;
  m->expected = control;
  ec_i2c_outcome outcome = carry(bus->number, m->address, &control, 1, NULL, 0);
  if (outcome == EC_I2C_DONE && m->verify) outcome = ask_control(bus, m, &read_back);
  if (outcome != EC_I2C_DONE) return outcome;
  if (read_back != control) return EC_I2C_BROKEN;
  m->control = control;
  return EC_I2C_DONE;
}

static ec_i2c_outcome select_one(reader *bus, mux *m, uint8_t control) {
  if (m->control == control) return EC_I2C_DONE;
  for (uint8_t i = 0; control && i < bus->mux_count; i++) {
    mux *beside = &bus->muxes[i];
    if (beside == m || beside->control == 0) continue;
    ec_i2c_outcome outcome = write_control(bus, beside, 0);
    if (outcome != EC_I2C_DONE && outcome != EC_I2C_NACK) return outcome;
  }
  return write_control(bus, m, control);
}

/* Whether the channel selected last, and no other, is still connected. */
static bool kept(reader *bus, mux *m) {
  uint8_t control;
  if (ask_control(bus, m, &control) != EC_I2C_DONE || control != m->expected) return false;
  bool all = true;
  for (uint8_t i = 0; i < bus->mux_count; i++) {
    mux *beside = &bus->muxes[i];
    if (beside == m) continue;
    bool answers = ask_control(bus, beside, &control) == EC_I2C_DONE;
    if (answers && control == 0) continue;
    beside->control = UNKNOWN;
    all = false;
    if (!answers) break;
  }
  return all;
}

static mux *mux_of(reader *bus, const ec_chip *chip) {
  for (uint8_t i = 0; chip->mux && i < bus->mux_count; i++) {
    if (bus->muxes[i].address == chip->mux) return &bus->muxes[i];
  }
  return NULL;
}

/* edge/wire/chips */
static ec_i2c_outcome transfer(
    reader *bus, const ec_chip *chip, const uint8_t *out, size_t n, uint8_t *in, size_t m) {
  mux *way = mux_of(bus, chip);
  ec_i2c_outcome outcome = EC_I2C_DONE;
  if (way) outcome = select_one(bus, way, (uint8_t)(1 << chip->channel));
  if (outcome == EC_I2C_DONE) outcome = carry(bus->number, chip->address, out, n, in, m);
  if (way && outcome != EC_I2C_DONE) way->control = UNKNOWN;
  return outcome;
}

/* Of a block, bytes whose CRC is wrong are read again, as a broken transfer. */
static ec_i2c_outcome receive(
    reader *bus, const ec_chip *chip, const uint8_t *out, size_t n, uint8_t *in, size_t m) {
  for (uint8_t i = 0; i <= ec_retries[EC_I2C_BROKEN]; i++) {
    ec_i2c_outcome outcome = transfer(bus, chip, out, n, in, m);
    if (outcome != EC_I2C_DONE) return outcome;
    if (chip->kind != EC_BLOCK || ec_crc16(in, m) == 0) return EC_I2C_DONE;
  }
  return EC_I2C_OTHER;
}

static ec_i2c_outcome take(reader *bus, const ec_chip *chip, const ec_script_step *step) {
  uint8_t answer[EC_MOST_ANSWER];
  if (!step->answer_size) {
    ec_i2c_outcome outcome = transfer(bus, chip, step->out, step->out_size, NULL, 0);
    if (outcome == EC_I2C_DONE && step->wait) ec_clock_us(step->wait);
    return outcome;
  }
  ec_i2c_outcome outcome =
      receive(bus, chip, step->out, step->out_size, answer, step->answer_size);
  if (outcome != EC_I2C_DONE) return outcome;
  for (uint8_t i = 0; i < step->answer_size; i++) {
    if ((answer[i] ^ step->answer[i]) & step->bits[i]) return EC_I2C_WRONG;
  }
  return EC_I2C_DONE;
}

static ec_i2c_outcome check_next(reader *bus, uint16_t i) {
  const ec_script *script = ec_chips[i].script;
  uint8_t next = ec_slots[i].check;
  ec_slots[i].check = (uint8_t)((next + 1) % script->checks);
  return take(bus, &ec_chips[i], &script->steps[1 + next]);
}

static ec_i2c_outcome read_chip(reader *bus, uint16_t i) {
  const ec_chip *chip = &ec_chips[i];
  ec_slot *slot = &ec_slots[i];
  uint8_t *row = ec_bytes + chip->first_byte;
  size_t size = chip->bytes;
  if (chip->kind == EC_AD7147) {
    if (slot->turn) size -= 2;
    slot->turn = (uint8_t)((slot->turn + 1) % EC_IDENTIFIED_EVERY);
  }
  ec_i2c_outcome outcome = receive(bus, chip, chip->pointer, chip->pointer_size, row, size);
  /* it may be a value, or a transfer that broke off before it */
  if (outcome == EC_I2C_DONE && chip->kind == EC_AD7147 && row[size - 1] == 0xFF) {
    outcome = transfer(bus, chip, chip->pointer, chip->pointer_size, row, size);
  }
  if (outcome != EC_I2C_DONE) return outcome;
  slot->good = true;
  slot->at = ec_time();
  if (slot->credit < EC_MOST_CREDIT) slot->credit++;
  return EC_I2C_DONE;
}

/* edge/wire/skin/bus_reader.py */
static bool any_alive(const reader *bus) {
  for (uint16_t i = bus->first; i < bus->end; i++) {
    if (ec_slots[i].running || ec_slots[i].step >= 0) return true;
  }
  return false;
}

static bool setting_up(const reader *bus) {
  for (uint16_t i = bus->first; i < bus->end; i++) {
    if (ec_slots[i].step >= 0) return true;
  }
  return false;
}

static void take_down(ec_slot *slot, ec_i2c_outcome error) {
  slot->running = false;
  slot->good = false;
  slot->error = (uint8_t)error;
  slot->step = -1;
  if (slot->credit) slot->credit--;
}

static void fail(reader *bus, uint16_t chip, ec_i2c_outcome error) {
  uint64_t now = ec_time();
  ec_slot *slot = &ec_slots[chip];
  for (uint8_t i = 0; i < bus->mux_count; i++) bus->muxes[i].control = UNKNOWN;
  take_down(slot, error);
  if (error == EC_I2C_HUNG) {
    for (uint16_t i = bus->first; bus->hung >= 0 && bus->hung != chip && i < bus->end; i++) {
      take_down(&ec_slots[i], error);
      ec_slots[i].credit = 0;
    }
    bus->hung = chip;
  }
  if (slot->credit) return;
  bus->lost = !any_alive(bus);
  uint64_t rest = EC_RESTS * (now - slot->began);
  bus->rest_until = now + (bus->lost || rest > EC_LONGEST_REST ? EC_LONGEST_REST : rest);
}

static void set_up_anew(ec_slot *slot) {
  slot->running = false;
  slot->good = false;
  slot->has_settings = false;
  slot->step = 0;
}

static void check(reader *bus, uint16_t chip) {
  ec_i2c_outcome outcome = check_next(bus, chip);
  if (outcome == EC_I2C_WRONG) {
    set_up_anew(&ec_slots[chip]);
  } else if (outcome != EC_I2C_DONE) {
    fail(bus, chip, outcome);
  }
}

/* The first step: a chip that kept its settings needs only the last one. */
static ec_i2c_outcome identify(reader *bus, uint16_t i, bool *runs) {
  const ec_chip *chip = &ec_chips[i];
  ec_slot *slot = &ec_slots[i];
  if (slot->has_settings) {
    ec_i2c_outcome outcome = slot->credit ? EC_I2C_DONE : check_next(bus, i);
    *runs = outcome == EC_I2C_DONE;
    if (*runs) return read_chip(bus, i);
    if (outcome != EC_I2C_WRONG) return outcome;
  }
  slot->has_settings = false;
  if (chip->mux && !mux_of(bus, chip)) {
    mux *way = &bus->muxes[bus->mux_count];
    way->address = chip->mux;
    way->verify = EC_VERIFY_MUX;
    ec_i2c_outcome outcome = write_control(bus, way, 0);
    if (outcome != EC_I2C_DONE) return outcome;
    bus->mux_count++;
  }
  ec_i2c_outcome outcome = take(bus, chip, chip->script->steps);
  if (outcome != EC_I2C_DONE) return outcome;
  slot->check = 0;
  slot->turn = 0;
  slot->step = 1;
  return EC_I2C_DONE;
}

/* Take one step to bring a chip back; false where it failed. */
static bool step(reader *bus, uint16_t chip) {
  ec_slot *slot = &ec_slots[chip];
  const ec_script *script = ec_chips[chip].script;
  bool runs = false;
  if (slot->step < 0) {
    slot->began = ec_time();
    slot->step = 0;
  }
  int32_t next = script->checks + slot->step;
  ec_i2c_outcome outcome;
  if (slot->step == 0) {
    outcome = identify(bus, chip, &runs);
  } else if (next < script->count) {
    outcome = take(bus, &ec_chips[chip], &script->steps[next]);
    slot->step++;
  } else {
    slot->has_settings = true;
    runs = true;
    outcome = read_chip(bus, chip);
  }
  if (outcome != EC_I2C_DONE) {
    fail(bus, chip, outcome);
    return false;
  }
  if (runs) {
    slot->running = true;
    slot->step = -1;
    slot->error = EC_I2C_DONE;
    bus->lost = false;
  }
  return true;
}

/* A chip is checked where its last bytes made no sense, and read. False: it did not answer because the
   mux no longer had its channel connected. */
static bool read_slot(reader *bus, uint16_t chip, mux *way) {
  ec_slot *slot = &ec_slots[chip];
  slot->good = false;
  if (slot->running) {
    if (slot->damaged == 1 && !setting_up(bus)) {
      check(bus, chip);
    } else if (slot->damaged == 1 || slot->damaged % EC_SET_UP_EVERY == EC_SET_UP_AFTER) {
      set_up_anew(slot);
    }
  }
  if (!slot->running) return true;
  slot->began = ec_time();
  ec_i2c_outcome outcome = read_chip(bus, chip);
  if (outcome == EC_I2C_DONE) return true;
  if (way && outcome == EC_I2C_NACK && !kept(bus, way)) return false;
  fail(bus, chip, outcome);
  return true;
}

/* Whether the channel was theirs all the time. */
static bool read_behind(reader *bus, uint16_t first, uint16_t end, mux *way) {
  bool on_its_channel = true;
  bool any_good = false;
  for (uint16_t i = first; i < end; i++) on_its_channel &= read_slot(bus, i, way);
  for (uint16_t i = first; i < end; i++) any_good |= ec_slots[i].good;
  if (on_its_channel && (!any_good || kept(bus, way))) return true;
  way->control = UNKNOWN;
  for (uint16_t i = first; i < end; i++) ec_slots[i].good = false;
  return false;
}

static void read_channel(reader *bus, uint16_t first, uint16_t end) {
  mux *way = mux_of(bus, &ec_chips[first]);
  if (!way || !EC_VERIFY_MUX) {
    for (uint16_t i = first; i < end; i++) read_slot(bus, i, NULL);
    return;
  }
  way->verify = false;
  if (!read_behind(bus, first, end, way)) read_behind(bus, first, end, way);
  way->verify = true;
}

static bool reachable(reader *bus) {
  if (any_alive(bus)) return true;
  if (ec_i2c(bus->number, 0, NULL, 0, NULL, 0) == EC_I2C_DONE) return true;
  bus->lost = true;
  bus->rest_until = ec_time() + EC_LONGEST_REST;
  return false;
}

/* Check the settings of the next running chip, where one is due. */
static void recheck(reader *bus) {
  uint32_t running = 0;
  if (bus->frame % EC_RECHECK_FRAMES) return;
  for (uint16_t i = bus->first; i < bus->end; i++) running += ec_slots[i].running;
  uint32_t turn = running ? bus->frame / EC_RECHECK_FRAMES % running : 0;
  for (uint16_t i = bus->first; i < bus->end; i++) {
    if (ec_slots[i].running && turn-- == 0) {
      check(bus, i);
      return;
    }
  }
}

/* Bring chips back, the longest waiting first, until the deadline. */
static void bring_back(reader *bus, uint64_t deadline) {
  uint16_t waiting[EC_CHIPS];
  uint16_t count = 0;
  for (uint16_t i = bus->first; i < bus->end; i++) {
    if (ec_slots[i].running) continue;
    uint16_t place = count++;
    for (; place && ec_slots[waiting[place - 1]].began > ec_slots[i].began; place--) {
      waiting[place] = waiting[place - 1];
    }
    waiting[place] = i;
  }
  if (!count || bus->rest_until > ec_time() || !reachable(bus)) return;
  for (uint16_t i = 0; i < count; i++) {
    bool goes_on = true;
    bool is_time = true;
    while (goes_on && is_time) {
      goes_on = step(bus, waiting[i]) && !ec_slots[waiting[i]].running;
      uint64_t now = ec_time();
      is_time = bus->rest_until <= now && now < deadline;
    }
    if (!is_time) return;
  }
}

static void read_bus(reader *bus, uint64_t deadline) {
  uint16_t first = bus->first;
  uint16_t end = bus->end;
  bus->frame++;
  bus->hung = -1;
  if (setting_up(bus)) {
    uint16_t share = (uint16_t)((end - first + EC_OLDEST_FRAMES - 1) / EC_OLDEST_FRAMES);
    first = (uint16_t)(first + bus->frame % EC_OLDEST_FRAMES * share);
    if (first + share < end) end = (uint16_t)(first + share);
  }
  while (first < end) {
    uint16_t next = first;
    while (next < end && ec_chips[next].mux == ec_chips[first].mux &&
           ec_chips[next].channel == ec_chips[first].channel) {
      next++;
    }
    read_channel(bus, first, next);
    first = next;
  }
  recheck(bus);
  bring_back(bus, deadline);
}

void ec_chips_read(uint64_t deadline) {
  for (uint8_t b = 0; b < EC_BUSES; b++) read_bus(&readers[b], deadline);
}

bool ec_chips_begin(void) {
  memset(ec_slots, 0, sizeof ec_slots);
  memset(readers, 0, sizeof readers);
  memset(ec_bytes, 0, sizeof ec_bytes);
  if (!last_time) last_time = UINT64_C(1) << 32; /* so that no time is 0, as that of no reading */
  bool any = false;
  bool refused = false;
  for (uint16_t i = 0; i < EC_CHIPS; i++) ec_slots[i].step = -1;
  for (uint8_t b = 0; b < EC_BUSES; b++) {
    reader *bus = &readers[b];
    bus->number = b;
    bus->first = ec_first_chips[b];
    bus->end = ec_first_chips[b + 1];
    for (int round = 0; round < 2; round++) {
      for (uint16_t i = bus->first; i < bus->end; i++) {
        bus->hung = -1;
        while (!ec_slots[i].running && step(bus, i)) continue;
      }
      if (!reachable(bus)) break;
    }
    for (uint16_t i = bus->first; i < bus->end; i++) {
      any |= ec_slots[i].running;
      refused |= ec_slots[i].error == EC_I2C_REFUSED;
    }
    if (refused) return false;
  }
  return any;
}
