#include "io/map_file/departure_record.hpp"

#include "map_file.pb.h"

#include <octosurf/error.hpp>

namespace octosurf::io {

void write_departure(const Departure& departure, map_file::Departure& record) {
  if (departure.of == Departure::Of::cylinder) record.set_cylinder(true);
  record.set_id(departure.id);
  if (departure.into != 0) record.set_into(departure.into);
  if (departure.born != 0) record.set_born(departure.born);
  record.set_revision(departure.revision);
  for (const SurfaceId parent : departure.parents) record.add_parents(parent);
}

Departure DepartureReader::operator()(const map_file::Departure& record) {
  const bool cylinder = record.cylinder();
  const std::uint32_t next_id = cylinder ? state_.cylinders.next_id() : state_.surfaces.next_id();
  const bool there =
      cylinder ? state_.cylinders.find(record.id()) != nullptr : state_.surfaces.find(record.id()) != nullptr;
  require(record.id() > 0 && record.id() < next_id, record, "was never there");
  require(!there, record, "has not gone");
  require(read_.insert({cylinder, record.id()}).second, record, "has gone twice");
  require(record.into() < next_id && record.into() != record.id(), record, "has gone into what never was");
  require(record.revision() <= state_.revision && record.revision() >= last_revision_ &&
              record.born() <= record.revision(),
          record, "has gone out of order");
  last_revision_ = record.revision();
  Departure departure{cylinder ? Departure::Of::cylinder : Departure::Of::surface,
                      record.id(),
                      record.into(),
                      record.born(),
                      record.revision(),
                      {}};
  for (const SurfaceId parent : record.parents()) {
    require(!cylinder && parent > 0 && parent < next_id, record, "has a parent that never was");
    departure.parents.push_back(parent);
  }
  return departure;
}

void DepartureReader::require(bool holds, const map_file::Departure& record, const char* what) const {
  if (holds) return;
  throw Error(Error::Kind::data, where_,
              std::string("is damaged: ") + (record.cylinder() ? "cylinder " : "surface ") +
                  std::to_string(record.id()) + " " + what,
              "restore it from a backup");
}

}  // namespace octosurf::io
