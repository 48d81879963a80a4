// Plain values to bytes and back, for handing data from one process to another on the same machine. A struct
// takes part through a function `template <class A> void visit_fields(A& archive, T& value)` that calls
// `archive(value.a, value.b, ...)`; the same function then serves both directions.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "lumigrove/error.h"

namespace lumigrove {

template <class T>
inline constexpr bool kIsPlain = std::is_trivially_copyable_v<T>;

class ArchiveWriter {
 public:
  template <class... T>
  void operator()(T&... values) {
    (put(values), ...);
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  void append(const void* data, std::size_t size) {
    const auto* first = static_cast<const std::uint8_t*>(data);
    bytes_.insert(bytes_.end(), first, first + size);
  }
  template <class T>
  void put(T& value) {
    if constexpr (kIsPlain<T>)
      append(&value, sizeof(T));
    else
      visit_fields(*this, value);
  }
  void put(std::string& text) {
    std::size_t size = text.size();
    put(size);
    append(text.data(), size);
  }
  template <class T>
  void put(std::vector<T>& values) {
    std::size_t size = values.size();
    put(size);
    if constexpr (kIsPlain<T>)
      append(values.data(), size * sizeof(T));
    else
      for (T& value : values) put(value);
  }

  std::vector<std::uint8_t> bytes_;
};

// Throws Error when the bytes end early or a length cannot be true.
class ArchiveReader {
 public:
  explicit ArchiveReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <class... T>
  void operator()(T&... values) {
    (get(values), ...);
  }
  bool at_end() const { return bytes_.empty(); }

 private:
  void take(void* data, std::size_t size) {
    if (size > bytes_.size()) throw Error("the data from the reading process is incomplete");
    if (size > 0) std::memcpy(data, bytes_.data(), size);
    bytes_ = bytes_.subspan(size);
  }
  // Every element takes at least a byte: a damaged length cannot ask for more memory than there are bytes.
  std::size_t take_size(std::size_t element_bytes) {
    std::size_t size = 0;
    take(&size, sizeof(size));
    if (size > bytes_.size() / element_bytes) throw Error("the data from the reading process is incomplete");
    return size;
  }
  template <class T>
  void get(T& value) {
    if constexpr (kIsPlain<T>)
      take(&value, sizeof(T));
    else
      visit_fields(*this, value);
  }
  void get(std::string& text) {
    text.resize(take_size(1));
    take(text.data(), text.size());
  }
  template <class T>
  void get(std::vector<T>& values) {
    if constexpr (kIsPlain<T>) {
      values.resize(take_size(sizeof(T)));
      take(values.data(), values.size() * sizeof(T));
    } else {
      values.resize(take_size(1));
      for (T& value : values) get(value);
    }
  }

  std::span<const std::uint8_t> bytes_;
};

}  // namespace lumigrove
