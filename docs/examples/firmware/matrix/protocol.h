// The block protocol of edge-classify (docs/block-protocol.md), for any C++11 compiler.
#pragma once
#include <stddef.h>
#include <stdint.h>
#include <string.h>

namespace taxels {

// CRC-16/CCITT-FALSE: polynomial 0x1021, from 0xFFFF.
inline uint16_t crc16(const uint8_t *data, size_t n) {
  uint16_t crc = 0xFFFF;
  while (n--) {
    crc ^= static_cast<uint16_t>(*data++) << 8;
    for (int i = 0; i < 8; i++) crc = crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1;
  }
  return crc;
}

inline size_t seal(uint8_t *data, size_t n) {
  const uint16_t crc = crc16(data, n);
  data[n] = crc >> 8, data[n + 1] = crc & 255;
  return n + 2;
}

// The registers: what a pointer selects. TAXELS * AXES up to 4000, BITS 8, 12 or 16. With AXES 3, a
// taxel is three int16: its normal force, and its shear along the rows and around the columns.
template <uint16_t TAXELS, uint8_t BITS, uint8_t AXES = 1>
class Registers {
 public:
  static_assert(AXES == 1 || (AXES == 3 && BITS == 16), "three axes have 16 bits each");
  static constexpr uint16_t kValues = TAXELS * AXES;
  static constexpr size_t kFrame = 2 + (static_cast<size_t>(kValues) * BITS + 7) / 8 + 2;

  Registers() {
    constexpr uint8_t bits = AXES == 3 ? BITS | 0x80 : BITS;
    const uint8_t identity[8] = {'T', 'A', 'X', 'L', 1, bits, TAXELS >> 8, TAXELS & 255};
    memcpy(identity_, identity, 8);
    seal(identity_, 8);
    seal(frame_[0], kFrame - 2);
  }

  // A new sample of kValues numbers, signed ones as their bits. An interrupt may read meanwhile: it gets the sample before, whole.
  void publish(const uint16_t *values) {
    uint8_t *out = frame_[1 - front_];
    sequence_++;
    out[0] = sequence_ >> 8, out[1] = sequence_ & 255;
    size_t at = 2;
    for (uint16_t i = 0; i < kValues; i++) {
      const uint16_t v = values[i];
      if (BITS == 8) {
        out[at++] = static_cast<uint8_t>(v);
      } else if (BITS == 16) {
        out[at++] = v >> 8, out[at++] = v & 255;
      } else if (i % 2 == 0) {
        out[at++] = v >> 4, out[at] = (v & 15) << 4;
      } else {
        out[at++] |= v >> 8, out[at++] = v & 255;
      }
    }
    seal(out, kFrame - 2);
    __asm__ __volatile__("" ::: "memory");  // the frame is whole before it is the one to read
    front_ = 1 - front_;
  }

  // Copies what stands behind a pointer; returns its length, 0 for an unknown pointer.
  size_t read(uint8_t pointer, uint8_t *out) const {
    if (pointer == 0x00) return memcpy(out, identity_, 10), 10;
    if (pointer == 0x10) return memcpy(out, frame_[front_], kFrame), kFrame;
    return 0;
  }

 private:
  uint8_t identity_[10], frame_[2][kFrame] = {};
  volatile uint8_t front_ = 0;
  uint16_t sequence_ = 0;
};

// The same registers over a serial port. A request is COBS(pointer, tag, CRC-16), an answer
// COBS(tag, register); a zero ends each.
template <uint16_t TAXELS, uint8_t BITS, uint8_t AXES = 1>
class Link {
 public:
  explicit Link(const Registers<TAXELS, BITS, AXES> &registers) : registers_(registers) {}

  // Takes in a byte; calls put(byte) with the answer when a request is complete.
  template <class Put>
  void feed(uint8_t byte, Put put) {
    if (byte != 0) {
      if (n_ < sizeof packet_) packet_[n_] = byte;
      if (n_ <= sizeof packet_) n_++;
      return;
    }
    uint8_t request[sizeof packet_];
    const bool whole = n_ <= sizeof packet_ && decode(request) == 4 && crc16(request, 4) == 0;
    n_ = 0;
    if (!whole) return;
    answer_[0] = request[1];
    const size_t n = registers_.read(request[0], answer_ + 1);
    if (n != 0) encode(1 + n, put);
  }

 private:
  size_t decode(uint8_t *out) const {
    size_t n = 0;
    for (size_t at = 0; at < n_;) {
      const size_t code = packet_[at];
      if (at + code > n_) return 0;
      for (size_t i = 1; i < code; i++) out[n++] = packet_[at + i];
      at += code;
      if (at < n_) out[n++] = 0;
    }
    return n;
  }

  template <class Put>
  void encode(size_t length, Put put) const {
    for (size_t at = 0; at <= length;) {
      size_t run = 0;
      while (run < 254 && at + run < length && answer_[at + run] != 0) run++;
      put(static_cast<uint8_t>(run + 1));
      for (size_t i = 0; i < run; i++) put(answer_[at + i]);
      at += run + (run < 254);
    }
    put(0);
  }

  const Registers<TAXELS, BITS, AXES> &registers_;
  uint8_t packet_[8], answer_[1 + Registers<TAXELS, BITS, AXES>::kFrame];
  size_t n_ = 0;
};

}  // namespace taxels
