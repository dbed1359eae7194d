// A frame that owns its arrays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "partiemc/frame.h"
#include "wire/frame_rows.h"

namespace partiemc::client {

/// Holds a copy of a frame. Assignment reuses its memory.
class OwnedFrame {
 public:
  OwnedFrame() = default;
  // Views stay valid: moved vectors keep the addresses of their elements.
  OwnedFrame(OwnedFrame&&) = default;
  OwnedFrame& operator=(OwnedFrame&&) = default;

  /// Copies `frame`, with `time` instead of its time. `number` is the caller's number of the frame.
  void Assign(const Frame& frame, double time, std::uint64_t number) {
    frame_ = frame;
    frame_.time = time;
    number_ = number;
    if (const auto* singles = std::get_if<std::span<const float>>(&frame.positions)) {
      frame_.positions = Copy(*singles, singles_);
    } else {
      frame_.positions = Copy(std::get<std::span<const double>>(frame.positions), doubles_);
    }
    frame_.volumes = Copy(frame.volumes, volumes_);
    frame_.ids = Copy(frame.ids, ids_);
    frame_.velocities = Copy(frame.velocities, velocities_);
    CopyAttributes(frame.attributes);
  }

  /// Same as Assign above, for arrays with arbitrary strides.
  void Assign(const wire::FrameRows& rows, double time, std::uint64_t number) {
    Take(rows, time, number, [](const std::byte*, std::size_t) { return false; });
  }

  /// Copies only the arrays of `rows` whose layout differs from a frame's. frame() refers to the
  /// other arrays, so they must stay valid while frame() is used.
  void Adopt(const wire::FrameRows& rows) {
    Take(rows, rows.scalars.time, 0, [](const std::byte* place, std::size_t alignment) {
      return place != nullptr && reinterpret_cast<std::uintptr_t>(place) % alignment == 0;
    });
  }

  const Frame& frame() const { return frame_; }
  double time() const { return frame_.time; }
  std::uint64_t number() const { return number_; }

 private:
  template <typename T>
  static std::span<const T> Copy(std::span<const T> from, std::vector<T>& to) {
    to.assign(from.begin(), from.end());
    return to;
  }

  void CopyAttributes(std::span<const Attribute> from) {
    carried_.resize(from.size());
    attributes_.assign(from.begin(), from.end());
    for (std::size_t k = 0; k < from.size(); ++k) {
      carried_[k].name = from[k].name;
      attributes_[k].name = carried_[k].name;
      attributes_[k].values = Copy(from[k].values, carried_[k].values);
    }
    frame_.attributes = attributes_;
  }

  struct Carried {
    std::string name;
    std::vector<float> values;
  };

  template <typename MayStay>
  void Take(const wire::FrameRows& rows, double time, std::uint64_t number, MayStay may_stay) {
    const auto array = [&]<typename T>(const wire::RowArray& from,
                                       std::vector<T>& to) -> std::span<const T> {
      const std::size_t count = from.bytes() / sizeof(T);
      if (may_stay(from.in_place, alignof(T))) {
        return {reinterpret_cast<const T*>(from.in_place), count};
      }
      to.resize(count);
      from.WriteAll(reinterpret_cast<std::byte*>(to.data()));
      return to;
    };
    frame_ = rows.scalars;
    frame_.time = time;
    number_ = number;
    if (std::holds_alternative<std::span<const float>>(frame_.positions)) {
      frame_.positions = array(rows.positions, singles_);
    } else {
      frame_.positions = array(rows.positions, doubles_);
    }
    frame_.volumes = array(rows.volumes, volumes_);
    frame_.ids = array(rows.ids, ids_);
    frame_.velocities = array(rows.velocities, velocities_);
    carried_.resize(rows.attributes.size());
    attributes_.clear();
    for (std::size_t k = 0; k < rows.attributes.size(); ++k) {
      const wire::AttributeRows& from = rows.attributes[k];
      carried_[k].name = from.name;
      attributes_.push_back(
          {carried_[k].name, from.components, array(from.values, carried_[k].values)});
    }
    frame_.attributes = attributes_;
  }

  std::vector<float> singles_;
  std::vector<double> doubles_;
  std::vector<float> volumes_, velocities_;
  std::vector<std::uint64_t> ids_;
  std::vector<Carried> carried_;
  std::vector<Attribute> attributes_;  // Views into `carried_`.
  Frame frame_;                        // Views into the vectors.
  std::uint64_t number_ = 0;
};

}  // namespace partiemc::client
