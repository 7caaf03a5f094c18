/* Finds the model's tables where they lie, and refuses what is no model for this program. */
#include <string.h>

#include "internal.h"

ec_model_tables ec_model_now;

/* CRC-32 as zlib has it, by halves of bytes. */
static uint32_t crc32(const uint8_t *bytes, uint32_t n) {
  static uint32_t table[16];
  uint32_t crc = UINT32_MAX;
  for (uint32_t i = 0; i < 16; i++) {
    table[i] = i;
    for (int bit = 0; bit < 4; bit++) table[i] = table[i] >> 1 ^ (table[i] & 1 ? 0xEDB88320u : 0);
  }
  for (uint32_t i = 0; i < n; i++) {
    crc ^= bytes[i];
    crc = crc >> 4 ^ table[crc & 15];
    crc = crc >> 4 ^ table[crc & 15];
  }
  return ~crc;
}

static bool fits(const ec_sizes *sizes) {
  static const ec_sizes most = EC_MOST;
  const uint32_t *size = (const uint32_t *)sizes;
  const uint32_t *room = (const uint32_t *)&most;
  for (uint32_t i = 0; i < sizeof most / sizeof *room; i++) {
    if (size[i] > room[i]) return false;
  }
  return true;
}

ec_refusal ec_open(const void *address) {
  const ec_header *header = address;
  const uint8_t *bytes = address;
  uint32_t begin = offsetof(ec_header, digest);
  ec_model_now.header = 0;
  if ((uintptr_t)address % 8 || header->magic != EC_MAGIC) return EC_NO_MODEL_THERE;
  if (header->header_digest != crc32(bytes + begin, sizeof *header - begin)) return EC_DAMAGED;
  if (header->digest != crc32(bytes + sizeof *header, header->size - (uint32_t)sizeof *header)) {
    return EC_DAMAGED;
  }
  if (header->program != EC_PROGRAM) return EC_OF_ANOTHER_SKIN;
  if (!fits(&header->sizes)) return EC_TOO_LARGE;
  const uint32_t *place = header->tables;
#define EC_FIND(type, name) ec_model_now.name = (const type *)(const void *)(bytes + *place++);
  EC_TABLES(EC_FIND)
  ec_model_now.header = header;
  return EC_ACCEPTED;
}

/* The text behind so many others. */
static const char *text(uint32_t place, uint32_t others) {
  const char *at = (const char *)ec_model_now.bytes + place;
  for (; others > 0; others--) at += strlen(at) + 1;
  return at;
}

const char *ec_task_name(uint32_t task) { return text(ec_tasks[task].text, 0); }

const char *ec_label(uint32_t task, int16_t label) {
  return label < 0 ? 0 : text(ec_tasks[task].text, 1 + (uint32_t)label);
}

const char *ec_model_name(void) { return text(EC_NUMBER(text), 0); }
