#pragma once

#include <cstdint>
#include <map>
#include <type_traits>
#include <utility>
#include <vector>

#include <octosurf/removals.hpp>

namespace octosurf::surfaces {

/// Models of surfaces or cylinders by id, and what taking back an open change needs of each that is accessed
/// for modification: a `Kept`, the model itself or its head().
template <class Model, class Kept>
class ModelStore {
 public:
  using Id = std::uint64_t;

  Model* find(Id id) {  ///< for modification
    const auto found = models_.find(id);
    return found == models_.end() ? nullptr : &kept(id, found->second);
  }
  const Model* find(Id id) const {  ///< for reading
    const auto found = models_.find(id);
    return found == models_.end() ? nullptr : &found->second;
  }
  std::size_t size() const { return models_.size(); }
  Id next_id() const { return next_id_; }
  void set_next_id(Id id) { next_id_ = id; }
  auto begin() const { return models_.begin(); }  ///< ascending id
  auto end() const { return models_.end(); }
  /// Removals since the last call, in order of erasure; their revision is not set yet.
  std::vector<Removal> take_removals() { return std::exchange(removals_, {}); }

 protected:
  /// Call before the model is changed.
  Model& kept(Id id, Model& model) {
    if (open_ && id < next_id_before_ && !before_.contains(id)) {
      if constexpr (std::is_same_v<Model, Kept>)
        before_.emplace(id, model);
      else
        before_.emplace(id, model.head());
    }
    return model;
  }
  void open() {
    open_ = true;
    next_id_before_ = next_id_;
  }
  void close() noexcept {
    open_ = false;
    before_.clear();
  }
  /// Instead of those of the change, `models`, one for each in before_.
  void put_back(std::map<Id, Model>& models) noexcept {
    models_.erase(models_.lower_bound(next_id_before_), models_.end());
    for (const auto& [id, model] : models) models_.erase(id);
    models_.merge(models);
    next_id_ = next_id_before_;
    removals_.clear();
    close();
  }

  std::map<Id, Model> models_;
  Id next_id_ = 1;
  std::vector<Removal> removals_;
  bool open_ = false;          // a change
  Id next_id_before_ = 1;      // it
  std::map<Id, Kept> before_;  // those accessed for modification since
};

}  // namespace octosurf::surfaces
