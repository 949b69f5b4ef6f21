#pragma once

#include <nlohmann/json_fwd.hpp>

#include <octosurf/cylinder.hpp>
#include <octosurf/stairs.hpp>

// Cylinders, steps and stairs as in exported files and answers: m, degrees, map frame.

template <>
struct nlohmann::adl_serializer<octosurf::Cylinder> {
  static void to_json(ordered_json& json, const octosurf::Cylinder& cylinder);
};

template <>
struct nlohmann::adl_serializer<octosurf::Step> {
  static void to_json(ordered_json& json, const octosurf::Step& step);
};

template <>
struct nlohmann::adl_serializer<octosurf::Stair> {
  static void to_json(ordered_json& json, const octosurf::Stair& stair);
};
