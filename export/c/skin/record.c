/* Raw values over a serial port, as a block of 16 bits: docs/block-protocol.md. */
#include "skin_internal.h"

enum { IDENTITY = 0x00, FRAME = 0x10 };

#define FRAME_BYTES (2 + 2 * EC_TAXELS)

static uint8_t packet[8];
static uint8_t filled;
static uint8_t answer[1 + FRAME_BYTES + 2];

/* A request of four bytes from its packet; whether it is whole. */
static bool decoded(uint8_t request[4]) {
  uint8_t n = 0;
  for (uint8_t at = 0; at < filled;) {
    uint8_t end = (uint8_t)(at + packet[at]);
    if (end > filled || end <= at) return false;
    for (at++; at < end && n < 4; at++) request[n++] = packet[at];
    if (at < end) return false;
    if (at < filled && n == 4) return false;
    if (at < filled) request[n++] = 0;
  }
  return n == 4 && ec_crc16(request, 4) == 0;
}

static size_t put_words(size_t n, const uint16_t *words, size_t count) {
  for (size_t i = 0; i < count; i++) {
    answer[n++] = (uint8_t)(words[i] >> 8);
    answer[n++] = (uint8_t)words[i];
  }
  return n;
}

/* The register at a pointer, behind the tag; how many bytes. */
static size_t fill(uint8_t pointer) {
  size_t n = 1;
  if (pointer == IDENTITY) {
    uint16_t words[4] = {'T' << 8 | 'A', 'X' << 8 | 'L', 1 << 8 | 16, EC_TAXELS};
    n = put_words(n, words, 4);
  } else if (pointer == FRAME) {
    n = put_words(n, &ec_sequence, 1);
    n = put_words(n, ec_raw, EC_TAXELS);
    for (size_t i = 0; i < EC_TAXELS; i++) {
      if (!ec_read[i]) answer[3 + 2 * i] = answer[4 + 2 * i] = 0xFF;
    }
  } else {
    return 0;
  }
  uint16_t crc = ec_crc16(answer + 1, n - 1);
  return put_words(n, &crc, 1);
}

static void send(size_t n, void (*put)(uint8_t byte)) {
  for (size_t at = 0; at <= n;) {
    size_t run = 0;
    while (run < 254 && at + run < n && answer[at + run]) run++;
    put((uint8_t)(run + 1));
    for (size_t i = 0; i < run; i++) put(answer[at + i]);
    at += run + (run < 254);
  }
  put(0);
}

void ec_record(uint8_t byte, void (*put)(uint8_t byte)) {
  uint8_t request[4];
  if (byte) {
    if (filled < sizeof packet) packet[filled] = byte;
    if (filled <= sizeof packet) filled++;
    return;
  }
  bool whole = filled <= sizeof packet && decoded(request);
  filled = 0;
  if (!whole) return;
  answer[0] = request[1];
  size_t n = fill(request[0]);
  if (n) send(n, put);
}
