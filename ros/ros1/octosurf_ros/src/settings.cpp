#include "settings.hpp"

#include <sstream>
#include <xmlrpcpp/XmlRpcValue.h>

#include <octosurf/error.hpp>

namespace octosurf::ros1 {
namespace {

[[noreturn]] void refuse(const std::string& name, const std::string& what) {
  throw Error(Error::Kind::usage, "~" + name, what);
}

/// A topic, several with blanks between them, or a list.
std::vector<std::string> topics(const ros::NodeHandle& node, const std::string& name) {
  std::vector<std::string> list;
  if (!node.hasParam(name) || node.getParam(name, list)) return list;
  std::string text;
  if (!node.getParam(name, text)) refuse(name, "is neither a topic nor a list of topics");
  std::istringstream words(text);
  for (std::string word; words >> word;) list.push_back(word);
  return list;
}

template <class Value>
void read(const ros::NodeHandle& node, const std::string& name, Value& value) {
  if (node.hasParam(name) && !node.getParam(name, value)) refuse(name, "is of another type");
}

/// A parameter as text, whatever YAML took it for.
std::string text_of(const std::string& name, XmlRpc::XmlRpcValue value) {
  using Value = XmlRpc::XmlRpcValue;
  if (value.getType() == Value::TypeString) return static_cast<std::string&>(value);
  if (value.getType() == Value::TypeBoolean) return static_cast<bool&>(value) ? "on" : "off";
  std::ostringstream text;
  text.precision(17);
  if (value.getType() == Value::TypeInt)
    text << static_cast<int&>(value);
  else if (value.getType() == Value::TypeDouble)
    text << static_cast<double&>(value);
  else
    refuse("mapping/" + name, "is no number, text or truth value");
  return text.str();
}

Parameters mapping_parameters(const ros::NodeHandle& node) {
  Parameters parameters;
  XmlRpc::XmlRpcValue all;
  if (!node.getParam("mapping", all)) return parameters;
  if (all.getType() != XmlRpc::XmlRpcValue::TypeStruct) refuse("mapping", "holds no parameters");
  for (auto& [name, value] : all) set_parameter(parameters, name, text_of(name, value));
  parameters.validate();
  return parameters;
}

}  // namespace

Settings read_settings(const ros::NodeHandle& node) {
  Settings settings;
  settings.cloud_topics = topics(node, "cloud_topics");
  settings.depth_topics = topics(node, "depth_topics");
  if (settings.cloud_topics.empty() && settings.depth_topics.empty())
    refuse("cloud_topics", "and ~depth_topics are empty: there is nothing to map");
  read(node, "fixed_frame", settings.fixed_frame);
  if (settings.fixed_frame.starts_with('/')) settings.fixed_frame.erase(0, 1);
  if (settings.fixed_frame.empty()) refuse("fixed_frame", "is empty");
  read(node, "map", settings.map);
  read(node, "resume", settings.resume);
  read(node, "save_at_end", settings.save_at_end);
  read(node, "threads", settings.threads);
  read(node, "tf_history", settings.tf_history_s);
  settings.parameters = mapping_parameters(node);
  require_z_up(settings.parameters, "~mapping/up");
  return settings;
}

void require_z_up(const Parameters& parameters, const std::string& where) {
  if (parameters.up && !parameters.up->isApprox(Eigen::Vector3d::UnitZ(), 1e-9))
    throw Error(Error::Kind::usage, where, "is not +z, which planners' messages take for up",
                "map in a frame whose z is up");
}

}  // namespace octosurf::ros1
