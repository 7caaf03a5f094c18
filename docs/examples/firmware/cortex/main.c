/* Reads a skin and prints what touches it, as the JSON lines of `edge-classify run`, without an
   operating system: on a Cortex-M3, the board mps2-an385 of QEMU. For your board write the functions down
   to `put` anew, and place CODE and RAM of board.ld. */
#include "edge_classify.h"
#include "skin.h"

typedef struct {
  volatile uint32_t data;
  volatile uint32_t state; /* 1: cannot send, 2: has a byte */
  volatile uint32_t control;
  uint32_t interrupts;
  volatile uint32_t divider;
} uart;

#define EVENTS ((uart *)0x40004000u)
#define CHIPS ((uart *)0x40005000u)

static void send(uart *port, uint32_t number, int bytes) {
  for (; bytes > 0; bytes--, number >>= 8) {
    while (port->state & 1) continue;
    port->data = number & 0xFF;
  }
}

static uint32_t come(int bytes) {
  uint32_t number = 0;
  for (int i = 0; i < bytes; i++) {
    while (!(CHIPS->state & 2)) continue;
    number |= CHIPS->data << 8 * i;
  }
  return number;
}

/* QEMU's board has no chips, and no time but its host's: who listens at its second port has both. */
ec_i2c_outcome ec_i2c(
    uint8_t bus, uint8_t address, const uint8_t *out, size_t n, uint8_t *in, size_t m) {
  send(CHIPS, (uint32_t)bus << 8 | address, 2);
  send(CHIPS, (uint32_t)(m << 16 | n), 4);
  for (size_t i = 0; i < n; i++) send(CHIPS, out[i], 1);
  ec_i2c_outcome outcome = (ec_i2c_outcome)come(1);
  for (size_t i = 0; outcome == EC_I2C_DONE && i < m; i++) in[i] = (uint8_t)come(1);
  return outcome;
}

uint32_t ec_clock_us(uint32_t wait_us) {
  send(CHIPS, 0xFFFF, 2);
  send(CHIPS, wait_us, 4);
  return come(4);
}

/* No memory stays: the skin file must hold the calibration. */
bool ec_load(void *bytes, size_t size) {
  (void)bytes;
  return size == 0;
}

bool ec_keep(const void *bytes, size_t size) {
  (void)bytes;
  return size == 0;
}

static void put(char letter) { send(EVENTS, (uint8_t)letter, 1); }

int main(void) {
  ec_frame frame;
  EVENTS->divider = CHIPS->divider = 16;
  EVENTS->control = CHIPS->control = 3;
  while (ec_model(ec_image) != EC_ACCEPTED || !ec_selftest()) put('!');
  while (!ec_skin_begin()) ec_clock_us(500000);
  for (;;) {
    bool comes = ec_skin_poll(ec_clock_us(0), &frame);
    if (comes) ec_push_lines(frame.counts, frame.valid, frame.t_s, NULL, ec_now_s, put);
    if (!comes && !ec_is_due()) ec_clock_us(2000);
    ec_work_lines(ec_now_s, put);
  }
}
